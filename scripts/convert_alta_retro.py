#!/usr/bin/env python3
"""Turn an ALTA text file of an isotropic measurement into the CSV that brdfit reads.

    python scripts/convert_alta_retro.py retro-3M-yellow.dat tape.csv

The layout of CEA's measurements of retro-reflective tapes (https://hal.archives-ouvertes.fr/hal-01083366), as the
ALTA library (http://alta.gforge.inria.fr) defines it:

    #DIM 3 1                                  three coordinates, one value
    #PARAM_IN ISOTROPIC_TL_TV_PROJ_DPHI       theta_l, theta_v cos(dphi), theta_v sin(dphi), in radians
    #PARAM_OUT INV_STERADIAN_COSINE_FACTOR    f cos(theta_v): weighted by the cosine of the *output* direction

or INV_STERADIAN for f itself. l is the light, v the viewer, dphi the azimuth between them: 0 where the viewer stands
over the light. A sample with the viewer in the horizon has lost its f and is left out. That theta_v is the angle whose
cosine is meant shows in the data, too: --check prints, for pairs of samples of which one is the other with light and
viewer exchanged, what reciprocity makes of either cosine.

Python's standard library only.
"""

import argparse
import math
import sys

INPUT = "ISOTROPIC_TL_TV_PROJ_DPHI"
OUTPUTS = ("INV_STERADIAN_COSINE_FACTOR", "INV_STERADIAN")
# A viewer closer to the horizon than this has no cosine to divide by.
LEAST_COSINE = 1e-6


def read(path):
    """The header's words by key, and the rows of four numbers."""
    header, rows = {}, []
    with open(path, encoding="utf-8") as lines:
        for number, line in enumerate(lines, 1):
            words = line.split()
            if line.startswith("#"):
                if words[0] != "#":
                    header[words[0][1:]] = words[1:]
                continue
            if not words:
                continue
            try:
                row = [float(word) for word in words]
            except ValueError:
                row = []
            if len(row) != 4 or not all(map(math.isfinite, row)):
                sys.exit(f"{path}, line {number}: expected four numbers, found '{line.strip()[:60]}'")
            rows.append(row)
    for key, expected in (("DIM", ["3 1"]), ("PARAM_IN", [INPUT]), ("PARAM_OUT", OUTPUTS)):
        found = " ".join(header.get(key, []))
        if found not in expected:
            sys.exit(f"{path}: expected #{key} {' or '.join(expected)}, found '{found}'")
    return header, rows


def samples(rows, weighted):
    """theta_l, theta_v, dphi and f of every row that has them."""
    for light, x, y, value in rows:
        view, dphi = math.hypot(x, y), math.atan2(y, x)
        cosine = math.cos(view) if weighted else 1.0
        if math.cos(view) > LEAST_COSINE:
            yield light, view, dphi, value / cosine


def check(rows):
    """Prints f(l, v)/f(v, l) of in-plane pairs, with the cosine of either direction divided out."""
    in_plane = [(light, x, value) for light, x, y, value in rows if abs(y) < 1e-6]
    close = math.radians(0.6)
    print("light viewer   by viewer's cosine   by light's")
    for light, x, value in in_plane:
        for other, back, exchanged in in_plane:
            same = abs(other - abs(x)) < close and abs(math.copysign(light, x) - back) < close
            if same and light < other:
                ratio = value / exchanged
                view = math.cos(other) / math.cos(light)
                print(f"{math.degrees(light):5.1f} {math.degrees(x):6.1f} {ratio / view:20.3f} {ratio * view:12.3f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("input")
    parser.add_argument("output", nargs="?")
    parser.add_argument("--check", action="store_true", help="which cosine the values carry, by reciprocity")
    arguments = parser.parse_args()
    header, rows = read(arguments.input)
    if arguments.check:
        check(rows)
    if arguments.output is None:
        return
    weighted = header["PARAM_OUT"] == [OUTPUTS[0]]
    kept = list(samples(rows, weighted))
    with open(arguments.output, "w", encoding="utf-8", newline="\n") as out:
        for key in ("SAMPLE", "ORIGIN", "URL"):
            if key in header:
                out.write(f"# {key.lower()}: {' '.join(header[key])}\n")
        out.write("theta_i,phi_i,theta_o,phi_o,y\n")
        for light, view, dphi, f in kept:
            angles = (math.degrees(angle) for angle in (light, view, dphi))
            theta_i, theta_o, phi_o = (format(angle, ".12g") for angle in angles)
            out.write(f"{theta_i},0,{theta_o},{phi_o},{f!r}\n")
    print(f"{len(kept)} samples, {len(rows) - len(kept)} with the viewer in the horizon left out")


if __name__ == "__main__":
    main()
