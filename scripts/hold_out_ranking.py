"""Ranks four models by the error on angles left out, with several seeds, on ten measurements.

Prints the table of docs/use/fitting.md, and fails if two models change places without being listed as not told apart in every ranking.
"""

import argparse
import itertools
import json
import subprocess
import sys
from pathlib import Path

from common import SHARED_DATA, checked_brdfit

MODELS = ["lambert + cook-torrance", "lambert + cook-torrance(d=beckmann)", "lambert + ward", "ashikhmin-shirley"]
SEEDS = range(5)
METALS = SHARED_DATA / "mwir/mwir_metals_lacquers.csv"
MATERIALS = [
    ("satin-red-paint", Path(__file__).parent.parent / "data/satin-red-paint.csv", []),
    ("garnet_red", SHARED_DATA / "cornell/garnet_red.brdf", []),
    ("krylon_blue", SHARED_DATA / "cornell/krylon_blue.brdf", []),
    ("cayman", SHARED_DATA / "cornell/cayman.brdf", []),
    ("retro-3M-yellow", SHARED_DATA / "cea-retro/retro-3M-yellow.dat", []),
    ("PTFE", SHARED_DATA / "nist-ptfe/PTFE.data.csv", []),
    ("aluminium_sandblasted", METALS, ["--material", "aluminium_sandblasted"]),
    ("ref_lacquer_rough", METALS, ["--material", "ref_lacquer_rough"]),
    ("vch_golden_yellow", SHARED_DATA / "rgl/vch_golden_yellow_rgb.bsdf", []),
    ("pink-felt-1d", SHARED_DATA / "merl-slices/pink-felt-1d.alta", []),
]


def ranked(brdfit, path, options, seed, hold_out):
    """The order of the models, their errors, the pairs not told apart, the number of groups of angles and of folds."""
    models = [part for model in MODELS for part in ("-m", model)]
    command = [brdfit, "fit", path, *options, *models, "--hold-out", hold_out, "--seed", str(seed), "--json"]
    done = subprocess.run(command, capture_output=True, text=True)
    if not done.stdout:
        sys.exit(f"{path}: {done.stderr.strip()}")
    reports = json.loads(done.stdout)
    order = [rank["index"] for rank in reports["ranking"]]
    values = [rank["value"] for rank in reports["ranking"]]
    alike = {frozenset((rank["index"], other)) for rank in reports["ranking"] for other in rank["not_told_apart"]}
    held_out = reports["reports"][0]["selection"]["held_out"]
    return order, values, alike, len(held_out["theta_i_deg"]), len(held_out["folds"])


def letters(order, alike):
    """The order as letters, with `~` before a model that is not told apart from the one before it, and `>` before one that is."""
    text = "ABCD"[order[0]]
    for before, after in itertools.pairwise(order):
        text += ("~" if frozenset((before, after)) in alike else ">") + "ABCD"[after]
    return text


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--brdfit", required=True, help="the program")
    parser.add_argument("--hold-out", default="0.2", help="what is left out at a time")
    arguments = parser.parse_args()
    brdfit = checked_brdfit(parser, arguments.brdfit)
    unsaid = []
    print("| material | angles | folds | " + " | ".join(f"seed {seed}" for seed in SEEDS) + " | error of the best | change places | told apart |")
    print("|" + "---|" * (len(SEEDS) + 6))
    for name, path, options in MATERIALS:
        rankings = [ranked(brdfit, path, options, seed, arguments.hold_out) for seed in SEEDS]
        moved, wrong, apart = [], [], 0
        for pair in itertools.combinations(range(len(MODELS)), 2):
            first = {order.index(pair[0]) < order.index(pair[1]) for order, *_ in rankings}
            listed = [frozenset(pair) in alike for _, _, alike, *_ in rankings]
            apart += not any(listed)
            if len(first) > 1:
                moved.append("".join("ABCD"[index] for index in pair))
                if not all(listed):
                    wrong.append(moved[-1])
        if wrong:
            unsaid.append(f"{name}: {' '.join(wrong)}")
        best = [values[0] for _, values, *_ in rankings]
        cells = [letters(order, alike) for order, _, alike, *_ in rankings]
        between = f"{min(best):.4f}" if max(best) - min(best) < 5e-5 else f"{min(best):.4f} to {max(best):.4f}"
        groups, folds = rankings[0][3:]
        print(f"| {name} | {groups} | {folds} | {' | '.join(cells)} | {between} | {' '.join(moved) or '-'} | {apart} of 6 |", flush=True)
    print(f"\nchange places without being listed: {'; '.join(unsaid) or 'none'}")
    return 1 if unsaid else 0


if __name__ == "__main__":
    sys.exit(main())
