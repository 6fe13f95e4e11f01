"""The Fresnel reflectances and their naive forms. The argument is mu = wi.h as the type holds it."""

from __future__ import annotations

import numpy as np
from mpmath import fabs, log, mpc, mpf, sqrt

from .distributions import numbers
from .grid import cosines
from .table import Table


def log_of_rest(mu, exponent):
    """|ln| of (1 - mu)^exponent."""
    return fabs(exponent * log(1 - mu)) if mu < 1 else mpf(0)


def schlick(mu, f0):
    return f0 + (1 - f0) * (1 - mu) ** 5


def schlick_naive(real, mu, f0):
    return f0 + (real(1) - f0) * (real(1) - mu) ** real(5)


def dielectric_of_index(mu, eta):
    """Half the squared Fresnel coefficients for both polarisations."""
    g = sqrt(eta**2 + mu**2 - 1)
    s = (mu - g) / (mu + g)
    p = (eta**2 * mu - g) / (eta**2 * mu + g)
    return (s**2 + p**2) / 2


def dielectric(mu, f0):
    if f0 == 0:
        return mpf(0)
    if f0 == 1:
        return mpf(1)
    return dielectric_of_index(mu, (1 + sqrt(f0)) / (1 - sqrt(f0)))


def dielectric_naive(real, mu, f0):
    """Cook and Torrance 1982, eq. 12."""
    one = real(1)
    eta = (one + np.sqrt(f0)) / (one - np.sqrt(f0))
    g = np.sqrt(eta * eta + mu * mu - one)
    bracket = one + ((mu * (g + mu) - one) / (mu * (g - mu) + one)) ** 2
    return ((g - mu) / (g + mu)) ** 2 / real(2) * bracket


def dielectric_slopes(mu, parameters):
    """At the ends of f0, where F grows with its root, and where the index is infinite.

    With r = sqrt f0, eta = 1 + 2 r + ... and F = f0 (1 + (2 mu^2 - 1)^2)/(2 mu^4) + ...; with 1/eta = (1 - f0)/4 + ...,
    F = 1 - 2 (mu + 1/mu)/eta + ...
    """
    ((mu,), (f0,)) = (mu, parameters)
    if f0 == 0:
        return [(1 + (2 * mu**2 - 1) ** 2) / (2 * mu**4)]
    if f0 == 1:
        return [(mu + 1 / mu) / 2]
    return None


def conductor(mu, eta, k):
    index = mpc(eta, k)
    g = sqrt(index**2 + mu**2 - 1)
    s = (mu - g) / (mu + g)
    p = (index**2 * mu - g) / (index**2 * mu + g)
    return (abs(s) ** 2 + abs(p) ** 2) / 2


def conductor_naive(real, mu, eta, k):
    """By a and b (Akenine-Moller, Haines and Hoffman 2008; Ozan 1972), with tan and sin of the angle."""
    one, two = real(1), real(2)
    s2 = one - mu * mu
    t = eta * eta - k * k - s2
    modulus = np.sqrt(t * t + real(4) * eta * eta * k * k)
    a = np.sqrt((modulus + t) / two)
    rs = (modulus - two * a * mu + mu * mu) / (modulus + two * a * mu + mu * mu)
    tan2 = s2 / (mu * mu)
    st = s2 / mu
    rp = rs * (modulus - two * a * st + s2 * tan2) / (modulus + two * a * st + s2 * tan2)
    return (rs + rp) / two


def generalised(mu, f0, f90, p):
    return f0 + (f90 - f0) * (1 - mu) ** p


def f82(mu, f0, tint):
    m = mpf(1) / 7
    b = schlick(m, f0) * (1 - tint) / (m * (1 - m) ** 6)
    return schlick(mu, f0) - b * mu * (1 - mu) ** 6


def f82_naive(real, mu, f0, tint):
    m, one = real(1) / real(7), real(1)
    b = schlick_naive(real, m, f0) * (one - tint) / (m * (one - m) ** real(6))
    return schlick_naive(real, mu, f0) - b * mu * (one - mu) ** real(6)


def lazanyi(mu, f0, a, p):
    return schlick(mu, f0) - a * mu * (1 - mu) ** p


F0 = ["0", "1e-9", "0.04", "0.5", "0.95", "1"]


def tables():
    def table(name, parameters, sets, exact, naive, exponent=lambda *parameters: 0, **more):
        return Table(
            name=f"fresnel-{name}",
            arguments=("mu",),
            parameters=parameters,
            rows=[(mu, p) for p in sets for mu in cosines()],
            exact=lambda mu, p: exact(*mu, *p),
            naive=lambda real, mu, p: naive(real, *mu, *p),
            log_factor=lambda mu, p: log_of_rest(*mu, exponent(*p)),
            **more,
        )

    yield table("schlick", ("f0",), numbers(*[(f,) for f in F0]), schlick, schlick_naive, lambda f0: 5)
    # f0 of refractive indices from 1 + 1e-9 to 100, and beyond at both ends.
    indices = ["1.000000001", "1.0001", "1.01", "1.33", "1.5", "2.4", "10", "100"]
    of_indices = [(((mpf(n) - 1) / (mpf(n) + 1)) ** 2,) for n in indices]
    ends = numbers(("0",), ("1e-9",), ("0.04",), ("0.999999",), ("1",))
    yield table("dielectric", ("f0",), ends + of_indices, dielectric, dielectric_naive, differentiate=dielectric_slopes)
    metals = [
        ("0.2", 3), ("1.18", "7.05"), ("3.17", "3.33"), ("0.01", "0.001"), ("0.01", 200), (100, "0.001"), (100, 200),
        ("1.000000001", "0.001"), ("1.5", "0.001"), ("30", 90), ("0.05", "4.2"), ("0.5", "0.01"),
    ]
    yield table("conductor", ("eta", "k"), numbers(*metals), conductor, conductor_naive)
    general = numbers(*[(f0, f90, p) for f0 in F0[:4] for f90, p in ((1, 5), ("0.7", "0.5"), (0, 20), ("0.3", "2.5"))])
    yield table(
        "generalised-schlick",
        ("f0", "f90", "p_f"),
        general,
        generalised,
        lambda real, mu, f0, f90, p: f0 + (f90 - f0) * (real(1) - mu) ** p,
        lambda f0, f90, p: p,
    )
    tints = numbers(*[(f0, tint) for f0 in F0 for tint in ("0", "0.5", "0.95", "1")])
    yield table("f82-tint", ("f0", "tint"), tints, f82, f82_naive, lambda f0, tint: 6)
    dips = numbers(*[(f0, a, p) for f0 in ("0.04", "0.5", "0.95") for a, p in ((0, 6), ("0.1", "0.5"), (2, 6), (20, 20))])
    yield table(
        "lazanyi",
        ("f0", "a", "alpha_f"),
        dips,
        lazanyi,
        lambda real, mu, f0, a, p: schlick_naive(real, mu, f0) - a * mu * (real(1) - mu) ** p,
        lambda f0, a, p: max(p, 5),
    )
    yield table("none", (), [()], lambda mu: mpf(1), lambda real, mu: real(1))
