"""Makes data/paint-drawdown.csv: a green paint over a black and white card, at two thicknesses.

    python scripts/drawdown_example.py > data/paint-drawdown.csv

Reflectances by the formulas of Kubelka 1948 as printed, and Saunderson's correction: a second implementation of what
`brdfit kubelka-munk` fits. Needs nothing but Python 3. The noise comes from a generator written out here, so that the file does
not depend on Python's version, and values are rounded to 1e-5, so that it does not depend on the last digit of a library's
functions.
"""

import math

K1, K2 = 0.04, 0.596  # the surface: refractive index 1.5
THICKNESSES = [0.03, 0.06]  # mm
BACKINGS = {"black": 0.01, "white": 0.82}  # as the film sees them
SIGMA = 0.001
WAVELENGTHS = range(400, 701, 20)


def absorption(nm):
    """K per mm: a band in the blue and one in the red."""
    band = lambda centre, width: math.exp(-(((nm - centre) / width) ** 2))
    return 0.5 + 12 * band(420, 45) + 9 * band(650, 50)


def scattering(nm):
    """S per mm, falling towards the red."""
    return 40 * (nm / 550) ** -1.2


def reflectance(k, s, x, rg):
    a = 1 + k / s
    b = math.sqrt(a * a - 1)
    coth = 1 / math.tanh(b * s * x)
    r = (1 - rg * (a - b * coth)) / (a - rg + b * coth)
    return K1 + (1 - K1) * (1 - K2) * r / (1 - K2 * r)


def normals(state=20260101):
    """Normal deviates by Box and Muller from the generator of Park and Miller (1988)."""

    def uniform():
        nonlocal state
        state = state * 48271 % 2147483647
        return state / 2147483647

    while True:
        radius, turn = math.sqrt(-2 * math.log(uniform())), 2 * math.pi * uniform()
        yield radius * math.cos(turn)
        yield radius * math.sin(turn)


def main():
    noise = normals()
    print("# synthetic drawdown of a green paint; thickness in mm, wavelength in nm; scripts/drawdown_example.py")
    print("# measured with the surface: --saunderson 0.04,0.596")
    print("wavelength,thickness,black,white,over_black,over_white,sigma")
    for x in THICKNESSES:
        for nm in WAVELENGTHS:
            k, s = absorption(nm), scattering(nm)
            measured = [reflectance(k, s, x, rg) + SIGMA * next(noise) for rg in BACKINGS.values()]
            backings = ",".join(str(rg) for rg in BACKINGS.values())
            print(f"{nm},{x},{backings},{measured[0]:.5f},{measured[1]:.5f},{SIGMA}")


if __name__ == "__main__":
    main()
