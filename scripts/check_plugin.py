#!/usr/bin/env python3
"""Tests the Mitsuba plugins of `brdfit export --to mitsuba-plugin`.

What it does
    For every model below, at values that are given and not fitted, `brdfit evaluate` writes a report and `brdfit export` the plugin.
    The script exits 1 if
      - Mitsuba's chi-square test finds that directions are not drawn from the density that the plugin says, for light from the
        normal, an oblique and a grazing direction (significance 0.01, corrected for the number of tests);
      - what is drawn is not weighted by f cos(theta)/density: the mean weight and the albedo, integrated over the hemisphere, differ
        by more than 1 %;
      - the picture of the studio's ball (data/scenes/studio-sphere.json) differs by 1 % or more, as root of the mean square over
        the ball's pixels relative to the mean, from that of `brdfit render`.

How to run it (packages come from scripts/requirements-renderers.txt; Debian's libllvm19 compiles Mitsuba's kernels)
    python scripts/check_plugin.py --brdfit target/release/brdfit
"""

from __future__ import annotations

import argparse
import glob
import importlib.util
import os
import sys
import tempfile
from pathlib import Path

import numpy as np

# Dr.Jit takes the first LLVM that it finds, and versions before 16 cannot compile for every processor.
for library in sorted(glob.glob("/usr/lib/*-linux-gnu/libLLVM*.so.1[6-9]*") + glob.glob("/usr/lib/*-linux-gnu/libLLVM-1[6-9]*.so*")):
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", library)

import mitsuba as mi  # noqa: E402
from common import checked_brdfit  # noqa: E402
import export_pictures  # noqa: E402
from export_pictures import Scene, brdfit_pictures, mitsuba_scene, run_for_long, studio  # noqa: E402

# So few pixels need only one run of brdfit, which leaves a pixel black if its grazing directions lie between cells of the table.
export_pictures.SIDE = 128

LIGHTS = ([0.0, 0.0, 1.0], [0.64, 0.48, 0.6], [0.3, -0.93, 0.21])
SIGNIFICANCE = 0.01
SAMPLES = 1024
# A sum, a metal that is brushed and has colour, a table of shadowing, and a renderer's model with another one.
MODELS = [
    ("lambert + cook-torrance", ["kd.r=0.4", "kd.g=0.1", "kd.b=0.05", "m=0.2", "f0=0.06"]),
    ("cook-torrance(d=ggx-anisotropic, f=schlick)", ["mx=0.3", "my=0.15", "f0.r=0.9", "f0.g=0.6", "f0.b=0.3"]),
    ("lambert + cook-torrance(d=student-t, g=smith)", ["kd=0.2", "m=0.25", "gamma=2.5", "f0=0.5"]),
    ("openpbr", ["specular_roughness=0.4"]),
]


def plugin(path: Path):
    """Loads a plugin in the variant that is set, which registers it."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return loaded


def chi_square(light: list[float]) -> float:
    """The p-value of the test that directions are drawn from the density."""
    from mitsuba.chi2 import BSDFAdapter, ChiSquareTest, SphericalDomain

    unit = [float(x) for x in np.array(light) / np.linalg.norm(light)]
    sample, density = BSDFAdapter("brdfit", "", wi=unit)
    test = ChiSquareTest(SphericalDomain(), sample, density, sample_dim=3, sample_count=1_000_000, res=101, ires=16)
    test.run(significance_level=SIGNIFICANCE, quiet=True)
    return float(test.p_value)


def albedos(light: list[float]) -> tuple[float, float]:
    """The mean weight of what is drawn, and the albedo from directions that are even over the hemisphere."""
    count = 2_000_000
    bsdf, context, point = mi.load_dict({"type": "brdfit"}), mi.BSDFContext(), mi.SurfaceInteraction3f()
    point.wi = mi.Vector3f((np.array(light) / np.linalg.norm(light)).tolist())
    rng = np.random.default_rng(25)
    one, two = mi.Float(rng.random(count)), mi.Point2f(rng.random(count), rng.random(count))
    _, weight = bsdf.sample(context, point, one, two)
    around = mi.warp.square_to_uniform_hemisphere(two)
    flux = bsdf.eval(context, point, around) * (2.0 * np.pi)
    return float(np.mean(np.array(weight))), float(np.mean(np.array(flux)))


def picture(scene: Scene, seen: np.ndarray, seed: int) -> np.ndarray:
    """The radiance that comes through the centres of the pixels that are `seen`, as in brdfit: not through their whole areas."""
    made = mitsuba_scene(mi.load_dict({"type": "brdfit"}), scene, 1)
    rays = np.repeat(scene.rays()[seen], SAMPLES, axis=0)
    sampler = mi.load_dict({"type": "multijitter", "sample_count": SAMPLES})
    sampler.set_samples_per_wavefront(SAMPLES)
    sampler.seed(seed, len(rays))
    ray = mi.RayDifferential3f(mi.Point3f(scene.eye.tolist()), mi.Vector3f(rays.T))
    radiance, _, _ = made.integrator().sample(made, sampler, ray)
    return np.array(radiance).T.reshape(-1, SAMPLES, 3).mean(axis=1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--brdfit", help="the program")
    parser.add_argument("--passes", type=int, default=8, help=f"render so often, each time with {SAMPLES} samples per pixel")
    arguments = parser.parse_args()
    brdfit = checked_brdfit(parser, arguments.brdfit)
    mi.set_variant("llvm_ad_rgb")
    scene, faults = studio(), []
    print("model; p-values of chi-square; mean weight against albedo; relative RMSE of the picture")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        # Fits are rendered where their measurement has samples, so that theirs must have them everywhere.
        measurement = folder / "everywhere.binary"
        run_for_long(brdfit, "synth", "-m", "lambert", "--grid", "merl", "-o", measurement)
        for number, (model, values) in enumerate(MODELS):
            report, path = folder / f"{number}.json", folder / f"plugin_{number}.py"
            given = [word for value in values for word in ("--set", value)]
            run_for_long(brdfit, "evaluate", measurement, "-m", model, *given, "-q", "-o", report)
            run_for_long(brdfit, "export", report, "--to", "mitsuba-plugin", "-o", path)
            mi.set_variant("llvm_ad_rgb")
            plugin(path)
            chances = [chi_square(light) for light in LIGHTS]
            pairs = [albedos(light) for light in LIGHTS]
            seen = scene.inside()
            passes = [picture(scene, seen.ravel(), seed) for seed in range(arguments.passes)]
            _, own = brdfit_pictures(brdfit, scene, report, measurement, folder)
            lit = np.any(own[seen] > 0, axis=1)
            difference, mean = (np.mean(passes, axis=0) - own[seen])[lit], np.mean(own[seen][lit])
            error = float(np.sqrt(np.mean(difference**2)) / mean)
            texts = [f"{chance:.2f}" for chance in chances], [f"{a:.4f}/{b:.4f}" for a, b in pairs]
            print(f"{model}; {' '.join(texts[0])}; {' '.join(texts[1])}; {100 * error:.2f} %")
            if min(chances) < 1 - (1 - SIGNIFICANCE) ** (1 / (len(MODELS) * len(LIGHTS))):
                faults.append(f"{model}: directions are not drawn from the density")
            if any(abs(a - b) > 0.01 * b for a, b in pairs):
                faults.append(f"{model}: weights are not f cos/density")
            if not error < 0.01:
                faults.append(f"{model}: pictures differ by {100 * error:.2f} %")
    for fault in faults:
        print(f"FAULT {fault}")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
