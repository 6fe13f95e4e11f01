"""What each renderer's own model costs in accuracy on measured materials, beside the best of a few sums.

Prints the table of docs/use/export.md.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from common import SHARED_DATA, checked_brdfit, nbrdf_tool

TARGETS = ("mitsuba", "gltf", "materialx", "usd", "blender", "radiance", "pbrt")
FREE = (
    "lambert + cook-torrance + cook-torrance",
    "ashikhmin-shirley + cook-torrance",
    "lambert + cook-torrance(d=student-t)",
    "oren-nayar + cook-torrance(d=exponential-power)",
)
MERL = (
    "alumina-oxide", "black-phenolic", "blue-fabric", "cherry-235", "chrome", "gold-metallic-paint2", "gold-paint", "gray-plastic",
    "green-latex", "pink-felt", "red-plastic", "silver-metallic-paint", "special-walnut-224", "specular-blue-phenolic", "steel",
    "two-layer-gold", "white-fabric2",
)
CORNELL = ("cayman", "garnet_red", "krylon_blue")
SAMPLES = ("--samples", "20000")


def materials(folder):
    """Yields the path of every measurement, made for the moment where it is a network."""
    for name in CORNELL:
        yield SHARED_DATA / f"cornell/{name}.brdf"
    tool = nbrdf_tool()
    networks = np.load(SHARED_DATA / "nbrdf/merl.npz")
    for name in MERL:
        path = Path(folder) / f"{name}.binary"
        tool.write_merl(tool.decode(networks[name])[0], path)
        yield path
        path.unlink()


def output(command):
    done = subprocess.run(command, capture_output=True, text=True)
    if not done.stdout:
        sys.exit(f"{' '.join(map(str, command))}: {done.stderr.strip()}")
    return json.loads(done.stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--brdfit", required=True, help="the program")
    brdfit = checked_brdfit(parser, parser.parse_args().brdfit)
    print(f"| material | {' | '.join(TARGETS)} | best of {len(FREE)} sums |")
    print("|---" * (len(TARGETS) + 2) + "|")
    logs = []
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "exported"
        for path in materials(folder):
            errors = [
                output([brdfit, "export", path, "--to", target, "-o", file, "--json", *SAMPLES])["exported"]["unbiased_cbrt"]
                for target in TARGETS
            ]
            models = [argument for model in FREE for argument in ("-m", model)]
            reports = output([brdfit, "fit", path, *models, "--json", *SAMPLES])["reports"]
            errors.append(min(report["errors"]["unbiased_cbrt"] for report in reports))
            print(f"| {path.stem} | {' | '.join(f'{error:.4f}' for error in errors)} |", flush=True)
            logs.append(np.log(errors))
    ratios = np.exp(np.mean(np.array(logs) - np.array(logs)[:, -1:], axis=0))
    print(f"| geometric mean of the ratios to the last | {' | '.join(f'{ratio:.2f}' for ratio in ratios)} |")


if __name__ == "__main__":
    main()
