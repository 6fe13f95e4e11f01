#!/usr/bin/env python3
"""Write measurements in other readings, and count how often `brdfit info` names the right one; the tables of docs/use/doctor.md.

    python scripts/other_readings.py --brdfit target/release/brdfit

Five materials, three of them measured, with four layouts each make twenty files. Each is written in every reading: with other units of
angles, other origins of azimuths, other values. For each, the script decides from the true file whether physics can tell (`can_tell`, as
docs/use/doctor.md says), and then asks the program. The same files as they should be, every file of ../shared/data, and 200 synthetic files of
ten models must give rise to no doubt about their reading.

Python's standard library only.
"""

import argparse
import csv
import itertools
import json
import math
import random
import subprocess
import sys
import tempfile
from pathlib import Path

from common import SHARED_DATA, checked_brdfit
from measured_files import FILES, materials, run

ANGLES = ("theta_i", "phi_i", "theta_o", "phi_o")
DEGREE = math.pi / 180

# Materials: a name, and what makes brdfit write it as CSV.
MATERIALS = {
    "garnet red paint, measured": ["convert", str(SHARED_DATA / "cornell/garnet_red.brdf")],
    "sintered PTFE, measured": ["convert", str(SHARED_DATA / "nist-ptfe/PTFE.data.csv")],
    "sandblasted steel, measured in plane": [
        *("convert", str(SHARED_DATA / "mwir/mwir_metals_lacquers.csv"), "--material", "steel_sandblasted"),
    ],
    "glossy paint": [
        *("synth", "-m", "lambert + cook-torrance", "--set", "kd=0.4", "m=0.25", "f0=0.05"),
        *("--at", "10:15:70 0:5:75 0:15:180", "--noise", "0.01"),
    ],
    "rough metal": [
        *("synth", "-m", "cook-torrance", "--set", "m=0.3", "f0=0.8"),
        *("--at", "0:12:72 0:6:78 0:20:180", "--noise", "0.01"),
    ],
}

# The models of the clean synthetic files.
CLEAN = (
    ("lambert", ["kd=0.6"]),
    ("oren-nayar", ["albedo=0.5", "sigma=30"]),
    ("lambert + cook-torrance", ["kd=0.3", "m=0.15", "f0=0.05"]),
    ("cook-torrance", ["m=0.4", "f0=0.9"]),
    ("cook-torrance(d=beckmann)", ["m=0.2", "f0=0.5"]),
    ("lambert + cook-torrance(d=gtr)", ["kd=0.1", "m=0.1", "f0=0.05", "gamma=1.5"]),
    ("ashikhmin-shirley", ["rd=0.3", "rs=0.05", "nu=50", "nv=50"]),
    ("lambert + ward", ["kd=0.3", "ks=0.1", "m=0.15"]),
    ("lambert + phong", ["kd=0.3", "ks=0.1", "n=20"]),
    ("lambert + cook-torrance(d=ggx-anisotropic)", ["kd=0.1", "mx=0.3", "my=0.1", "f0=0.3"]),
)
# Angles of incidence, of viewing, and the azimuths between them: first, step and last, degrees.
CLEAN_GRIDS = (
    "10:20:70 0:5:80 0:15:180",
    "0:15:75 0:10:80 0:30:330",
    "45:10:45 0:3:84 0:10:180",
    "0:10:80 0:2:84 0:180:180",
)


class File:
    """Samples: four angles in degrees each, and a value."""

    def __init__(self, rows):
        self.rows = rows

    def write(self, path, digits=7):
        with open(path, "w", encoding="utf-8") as file:
            file.write(",".join(ANGLES) + ",f\n")
            file.writelines(",".join(f"{number:.{digits}g}" for number in row) + "\n" for row in self.rows)

    def angles(self, change):
        """The file with changed angles."""
        return File([[*change(*row[:4]), row[4]] for row in self.rows])

    def values(self, change):
        """The file with changed values: `change` takes the value and the cosines of light and viewer."""
        cosine = lambda angle: math.cos(angle * DEGREE)
        return File([[*row[:4], change(row[4], cosine(row[0]), cosine(row[2]))] for row in self.rows])


