#!/usr/bin/env python3
"""Turn measurements of metals and lacquers in the thermal infrared into CSV files that brdfit reads, one per material.

    python scripts/convert_mwir.py mwir_metals_lacquers.csv mwir/

The table (2 to 5.7 micrometres, in the plane of incidence, on the side of the mirror direction;
https://github.com/MT-MRT/JSSS-GonioreflectometryBRDF) has comments and

    material,theta_i_deg,theta_o_deg,brdf_per_sr,L_o

with brdf = L_o cos(theta_o)/(L_i cos(theta_i) Omega_i), L radiances and Omega_i the source's solid angle. The BRDF is a
radiance over an irradiance, without the viewer's cosine, so it is divided out; --keep-cosine leaves it in. Reciprocity
tells the two apart: --check prints the exponent p of the best f(i, o)/f(o, i) = (cos o/cos i)^p over the exchanged pairs
of each material as published; 1 is one cosine of the viewer too many, 0 is none.

Rows with theta_i of 88 degrees and more are left out, as by the authors.

Python's standard library only. --self-test tries the script on a small table.
"""

import argparse
import csv
import io
import math
import pathlib
import re
import sys

NEEDED = ("material", "theta_i_deg", "theta_o_deg", "brdf_per_sr")
# The authors' plots begin below this.
GRAZING = 88.0
# brdfit's default of the largest angle, beyond which measurements are least exact.
CHECKED = 80.0


def fail(message):
    sys.exit(f"convert_mwir: {message}")


def read(lines, path):
    """(theta_i, theta_o, f as published) by material, and how many rows were left out."""
    table = csv.DictReader(line for line in lines if not line.startswith("#"))
    missing = [name for name in NEEDED if name not in (table.fieldnames or ())]
    if missing:
        fail(f"{path}: no column {', '.join(missing)}")
    materials, dropped = {}, 0
    for number, row in enumerate(table, 1):
        name = row["material"] or ""
        try:
            theta_i, theta_o, f = (float(row[column]) for column in NEEDED[1:])
        except (TypeError, ValueError):
            fail(f"{path}, row {number}: expected numbers in {', '.join(NEEDED[1:])}")
        if not re.fullmatch(r"\w+", name) or not all(map(math.isfinite, (theta_i, theta_o, f))):
            fail(f"{path}, row {number}: expected a material's name and finite numbers")
        if theta_i >= GRAZING or theta_o >= 90.0:
            dropped += 1
            continue
        materials.setdefault(name, []).append((theta_i, theta_o, f))
    return materials, dropped


def excess(samples):
    """The least-squares p of ln f(i, o)/f(o, i) = p ln(cos o/cos i), and the number of pairs."""
    values = {(theta_i, theta_o): f for theta_i, theta_o, f in samples}
    square, product, pairs = 0.0, 0.0, 0
    for (theta_i, theta_o), f in values.items():
        back = values.get((theta_o, theta_i))
        if theta_i < theta_o <= CHECKED and back is not None and f > 0.0 and back > 0.0:
            cosines = math.log(math.cos(math.radians(theta_o)) / math.cos(math.radians(theta_i)))
            square += cosines * cosines
            product += cosines * math.log(f / back)
            pairs += 1
    return (product / square if pairs else math.nan), pairs


def write(out, name, samples, keep_cosine):
    out.write(f"# {name}, 2 to 5.7 um\ntheta_i,phi_i,theta_o,phi_o,y\n")
    for theta_i, theta_o, f in samples:
        value = f if keep_cosine else f / math.cos(math.radians(theta_o))
        out.write(f"{theta_i:.12g},0,{theta_o:.12g},180,{value!r}\n")


def self_test():
    header = ",".join(NEEDED) + ",L_o\n"
    text = "# a comment\n" + header + "a,88,0,1,1\na,60,0,2,1\na,0,60,1,1\n"
    materials, dropped = read(io.StringIO(text), "test")
    out = io.StringIO()
    write(out, "a", materials["a"], False)
    rows = [[float(word) for word in line.split(",")] for line in out.getvalue().splitlines()[2:]]
    expected = [[60, 0, 0, 180, 2], [0, 0, 60, 180, 2]]
    close = all(abs(a - b) < 1e-12 for row, other in zip(rows, expected) for a, b in zip(row, other))
    power, pairs = excess(materials["a"])
    if dropped != 1 or len(rows) != 2 or not close or pairs != 1 or abs(power - 1.0) > 1e-12:
        fail(f"self-test: {dropped} left out, rows {rows}, exponent {power} of {pairs} pairs")
    print("self-test passed")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("input", nargs="?")
    parser.add_argument("folder", nargs="?")
    parser.add_argument("--keep-cosine", action="store_true", help="values as published, times the viewer's cosine")
    parser.add_argument("--check", action="store_true", help="which cosine the values carry, by reciprocity")
    parser.add_argument("--self-test", action="store_true", help="try the script on a small table")
    arguments = parser.parse_args()
    if arguments.self_test:
        return self_test()
    if arguments.input is None or (arguments.folder is None and not arguments.check):
        parser.error("expected an input and a folder")
    with open(arguments.input, encoding="utf-8-sig", newline="") as lines:
        materials, dropped = read(lines, arguments.input)
    if arguments.check:
        print("material                 pairs  exponent")
        for name, samples in materials.items():
            power, pairs = excess(samples)
            print(f"{name:24} {pairs:5} {power:9.3f}")
    if arguments.folder is not None:
        folder = pathlib.Path(arguments.folder)
        folder.mkdir(parents=True, exist_ok=True)
        for name, samples in materials.items():
            with open(folder / f"{name}.csv", "w", encoding="utf-8", newline="\n") as out:
                write(out, name, samples, arguments.keep_cosine)
        print(f"{len(materials)} materials, {sum(map(len, materials.values()))} samples; {dropped} rows left out")


if __name__ == "__main__":
    main()
