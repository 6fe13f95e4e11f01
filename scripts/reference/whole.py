"""A whole model: what its table of reference values needs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mpmath import mpf

from .grid import PAIR, Geometry, corners, geometry
from .table import Table


def nothing(g: Geometry, *parameters) -> mpf:
    """No exponential or power factor."""
    return mpf(0)


@dataclass
class Whole:
    """A model by its name in the file, as tests/reference.rs knows it.

    `value(g, *parameters)` and `log_factor(g, *parameters)`, parameters in the order of the program, angles in radians.
    `differentiate(g, *parameters)` replaces differences where these do not exist.
    """

    name: str
    parameters: tuple[str, ...]
    sets: list[tuple]
    value: Callable
    log_factor: Callable = nothing
    differentiate: Callable = lambda g, *parameters: None
    step: mpf | None = None

    def table(self) -> Table:
        return Table(
            name=f"model-{self.name}",
            arguments=PAIR,
            parameters=self.parameters,
            rows=[(pair, parameters) for parameters in self.sets for pair in corners()],
            exact=lambda pair, p: self.value(geometry(pair), *p),
            log_factor=lambda pair, p: self.log_factor(geometry(pair), *p),
            differentiate=lambda pair, p: self.differentiate(geometry(pair), *p),
            step=self.step,
        )
