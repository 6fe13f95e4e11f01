"""Whole models of diffuse light: rough surfaces, paint, and light from below a surface."""

from __future__ import annotations

from mpmath import atan2, cosh, exp, fabs, mpf, pi, sin, sinh, sqrt, tan

from .distributions import numbers
from .fresnel import dielectric_of_index
from .grid import Geometry
from .whole import Whole

K1 = mpf(1) / 2 - 2 / (3 * pi)
K2 = mpf(2) / 3 - 28 / (15 * pi)


def projected(v):
    return sqrt(v[0] ** 2 + v[1] ** 2)


def polar(v):
    return atan2(projected(v), v[2])


def lambert(g: Geometry, kd):
    return kd / pi


# Oren and Nayar


def angles(g: Geometry):
    """The larger and the smaller polar angle, and the cosine of the azimuth between the directions; any at the normal."""
    b, a = sorted((polar(g.wi), polar(g.wo)))
    lengths = projected(g.wi) * projected(g.wo)
    dot = g.wi[0] * g.wo[0] + g.wi[1] * g.wo[1]
    return a, b, dot / lengths if lengths else mpf(0)


def oren_nayar(g: Geometry, albedo, sigma):
    (a, b, cos_p), s2 = angles(g), sigma**2
    c1 = 1 - s2 / (2 * (s2 + mpf("0.33")))
    c2 = mpf("0.45") * s2 / (s2 + mpf("0.09")) * (sin(a) - ((2 * b / pi) ** 3 if cos_p < 0 else 0))
    c3 = mpf("0.125") * s2 / (s2 + mpf("0.09")) * (4 * a * b / pi**2) ** 2
    direct = c1 + c2 * cos_p * tan(b) + c3 * (1 - fabs(cos_p)) * tan((a + b) / 2)
    bounced = mpf("0.17") * s2 / (s2 + mpf("0.13")) * (1 - cos_p * (2 * b / pi) ** 2)
    return albedo / pi * direct + albedo**2 / pi * bounced


def qualitative(g: Geometry, albedo, sigma):
    (a, b, cos_p), s2 = angles(g), sigma**2
    c1 = 1 - s2 / (2 * (s2 + mpf("0.33")))
    return albedo / pi * (c1 + mpf("0.45") * s2 / (s2 + mpf("0.09")) * max(0, cos_p) * sin(a) * tan(b))


def fujii(g: Geometry, albedo, r):
    # wi.wo - ci co = sin sin cos, by the angles
    a, b, cos_p = angles(g)
    s = sin(a) * sin(b) * cos_p
    return albedo / pi * (1 + r * s / (max(g.ci, g.co) if s > 0 else 1)) / (1 + K1 * r)


# EON


def eon(g: Geometry, r, albedo):
    a = 1 / (1 + K1 * r)

    def directional(v):
        theta = polar(v)
        s = sin(theta)
        bounced = s * (theta - s * sin(pi / 2 - theta)) + mpf(2) / 3 * (tan(theta) * (1 - s**3) - s)
        return a * (1 + r * bounced / pi)

    mean = a * (1 + K2 * r)
    # The pattern of later bounces is 0/0 on a smooth surface, where it has a limit that mean - 1 = 0 hides.
    if r == 0:
        return fujii(g, albedo, r)
    b = albedo**2 * mean / (1 - albedo * (1 - mean))
    return fujii(g, albedo, r) + b / pi * (1 - directional(g.wi)) * (1 - directional(g.wo)) / (1 - mean)


# Disney's diffuse lobe


def disney_diffuse(g: Geometry, kd, r):
    rise = 2 * r * g.mu**2 - mpf(1) / 2
    return kd / pi * (1 + rise * (1 - g.ci) ** 5) * (1 + rise * (1 - g.co) ** 5)


# Kubelka and Munk


def below_surface(k1, k2, r):
    return (1 - k1) * (1 - k2) * r / (1 - k2 * r) / pi


def opaque(g: Geometry, ratio, k1, k2):
    return below_surface(k1, k2, 1 + ratio - sqrt(ratio**2 + 2 * ratio))


def film(g: Geometry, kx, sx, rg, k1, k2):
    if sx == 0:
        r = rg * exp(-2 * kx)
    else:
        a = 1 + kx / sx
        b = sqrt(a * a - 1)
        coth = cosh(b * sx) / sinh(b * sx)
        r = (1 - rg * (a - b * coth)) / (a - rg + b * coth)
    return below_surface(k1, k2, r)


# Light from below a surface


def transmittance(cos, eta):
    return 1 - dielectric_of_index(cos, eta)


def dipole_exponents(albedo, eta):
    fdr = mpf("-1.440") / eta**2 + mpf("0.710") / eta + mpf("0.668") + mpf("0.0636") * eta
    a, w = (1 + fdr) / (1 - fdr), sqrt(3 * (1 - albedo))
    return 4 * a * w / 3, w


def dipole(g: Geometry, albedo, eta):
    to_air, w = dipole_exponents(albedo, eta)
    rd = albedo / 2 * (1 + exp(-to_air)) * exp(-w)
    return transmittance(g.ci, eta) * transmittance(g.co, eta) * rd / pi


