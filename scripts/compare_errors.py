#!/usr/bin/env python3
"""Compare the default standard errors with those of the block bootstrap, and print the tables of docs/trust/calibration.md.

    python scripts/compare_errors.py --brdfit target/release/brdfit

Every measured file and a dozen neural regressions are fitted with two models and three sources of standard errors. The block bootstrap
repeats the fit 200 times on angles of incidence drawn anew; it needs at least five of them, and counts here where there are ten. Files with
more samples are fitted with the budget `balanced`, whose 20 000 samples make 200 fits bearable.

It needs numpy.
"""

import argparse
import itertools
import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from common import SHARED_DATA, checked_brdfit, nbrdf_tool
from measured_files import FILES, materials, run

MODELS = ("lambert + cook-torrance", "lambert + cook-torrance(d=gtr)")
# Of the neural regressions in each archive, every so many.
NEURAL = {"merl.npz": 12, "nielsen.npz": 4, "rgl-isotropic.npz": 12}
FEWEST_ANGLES = 10


def fitted(brdfit, arguments, source):
    """The report of a fit with standard errors from `source`; None if it is not to be had."""
    command = [brdfit, "fit", *arguments, "--uncertainty", source, "--budget", "balanced", "--json", "-q"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return json.loads(done.stdout) if done.returncode in (0, 1) and done.stdout else None


def errors(report):
    """The standard error of each fitted parameter that has one."""
    return {
        f"{p['lobe']}.{p['name']}.{p['channel']}": p["std_error"]
        for p in report["parameters"]
        if p["std_error"] is not None
    }


def decoded(folder):
    """MERL tables of the neural regressions, as this project's helper decodes them, one at a time."""
    tool = nbrdf_tool()
    for archive, step in NEURAL.items():
        networks = np.load(SHARED_DATA / "nbrdf" / archive)
        for name in networks.files[::step]:
            path = Path(folder) / f"{name}.binary"
            tool.write_merl(tool.decode(networks[name])[0], path)
            yield name, [str(path)]
            path.unlink()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--brdfit", required=True, help="the program")
    brdfit = checked_brdfit(parser, parser.parse_args().brdfit)
    clustered_ratios, formula_ratios = [], []
    print("| measurement | model | groups | parameters | clustered / bootstrap | formula / bootstrap |")
    print("|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        measured = ((name, [str(SHARED_DATA / name)]) for name in FILES)
        for name, arguments in itertools.chain(measured, decoded(folder)):
            for material in materials(run(brdfit, ["info", *arguments, "--json"])) or [None]:
                chosen = ["--material", material] if material else []
                for model in MODELS:
                    command = [*arguments, *chosen, "-m", model]
                    bootstrap = fitted(brdfit, command, "block-bootstrap")
                    if bootstrap is None or not bootstrap["fit"]["resampling"]:
                        print(f"compare_errors: {name} {material or ''}: no bootstrap", file=sys.stderr)
                        continue
                    if len(bootstrap["fit"]["resampling"]["theta_i_deg"]) < FEWEST_ANGLES:
                        print(f"compare_errors: {name}: too few angles", file=sys.stderr)
                        continue
                    clustered, formula = (fitted(brdfit, command, source) for source in ("clustered", "formula"))
                    wanted = errors(bootstrap)
                    of = [errors(report) for report in (clustered, formula)]
                    ratios = [[e[key] / wanted[key] for key in wanted if key in e] for e in of]
                    clustered_ratios += ratios[0]
                    formula_ratios += ratios[1]
                    grouping = clustered["fit"]["grouping"]
                    groups = f"{grouping['groups']} {grouping['kind']}" if grouping else "none"
                    label = f"`{name}`" + (f" {material}" if material else "")
                    cells = [f"{min(r):.2f} to {max(r):.2f}" if r else "-" for r in ratios]
                    print(
                        f"| {label} | `{model}` | {groups} | {len(ratios[0])} of {len(wanted)} | {cells[0]} | {cells[1]} |",
                        flush=True,
                    )
    for label, ratios in (("clustered", clustered_ratios), ("formula", formula_ratios)):
        within = sum(0.7 <= ratio <= 1.5 for ratio in ratios)
        print(
            f"\n{label}: {within} of {len(ratios)} ratios ({100 * within / len(ratios):.0f} %) from 0.7 to 1.5; "
            f"median {statistics.median(ratios):.2f}"
        )


if __name__ == "__main__":
    main()
