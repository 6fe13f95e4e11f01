#!/usr/bin/env python3
"""Compare the default standard errors with those of the block bootstrap, and print the tables of docs/trust/calibration.md.

    python scripts/compare_errors.py --brdfit target/release/brdfit

Every measured file and every neural regression is fitted with two models and three sources of standard errors. The block bootstrap
repeats the fit 200 times on angles of incidence drawn anew; it needs at least five of them, and counts here where there are ten. Files with
more samples are fitted with the budget `balanced`, whose 20 000 samples make 200 fits bearable. `--every N` takes every Nth regression
of each archive, from the first.

It needs numpy.
"""

import argparse
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
ARCHIVES = ("merl.npz", "nielsen.npz", "rgl-isotropic.npz")
FEWEST_ANGLES = 10
WITHIN = (0.7, 1.5)
# Half of a 95 % interval of a normal distribution, in standard deviations.
NORMAL = 1.96


def fitted(brdfit, arguments, source):
    """The report of a fit with standard errors from `source`; None if it is not to be had."""
    command = [brdfit, "fit", *arguments, "--uncertainty", source, "--budget", "balanced", "--json", "-q"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return json.loads(done.stdout) if done.returncode in (0, 1) and done.stdout else None


def errors(report):
    """The standard error and half the 95 % interval of each fitted parameter that has them."""
    return {
        f"{p['lobe']}.{p['name']}.{p['channel']}": (p["std_error"], (p["ci95"][1] - p["ci95"][0]) / 2)
        for p in report["parameters"]
        if p["std_error"] is not None and p["ci95"] is not None
    }


def decoded(folder, archive, every):
    """MERL tables of the neural regressions of an archive, as this project's helper decodes them, one at a time."""
    tool = nbrdf_tool()
    networks = np.load(SHARED_DATA / "nbrdf" / archive)
    for name in networks.files[::every]:
        path = Path(folder) / f"{name}.binary"
        tool.write_merl(tool.decode(networks[name])[0], path)
        yield name, [str(path)]
        path.unlink()


def compared(brdfit, name, arguments, model):
    """The ratios of one measurement with one model; None if the bootstrap is not to be had, or has too few angles."""
    command = [*arguments, "-m", model]
    bootstrap = fitted(brdfit, command, "block-bootstrap")
    if bootstrap is None or not bootstrap["fit"]["resampling"]:
        print(f"compare_errors: {name}: no bootstrap", file=sys.stderr)
        return None
    if len(bootstrap["fit"]["resampling"]["theta_i_deg"]) < FEWEST_ANGLES:
        print(f"compare_errors: {name}: too few angles", file=sys.stderr)
        return None
    clustered, formula = (fitted(brdfit, command, source) for source in ("clustered", "formula"))
    refits, default, independent = (errors(report) for report in (bootstrap, clustered, formula))
    grouping = clustered["fit"]["grouping"]
    both = [key for key in refits if key in default]
    return {
        "name": name,
        "model": model,
        "groups": f"{grouping['groups']} {grouping['kind']}" if grouping else "none",
        "wanted": len(refits),
        "parameters": both,
        # The standard deviation of the refits, and what would be that of a normal distribution with their 95 % interval.
        "deviation": [default[key][0] / refits[key][0] for key in both],
        "interval": [default[key][0] / (refits[key][1] / NORMAL) for key in both],
        "formula": [independent[key][0] / refits[key][0] for key in refits if key in independent],
    }


def is_within(ratio):
    return WITHIN[0] <= ratio <= WITHIN[1]


def share(ratios):
    within = sum(map(is_within, ratios))
    return f"{within} of {len(ratios)} ({100 * within / len(ratios):.0f} %)" if ratios else "-"


def extent(ratios):
    return f"{min(ratios):.2f} to {max(ratios):.2f}" if ratios else "-"


def spread(ratios):
    return f"{min(ratios):.2f}, {statistics.median(ratios):.2f}, {max(ratios):.2f}" if ratios else "-"


def gathered(results, what):
    return [ratio for result in results for ratio in result[what]]


def line(*cells):
    print("| " + " | ".join(cells) + " |", flush=True)


def compare_files(brdfit):
    """The table of the measured files, a line for each material and model."""
    line("measurement", "model", "groups", "parameters", "clustered / bootstrap", "clustered / its interval", "formula / bootstrap")
    print("|---|---|---|---|---|---|---|")
    results = []
    for name in FILES:
        path = str(SHARED_DATA / name)
        for material in materials(run(brdfit, ["info", path, "--json"])) or [None]:
            chosen = ["--material", material] if material else []
            label = f"`{name}`" + (f" {material}" if material else "")
            for model in MODELS:
                result = compared(brdfit, label, [path, *chosen], model)
                if result is None:
                    continue
                results.append(result)
                count = f"{len(result['parameters'])} of {result['wanted']}"
                cells = [extent(result[what]) for what in ("deviation", "interval", "formula")]
                line(label, f"`{model}`", result["groups"], count, *cells)
    return results


def compare_regressions(brdfit, every):
    """The table of the neural regressions, a line for each archive and model."""
    results = []
    lines = []
    with tempfile.TemporaryDirectory() as folder:
        for archive in ARCHIVES:
            here = []
            for name, arguments in decoded(folder, archive, every):
                for model in MODELS:
                    result = compared(brdfit, name, arguments, model)
                    if result is not None:
                        here.append({**result, "archive": archive})
            for model in MODELS:
                of_model = [result for result in here if result["model"] == model]
                deviation, interval = gathered(of_model, "deviation"), gathered(of_model, "interval")
                cells = [share(deviation), spread(deviation), share(interval), spread(interval)]
                lines.append((f"`{archive}`, {len(of_model)}", f"`{model}`", *cells, spread(gathered(of_model, "formula"))))
            results += here
    print()
    line(
        "archive, regressions", "model", "clustered / bootstrap: within", "least, median, largest",
        "clustered / its interval: within", "least, median, largest", "formula / bootstrap: least, median, largest",
    )
    print("|---|---|---|---|---|---|---|")
    for cells in lines:
        line(*cells)
    return results


def tell_misses(results):
    """How many ratios are too far off, and of which measurements."""
    for label, what in (("standard deviation", "deviation"), ("95 % interval", "interval")):
        print(f"\noutside, against the {label} of the refits:")
        for result in results:
            off = [ratio for ratio in result[what] if not is_within(ratio)]
            if off:
                print(f"  {result['name']}, {result['model']}: {len(off)} of {len(result[what])}, {extent(off)}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--brdfit", required=True, help="the program")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="take every Nth neural regression [default: 1]")
    parser.add_argument("--raw", type=Path, metavar="FILE", help="write every ratio to FILE as JSON")
    arguments = parser.parse_args()
    if arguments.every < 1:
        parser.error("--every: at least 1")
    brdfit = checked_brdfit(parser, arguments.brdfit)
    results = compare_files(brdfit)
    measured = len(results)
    results += compare_regressions(brdfit, arguments.every)
    if arguments.raw:
        arguments.raw.write_text(json.dumps(results), encoding="utf-8")
    tell_misses(results)
    for label, part in (("files", results[:measured]), ("regressions", results[measured:]), ("all", results)):
        for what in ("deviation", "interval", "formula"):
            ratios = gathered(part, what)
            print(f"\n{label}, {what}: {share(ratios)} from {WITHIN[0]} to {WITHIN[1]}; least, median, largest {spread(ratios)}")


if __name__ == "__main__":
    main()
