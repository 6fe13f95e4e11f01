#!/usr/bin/env python3
"""What a user would write without brdfit: a MERL table fitted with numpy and scipy.optimize.least_squares.

    pip install -r scripts/requirements.txt
    python scripts/baseline_scipy.py chrome.binary
    python scripts/baseline_scipy.py chrome.binary --metric l2 --repeat 3 --json
    brdfit fit chrome.binary -m 'lambert + cook-torrance' -q -o chrome.json
    python scripts/baseline_scipy.py chrome.binary --compare chrome.json

The model is `lambert + cook-torrance(d=ggx)` with ks fixed at 1: kd and f0 per channel and a shared m, seven
parameters within brdfit's bounds, always begun at its defaults. Samples, weights, metrics and so the cost are those
of docs/use/conventions.md, bin centres and theta_i, theta_o up to 80 degrees; the cost is brdfit's `fit.cost`, the
weighted mean square of the residuals. All samples count in every iteration.

The method is scipy's trust region within bounds (`trf`, `x_scale="jac"`), with derivatives by forward differences
(`2-point`) and tolerances as scipy has them. The code is vectorised; what no parameter changes is computed once, when
reading. Times are wall-clock seconds, medians of the repeats: `read` (the file, and its geometry), `fit`, and `whole`,
the two with the imports; the peak of the resident memory is the whole process's. From its one start it may end in
another minimum than the best: chrome in `log` ends at 55 times the cost.

--compare evaluates the cost here at the parameters of a report, too: the two programs should agree on that to rounding,
whatever their minima. It ends with exit code 1 if they differ by more than 1e-9.
"""

from __future__ import annotations

import time

STARTED = time.perf_counter()

import argparse
import json
import resource
import statistics
import sys
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

IMPORTED = time.perf_counter() - STARTED

DIMENSIONS = (90, 90, 180)
SCALES = np.array([1.0, 1.15, 1.66]) / 1500
MAX_THETA = 80.0
LOG_FLOOR = -0.99
CBRT_SMOOTHING = 1e-6

# In the order of the solver's vector: kd of r, g, b; f0 of r, g, b; m.
NAMES = ["kd.r", "kd.g", "kd.b", "f0.r", "f0.g", "f0.b", "m"]
START = np.array([0.2, 0.2, 0.2, 0.05, 0.05, 0.05, 0.2])
LOWER = np.array([0, 0, 0, 0, 0, 0, 1e-4])
UPPER = np.array([2, 2, 2, 1, 1, 1, 1])


class Table:
    """The samples of a MERL table that count, one row each."""

    def __init__(self, path: Path):
        header = np.fromfile(path, "<i4", 3)
        if tuple(header) != DIMENSIONS:
            raise SystemExit(f"{path}: expected the dimensions 90 x 90 x 180, found {header}")
        stored = np.fromfile(path, "<f8", offset=12)
        if stored.size != 3 * np.prod(DIMENSIONS):
            raise SystemExit(f"{path}: expected {3 * np.prod(DIMENSIONS)} values, found {stored.size}")
        stored = stored.reshape(3, *DIMENSIONS)

        # Bin centres; theta_h grows with the square of its index.
        i, j, k = (np.arange(n) for n in DIMENSIONS)
        theta_h = (((i + 0.5) / 90) ** 2 * np.pi / 2)[:, None, None]
        theta_d = ((j + 0.5) / 90 * np.pi / 2)[None, :, None]
        phi_d = ((k + 0.5) / 180 * np.pi)[None, None, :]
        along = np.cos(theta_d) * np.cos(theta_h)
        across = np.sin(theta_d) * np.cos(phi_d) * np.sin(theta_h)
        cos_i, cos_o = along - across, along + across

        # Negative cells were not measured.
        limit = np.cos(np.radians(MAX_THETA + 1e-9))
        counts = (cos_i >= limit) & (cos_o >= limit) & (stored >= 0).all(0) & np.isfinite(stored).all(0)
        self.cos_i, self.cos_o = cos_i[counts], cos_o[counts]
        self.sin2_i, self.sin2_o = 1 - self.cos_i**2, 1 - self.cos_o**2
        row_h, row_d, _ = np.nonzero(counts)
        theta_h, theta_d = theta_h.ravel(), theta_d.ravel()
        self.cos2_h, self.sin2_h = (np.cos(theta_h) ** 2)[row_h], (np.sin(theta_h) ** 2)[row_h]
        self.schlick = ((1 - np.cos(theta_d)) ** 5)[row_d]
        # dwi dwo of the bin, 1 on average.
        weights = (np.sin(theta_h) * (2 * i + 1))[row_h] * (np.cos(theta_d) * np.sin(theta_d))[row_d]
        self.weights = weights / weights.mean()
        # f cos(theta_i), one row per channel.
        self.measured = stored[:, counts] * SCALES[:, None] * self.cos_i


def model(p: np.ndarray, t: Table) -> np.ndarray:
    """f cos(theta_i): Lambert and Cook-Torrance with GGX, height-correlated Smith, and Schlick's Fresnel."""
    kd, f0, m2 = p[0:3, None], p[3:6, None], p[6] ** 2
    d = m2 / (np.pi * (m2 * t.cos2_h + t.sin2_h) ** 2)
    # cos Lambda = (sqrt(cos^2 + m^2 sin^2) - cos)/2, G/(4 ci co) = 1/(4 (ci co + co L_i + ci L_o)).
    lambda_i = (np.sqrt(t.cos_i**2 + m2 * t.sin2_i) - t.cos_i) / 2
    lambda_o = (np.sqrt(t.cos_o**2 + m2 * t.sin2_o) - t.cos_o) / 2
    lobe = d / (4 * (t.cos_i * t.cos_o + t.cos_o * lambda_i + t.cos_i * lambda_o))
    return (kd / np.pi + lobe * (f0 + (1 - f0) * t.schlick)) * t.cos_i


