#!/usr/bin/env python3
"""Turn NIST's measurement of sintered PTFE into the CSV that brdfit reads.

    python scripts/convert_nist_ptfe.py PTFE.data.csv ptfe.csv

The layout of the table published with Germer 2017 (Full four-dimensional and reciprocal Mueller matrix bidirectional
reflectance distribution function of sintered polytetrafluoroethylene, Applied Optics): a header, then one line per
sample,

    lambda, thetai, phi, thetar, phir, f_r11, ...     micrometres, degrees, 1/sr

f_r11 is the BRDF for unpolarised light; the elements of the Mueller matrix behind it are left out. phi is the turn of the
sample about its normal. A negative polar angle stands for its absolute value half a turn further, so that
thetai = -75 comes from azimuth 180 and throws its mirror image to phir = 0: there the table is largest.

Each wavelength becomes a column, if all were measured in the same directions. Lines with a direction in or below the
horizon are left out and counted.

Python's standard library only. --self-test tries the script on a small table.
"""

import argparse
import csv
import io
import math
import sys

NEEDED = ("lambda", "thetai", "phi", "thetar", "phir", "f_r11")


def fail(message):
    sys.exit(f"convert_nist_ptfe: {message}")


def direction(theta, phi):
    """Polar angle of at least zero and azimuth in 0..360, degrees."""
    return abs(theta), (phi + 180.0 if theta < 0.0 else phi) % 360.0


def read(lines, path):
    """Wavelength in nanometres, the four angles and f of every line, and how many were below the horizon."""
    table = csv.DictReader(lines)
    missing = [name for name in NEEDED if name not in (table.fieldnames or ())]
    if missing:
        fail(f"{path}: no column {', '.join(missing)}")
    samples, below = [], 0
    for row in table:
        try:
            wavelength, theta_i, turn, theta_o, phi_o, f = (float(row[name]) for name in NEEDED)
        except (TypeError, ValueError):
            fail(f"{path}, line {table.line_num}: expected numbers in {', '.join(NEEDED)}")
        if not all(map(math.isfinite, (wavelength, theta_i, turn, theta_o, phi_o, f))):
            fail(f"{path}, line {table.line_num}: a number is not finite")
        light, view = direction(theta_i, turn), direction(theta_o, turn + phi_o)
        if light[0] >= 90.0 or view[0] >= 90.0:
            below += 1
            continue
        samples.append((round(1000.0 * wavelength, 6), light + view, f))
    return samples, below


def columns(samples, path):
    """The wavelengths, and the values at all of them by direction and repetition, in the order of the table."""
    wavelengths = sorted({wavelength for wavelength, _, _ in samples})
    repetition, rows = {}, {}
    for wavelength, angles, f in samples:
        # Directions that stand twice in the table stay two samples.
        turn = repetition[wavelength, angles] = repetition.get((wavelength, angles), -1) + 1
        rows.setdefault((angles, turn), {})[wavelength] = f
    uneven = sum(len(values) != len(wavelengths) for values in rows.values())
    if uneven:
        fail(f"{path}: {uneven} directions were not measured at every wavelength")
    return wavelengths, [(angles, [values[w] for w in wavelengths]) for (angles, _), values in rows.items()]


def write(out, wavelengths, rows):
    out.write("# sintered PTFE, NIST; unpolarised BRDF\n")
    out.write("theta_i,phi_i,theta_o,phi_o," + ",".join(f"{w:.12g}nm" for w in wavelengths) + "\n")
    for angles, values in rows:
        out.write(",".join([format(angle, ".12g") for angle in angles] + [repr(f) for f in values]) + "\n")


def self_test():
    header = ",".join(NEEDED) + ",f_r12/f_r11\n"
    text = header + "0.633,-75,0,80,-24,0.66,0\n0.633,-75,0,91,0,9,0\n0.351,-75,0,80,-24,0.5,0\n0.351,-75,0,-10,0,0.2,0\n"
    text += "0.633,-75,0,-10,0,0.3,0\n"
    samples, below = read(io.StringIO(text), "test")
    out = io.StringIO()
    write(out, *columns(samples, "test"))
    lines = out.getvalue().splitlines()[1:]
    expected = ["theta_i,phi_i,theta_o,phi_o,351nm,633nm", "75,180,80,336,0.5,0.66", "75,180,10,180,0.2,0.3"]
    if below != 1 or lines != expected:
        fail(f"self-test: found {below} below the horizon and {lines}")
    print("self-test passed")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("input", nargs="?")
    parser.add_argument("output", nargs="?")
    parser.add_argument("--self-test", action="store_true", help="try the script on a small table")
    arguments = parser.parse_args()
    if arguments.self_test:
        return self_test()
    if arguments.output is None:
        parser.error("expected an input and an output")
    with open(arguments.input, encoding="utf-8-sig", newline="") as lines:
        samples, below = read(lines, arguments.input)
    wavelengths, rows = columns(samples, arguments.input)
    with open(arguments.output, "w", encoding="utf-8", newline="\n") as out:
        write(out, wavelengths, rows)
    print(f"{len(rows)} directions at {len(wavelengths)} wavelengths; {below} lines below the horizon left out")


if __name__ == "__main__":
    main()