def synthesise(brdfit, command, path, folder):
    """Runs a command of brdfit, in which `--at` is followed by a grid."""
    if "--at" in command:
        place = command.index("--at") + 1
        ranges = [[int(number) for number in part.split(":")] for part in command[place].split()]
        theta_i, theta_o, phi = (range(first, last + 1, step) for first, step, last in ranges)
        directions = Path(folder) / "directions.csv"
        rows = (f"{ti},0,{to},{po}\n" for ti in theta_i for to in theta_o for po in phi)
        directions.write_text(",".join(ANGLES) + "\n" + "".join(rows), encoding="utf-8")
        command = [*command[:place], str(directions), *command[place + 1 :]]
    done = subprocess.run([brdfit, *command, "-o", str(path)], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"other_readings: {done.stderr.strip()}")


def read(path):
    """The file that brdfit wrote, with the mean of all channels."""
    with open(path, encoding="utf-8") as file:
        table = list(csv.reader(line for line in file if not line.startswith("#")))
    head, rows = table[0], table[1:]
    channels = [place for place, name in enumerate(head) if name not in ANGLES and not name.startswith("sigma")]
    samples = []
    for row in rows:
        values = [float(row[place]) for place in channels if row[place].strip() not in ("", "nan", "NaN")]
        if values:
            angles = [float(row[head.index(name)]) for name in ANGLES]
            angles[3] = (angles[3] - angles[1]) % 360
            samples.append([angles[0], 0.0, angles[2], angles[3], sum(values) / len(values)])
    return File(samples)


