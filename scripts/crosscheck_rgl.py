#!/usr/bin/env python3
"""Cross-check of RGL tensor files: does Mitsuba 3's plugin `measured` make of them what brdfit wrote?

What it does
    For a metal, a plastic and an anisotropic metal, at values that are given and not fitted, this script
      1. lets `brdfit evaluate` write its report, and `brdfit convert --to rgl` the file;
      2. lets Mitsuba evaluate the file at 10 000 pairs of directions, and `brdfit convert --at` the file and the report;
      3. lets Mitsuba draw directions from the file, whose mean weight must be the albedo that its own evaluation gives.
    Errors are root mean squares over the pairs of f cos(theta_i) cos(theta_o), relative to that of the expected values. Against brdfit's
    evaluation of the file they must be below 0.1 %, and against the model, where interpolation counts, below 1 %. It exits 1 if not.

How to run it (packages come from scripts/requirements-renderers.txt)
    python scripts/crosscheck_rgl.py --brdfit target/release/brdfit
    python scripts/crosscheck_rgl.py --brdfit target/release/brdfit --only metal
    python scripts/crosscheck_rgl.py --self-test        Mitsuba against scripts/reference/rgl.py on the files in tests/rgl; no brdfit needed
"""

from __future__ import annotations

import argparse
import csv
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from common import checked_brdfit

ROOT = Path(__file__).resolve().parents[1]
# Not by way of its package, which needs mpmath.
sys.path.insert(0, str(ROOT / "scripts" / "reference"))
import rgl  # noqa: E402

MEASUREMENT = ROOT / "data" / "satin-red-paint.csv"
PAIRS = 10_000
# Pairs further from the normal than this are left out: f grows there beyond all bounds.
LIMIT_DEG = 85
FILE_LIMIT, MODEL_LIMIT = 0.001, 0.01


@dataclass(frozen=True)
class Material:
    model: str
    settings: tuple


MATERIALS = {
    "metal": Material(
        "cook-torrance(d=ggx, f=conductor)",
        ("cook-torrance.m=0.1", "cook-torrance.eta.r=0.17", "cook-torrance.eta.g=0.42", "cook-torrance.eta.b=1.33", "cook-torrance.k=2.5"),
    ),
    "plastic": Material(
        "lambert + cook-torrance(d=ggx)",
        ("lambert.kd.r=0.42", "lambert.kd.g=0.055", "lambert.kd.b=0.3", "cook-torrance.m=0.1", "cook-torrance.f0=0.05"),
    ),
    "anisotropic": Material(
        "cook-torrance(d=ggx-anisotropic)", ("cook-torrance.mx=0.1", "cook-torrance.my=0.3", "cook-torrance.f0=0.9")
    ),
}


def run(brdfit, *arguments):
    done = subprocess.run([brdfit, *map(str, arguments)], capture_output=True, text=True, timeout=300)
    if done.returncode:
        sys.exit(f"brdfit {' '.join(map(str, arguments))} exited {done.returncode}: {done.stderr.strip()}")


