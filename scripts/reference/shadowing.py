"""The visibility G/(4 ci co) of every shadowing, and its naive form, a quotient."""

from __future__ import annotations

import numpy as np
from mpmath import mpf, pi, sqrt

from . import distributions
from .distributions import DISTRIBUTIONS, Distribution, naive_projected2, numbers, projected2
from .grid import PAIR, geometry, textbook_geometry, views
from .table import Table

# Of differences of quadratures, which leaves 12 of their digits.
QUADRATURE_STEP = mpf(10) ** -6
# (1 - 1.259 a + 0.396 a^2)/(3.535 a + 2.181 a^2), for a below the last.
RATIONAL, RATIONAL_END = ("1.259", "0.396", "3.535", "2.181"), "1.6"
NORMAL = (mpf(0), mpf(0), mpf(1), mpf(0), mpf(0), mpf(1))


def quotient(real, g, shadowing):
    return shadowing / (real(4) * g.wi[2] * g.wo[2])


# Of the directions alone.


def v_cavity(pair):
    g = geometry(pair)
    (ci, co), c = (g.wi[2], g.wo[2]), g.h[2]
    return min(mpf(1), 2 * c * ci / g.cos_d, 2 * c * co / g.cos_d) / (4 * ci * co)


def v_cavity_naive(real, g):
    c = g.h[2]
    return min(real(1), real(2) * c * g.wi[2] / g.cos_d, real(2) * c * g.wo[2] / g.cos_d)


OF_DIRECTIONS = {
    "v-cavity": (v_cavity, v_cavity_naive),
    "kelemen": (lambda pair: 1 / (4 * geometry(pair).cos_d ** 2), lambda real, g: g.wi[2] * g.wo[2] / g.cos_d**2),
    "neumann": (lambda pair: 1 / (4 * max(pair[2], pair[5])), lambda real, g: min(g.wi[2], g.wo[2])),
    "implicit": (lambda pair: mpf(1) / 4, lambda real, g: g.wi[2] * g.wo[2]),
    "none": (lambda pair: 1 / (4 * pair[2] * pair[5]), lambda real, g: real(1)),
}

# Of directions and roughness.


def smith(d: Distribution, pair, shapes):
    wi, wo = pair[:3], pair[3:]
    return 1 / (2 * (wo[2] * d.stretched(shapes, wi) + wi[2] * d.stretched(shapes, wo)))


def smith_naive(d: Distribution, real, g, shapes):
    return real(1) / (real(1) + d.naive_lambda(real, shapes, g.wi) + d.naive_lambda(real, shapes, g.wo))


def smith_uncorrelated(d: Distribution, pair, shapes):
    wi, wo = pair[:3], pair[3:]
    return 1 / ((wi[2] + d.stretched(shapes, wi)) * (wo[2] + d.stretched(shapes, wo)))


def smith_uncorrelated_naive(d: Distribution, real, g, shapes):
    one = real(1)
    return one / (one + d.naive_lambda(real, shapes, g.wi)) / (one + d.naive_lambda(real, shapes, g.wo))


def schlick_smith_k(d: Distribution, shapes):
    return 1 / (2 * sqrt(pi * d.density(shapes, geometry(NORMAL))))


def schlick_smith(d: Distribution, pair, shapes):
    k = schlick_smith_k(d, shapes)
    return 1 / (4 * (pair[2] * (1 - k) + k) * (pair[5] * (1 - k) + k))


def schlick_smith_naive(d: Distribution, real, g, shapes):
    k = real(float(schlick_smith_k(d, tuple(mpf(float(s)) for s in shapes))))
    one = real(1)
    return g.wi[2] / (g.wi[2] * (one - k) + k) * g.wo[2] / (g.wo[2] * (one - k) + k)


def rational_lambda(real, a):
    """Of a = 1/(m tan), as printed, but that it is not let below 0 short of a = 1.6."""
    if a >= real(RATIONAL_END):
        return real(0)
    numerator = real(1) - real(RATIONAL[0]) * a + real(RATIONAL[1]) * a * a
    return max(real(0), numerator) / (real(RATIONAL[2]) * a + real(RATIONAL[3]) * a * a)