class Problem:
    """The residuals of a metric."""

    def __init__(self, table: Table, metric: str):
        self.table = table
        self.metric = metric
        self.root_weights = np.sqrt(table.weights)
        measured = table.measured
        mean = (table.weights * np.abs(measured)).mean(1)
        self.smoothing2 = (CBRT_SMOOTHING * mean[:, None]) ** 2
        self.wanted = self.transform(np.maximum(measured, LOG_FLOOR) if metric == "log" else measured)

    def transform(self, x: np.ndarray) -> np.ndarray:
        if self.metric == "l2":
            return x
        if self.metric == "log":
            return np.log1p(x)
        # The cube root with a finite slope at 0.
        return x / np.cbrt(x * x + self.smoothing2)

    def residuals(self, p: np.ndarray) -> np.ndarray:
        difference = self.transform(model(p, self.table)) - self.wanted
        return (self.root_weights * difference).ravel()

    def cost(self, p: np.ndarray) -> float:
        return float(np.mean(self.residuals(p) ** 2))


def run(path: Path, metric: str) -> tuple[dict, Problem]:
    """One fit from the file to the parameters."""
    started = time.perf_counter()
    problem = Problem(Table(path), metric)
    read = time.perf_counter() - started
    solution = least_squares(
        problem.residuals, START, bounds=(LOWER, UPPER), jac="2-point", method="trf", x_scale="jac"
    )
    fit = time.perf_counter() - started - read
    result = {
        "samples": problem.table.weights.size,
        # scipy's cost is half the sum of squares.
        "cost": 2 * solution.cost / solution.fun.size,
        "parameters": dict(zip(NAMES, solution.x.tolist())),
        # scipy counts neither the evaluations for differences nor the iterations.
        "nfev": solution.nfev,
        "njev": solution.njev,
        "message": solution.message,
        "time_s": {"read": read, "fit": fit, "whole": IMPORTED + read + fit},
    }
    return result, problem


def compare(report: dict, result: dict, problem: Problem) -> dict:
    """The costs of a report of brdfit's beside those found here."""
    values = {}
    for parameter in report["parameters"]:
        channel = parameter["channel"]
        values[parameter["name"] if channel is None else f"{parameter['name']}.{channel}"] = parameter["value"]
    here = problem.cost(np.array([values[name] for name in NAMES]))
    there = report["fit"]["cost"]
    return {
        "brdfit_cost": there,
        "same_parameters": abs(here / there - 1),
        "minima": result["cost"] / there - 1,
    }


def text(result: dict) -> str:
    time_s = result["time_s"]
    lines = [
        f"{result['path']}: {result['metric']}, {result['samples']} samples",
        *(f"  {name:<5} {value:.9g}" for name, value in result["parameters"].items()),
        f"cost        {result['cost']:.12e}",
        f"evaluations {result['nfev']}, Jacobians {result['njev']}: {result['message']}",
        f"time        {time_s['read']:.3f} s read, {time_s['fit']:.3f} s fit, {time_s['whole']:.3f} s whole",
        f"peak memory {result['peak_mb']:.0f} MB",
    ]
    if "compared" in result:
        compared = result["compared"]
        lines += [
            f"brdfit      cost {compared['brdfit_cost']:.12e}",
            f"            relative difference at its parameters {compared['same_parameters']:.1e}",
            f"            the minimum here above brdfit's       {compared['minima']:.1e}",
        ]
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("file", type=Path, help="MERL table")
    parser.add_argument("--metric", choices=["l2", "log", "cbrt"], default="cbrt")
    parser.add_argument("--repeat", type=int, default=1, metavar="N", help="fits, for the times")
    parser.add_argument("--compare", type=Path, metavar="REPORT", help="brdfit's report of the same fit")
    parser.add_argument("--json", action="store_true", help="JSON instead of text")
    arguments = parser.parse_args()

    times: dict[str, list[float]] = {"read": [], "fit": [], "whole": []}
    for _ in range(max(arguments.repeat, 1)):
        # The last repeat's numbers must not stand beside the next one's in memory.
        problem = None
        result, problem = run(arguments.file, arguments.metric)
        for name, series in times.items():
            series.append(result["time_s"][name])
    # In kilobytes on Linux.
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    result = {"path": str(arguments.file), "metric": arguments.metric, **result}
    result["time_s"] = {name: statistics.median(series) for name, series in times.items()}
    result["peak_mb"] = peak
    agree = True
    if arguments.compare:
        report = json.loads(arguments.compare.read_text())
        if report["metric"] != arguments.metric:
            raise SystemExit(f"{arguments.compare}: expected the metric {arguments.metric}, found {report['metric']}")
        result["compared"] = compare(report, result, problem)
        agree = result["compared"]["same_parameters"] < 1e-9
    print(json.dumps(result, indent=2) if arguments.json else text(result))
    return 0 if agree else 1


if __name__ == "__main__":
    sys.exit(main())
