"""A table of reference values: its rows, derivatives, what the textbook's form loses, and the file.

The arguments of a row are rounded to the type that the row is for, before anything else is computed of them: so the
values say what a program should find at the numbers it holds, and no error of the arguments is laid to the
formula's account.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from mpmath import fabs, inf, isnan, log10, mpf, nstr

# Derivatives are differences: central over p (1 +- STEP), whose square is what they miss, relative to the function's
# third derivative; at p = 0, where formulas may end, from 0 to the other step, whose root is what they may miss.
STEP, STEP_AT_0 = mpf(10) ** -26, mpf(10) ** -45
# What is below this part of the value is what differences leave of a slope of 0 at p = 0.
LEFT = mpf(10) ** -36

TYPES = {"f64": np.float64, "f32": np.float32}
# Digits that identify a number of the type.
ARGUMENT_DIGITS = {"f64": 17, "f32": 9}
VALUE_DIGITS = {"f64": 17, "f32": 11}
# Half a unit in the last place, relative.
ROUNDING = {"f64": mpf(2) ** -53, "f32": mpf(2) ** -24}
# log10 of its inverse: what there is to lose.
ALL_DIGITS = {"f64": 15.95, "f32": 7.22}

Numbers = tuple[mpf, ...]


@dataclass
class Table:
    """Reference values of one function.

    `exact` takes arguments and parameters as exact numbers, `naive` as numbers of numpy's type and that type first; both
    give the function's value. `log_factor` is the sum of the |ln| of the exponential and power factors of the value.
    `differentiate` gives the derivatives, or None, where differences of `exact` do not exist; `step` is that of
    differences where `exact` has fewer digits.
    """

    name: str
    arguments: tuple[str, ...]
    parameters: tuple[str, ...]
    rows: Iterable[tuple[Numbers, Numbers]]
    exact: Callable[[Numbers, Numbers], mpf]
    log_factor: Callable[[Numbers, Numbers], mpf] = lambda arguments, parameters: mpf(0)
    naive: Callable | None = None
    differentiate: Callable[[Numbers, Numbers], list[mpf] | None] = lambda arguments, parameters: None
    step: mpf | None = None
    types: tuple[str, ...] = field(default=("f64", "f32"))

    def header(self) -> list[str]:
        derivatives = [f"d_{name}" for name in self.parameters]
        return ["type", *self.arguments, *self.parameters, "log_factor", "value", *derivatives, "naive_loses"]

    def lines(self):
        """The rows of the file as lists of text."""
        seen = set()
        for kind in self.types:
            for arguments, parameters in self.rows:
                arguments = rounded(kind, arguments)
                parameters = rounded(kind, parameters)
                if (kind, arguments, parameters) in seen:
                    continue
                seen.add((kind, arguments, parameters))
                yield self.line(kind, arguments, parameters)

    def line(self, kind: str, arguments: Numbers, parameters: Numbers) -> list[str]:
        value = self.exact(arguments, parameters)
        derivatives = self.differentiate(arguments, parameters) or self.differences(arguments, parameters)
        cells = [decimal(x, ARGUMENT_DIGITS[kind]) for x in (*arguments, *parameters)]
        cells.append(nstr(self.log_factor(arguments, parameters), 3, strip_zeros=True))
        cells += [decimal(x, VALUE_DIGITS[kind]) for x in (value, *derivatives)]
        return [kind, *cells, self.naive_loses(kind, arguments, parameters, value)]

    def differences(self, arguments: Numbers, parameters: Numbers) -> list[mpf]:
        """The derivative of the exact value with respect to every parameter."""

        def at(index: int, value: mpf) -> mpf:
            return self.exact(arguments, (*parameters[:index], value, *parameters[index + 1 :]))

        found = []
        for index, p in enumerate(parameters):
            if p == 0 and self.step is None:
                slope = (at(index, STEP_AT_0) - at(index, mpf(0))) / STEP_AT_0
            else:
                h = (p or 1) * (self.step or STEP)
                slope = (at(index, p + h) - at(index, p - h)) / (2 * h)
            left = LEFT if self.step is None else 1000 * self.step**2
            if p == 0 and fabs(slope) < left * fabs(self.exact(arguments, parameters)):
                slope = mpf(0)
            found.append(slope)
        return found

    def naive_loses(self, kind: str, arguments: Numbers, parameters: Numbers, value: mpf) -> str:
        """Decimal digits that the textbook's form loses of the type's; all where no digit is right."""
        if self.naive is None:
            return ""
        real = TYPES[kind]
        with np.errstate(all="ignore"):
            found = self.naive(real, [real(float(x)) for x in arguments], [real(float(x)) for x in parameters])
        assert isinstance(found, real), (self.name, kind, type(found))
        if abs(value) < mpf(float(np.finfo(real).tiny)):
            return ""
        if not math.isfinite(found):
            return str(ALL_DIGITS[kind])
        return f"{digits_lost(kind, mpf(float(found)), value):.1f}"

    def text(self) -> str:
        return "\n".join(",".join(cells) for cells in [self.header(), *self.lines()]) + "\n"

    def write(self, folder: Path) -> None:
        (folder / f"{self.name}.csv").write_text(self.text(), encoding="ascii")


def digits_lost(kind: str, found: mpf, exact: mpf) -> float:
    error = fabs(found / exact - 1)
    if isnan(error) or error == inf:
        return ALL_DIGITS[kind]
    if error <= ROUNDING[kind]:
        return 0.0
    return min(float(log10(error / ROUNDING[kind])), ALL_DIGITS[kind])


def rounded(kind: str, numbers: Numbers) -> Numbers:
    """The numbers of the type that are next to these."""
    return tuple(mpf(float(TYPES[kind](float(x)))) for x in numbers)


def decimal(x: mpf, digits: int) -> str:
    """Shortest text with that many digits, as programs print numbers."""
    if x == 0:
        return "0"
    text = nstr(x, digits, strip_zeros=True, min_fixed=-4, max_fixed=6)
    return text.removesuffix(".0").replace(".0e", "e").replace("e+", "e")