def write_directions(path, angles):
    with open(path, "w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(["theta_i", "phi_i", "theta_o", "phi_o"])
        rows.writerows(np.degrees(angles).tolist())


def read_values(path):
    with open(path, encoding="utf-8") as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    at = {name: place for place, name in enumerate(rows[0])}
    return np.array([[float(row[at[channel]]) for channel in "rgb"] for row in rows[1:]])


def pairs(count, seed):
    """Half of the pairs anywhere, and half near the mirror direction."""
    random = np.random.default_rng(seed)
    limit = np.radians(LIMIT_DEG)
    angles = random.uniform([0, -np.pi, 0, -np.pi], [limit, np.pi, limit, np.pi], (count, 4))
    half = count // 2
    angles[:half, 2] = np.clip(np.abs(angles[:half, 0] + random.normal(0, 0.1, half)), 0, limit)
    angles[:half, 3] = angles[:half, 1] + np.pi + random.normal(0, 0.1, half)
    return angles


def error(found, expected, weights):
    return float(np.sqrt(np.sum((weights * (found - expected)) ** 2) / np.sum((weights * expected) ** 2)))


def sampling_error(path, theta) -> float:
    """How far the mean weight of drawn directions is from the integral of what Mitsuba evaluates, relative to it."""
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    bsdf = mi.load_dict({"type": "measured", "filename": str(path)})
    context, point = mi.BSDFContext(), mi.SurfaceInteraction3f()
    point.wi = rgl.direction(theta, 0.3).tolist()
    random, count = np.random.default_rng(1), 20_000
    drawn = np.mean([np.array(bsdf.sample(context, point, 0.5, u)[1]) for u in random.uniform(0, 1, (count, 2)).tolist()], axis=0)
    # By quadrature over half vectors, where a sharp lobe is resolved.
    n_theta, n_phi = 300, 120
    x = (np.arange(n_theta) + 0.5) / n_theta
    theta_m, phi_m = np.meshgrid(0.5 * np.pi * x**2, (np.arange(n_phi) + 0.5) / n_phi * 2 * np.pi, indexing="ij")
    m, wi = rgl.direction(theta_m, phi_m).reshape(-1, 3), rgl.direction(theta, 0.3)
    area = (np.sin(theta_m) * np.pi * x[:, None] / n_theta * 2 * np.pi / n_phi).ravel()
    facing = m @ wi
    wo = 2 * facing[:, None] * m - wi
    good = (facing > 0) & (wo[:, 2] > 0)
    values = np.array([np.array(bsdf.eval(context, point, w)) for w in wo[good].tolist()])
    integral = np.sum(values * (4 * facing * area)[good, None], axis=0)
    return float(np.max(np.abs(drawn / integral - 1)))


def check(brdfit, name, material, folder) -> list[str]:
    report, file, directions = folder / "report.json", folder / f"{name}.bsdf", folder / "pairs.csv"
    run(brdfit, "evaluate", MEASUREMENT, "-m", material.model, "--set", *material.settings, "-q", "-o", report)
    run(brdfit, "convert", report, "-o", file, "--to", "rgl")
    angles = pairs(PAIRS, 7)
    write_directions(directions, angles)
    values = {}
    for what, source in (("file", file), ("model", report)):
        run(brdfit, "convert", source, "--at", directions, "-o", folder / f"{what}.csv")
        values[what] = read_values(folder / f"{what}.csv")
    wi, wo = rgl.direction(*angles.T[:2]), rgl.direction(*angles.T[2:])
    found = rgl.mitsuba(file, rgl.read(file), wi, wo)
    weights = (wi[:, 2] * wo[:, 2])[:, None]
    against_file, against_model = (error(found, values[what], weights) for what in ("file", "model"))
    drawn = sampling_error(file, 0.8)
    size = file.stat().st_size / 1e6
    print(f"| {name} | `{material.model}` | {size:.1f} MB | {against_file:.1e} | {against_model:.2%} | {drawn:.1%} |", flush=True)
    return [
        f"{name}: {problem}"
        for wrong, problem in (
            (not against_file <= FILE_LIMIT, f"Mitsuba differs from brdfit's evaluation by {against_file:.1e}"),
            (not against_model <= MODEL_LIMIT, f"Mitsuba differs from the model by {against_model:.2%}"),
            (not drawn <= 0.05, f"drawn directions have a mean weight that is off by {drawn:.1%}"),
        )
        if wrong
    ]


def self_test():
    # Mitsuba 3.9.1 leaves the symmetry of isotropic files undefined, which may mirror both directions: made-up numbers have no symmetry.
    for name in ("whole", "half", "quarter"):
        path = rgl.FOLDER / f"{name}.bsdf"
        fields, angles = rgl.read(path), pairs(500, 3)
        wi, wo = rgl.direction(*angles.T[:2]), rgl.direction(*angles.T[2:])
        found = rgl.mitsuba(path, fields, wi, wo)
        expected = rgl.evaluate(fields, wi, wo)[:, : found.shape[1]]
        weights = (wi[:, 2] * wo[:, 2])[:, None]
        assert error(found, expected, weights) < 1e-4, (path, error(found, expected, weights))
        assert error(found * 1.01, expected, weights) > 0.009, path


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--brdfit", metavar="PATH")
    parser.add_argument("--only", action="append", choices=MATERIALS, default=[])
    parser.add_argument("--self-test", action="store_true")
    options = parser.parse_args()
    if options.self_test:
        self_test()
        print("self-test passed")
        return 0
    brdfit = checked_brdfit(parser, options.brdfit)
    started, problems = time.monotonic(), []
    print("| material | model | size | Mitsuba - brdfit's evaluation | Mitsuba - model | drawn directions |\n|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name in options.only or MATERIALS:
            problems += check(brdfit, name, MATERIALS[name], Path(folder))
    print(f"\n{time.monotonic() - started:.0f} s")
    print("\n".join(problems) or "all agree")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
