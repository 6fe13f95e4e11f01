"""Fits every measurement at hand in the metrics cbrt and unbiased-cbrt, and compares parameters and errors held out.

Prints the tables of docs/trust/objective.md.
"""

import argparse
import itertools
import json
import math
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from common import SHARED_DATA, checked_brdfit
from two_lobes import converted, merl_tables

MODEL = "lambert + cook-torrance"
METRICS = ("cbrt", "unbiased-cbrt")
MOST_SAMPLES = 100_000
SEEDS = (0, 1, 2)
"""Seeds of the draws of held-out angles of incidence."""


def fit(brdfit, path, metric, *more):
    """The report of a fit; None if there is none."""
    command = [brdfit, "fit", path, "-m", MODEL, "--samples", str(MOST_SAMPLES), "--json", "--metric", metric, *more]
    done = subprocess.run(command, capture_output=True, text=True)
    if not done.stdout:
        print(f"{path.name}: {done.stderr.strip()}", file=sys.stderr)
        return None
    return json.loads(done.stdout)


def held_out(brdfit, path, metric):
    """The errors on the samples held out, each the root mean square over the draws."""
    reports = [fit(brdfit, path, metric, "--hold-out", "0.25", "--seed", str(seed)) for seed in SEEDS]
    errors = [report["selection"]["held_out"] for report in reports if report]
    mean = lambda name: math.sqrt(statistics.fmean(error[name] ** 2 for error in errors))
    return {name: mean(name) for name in ("relative", "unbiased_cbrt", "cbrt")} if errors else None


def values(report):
    """The median over the channels of each free parameter."""
    by_name = {}
    for parameter in report["parameters"]:
        if parameter["status"] != "fixed":
            by_name.setdefault(parameter["name"], []).append(parameter["value"])
    return {name: statistics.median(found) for name, found in by_name.items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--brdfit", required=True, help="the program")
    parser.add_argument("--some", type=int, default=1, help="take one in this many of the tables made of networks")
    arguments = parser.parse_args()
    brdfit = checked_brdfit(parser, arguments.brdfit)
    ratios = {"relative": [], "unbiased_cbrt": [], "cbrt": []}
    print("| material | kd | m | f0 | held out: relative | unbiased-cbrt | cbrt |\n|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        cornell = sorted((SHARED_DATA / "cornell").glob("*.brdf"))
        networks = itertools.islice(merl_tables(folder), 0, None, arguments.some)
        for path in itertools.chain(cornell, converted(folder), networks):
            reports = [fit(brdfit, path, metric) for metric in METRICS]
            if None in reports:
                continue
            old, new = map(values, reports)
            cells = []
            for name in ("kd", "m", "f0"):
                cells.append(f"{old[name]:.4g} → {new[name]:.4g}" if name in old and name in new else "–")
            errors = [held_out(brdfit, path, metric) for metric in METRICS]
            for name, found in ratios.items():
                if None in errors:
                    cells.append("–")
                    continue
                found.append(errors[1][name] / errors[0][name])
                cells.append(f"{found[-1]:.3f}")
            print(f"| {path.stem} | {' | '.join(cells)} |", flush=True)
    for name, found in ratios.items():
        mean = math.exp(sum(map(math.log, found)) / len(found))
        worse = sum(ratio > 1.02 for ratio in found)
        print(f"{name}: {len(found)} measurements, geometric mean {mean:.3f}, largest {max(found):.3f}, {worse} above 1.02")


if __name__ == "__main__":
    main()