def layouts(file, seed):
    """Four files of a material: whole, thinned, with few angles of incidence, and with the sample turned on its holder."""
    rng = random.Random(seed)
    thinned = [row for row in file.rows if rng.random() < 0.5]
    all_angles = sorted({round(row[0], 1) for row in file.rows})
    middle = [angle for angle in all_angles if 15 <= angle <= 70] or all_angles
    chosen = {middle[0], middle[len(middle) // 2], middle[-1]}
    few = [row for row in file.rows if round(row[0], 1) in chosen]
    turned = [[ti, turn, to, (po + turn) % 360, f] for ti, _, to, po, f in file.rows for turn in [rng.choice((0, 30, 60, 90))]]
    return {"whole": file, "half": File(thinned), "three angles": File(few), "turned": File(turned)}


class Facts:
    """What physics can be asked of a file: computed from the true values."""

    def __init__(self, file):
        values = sorted(row[4] for row in file.rows)
        brightest = values[-max(5, len(values) * 3 // 100) :]
        median = values[len(values) // 2]
        self.lobe = sum(brightest) / len(brightest) > 3.5 * max(median, 0)
        beside = [row for row in file.rows if abs(math.sin((row[3] - row[1]) * DEGREE)) * math.sin(row[2] * DEGREE) > 0.2]
        self.out_of_plane = len(beside) > 0.25 * len(file.rows)
        self.turned = len({round(row[1]) for row in file.rows}) > 1
        incidences = sorted({round(row[0], 1) for row in file.rows})
        self.incidences = len(incidences)
        viewed = max(row[2] for row in file.rows)
        self.exchanged = sum(1 for angle in incidences if angle <= viewed) > 1
        self.densely = len(file.rows) / (len(incidences) if self.incidences < 30 else 1) >= 40
        # The albedo, roughly: pi times the mean of f over directions that are spread by their solid angle and cosine.
        self.albedo = math.pi * weighted_mean(file)
        self.steepest = max(max(row[0], row[2]) for row in file.rows)


def weighted_mean(file):
    """The largest mean of f at one angle of incidence, weighted by sin(theta_o) cos(theta_o), of what a lobe does not add: few samples see it."""
    sums = {}
    median = sorted(row[4] for row in file.rows)[len(file.rows) // 2]
    for row in file.rows:
        weight = math.sin(row[2] * DEGREE) * math.cos(row[2] * DEGREE)
        total = sums.setdefault(round(row[0]), [0.0, 0.0])
        total[0] += weight
        total[1] += weight * min(row[4], 3 * median)
    return max(value / weight for weight, value in sums.values() if weight > 0)


RADIANS = lambda angle: angle * DEGREE
GRADIANS = lambda angle: angle / 0.9
COSINE = lambda angle: math.cos(angle * DEGREE)
ELEVATION = lambda angle: 90 - angle
SAME = lambda angle: angle


def units(theta_i=SAME, phi_i=SAME, theta_o=SAME, phi_o=SAME):
    """A change of the units of some angles."""
    return lambda file: file.angles(lambda ti, pi, to, po: (theta_i(ti), phi_i(pi), theta_o(to), phi_o(po)))


def relative(offset):
    """Azimuths of the viewer that count from the light or, with an offset, from the mirror direction."""
    return lambda file: file.angles(lambda ti, pi, to, po: (ti, pi, to, (po - pi + offset) % 360))


def values(change):
    return lambda file: file.values(change)


LOBE = lambda facts: facts.lobe
# Name: how it is written, options that read it, and whether physics can tell from the facts of the true file.
READINGS = {
    "all angles in radians": (units(RADIANS, RADIANS, RADIANS, RADIANS), ["--angles radians"], lambda f: f.steepest > 30),
    "theta_i in radians": (
        *(units(theta_i=RADIANS), ["--angles theta_i=radians"]),
        lambda f: f.lobe and f.incidences > 2,
    ),
    "theta_o in radians": (units(theta_o=RADIANS), ["--angles theta_o=radians"], LOBE),
    "azimuths in radians": (
        *(units(phi_i=RADIANS, phi_o=RADIANS), ["--angles phi_o=radians", "--angles phi_i=radians,phi_o=radians"]),
        lambda f: f.lobe,
    ),
    "all angles in gradians": (
        *(units(GRADIANS, GRADIANS, GRADIANS, GRADIANS), ["--angles gradians"]),
        lambda f: f.lobe and f.steepest < 81,
    ),
    "elevations": (units(theta_i=ELEVATION, theta_o=ELEVATION), ["--angles elevation"], lambda f: f.lobe and f.out_of_plane),
    "theta_i as elevation": (
        *(units(theta_i=ELEVATION), ["--angles theta_i=elevation"]),
        lambda f: f.lobe and f.incidences > 2,
    ),
    "theta_o as elevation": (units(theta_o=ELEVATION), ["--angles theta_o=elevation"], lambda f: f.lobe and f.incidences > 2),
    "cosines of polar angles": (units(theta_i=COSINE, theta_o=COSINE), ["--angles cosine"], lambda f: f.lobe and f.out_of_plane),
    "theta_i as cosine": (units(theta_i=COSINE), ["--angles theta_i=cosine"], lambda f: f.lobe and f.incidences > 2),
    "theta_o as cosine": (units(theta_o=COSINE), ["--angles theta_o=cosine"], LOBE),
    "azimuth from the light": (
        *(relative(0), ["--azimuth from-light"]),
        lambda f: f.lobe and f.turned,
    ),
    "azimuth from the mirror direction": (relative(180), ["--azimuth from-mirror"], LOBE),
    "light as it travels": (
        *(units(phi_i=lambda angle: (angle + 180) % 360), ["--light-direction as-it-travels"]),
        LOBE,
    ),
    "f cos(theta_i)": (values(lambda f, ci, co: f * ci), ["--quantity f-cos-i"], lambda f: f.exchanged),
    "f cos(theta_o)": (values(lambda f, ci, co: f * co), ["--quantity f-cos-o"], lambda f: f.exchanged),
    "f cos(theta_i) cos(theta_o)": (values(lambda f, ci, co: f * ci * co), ["--quantity f-cos-i-cos-o"], lambda f: False),
    "pi f": (
        *(values(lambda f, ci, co: math.pi * f), ["--quantity reflectance-factor"]),
        lambda f: f.out_of_plane and f.densely and f.albedo * math.pi > 1.4,
    ),
    "per cent": (
        *(values(lambda f, ci, co: 100 * f), ["--quantity percent"]),
        lambda f: f.out_of_plane and f.densely and f.albedo > 0.03,
    ),
    "per cent of pi f": (
        *(values(lambda f, ci, co: 100 * math.pi * f), ["--quantity reflectance-factor,percent"]),
        lambda f: f.out_of_plane and f.densely and f.albedo > 0.03,
    ),
    "decibels": (
        *(values(lambda f, ci, co: 10 * math.log10(max(f, 1e-9))), ["--quantity decibel"]),
        lambda f: f.densely,
    ),
    "a scale of 3": (
        *(values(lambda f, ci, co: 3 * f), ["--scale"]),
        lambda f: f.out_of_plane and f.densely and f.albedo * 3 > 1.4,
    ),
}


def doubts(brdfit, path, *options):
    """What `brdfit info` says of other readings of a file; None if it cannot read it."""
    done = subprocess.run([brdfit, "info", str(path), *options, "--json"], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        return None
    return json.loads(done.stdout)["readings"]


def named(readings):
    """The options that were named."""
    return [f"--{option['option']} {option['value']}".strip() for reading in readings for option in reading["options"]]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--brdfit", required=True, help="the program")
    parser.add_argument("--clean", action="store_true", help="only the files that are as they should be")
    parser.add_argument("-v", action="store_true", help="say what was named for each file")
    arguments = parser.parse_args()
    brdfit = checked_brdfit(parser, arguments.brdfit)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "file.csv"
        files = {}
        for seed, (material, command) in enumerate(MATERIALS.items()):
            synthesise(brdfit, command, path, folder)
            files |= {(material, layout): file for layout, file in layouts(read(path), seed).items()}
        print("| reading | files | physics can tell | right one named | among others | another named |")
        print("|---|---|---|---|---|---|")
        for reading, (write, right, can_tell) in READINGS.items():
            if arguments.clean:
                break
            telling = alone = among = other = 0
            for (material, layout), file in files.items():
                tells = can_tell(Facts(file))
                write(file).write(path)
                found = doubts(brdfit, path)
                names = named(found or [])
                hit = any(name in right for name in names)
                telling += tells
                alone += tells and hit and len(names) < 2
                among += tells and hit and len(names) > 1
                other += bool(names) and not hit
                if arguments.v and (tells != hit or (names and not hit)):
                    print(f"    {reading}: {material}, {layout}: {'can' if tells else 'cannot'} tell, named {names}", file=sys.stderr)
            print(f"| {reading} | {len(files)} | {telling} | {alone} | {among} | {other} |", flush=True)
        wrong = 0

        def clean(what, named_files):
            """Counts doubts about files as they should be, each with its name and the arguments that read it."""
            nonlocal wrong
            count = with_doubt = 0
            for name, read_by in named_files:
                found = doubts(brdfit, *read_by)
                count += 1
                if found:
                    with_doubt += 1
                    print(f"    {name}: {found}", file=sys.stderr)
            wrong += with_doubt
            print(f"{count} {what}: {with_doubt} with a doubt")

        def as_they_should_be():
            for (material, layout), file in files.items():
                file.write(path)
                yield f"as it should be: {material}, {layout}", [path]

        def measured():
            for name in FILES:
                for material in materials(run(brdfit, ["info", str(SHARED_DATA / name), "--json"])) or [None]:
                    yield f"{name} {material or ''}", [SHARED_DATA / name, *(["--material", material] if material else [])]

        def synthetic():
            for (model, parameters), grid in itertools.product(CLEAN, CLEAN_GRIDS):
                for seed, noise in enumerate(("0", "0.01", "0.02", "0.05", "0.1")):
                    command = ["synth", "-m", model, "--set", *parameters, "--at", grid, "--noise", noise]
                    synthesise(brdfit, [*command, "--seed", str(seed)], path, folder)
                    yield f"{model} on {grid}, noise {noise}", [path]

        print()
        clean("files as they should be", as_they_should_be())
        clean("materials of ../shared/data", measured())
        clean("synthetic files", synthetic())
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
