"""The facet distributions, their naive forms, and Smith's shadowing.

Formulas are those in the heads of src/model/parts/distribution/*.rs, written anew for exact numbers. Normalisations that
the program finds by quadrature are closed forms here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from mpmath import acos, atan2, erf, exp, fabs, gamma, gammainc, inf, log, log1p, mp, mpf, pi, quad, sqrt

from .grid import PAIR, Geometry, facets, geometry, textbook_geometry
from .table import Table

PI = np.pi


@dataclass
class Distribution:
    """D(h) of shapes and geometry, |ln| of its exponential or power factor, D in the textbook's form, and Smith's shadowing.

    `density(shapes, g)`, `log_factor(shapes, g)`, `naive(real, shapes, g)`. `stretched(shapes, v)` is cos (1 + 2 Lambda);
    `naive_lambda(real, shapes, v)` Lambda.
    """

    name: str
    parameters: tuple[str, ...]
    shapes: list[tuple]
    density: Callable
    naive: Callable
    stretched: Callable
    log_factor: Callable = lambda shapes, g: mpf(0)
    naive_lambda: Callable | None = None

    @property
    def tabulated(self) -> bool:
        return self.naive_lambda is None


def roughnesses(*m) -> list[tuple]:
    return [(mpf(x),) for x in m]


def numbers(*rows) -> list[tuple]:
    return [tuple(mpf(x) for x in row) for row in rows]


M = roughnesses("1e-5", "1e-4", "1e-3", "0.02", "0.1", "0.35", "0.7", 1, 2)
TWO = numbers(
    ("1e-5", "1e-4"), ("1e-3", "2e-3"), ("0.05", "0.01"), ("0.1", "0.1"), ("0.3", "0.6"), ("1e-4", 1), (1, "0.5"), (2, "1.5")
)


# Angles as most texts have them: from the arc cosine of n.h, or of n.v.


def tan2_of(cos):
    return np.tan(np.arccos(cos)) ** 2


def azimuth_of(v):
    return np.arctan2(v[1], v[0])


def projected2(shapes, v) -> mpf:
    """(roughness seen from v, times the sine)^2"""
    mx, my = shapes[0], shapes[-1]
    return (mx * v[0]) ** 2 + (my * v[1]) ** 2


def slope2(shapes, h) -> mpf:
    """Squared slope of the facet in units of the roughness."""
    mx, my = shapes[0], shapes[-1]
    return ((h[0] / mx) ** 2 + (h[1] / my) ** 2) / h[2] ** 2


def naive_slope2(shapes, g: Geometry):
    tan2, phi = tan2_of(g.h[2]), azimuth_of(g.h)
    if len(shapes) == 1:
        return tan2 / shapes[0] ** 2
    return tan2 * (np.cos(phi) ** 2 / shapes[0] ** 2 + np.sin(phi) ** 2 / shapes[1] ** 2)


def naive_projected2(shapes, v):
    """The squared roughness seen from v, times tan^2."""
    tan2, phi = tan2_of(v[2]), azimuth_of(v)
    if len(shapes) == 1:
        return shapes[0] ** 2 * tan2
    return (shapes[0] ** 2 * np.cos(phi) ** 2 + shapes[1] ** 2 * np.sin(phi) ** 2) * tan2


# GGX


def ggx(shapes, g: Geometry) -> mpf:
    mx, my = shapes[0], shapes[-1]
    return 1 / (pi * mx * my * ((g.h[0] / mx) ** 2 + (g.h[1] / my) ** 2 + g.h[2] ** 2) ** 2)


def ggx_naive(real, shapes, g: Geometry):
    c = g.h[2]
    if len(shapes) == 1:
        m2 = shapes[0] ** 2
        return m2 / (real(PI) * (c * c * (m2 - real(1)) + real(1)) ** 2)
    return real(1) / (real(PI) * shapes[0] * shapes[1] * c**4 * (real(1) + naive_slope2(shapes, g)) ** 2)


def ggx_stretched(shapes, v) -> mpf:
    return sqrt(projected2(shapes, v) + v[2] ** 2)


def ggx_naive_lambda(real, shapes, v):
    return (real(-1) + np.sqrt(real(1) + naive_projected2(shapes, v))) / real(2)


# Beckmann


def beckmann(shapes, g: Geometry) -> mpf:
    return exp(-slope2(shapes, g.h)) / (pi * shapes[0] * shapes[-1] * g.h[2] ** 4)


def beckmann_naive(real, shapes, g: Geometry):
    return np.exp(-naive_slope2(shapes, g)) / (real(PI) * shapes[0] * shapes[-1] * g.h[2] ** 4)


def beckmann_stretched(shapes, v) -> mpf:
    slope = sqrt(projected2(shapes, v))
    if slope == 0:
        return v[2]
    x = v[2] / slope
    return slope * exp(-x * x) / sqrt(pi) + v[2] * erf(x)


def beckmann_naive_lambda(real, shapes, v):
    from scipy.special import erf as scipy_erf

    x = real(1) / np.sqrt(naive_projected2(shapes, v))
    return (real(scipy_erf(x)) - real(1)) / real(2) + np.exp(-x * x) / (real(2) * x * np.sqrt(real(PI)))


# Blinn-Phong


def blinn_phong_power(shapes, g: Geometry) -> mpf:
    """ln of the power of the cosine."""
    sin2 = g.sin2_h
    if sin2 == 0:
        return mpf(0)
    exponents = [2 / m**2 - 2 for m in (shapes[0], shapes[-1])]
    if len(shapes) == 1:
        return exponents[0] * log(g.h[2])
    # sqrt((nx + 2)(ny + 2))/2 is 1/(mx my); the exponent is the mean of nx and ny over the azimuth of h.
    return (exponents[0] * g.h[0] ** 2 + exponents[1] * g.h[1] ** 2) / sin2 * log(g.h[2])


def blinn_phong(shapes, g: Geometry) -> mpf:
    return exp(blinn_phong_power(shapes, g)) / (pi * shapes[0] * shapes[-1])


def blinn_phong_naive(real, shapes, g: Geometry):
    n = [real(2) / m**2 - real(2) for m in (shapes[0], shapes[-1])]
    phi = azimuth_of(g.h)
    power = n[0] if len(shapes) == 1 else n[0] * np.cos(phi) ** 2 + n[1] * np.sin(phi) ** 2
    norm = np.sqrt((n[0] + real(2)) * (n[1] + real(2))) / real(2 * PI)
    return norm * g.h[2] ** power


# Gaussian


@lru_cache(maxsize=None)
def gaussian_norm(m: mpf) -> mpf:
    """N = pi Im int_0^(pi/2) exp(-(a/m)^2 + 2 i a) da, the square completed."""
    i = mp.mpc(0, 1)
    integral = m * sqrt(pi) / 2 * exp(-m * m) * (erf(pi / (2 * m) - i * m) - erf(-i * m))
    return pi * integral.imag


def polar_angle(g: Geometry) -> mpf:
    return atan2(sqrt(g.sin2_h), g.h[2])


def gaussian(shapes, g: Geometry) -> mpf:
    return exp(-((polar_angle(g) / shapes[0]) ** 2)) / gaussian_norm(shapes[0])


def gaussian_naive(real, shapes, g: Geometry):
    # No text has a closed form: the exact normalisation, rounded.
    return np.exp(-((np.arccos(g.h[2]) / shapes[0]) ** 2)) / real(float(gaussian_norm(mpf(float(shapes[0])))))


# Generalised Trowbridge-Reitz


def gtr_norm(m: mpf, power: mpf) -> mpf:
    """N = 2 pi int (c^2 + (1 - c^2)/m^2)^-gamma c dc"""
    if m == 1:
        return pi
    if power == 1:
        return pi * m**2 * log(m**2) / (m**2 - 1)
    return pi * m**2 * (1 - m ** (2 * power - 2)) / ((power - 1) * (1 - m**2))


def gtr_power(shapes, g: Geometry) -> mpf:
    m, power = shapes
    return power * log(g.h[2] ** 2 + g.sin2_h / m**2)


def gtr(shapes, g: Geometry) -> mpf:
    return exp(-gtr_power(shapes, g)) / gtr_norm(*shapes)


def gtr_naive(real, shapes, g: Geometry):
    (m, power), one = shapes, real(1)
    m2, c = m * m, g.h[2]
    norm = (power - one) * (m2 - one) / (real(PI) * (one - m2 ** (one - power)))
    return norm / (one + (m2 - one) * c * c) ** power


# Student's t


def student_power(shapes, g: Geometry) -> mpf:
    m, power = shapes
    return power * log1p(g.tan2_h / (m**2 * (power - 1)))


def student(shapes, g: Geometry) -> mpf:
    return exp(-student_power(shapes, g)) / (pi * shapes[0] ** 2 * g.h[2] ** 4)


def student_naive(real, shapes, g: Geometry):
    m, power = shapes
    base = real(1) + tan2_of(g.h[2]) / (m * m * (power - real(1)))
    return real(1) / (real(PI) * m * m * g.h[2] ** 4 * base**power)


# Exponential power


@lru_cache(maxsize=None)
def gamma_of(x: mpf) -> mpf:
    return gamma(x)


def exponential_power_ln(shapes, g: Geometry) -> mpf:
    m, p = shapes
    u2 = g.tan2_h / m**2
    return u2**p if u2 else mpf(0)


def exponential_power(shapes, g: Geometry) -> mpf:
    m, p = shapes
    return p * exp(-exponential_power_ln(shapes, g)) / (pi * m**2 * gamma_of(1 / p) * g.h[2] ** 4)


def exponential_power_naive(real, shapes, g: Geometry):
    from scipy.special import gamma as scipy_gamma

    m, p = shapes
    fall = np.exp(-((tan2_of(g.h[2]) / m**2) ** p))
    return p * fall / (real(PI) * m * m * real(scipy_gamma(real(1) / p)) * g.h[2] ** 4)


# Shifted gamma


@lru_cache(maxsize=None)
def sgd_norm(alpha: mpf, p: mpf) -> mpf:
    """K"""
    return 1 / (alpha * gammainc(1 - p, alpha, inf))


def sgd_ln(shapes, g: Geometry) -> mpf:
    alpha, p = shapes
    x = alpha + g.tan2_h / alpha
    return fabs(x) + fabs(p * log(x))


def sgd(shapes, g: Geometry) -> mpf:
    alpha, p = shapes
    x = alpha + g.tan2_h / alpha
    return sgd_norm(alpha, p) * exp(-x) / (pi * x**p * g.h[2] ** 4)


def sgd_naive(real, shapes, g: Geometry):
    alpha, p = shapes
    x = alpha + tan2_of(g.h[2]) / alpha
    k = real(float(sgd_norm(mpf(float(alpha)), mpf(float(p)))))
    return k * np.exp(-x) / (real(PI) * x**p * g.h[2] ** 4)


# ABC


@lru_cache(maxsize=None)
def abc_norm(b: mpf, c: mpf) -> mpf:
    """N = 2 pi/b int_1^(1 + b) s^-c (1 - (s - 1)/b) ds"""

    def power(e):
        return log(1 + b) if e == -1 else ((1 + b) ** (e + 1) - 1) / (e + 1)

    return 2 * pi / b * ((1 + 1 / b) * power(-c) - power(1 - c) / b)


def abc_ln(shapes, g: Geometry) -> mpf:
    b, c = shapes
    return c * log1p(b * (1 - g.h[2]))


def abc(shapes, g: Geometry) -> mpf:
    return exp(-abc_ln(shapes, g)) / abc_norm(*shapes)


def abc_naive(real, shapes, g: Geometry):
    b, c = shapes
    n = real(float(abc_norm(mpf(float(b)), mpf(float(c)))))
    return (real(1) + b * (real(1) - g.h[2])) ** -c / n


# A table of exponents

KNOTS = [mpf(x) for x in ("0", "0.5", "1", "2", "3", "4.5", "6", "8")]


def exponents_integral(exponents, v):
    """int_0^v s: s linear between the knots, 2 at the first, constant beyond the last."""
    heights, total = (2, *exponents), 0 * v
    for k in range(len(exponents)):
        width = KNOTS[k + 1] - KNOTS[k]
        inside = min(v - KNOTS[k], width)
        if inside <= 0:
            return total
        total += inside * (heights[k] + (heights[k + 1] - heights[k]) * inside / (2 * width))
    return total + max(v - KNOTS[-1], 0) * heights[-1]


@lru_cache(maxsize=None)
def table_norm(exponents: tuple) -> mpf:
    """n"""
    inside = quad(lambda v: exp(v - exponents_integral(exponents, v)), KNOTS)
    return inside + exp(KNOTS[-1] - exponents_integral(exponents, KNOTS[-1])) / (exponents[-1] - 1)


def table_ln(shapes, g: Geometry) -> mpf:
    return exponents_integral(shapes[1:], log1p(g.tan2_h / shapes[0] ** 2))


def tabulated(shapes, g: Geometry) -> mpf:
    return exp(-table_ln(shapes, g)) / (pi * shapes[0] ** 2 * table_norm(shapes[1:]) * g.h[2] ** 4)


def tabulated_naive(real, shapes, g: Geometry):
    m = shapes[0]
    v = np.log(real(1) + tan2_of(g.h[2]) / (m * m))
    heights, total = [real(2), *shapes[1:]], real(0)
    for k in range(len(KNOTS) - 1):
        width = real(float(KNOTS[k + 1] - KNOTS[k]))
        inside = min(max(v - real(float(KNOTS[k])), real(0)), width)
        total = total + inside * (heights[k] + (heights[k + 1] - heights[k]) * inside / (real(2) * width))
    total = total + max(v - real(8), real(0)) * heights[-1]
    n = real(float(table_norm(tuple(mpf(float(s)) for s in shapes[1:]))))
    return np.exp(-total) / (real(PI) * m * m * n * g.h[2] ** 4)


# Smith's shadowing without a closed form

# The program states six digits, and derivatives cost six of these.
QUADRATURE_DIGITS = 20


def by_quadrature(density, scale2, breaks=lambda shapes: []):
    """cos (1 + 2 Lambda) of a distribution of slopes, from what Lambda is defined as.

    `density(shapes)` gives D cos^4 as a function of the squared slope t^2. With mu the cotangent, and P2 the density of
    the slope along the direction of view, Lambda mu = int_mu^inf (q - mu) P2(q) dq (Smith 1967; Heitz 2014, appendix A). With
    the slopes (q, r) in polar coordinates, q = t cos f, the inner integral over |f| < arccos(mu/t) leaves
    2 int_mu^inf P(t^2) (t sin(F) - mu F) t dt, F = arccos(mu/t).
    """

    def stretched(shapes, v) -> mpf:
        if v[0] == 0 and v[1] == 0:
            return v[2]
        return _integral(density, shapes, scale2(shapes, v), v, tuple(breaks(shapes)))

    return stretched


@lru_cache(maxsize=None)
def _integral(density, shapes, slope2_of_view, v, breaks) -> mpf:
    digits = mp.dps
    mp.dps = QUADRATURE_DIGITS
    try:
        # In units of the roughness seen from v.
        slope = sqrt(slope2_of_view)
        mu, of_slope2 = v[2] / slope, density(shapes)

        def integrand(s):
            # Over the logarithm of t, in which long tails are short.
            t = exp(s)
            angle = acos(min(mu / t, mpf(1)))
            return of_slope2(t * t) * (t * mp.sin(angle) - mu * angle) * t * t

        # Beyond e^250 there is less than 1e-20 even of slopes whose mean is barely finite.
        inner = [log(mu), *(log(mu + step) for step in (mpf("0.03"), 1, 5)), *(log(b) for b in breaks if b > mu)]
        ends = sorted({*inner, *(inner[3] + step for step in (2, 8, 40, 250))})
        return v[2] + 4 * slope * quad(integrand, ends)
    finally:
        mp.dps = digits


# Spacing of the trapezoidal rules for slopes in the plane: 15 digits remain; a finer one gives more, and takes longer.
PLANE_STEP = mpf(1) / 16


@lru_cache(maxsize=None)
def plane_rules() -> tuple[list, list]:
    """Points and weights of double-exponential rules over (0, inf) and (-inf, inf) (Takahasi and Mori 1974)."""
    half_line, line = [], []
    for i in range(-56, 69):
        s = i * PLANE_STEP
        x = exp(pi / 2 * mp.sinh(s))
        half_line.append((x, PLANE_STEP * pi / 2 * mp.cosh(s) * x))
    for i in range(-52, 53):
        s = i * PLANE_STEP
        z = pi / 2 * mp.sinh(s)
        line.append((mp.sinh(z), PLANE_STEP * pi / 2 * mp.cosh(s) * mp.cosh(z)))
    return half_line, line


@lru_cache(maxsize=None)
def blinn_phong_two(shapes, v) -> mpf:
    """cos (1 + 2 Lambda) of two roughnesses, from the definition over the plane of slopes.

    Slopes are in units of mx and my; q is that along the view and r that across it, in these units. With y the cotangent in
    units of the roughness seen from v, Lambda y = int_y^inf (q - y) int P(q, r) dr dq, and P is D cos^4 itself.
    """
    if v[0] == 0 and v[1] == 0:
        return v[2]
    with mp.workdps(QUADRATURE_DIGITS):
        mx, my = shapes
        slope = sqrt(projected2(shapes, v))
        along = mx * v[0] / slope, my * v[1] / slope
        y, total = v[2] / slope, mpf(0)
        half_line, line = plane_rules()
        for beyond, weight in half_line:
            q = y + beyond
            scale = sqrt(1 + q * q)
            across = mpf(0)
            for place, weight_across in line:
                r = scale * place
                tx, ty = mx * (q * along[0] - r * along[1]), my * (q * along[1] + r * along[0])
                t2 = tx * tx + ty * ty
                # D cos^4 = cos^(n + 4)/(pi mx my), n + 4 = 2 ((tx/mx)^2 + (ty/my)^2)/t^2 + 2, and log(cos) = -log1p(t^2)/2
                across += weight_across * exp(-((q * q + r * r) / t2 + 1) * log1p(t2))
            total += weight * beyond * scale * across / pi
        return v[2] + 2 * slope * total


def with_m(shapes, v) -> mpf:
    return projected2(shapes[:1], v)


def blinn_phong_unit(shapes):
    m2 = shapes[0] ** 2
    return lambda u2: (1 + m2 * u2) ** -(1 / m2 + 1) / pi


def gaussian_unit(shapes):
    m = shapes[0]
    peak = m**2 / gaussian_norm(m)
    return lambda u2: exp(-((mp.atan(m * sqrt(u2)) / m) ** 2)) * peak / (1 + m**2 * u2) ** 2


def gtr_unit(shapes):
    m, power = shapes
    peak = m**2 / gtr_norm(m, power)
    return lambda u2: (1 + m**2 * u2) ** (power - 2) * (1 + u2) ** -power * peak


def student_unit(shapes):
    power = shapes[1]
    return lambda u2: (1 + u2 / (power - 1)) ** -power / pi


def exponential_power_unit(shapes):
    p = shapes[1]
    peak = p / (pi * gamma_of(1 / p))
    return lambda u2: exp(-(u2**p)) * peak


def sgd_unit(shapes):
    alpha, p = shapes
    peak = sgd_norm(alpha, p) * alpha / pi
    return lambda u2: exp(-(alpha + u2)) * (alpha + u2) ** -p * peak


def abc_scale2(shapes) -> mpf:
    return 1 / shapes[0]


def abc_unit(shapes):
    b, c = shapes
    peak = abc_scale2(shapes) / abc_norm(b, c)

    def density(u2):
        t2 = abc_scale2(shapes) * u2
        cos = 1 / sqrt(1 + t2)
        return (1 + b * t2 * cos**2 / (1 + cos)) ** -c * cos**4 * peak

    return density


def table_unit(shapes):
    peak = 1 / (pi * table_norm(shapes[1:]))
    return lambda u2: exp(-exponents_integral(shapes[1:], log1p(u2))) * peak


def table_breaks(shapes):
    """Where the density of slopes has kinks in its derivatives."""
    return [sqrt(exp(v) - 1) for v in KNOTS[1:]]


POWERS = numbers(
    ("1e-5", 2), ("1e-4", "0.6"), ("0.01", 3), ("0.1", "1.5"), ("0.3", 1), ("0.5", 10), ("0.8", "0.2"), (1, "2.5"), (2, "1.7")
)

DISTRIBUTIONS = [
    Distribution("ggx", ("m",), M, ggx, ggx_naive, ggx_stretched, naive_lambda=ggx_naive_lambda),
    Distribution("ggx-anisotropic", ("mx", "my"), TWO, ggx, ggx_naive, ggx_stretched, naive_lambda=ggx_naive_lambda),
    Distribution(
        "beckmann",
        ("m",),
        M,
        beckmann,
        beckmann_naive,
        beckmann_stretched,
        lambda shapes, g: slope2(shapes, g.h),
        beckmann_naive_lambda,
    ),
    Distribution(
        "beckmann-anisotropic",
        ("mx", "my"),
        TWO,
        beckmann,
        beckmann_naive,
        beckmann_stretched,
        lambda shapes, g: slope2(shapes, g.h),
        beckmann_naive_lambda,
    ),
    Distribution(
        "blinn-phong",
        ("m",),
        M,
        blinn_phong,
        blinn_phong_naive,
        by_quadrature(blinn_phong_unit, projected2),
        lambda shapes, g: fabs(blinn_phong_power(shapes, g)),
    ),
    Distribution(
        "blinn-phong-anisotropic",
        ("mx", "my"),
        TWO,
        blinn_phong,
        blinn_phong_naive,
        blinn_phong_two,
        lambda shapes, g: fabs(blinn_phong_power(shapes, g)),
    ),
    Distribution(
        "gaussian",
        ("m",),
        M,
        gaussian,
        gaussian_naive,
        by_quadrature(gaussian_unit, with_m),
        lambda shapes, g: (polar_angle(g) / shapes[0]) ** 2,
    ),
    Distribution(
        "gtr",
        ("m", "gamma"),
        POWERS,
        gtr,
        gtr_naive,
        by_quadrature(gtr_unit, with_m),
        lambda shapes, g: fabs(gtr_power(shapes, g)),
    ),
    Distribution(
        "student-t",
        ("m", "gamma"),
        numbers(("1e-5", 2), ("1e-4", "1.6"), ("0.01", 1000), ("0.1", "1.7"), ("0.3", 3), ("0.5", 50), (1, "2.5"), (2, 20)),
        student,
        student_naive,
        by_quadrature(student_unit, with_m),
        lambda shapes, g: student_power(shapes, g),
    ),
    Distribution(
        "exponential-power",
        ("m", "p"),
        numbers(("1e-5", 1), ("1e-4", "0.3"), ("0.01", "0.2"), ("0.1", 5), ("0.3", "0.6"), ("0.5", 2), (1, "0.4"), (2, "1.3")),
        exponential_power,
        exponential_power_naive,
        by_quadrature(exponential_power_unit, with_m),
        lambda shapes, g: exponential_power_ln(shapes, g),
    ),
    Distribution(
        "sgd",
        ("alpha", "p"),
        numbers(
            ("1e-6", "0.5"), ("1e-6", 4), ("1e-4", 0), ("0.003", "1.6"), ("0.05", "0.5"), ("0.5", 1), (3, -1), (10, 4)
        ),
        sgd,
        sgd_naive,
        by_quadrature(sgd_unit, lambda shapes, v: shapes[0] * projected2((mpf(1),), v)),
        sgd_ln,
    ),
    Distribution(
        "abc",
        ("b", "c"),
        numbers(("0.01", "0.05"), ("0.01", 20), (1, 1), (10, "0.5"), (1000, "1.2"), ("1e5", 2), ("1e6", 5), ("1e9", "0.05"), ("1e9", 20)),
        abc,
        abc_naive,
        by_quadrature(abc_unit, lambda shapes, v: abc_scale2(shapes) * projected2((mpf(1),), v)),
        abc_ln,
    ),
    Distribution(
        "tabulated",
        ("m", "s1", "s2", "s3", "s4", "s5", "s6", "s7"),
        numbers(
            ("1e-5", 2, 2, 2, 2, 2, 2, 2),
            ("1e-3", "1.5", "0.5", "1.2", "1.8", "2.2", "2.5", "1.6"),
            ("0.1", 3, 1, "0.5", 6, "2.5", "1.7", "1.65"),
            ("0.4", "2.5", 3, 6, 12, 20, 30, 40),
            (2, 0, 0, 1, 3, 2, "1.8", 50),
        ),
        tabulated,
        tabulated_naive,
        by_quadrature(table_unit, with_m, table_breaks),
        table_ln,
    ),
]


def tables():
    """D of every distribution."""
    for d in DISTRIBUTIONS:
        yield Table(
            name=f"distribution-{d.name}",
            arguments=PAIR,
            parameters=d.parameters,
            rows=[(pair, shapes) for shapes in d.shapes for pair in facets()],
            exact=lambda pair, shapes, d=d: d.density(shapes, geometry(pair)),
            log_factor=lambda pair, shapes, d=d: d.log_factor(shapes, geometry(pair)),
            naive=lambda real, pair, shapes, d=d: d.naive(real, shapes, textbook_geometry(pair)),
        )
