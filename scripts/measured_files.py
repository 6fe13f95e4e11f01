#!/usr/bin/env python3
"""Fit every measured file as it was published, and print the table of docs/trust/measured.md, "Every file as it is published".

    python scripts/measured_files.py --brdfit target/release/brdfit

Each command names the file and nothing else about it: format, angles, units and cosines are the reader's affair. A file that holds several
materials is fitted once for each of them.

Python's standard library only.
"""

import argparse
import json
import subprocess
import sys

from common import SHARED_DATA, checked_brdfit

MODELS = (
    "lambert + cook-torrance",
    "lambert + cook-torrance(d=gtr)",
    "ashikhmin-shirley + cook-torrance",
    "lambert + cook-torrance + retro",
)
FILES = (
    "cornell/garnet_red.brdf",
    "cornell/krylon_blue.brdf",
    "cornell/cayman.brdf",
    "rgl/paper_white_rgb.bsdf",
    "rgl/colodur_napoli_4f_rgb.bsdf",
    "rgl/vch_golden_yellow_rgb.bsdf",
    "rgl/cc_iris_purple_gem_rgb.bsdf",
    "nist-ptfe/PTFE.data.csv",
    "cea-retro/retro-3M-yellow.dat",
    "merl-slices/pink-felt-1d.alta",
    "merl-slices/red-fabric-slice.exr",
    "more/ansys-optical-automation/planesymmetric_brdf_zemax.bsdf",
    "mwir/mwir_metals_lacquers.csv",
)


def run(brdfit, arguments):
    """What the program prints as JSON. Exit code 1 means that a fit is not usable, which the report says, too."""
    done = subprocess.run([brdfit, *arguments], capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):
        sys.exit(f"measured_files: {' '.join(arguments)}: {done.stderr.strip()}")
    return json.loads(done.stdout)


def materials(info):
    """The materials in a file, as its reader lists them; none if it holds one."""
    for remark in info["remarks"]:
        if remark.startswith("read material"):
            return [name.strip().strip("'") for name in remark.split(":", 1)[1].split(",")]
    return []


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--brdfit", required=True, help="the program")
    brdfit = checked_brdfit(parser, parser.parse_args().brdfit)
    print("| file | format | samples used | best of four | error, `unbiased-cbrt` | relative |")
    print("|---|---|---|---|---|---|")
    for name in FILES:
        path = str(SHARED_DATA / name)
        for material in materials(run(brdfit, ["info", path, "--json"])) or [None]:
            chosen = ["--material", material] if material else []
            fits = [run(brdfit, ["fit", path, *chosen, "-m", model, "--json"]) for model in MODELS]
            best = min(fits, key=lambda fit: fit["errors"]["unbiased_cbrt"])
            data, errors = best["data"], best["errors"]
            short = next(model for model, fit in zip(MODELS, fits) if fit is best)
            label = f"`{name}`" + (f" `--material {material}`" if material else "")
            print(
                f"| {label} | {data['format']} | {data['used']} of {data['samples']} | `{short}` "
                f"| {errors['unbiased_cbrt']:.4f} | {100 * errors['relative']:.1f} % |",
                flush=True,
            )


if __name__ == "__main__":
    main()
