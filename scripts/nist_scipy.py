#!/usr/bin/env python3
"""scipy.optimize.least_squares on the NIST StRD problems, as `tests/nist.rs` runs brdfit on them.

    pip install -r scripts/requirements.txt
    python scripts/nist_scipy.py            prints the table of correct digits
    python scripts/nist_scipy.py --write    also writes tests/nist/scipy.csv, from which docs/trust/nist.md is made
    python scripts/nist_scipy.py --tight    all tolerances at 1e-15, the least that scipy accepts

The problems come from tests/nist/problems.csv, both starts. Methods: lm (MINPACK's lmder), trf and dogbox, each
with its default options. Derivatives by the complex step (Squire and Trapp 1998), which are right to rounding,
given as a function, since scipy's own complex step (jac="cs") is not for MINPACK.
Digits are those of the worst parameter, -log10 of its relative error, at most 11, none below 0.
"""

from __future__ import annotations

import argparse
import csv
import warnings
from pathlib import Path

import numpy as np
import scipy
from scipy.optimize import least_squares

FOLDER = Path(__file__).resolve().parent.parent / "tests" / "nist"
METHODS = ("lm", "trf", "dogbox")
STEP = 1e-200


def gauss(b, x):
    """A bell of height b[0] about b[1]."""
    return b[0] * np.exp(-(((x - b[1]) / b[2]) ** 2))


def wave(c, s, period, x):
    """An oscillation."""
    phase = 2 * np.pi * x / period
    return c * np.cos(phase) + s * np.sin(phase)


def growth(b, x):
    return -b[0] * np.expm1(-b[1] * x)


def decay(b, x):
    return np.exp(-b[0] * x) / (b[1] + b[2] * x)


def lanczos(b, x):
    return b[0] * np.exp(-b[1] * x) + b[2] * np.exp(-b[3] * x) + b[4] * np.exp(-b[5] * x)


def bells(b, x):
    return b[0] * np.exp(-b[1] * x) + gauss(b[2:5], x) + gauss(b[5:8], x)


def cubic(b, x):
    return (((b[3] * x + b[2]) * x + b[1]) * x + b[0]) / (((b[6] * x + b[5]) * x + b[4]) * x + 1)


# As NIST writes them; x holds the predictors.
MODELS = {
    "Bennett5": lambda b, x: b[0] * (b[1] + x[0]) ** (-1 / b[2]),
    "BoxBOD": lambda b, x: growth(b, x[0]),
    "Chwirut1": lambda b, x: decay(b, x[0]),
    "Chwirut2": lambda b, x: decay(b, x[0]),
    "DanWood": lambda b, x: b[0] * x[0] ** b[1],
    "ENSO": lambda b, x: b[0]
    + wave(b[1], b[2], 12, x[0])
    + wave(b[4], b[5], b[3], x[0])
    + wave(b[7], b[8], b[6], x[0]),
    "Eckerle4": lambda b, x: b[0] / b[1] * np.exp(-0.5 * ((x[0] - b[2]) / b[1]) ** 2),
    "Gauss1": lambda b, x: bells(b, x[0]),
    "Gauss2": lambda b, x: bells(b, x[0]),
    "Gauss3": lambda b, x: bells(b, x[0]),
    "Hahn1": lambda b, x: cubic(b, x[0]),
    "Kirby2": lambda b, x: ((b[2] * x[0] + b[1]) * x[0] + b[0]) / ((b[4] * x[0] + b[3]) * x[0] + 1),
    "Lanczos1": lambda b, x: lanczos(b, x[0]),
    "Lanczos2": lambda b, x: lanczos(b, x[0]),
    "Lanczos3": lambda b, x: lanczos(b, x[0]),
    "MGH09": lambda b, x: b[0] * (x[0] ** 2 + x[0] * b[1]) / (x[0] ** 2 + x[0] * b[2] + b[3]),
    "MGH10": lambda b, x: b[0] * np.exp(b[1] / (x[0] + b[2])),
    "MGH17": lambda b, x: b[0] + b[1] * np.exp(-b[3] * x[0]) + b[2] * np.exp(-b[4] * x[0]),
    "Misra1a": lambda b, x: growth(b, x[0]),
    "Misra1b": lambda b, x: b[0] * (1 - (1 + b[1] * x[0] / 2) ** -2),
    "Misra1c": lambda b, x: b[0] * (1 - (1 + 2 * b[1] * x[0]) ** -0.5),
    "Misra1d": lambda b, x: b[0] * b[1] * x[0] / (1 + b[1] * x[0]),
    "Nelson": lambda b, x: b[0] - b[1] * x[0] * np.exp(-b[2] * x[1]),
    "Rat42": lambda b, x: b[0] / (1 + np.exp(b[1] - b[2] * x[0])),
    "Rat43": lambda b, x: b[0] / (1 + np.exp(b[1] - b[2] * x[0])) ** (1 / b[3]),
    "Roszman1": lambda b, x: b[0] - b[1] * x[0] - np.arctan(b[2] / (x[0] - b[3])) / np.pi,
    "Thurber": lambda b, x: cubic(b, x[0]),
}