def refracted(v, eta):
    x, y = v[0] / eta, v[1] / eta
    return x, y, sqrt(1 - (1 - v[2] ** 2) / eta**2)


def hanrahan_krueger(g: Geometry, albedo, mean_cos, tau, eta):
    wi, wo = refracted(g.wi, eta), refracted(g.wo, eta)
    ci, co = wi[2], wo[2]
    # By the angle between the two, whose lengths are off 1 by what rounding did to wi and wo.
    apart, along = (sum((a + sign * b) ** 2 for a, b in zip(wi, wo)) for sign in (-1, 1))
    cos = -(along - apart) / (along + apart)
    phase = (1 - mean_cos**2) / (4 * pi * (1 + mean_cos**2 - 2 * mean_cos * cos) ** mpf("1.5"))
    through = transmittance(g.ci, eta) * transmittance(g.co, eta)
    return albedo * through * phase / (eta**2 * (ci + co)) * (1 - exp(-tau * (1 / ci + 1 / co)))


ALBEDOS = ("0", "1e-9", "0.04", "1", "2")


def degrees(x):
    return mpf(x) * pi / 180


MODELS = [
    Whole("lambert", ("kd",), numbers(*[(x,) for x in ALBEDOS]), lambert),
    Whole(
        "oren-nayar-full",
        ("albedo", "sigma"),
        [
            (mpf(a), degrees(s))
            for a, s in (("0", 20), ("1e-9", 40), ("0.04", "1e-3"), ("0.5", 0), (1, 10), (1, "0.5"), ("0.7", 30), (2, 90))
        ],
        oren_nayar,
    ),
    Whole(
        "oren-nayar-qualitative",
        ("albedo", "sigma"),
        [
            (mpf(a), degrees(s))
            for a, s in (("0", 20), ("1e-9", 40), ("0.04", "1e-3"), ("0.5", 0), (1, 10), (1, "0.5"), ("0.7", 30), (2, 90))
        ],
        qualitative,
    ),
    Whole(
        "oren-nayar-fujii",
        ("albedo", "r"),
        numbers(("0", "0.5"), ("1e-9", "0.3"), ("0.04", "1e-5"), ("0.5", 0), (1, "0.5"), (1, 1), (2, "0.9")),
        fujii,
    ),
    Whole(
        "eon",
        ("r", "albedo"),
        numbers(("0.5", 0), ("0.3", "1e-9"), ("1e-5", "0.04"), ("0.2", "0.5"), ("0.5", 1), (1, 1), (1, "0.9")),
        eon,
    ),
    Whole(
        "disney-diffuse",
        ("kd", "r"),
        numbers(("0", "0.5"), ("1e-9", "0.3"), ("0.04", "1e-5"), ("0.5", 0), (1, "0.25"), (1, 1), (2, "0.9")),
        disney_diffuse,
    ),
    Whole(
        "kubelka-munk-opaque",
        ("k_over_s", "k1", "k2"),
        numbers(
            ("1e-6", 0, 0), ("1e-6", "0.04", "0.596"), ("1e-3", "0.99", "0.99"), ("0.1", 0, "0.6"), (1, "1e-9", "1e-9"),
            (20, "0.04", "0.596"), ("1e3", "0.1", "0.9"), ("1e6", 0, 0),
        ),
        opaque,
    ),
    Whole(
        "kubelka-munk-film",
        ("kx", "sx", "rg", "k1", "k2"),
        numbers(
            ("1e-6", 1, 1, 0, 0), ("1e-6", "1e4", 0, 0, 0), ("1e-6", "1e-9", "0.04", 0, 0), ("1e4", 1, 1, 0, 0), ("1e4", "1e4", "0.5", 0, 0),
            (1, 0, "0.8", 0, 0), (1, 1, 1, "0.04", "0.596"), ("0.1", 3, "0.8", "0.99", "0.99"), ("0.5", "0.01", "1e-9", "0.1", "0.9"),
            ("1e-3", 30, 0, "0.04", "0.6"),
        ),
        film,
    ),
    Whole(
        "dipole",
        ("albedo_prime", "eta"),
        numbers((0, "1.5"), ("1e-9", "1.3"), ("0.04", "1.05"), ("0.5", 3), ("0.9", "1.5"), ("0.99", "1.1"), ("0.999999", "2.5")),
        dipole,
        lambda g, albedo, eta: sum(dipole_exponents(albedo, eta)),
    ),
    Whole(
        "hanrahan-krueger",
        ("albedo", "g", "tau", "eta"),
        numbers(
            ("0", "0.5", 1, "1.5"), ("1e-9", "-0.95", "1e-3", "1.3"), ("0.04", "0.95", "1e3", "1.000000001"),
            ("0.5", 0, "0.1", "1.5"), (1, "-0.95", 10, "1.0001"), (1, "0.95", "1e-3", 3), ("0.9", "0.3", "0.5", "1.33"),
        ),
        hanrahan_krueger,
    ),
]
