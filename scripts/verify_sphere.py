#!/usr/bin/env python3
"""Checks the spheres of `brdfit plot --kind sphere` with a second renderer, which shares no code with it.

What it does
    For every model below this script makes a measurement (`brdfit synth`), evaluates the model that made it at the true
    values (`brdfit evaluate`), lets `brdfit plot --kind sphere --data` write the radiance of every pixel, renders the same
    formula in numpy, and compares the panel `fit`, pixel by pixel. It exits 1 if a pixel differs by more than 1e-3 of the
    brightest, or the whole image by more than 1e-3 of its root mean square.

How to run it (numpy and scipy come from scripts/requirements.txt)
    python scripts/verify_sphere.py --brdfit target/release/brdfit

What does not differ
    The scene, data/scenes/studio-sphere.json, and the points of light that docs/use/scene.md says stand for a rectangle:
    the midpoints of at most `samples` cells, as nearly square as possible. The renderer and the formulas are those of
    verify_select.py, written from the papers.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import sys
import tempfile
from pathlib import Path

import numpy as np

from common import checked_brdfit
from verify_select import Exact, Lights, brdf, call, render, scene_path, see, unit

TOLERANCE = 1e-3

# Expression, true values.
MODELS = [
    ("lambert", {"lambert.kd.r": 0.6, "lambert.kd.g": 0.3, "lambert.kd.b": 0.1}),
    (
        "lambert + cook-torrance(d=ggx, g=smith, f=schlick)",
        {
            "lambert.kd.r": 0.4,
            "lambert.kd.g": 0.1,
            "lambert.kd.b": 0.05,
            "cook-torrance.m": 0.2,
            "cook-torrance.ks.r": 1.0,
            "cook-torrance.ks.g": 1.0,
            "cook-torrance.ks.b": 1.0,
            "cook-torrance.f0.r": 0.05,
            "cook-torrance.f0.g": 0.05,
            "cook-torrance.f0.b": 0.05,
        },
    ),
    (
        "cook-torrance(d=beckmann, g=smith, f=schlick)",
        {
            "cook-torrance.m": 0.35,
            "cook-torrance.ks.r": 1.0,
            "cook-torrance.ks.g": 1.0,
            "cook-torrance.ks.b": 1.0,
            "cook-torrance.f0.r": 0.9,
            "cook-torrance.f0.g": 0.7,
            "cook-torrance.f0.b": 0.4,
        },
    ),
]


def rectangles(scene: dict) -> list[Lights]:
    """The lights of a scene of rectangles, as docs/use/scene.md divides them."""
    lights = []
    for light in scene["lights"]:
        q = light["area"]
        u, v = np.array(q["half_u"], float), np.array(q["half_v"], float)
        long, short, most = np.linalg.norm(u), np.linalg.norm(v), q["samples"]
        across = max(1, round(math.sqrt(most * short / long)))
        along = most // across
        x, y = ((2 * np.arange(n) + 1) / n - 1 for n in (along, across))
        at = np.array(q["center"]) + (x[:, None, None] * u + y[None, :, None] * v).reshape(-1, 3)
        normal = np.broadcast_to(unit(np.cross(u, v)), at.shape)
        each = np.array(q["radiance_rgb"], float) * 4 * long * short / len(at)
        lights.append(Lights(True, at, normal, np.broadcast_to(each, at.shape)))
    return lights


def panel(path: Path, name: str) -> np.ndarray:
    """The radiance of a panel, (rows, columns, 3)."""
    with path.open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["panel"] == name]
    place = np.array([[int(row["row"]), int(row["column"])] for row in rows])
    image = np.zeros((*(place.max(axis=0) + 1), 3))
    names = [key for key in rows[0] if key[:2] in ("r ", "g ", "b ")]
    image[place[:, 0], place[:, 1]] = [[float(row[key]) for key in names] for row in rows]
    return image


def compare(brdfit: str, expression: str, values: dict[str, float], folder: Path) -> bool:
    """Whether the two renderings of a model agree."""
    data, report, svg, table = (folder / name for name in ("m.binary", "m.json", "m.svg", "m-numbers.csv"))
    given = [f"{name}={value}" for name, value in values.items()]
    call([brdfit, "synth", "-m", expression, "--set", *given, "--grid", "merl", "-o", str(data)])
    call([brdfit, "evaluate", str(data), "-m", expression, "--set", *given, "-o", str(report), "-q"])
    call([brdfit, "plot", str(report), "--kind", "sphere", "-o", str(svg), "--data", str(table)])
    theirs = panel(table, "fit")
    measured = panel(table, "measured")

    scene = json.loads(scene_path("studio-sphere").read_text())
    scene["camera"] |= {"height": theirs.shape[0], "width": theirs.shape[1]}
    seen = see(scene)
    model = brdf(expression, list(values.items()), ["r", "g", "b"])
    (image,), _ = render(seen, rectangles(scene), Exact(model), [])
    ours = np.zeros((theirs.shape[0] * theirs.shape[1], 3))
    ours[seen.pixel] = image
    ours = ours.reshape(theirs.shape)
    # The program leaves black what no sample of the measurement surrounds, in the fit as well.
    known = np.any(measured != 0, axis=2)
    off = np.abs(ours - theirs)[known]
    largest = off.max() / ours.max()
    root = math.sqrt((off**2).sum() / (ours[known] ** 2).sum())
    share = known.sum() / len(seen.pixel)
    print(f"{expression}: largest difference {largest:.1e} of the brightest pixel, root mean square {root:.1e}; {share:.1%} of the ball")
    return largest < TOLERANCE and root < TOLERANCE and share > 0.9


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--brdfit", help="the program to check")
    brdfit = checked_brdfit(parser, parser.parse_args().brdfit)
    with tempfile.TemporaryDirectory() as folder:
        agree = [compare(brdfit, expression, values, Path(folder)) for expression, values in MODELS]
    return 0 if all(agree) else 1


if __name__ == "__main__":
    sys.exit(main())