def problems() -> dict[str, dict]:
    """The carried table, by name."""
    found: dict[str, dict] = {}
    with (FOLDER / "problems.csv").open(encoding="ascii") as lines:
        for kind, *fields in csv.reader(line for line in lines if not line.startswith("#")):
            if kind == "problem":
                problem = found[fields[0]] = {"parameter": [], "observation": []}
            else:
                problem[kind].append([float(field) for field in fields])
    return {name: {kind: np.array(rows).T for kind, rows in problem.items()} for name, problem in found.items()}


def solve(name: str, problem: dict, start: np.ndarray, method: str, options: dict) -> float:
    """Correct digits of the worst parameter."""
    y, *x = problem["observation"]
    y = np.log(y) if name == "Nelson" else y
    certified = problem["parameter"][2]

    def residual(b):
        return MODELS[name](b, x) - y

    def jacobian(b):
        columns = []
        for j in range(len(b)):
            shifted = b.astype(complex)
            shifted[j] += 1j * STEP
            columns.append(MODELS[name](shifted, x).imag / STEP)
        return np.array(columns).T

    try:
        found = least_squares(residual, start, jac=jacobian, method=method, **options).x
    except (ValueError, np.linalg.LinAlgError):
        # Residuals that are not finite end scipy's search with an error.
        return 0.0
    error = np.max(np.abs((found - certified) / certified))
    return float(np.clip(-np.log10(error), 0, 11)) if np.isfinite(error) and error > 0 else 11.0 * (error == 0)


def main() -> None:
    parser = argparse.ArgumentParser(description="scipy.optimize.least_squares on the NIST StRD problems.")
    parser.add_argument("--write", action="store_true", help="also write tests/nist/scipy.csv")
    parser.add_argument("--tight", action="store_true", help="all tolerances at 1e-15")
    arguments = parser.parse_args()
    # Overflow on the way is the solvers' business, not the reader's.
    warnings.simplefilter("ignore")
    np.seterr(all="ignore")
    options = dict.fromkeys(("ftol", "xtol", "gtol"), 1e-15) if arguments.tight else {}
    rows = []
    for name, problem in problems().items():
        for index in (0, 1):
            start = problem["parameter"][index]
            digits = [solve(name, problem, start, method, options) for method in METHODS]
            rows.append([name, index + 1, *digits])
    print(f"scipy {scipy.__version__}, numpy {np.__version__}\n")
    print("| problem | start |" + "".join(f" {method} |" for method in METHODS))
    print("|---|---|" + "---|" * len(METHODS))
    for name, start, *digits in rows:
        print(f"| {name} | {start} |" + "".join(f" {value:.1f} |" for value in digits))
    columns = np.array([digits for _, _, *digits in rows])
    for label, values in (
        ("mean", columns.mean(axis=0)),
        ("4 digits or more, of 54", (columns >= 4).sum(axis=0)),
        ("7 digits or more, of 54", (columns >= 7).sum(axis=0)),
    ):
        print(f"| {label} | |" + "".join(f" {value:.4g} |" for value in values))
    if arguments.write and not arguments.tight:
        lines = [f"# Correct digits; made by scripts/nist_scipy.py --write with scipy {scipy.__version__}."]
        lines.append(",".join(["problem", "start", *METHODS]))
        lines += [",".join([name, str(start), *(f"{v:.2f}" for v in digits)]) for name, start, *digits in rows]
        (FOLDER / "scipy.csv").write_text("\n".join(lines) + "\n", encoding="ascii")


if __name__ == "__main__":
    main()
