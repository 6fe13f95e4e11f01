"""Fits one and two lobes to every measurement at hand, and compares the errors.

Prints the table of docs/trust/nesting.md, and fails if two lobes are worse than one anywhere.
"""

import argparse
import itertools
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from common import SHARED_DATA, checked_brdfit, nbrdf_tool

ONE = "lambert + cook-torrance"
TWO = f"{ONE} + cook-torrance"
MOST_SAMPLES = 100_000
"""Samples per fit: enough for any table, and few enough for all materials in minutes."""


def merl_tables(folder):
    """Makes MERL tables of the networks at hand, one at a time, and yields their paths."""
    tool = nbrdf_tool()
    for file in sorted((SHARED_DATA / "nbrdf").glob("*.npz")):
        networks = np.load(file)
        for name in sorted(networks.files):
            path = Path(folder) / f"{name}.binary"
            tool.write_merl(tool.decode(networks[name])[0], path)
            yield path
            path.unlink()


def others(folder):
    """Yields the name, path and options of the measurements at hand that are neither Cornell's nor MERL's."""
    folder = Path(folder)
    yield "nist-ptfe", SHARED_DATA / "nist-ptfe/PTFE.data.csv", []
    yield "retro-3M-yellow", SHARED_DATA / "cea-retro/retro-3M-yellow.dat", []
    metals = SHARED_DATA / "mwir/mwir_metals_lacquers.csv"
    rows = [line.split(",")[0] for line in metals.read_text().splitlines() if not line.startswith("#")]
    for material in sorted(set(rows[1:])):
        yield material, metals, ["--material", material]
    for file in sorted((SHARED_DATA / "rgl").glob("*_reference.csv")):
        header, *rows = file.read_text().splitlines()
        with (folder / f"{file.stem}.csv").open("w") as out:
            print(header, file=out)
            for row in rows:
                numbers = [float(number) for number in row.split(",")]
                print(*map(math.degrees, numbers[:4]), *numbers[4:], sep=",", file=out)
        yield file.stem, folder / f"{file.stem}.csv", []


def fit(brdfit, path, options, model):
    """The errors of a fit in cbrt: on the samples fitted, and on angles of incidence, each left out of a fit."""
    sampled = ["--samples", str(MOST_SAMPLES), "--hold-out", "0.2"]
    command = [brdfit, "fit", path, *options, "-m", model, *sampled, "--metric", "cbrt", "--json"]
    done = subprocess.run(command, capture_output=True, text=True)
    if not done.stdout:
        print(f"{path.name}: {done.stderr.strip()}", file=sys.stderr)
        return math.nan, math.nan
    report = json.loads(done.stdout)
    return report["errors"]["cbrt"], report["selection"]["held_out"]["cbrt"]


def geometric_mean(ratios):
    return math.exp(sum(map(math.log, ratios)) / len(ratios))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--brdfit", required=True, help="the program")
    brdfit = checked_brdfit(parser, parser.parse_args().brdfit)
    worse, ratios, held = [], [], []
    print("| material | one lobe | two lobes | ratio | held out: ratio |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        cornell = sorted((SHARED_DATA / "cornell").glob("*.brdf"))
        paints = [(path.stem, path, []) for path in cornell]
        merl = ((path.stem, path, []) for path in merl_tables(folder))
        for name, path, options in itertools.chain(paints, others(folder), merl):
            (one, held_one), (two, held_two) = (fit(brdfit, path, options, model) for model in (ONE, TWO))
            print(f"| {name} | {one:.5f} | {two:.5f} | {two / one:.3f} | {held_two / held_one:.3f} |", flush=True)
            ratios.append(two / one)
            held.append(held_two / held_one)
            if two > one * (1 + 1e-9):
                worse.append(name)
    print(
        f"\n{len(ratios)} materials, geometric mean of the ratios {geometric_mean(ratios):.3f}; worse with two lobes: {', '.join(worse) or 'none'}\n"
        f"held out: geometric mean {geometric_mean(held):.3f}; worse on {sum(ratio > 1 for ratio in held)}, by {100 * (max(held) - 1):.1f} % at most"
    )
    return 1 if worse else 0


if __name__ == "__main__":
    sys.exit(main())