def beckmann_m(d: Distribution, shapes):
    """One roughness or two, of the Beckmann surface that the distribution is taken for."""
    if d.name == "sgd":
        return (shapes[0] ** 0.5,)
    if d.name == "abc":
        return ((2 / (shapes[0] * shapes[1])) ** 0.5,)
    return shapes if d.parameters == ("mx", "my") else shapes[:1]


def smith_rational(d: Distribution, pair, shapes):
    m = beckmann_m(d, shapes)

    def of(v):
        slope = sqrt(projected2(m, v))
        return v[2] * rational_lambda(mpf, v[2] / slope) if slope else mpf(0)

    ci, co = pair[2], pair[5]
    return 1 / (4 * (ci * co + co * of(pair[:3]) + ci * of(pair[3:])))


def smith_rational_naive(d: Distribution, real, g, shapes):
    m = beckmann_m(d, tuple(shapes))

    def of(v):
        return rational_lambda(real, real(1) / np.sqrt(naive_projected2(m, v)))

    return real(1) / (real(1) + of(g.wi) + of(g.wo))


OF_ROUGHNESS = {
    "smith": (smith, smith_naive),
    "smith-uncorrelated": (smith_uncorrelated, smith_uncorrelated_naive),
    "smith-rational": (smith_rational, smith_rational_naive),
    "schlick-smith": (schlick_smith, schlick_smith_naive),
}

# Where shadowing is by quadrature: fewer rows.
SPARSE = {
    "blinn-phong": numbers(("1e-4",), ("0.1",), ("0.7",)),
    "blinn-phong-anisotropic": numbers(("0.001", "0.1"), ("0.3", "0.6"), (1, "0.1"), ("1e-4", 1)),
    "gaussian": numbers(("1e-4",), ("0.1",), ("0.7",)),
    "gtr": numbers(("1e-4", "0.6"), ("0.1", "1.5"), ("0.3", 1), ("0.5", 10)),
    "student-t": numbers(("1e-4", "1.6"), ("0.1", "1.7"), ("0.3", 3), ("0.5", 1000)),
    "exponential-power": numbers(("1e-4", "0.3"), ("0.3", "0.6"), ("0.5", 2)),
    "sgd": numbers(("1e-6", 1), ("0.05", "0.5"), ("0.5", 1), (10, -1)),
    "abc": numbers((10, "0.5"), (1000, "1.2"), ("1e6", 2), ("1e9", 5)),
    "tabulated": numbers((("1e-4"), 2, 2, 2, 2, 2, 2, 2), ("0.1", 3, 1, "0.5", 6, "2.5", "1.7", "1.65")),
}
# Every other pair, grazing among them.
SPARSE_VIEWS = (1, 3, 5, 7, 9, 10, 13)


def tables():
    for name, (exact, naive) in OF_DIRECTIONS.items():
        yield Table(
            name=f"shadowing-{name}",
            arguments=PAIR,
            parameters=(),
            rows=[(pair, ()) for pair in views()],
            exact=lambda pair, _, exact=exact: exact(pair),
            naive=lambda real, pair, _, naive=naive: quotient(
                real, textbook_geometry(pair), naive(real, textbook_geometry(pair))
            ),
        )
    for name, (exact, naive) in OF_ROUGHNESS.items():
        for d in DISTRIBUTIONS:
            by_quadrature = d.tabulated and name not in ("schlick-smith", "smith-rational")
            sets = SPARSE[d.name] if d.tabulated else d.shapes
            pairs = [views()[k] for k in SPARSE_VIEWS] if d.tabulated else views()
            yield Table(
                name=f"shadowing-{name}-{d.name}",
                arguments=PAIR,
                parameters=d.parameters,
                rows=[(pair, shapes) for shapes in sets for pair in pairs],
                exact=lambda pair, shapes, exact=exact, d=d: exact(d, pair, shapes),
                naive=None
                if by_quadrature
                else lambda real, pair, shapes, naive=naive, d=d: quotient(
                    real, textbook_geometry(pair), naive(d, real, textbook_geometry(pair), shapes)
                ),
                step=QUADRATURE_STEP if by_quadrature else None,
            )
