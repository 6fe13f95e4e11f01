"""Whole models of facets, layered models, and those of published tables."""

from __future__ import annotations

from functools import partial

from mpmath import exp, fabs, log, log1p, mpf, pi, sqrt

from . import diffuse, lobes
from .diffuse import polar
from .distributions import DISTRIBUTIONS, numbers, slope2
from .fresnel import conductor, dielectric_of_index, f82, generalised, lazanyi, schlick
from .grid import Geometry, geometry
from .lobes import norm, power_of, ward, ward_duer
from .openpbr import OPENPBR
from .shadowing import smith, smith_uncorrelated, v_cavity
from .targets import TARGETS
from .whole import Whole

D = {d.name: d for d in DISTRIBUTIONS}


def pair(g: Geometry):
    return (*g.wi, *g.wo)


def dielectric_of_inverse(mu, inverse):
    """By the amplitudes of both polarisations and 1/eta, in which F is smooth where the index is infinite."""
    inside = sqrt(1 - inverse**2 * (1 - mu**2))
    s = (inverse * mu - inside) / (inverse * mu + inside)
    p = (mu - inverse * inside) / (mu + inverse * inside)
    return (s**2 + p**2) / 2


def dielectric(mu, f0):
    if f0 == 0:
        return mpf(0)
    return dielectric_of_inverse(mu, (1 - sqrt(f0)) / (1 + sqrt(f0)))


# Microfacet lobes. A visibility is G/(4 ci co).

VISIBILITY = {
    "smith": lambda d, g, shapes: smith(d, pair(g), shapes),
    "smith-uncorrelated": lambda d, g, shapes: smith_uncorrelated(d, pair(g), shapes),
    "v-cavity": lambda d, g, shapes: v_cavity(pair(g)),
    "kelemen": lambda d, g, shapes: 1 / (4 * g.mu**2),
    "neumann": lambda d, g, shapes: 1 / (4 * max(g.ci, g.co)),
    "implicit": lambda d, g, shapes: mpf(1) / 4,
    "none": lambda d, g, shapes: 1 / (4 * g.ci * g.co),
    "distribution-based": lambda d, g, shapes: g.h[2] / (4 * (g.ci + g.co - g.ci * g.co)),
}
FRESNEL = {
    "schlick": (("f0",), schlick),
    "dielectric": (("f0",), dielectric),
    "conductor": (("eta", "k"), conductor),
    "generalised-schlick": (("f0", "f90", "p_f"), generalised),
    "f82-tint": (("f0", "tint"), f82),
    "lazanyi": (("f0", "a", "alpha_f"), lazanyi),
    "none": ((), lambda mu: mpf(1)),
}
M = numbers(("1e-5",), ("1e-4",), ("1e-3",), ("0.02",), ("0.1",), ("0.5",), (1,), (2,))
TWO = numbers(("1e-5", "1e-4"), ("1e-3", "2e-3"), ("0.05", "0.01"), ("0.3", "0.6"), ("1e-4", 1), (1, "0.5"), (2, "1.5"))
# To go with them, in turn.
F0 = numbers(("0", 1), ("1e-9", 1), ("0.04", 1), (1, 1), ("0.5", 1000), ("1e-9", "1e-9"), ("0.04", "0.04"), ("0", 0))


def cook_torrance(name: str, d: str, g: str, f: str, shapes: list, rest: list) -> Whole:
    distribution, visibility, (names, fresnel) = D[d], VISIBILITY[g], FRESNEL[f]
    count = len(distribution.parameters)
    powers = {"schlick": 5, "f82-tint": 6, "lazanyi": 5}

    def value(g, *p):
        (*of_fresnel, ks), p = p[count:], p[:count]
        return ks * distribution.density(p, g) * visibility(distribution, g, p) * fresnel(g.mu, *of_fresnel)

    def log_factor(g, *p):
        power = p[count + 2] if f in ("generalised-schlick", "lazanyi") else powers.get(f, 0)
        of_rest = fabs(power * log(g.rest)) if power and g.rest else mpf(0)
        # Of f0 = 0 the power is all that is left.
        return distribution.log_factor(p[:count], g) + (of_rest if p[count] == 0 else 0)

    sets = [(*a, *rest[k % len(rest)]) for k, a in enumerate(shapes)]
    return Whole(name, (*distribution.parameters, *names, "ks"), sets, value, log_factor)


def cook_torrances():
    def all_of(*rows):
        return numbers(*rows)

    metals = all_of(
        ("0.2", 3, 1), ("1.18", "7.05", 1), ("0.01", "0.001", "0.04"), (100, 200, 1), ("1.000000001", "0.001", 1), ("0.05", "4.2", 0),
        ("1.5", "1e-3", 1000),
    )
    general = all_of(("0", 1, 5, 1), ("1e-9", "0.7", "0.5", 1), ("0.04", 0, 20, 1), (1, "0.3", "2.5", "0.5"))
    tints = all_of(("0.9", "0.8", 1), ("0.04", "0.5", 1), ("1e-9", 1, 1), (1, "0.95", "0.04"), ("0.5", 1, 1000))
    dips = all_of(("0.04", 0, 6, 1), ("0.5", "0.1", "0.5", 1), ("0.95", "0.2", 6, "0.04"), (1, "0.1", 20, 1))
    pairs = [
        ("beckmann", "v-cavity", "schlick", M, F0),
        ("ggx", "smith", "schlick", M, F0),
        ("ggx", "smith", "dielectric", M, F0),
        ("beckmann", "smith", "conductor", M, metals),
        ("ggx-anisotropic", "smith", "schlick", TWO, F0),
        ("blinn-phong", "kelemen", "f82-tint", numbers(("1e-4",), ("1e-3",), ("0.05",), ("0.3",), (1,)), tints),
        ("gtr", "implicit", "generalised-schlick", D["gtr"].shapes, general),
        ("student-t", "neumann", "lazanyi", D["student-t"].shapes, dips),
        ("exponential-power", "none", "none", D["exponential-power"].shapes, numbers((1,), (0,), ("1e-9",), (1000,))),
    ]
    for d, g, f, shapes, rest in pairs:
        yield cook_torrance(f"cook-torrance-{d}-{g}-{f}", d, g, f, shapes, rest)
    yield cook_torrance("ashikhmin-premoze-shirley", "ggx", "smith-uncorrelated", "schlick", M, F0)
    yield cook_torrance("distribution-based", "ggx", "distribution-based", "schlick", M, F0)


def cook_torrance_1982(g: Geometry, kd, s, m, f0):
    # D' has no pi.
    return kd / pi + s * dielectric(g.mu, f0) * pi * beckmann(m, g) * 4 * v_cavity(pair(g)) / pi


def beckmann(m, g: Geometry):
    return D["beckmann"].density((m,), g)


def beckmann_exponent(g: Geometry, kd, ks, *p):
    return slope2(p[:1], g.h)


def low_cook_torrance(g: Geometry, kd, ks, m, eta):
    return kd / pi + ks * dielectric_of_index(g.mu, eta) * pi * beckmann(m, g) * 4 * v_cavity(pair(g)) / pi


def ngan_cook_torrance(g: Geometry, kd, ks, f0, m):
    return kd / pi + ks * schlick(g.mu, f0) * beckmann(m, g) * 4 * v_cavity(pair(g)) / pi


# A lobe back to the light


def mirrored(g: Geometry) -> Geometry:
    return geometry((-g.wi[0], -g.wi[1], g.wi[2], *g.wo))


def retro(d: str, visibility: str, shapes: list) -> Whole:
    distribution, of = D[d], VISIBILITY[visibility]

    def value(g, *p):
        back = mirrored(g)
        return p[-1] * distribution.density(p[:-1], back) * of(distribution, back, p[:-1])

    scales = numbers((1,), ("1e-9",), ("0.04",), (0,), ("0.2",), (1000,))
    sets = [(*a, *scales[k % len(scales)]) for k, a in enumerate(shapes)]
    name, parameters = f"retro-{d}-{visibility}", (*distribution.parameters, "ks")
    return Whole(name, parameters, sets, value, lambda g, *p: distribution.log_factor(p[:-1], mirrored(g)))


# Ashikhmin and Shirley


def exponent_along(g: Geometry, nu, nv):
    """Exponent of n.h."""
    return (nu * g.h[0] ** 2 + nv * g.h[1] ** 2) / g.sin2_h if g.sin2_h else mpf(0)


def phong_facets(g: Geometry, nu, nv):
    lobe = sqrt((nu + 1) * (nv + 1)) / (8 * pi) * g.h[2] ** exponent_along(g, nu, nv)
    return lobe / (g.mu * max(g.ci, g.co))


def facets_power(g: Geometry, nu, nv):
    return power_of(g.h[2], exponent_along(g, nu, nv))


def ashikhmin_shirley(g: Geometry, rd, rs, nu, nv):
    below = 28 * rd / (23 * pi) * (1 - rs) * (1 - (1 - g.ci / 2) ** 5) * (1 - (1 - g.co / 2) ** 5)
    return phong_facets(g, nu, nv) * schlick(g.mu, rs) + below


def ngan_ashikhmin_shirley(g: Geometry, kd, ks, f0, n):
    return kd / pi + ks * phong_facets(g, n, n) * schlick(g.mu, f0)


def low_ashikhmin_shirley(g: Geometry, kd, ks, n, eta):
    return kd / pi + ks * phong_facets(g, n, n) * dielectric_of_index(g.mu, eta)


# ABC


def low_microfacet(g: Geometry, kd, a, b, c, eta):
    s = (1 + b * (1 - g.h[2])) ** -c
    return kd / pi + a * dielectric_of_index(g.mu, eta) * s * 4 * v_cavity(pair(g)) / pi


def deviation2(g: Geometry):
    return (g.wi[0] + g.wo[0]) ** 2 + (g.wi[1] + g.wo[1]) ** 2


def low_smooth(g: Geometry, kd, a, b, c, eta):
    # 1 - |xy(wi) - xy(wo)|^2/4 for directions of length 1, whatever rounding made of it
    mu = sqrt((g.ci**2 + g.co**2) / 2 + deviation2(g) / 4)
    return kd / pi + a * dielectric_of_index(mu, eta) / (1 + b * deviation2(g)) ** c


# Bagher


def bagher_fall(v, lambda_, c, k, theta0):
    beyond = polar(v) - theta0
    return max(mpf(0), 1 + lambda_ * (1 - exp(c * beyond**k))) if beyond > 0 else mpf(1)


def bagher(g: Geometry, kd, ks, f0, f1, alpha, p, *fall):
    fresnel = schlick(g.mu, f0) - f1 * g.mu
    d = D["sgd"].density((alpha, p), g)
    return kd / pi + ks * fresnel * d * bagher_fall(g.wi, *fall) * bagher_fall(g.wo, *fall) / (pi * g.ci * g.co)


def bagher_powers(g: Geometry, kd, ks, f0, f1, alpha, p, lambda_, c, k, theta0):
    def of(v):
        beyond = polar(v) - theta0
        return fabs(k * log(beyond)) + c * beyond**k if beyond > 0 and bagher_fall(v, lambda_, c, k, theta0) > 0 else mpf(0)

    return D["sgd"].log_factor((alpha, p), g) + of(g.wi) + of(g.wo)


# Disney


def revised(g: Geometry, roughness, m):
    """The highlight's shadowing is that of its own facets."""
    return smith_uncorrelated(D["ggx-anisotropic"], pair(g), m)


def original(g: Geometry, roughness, m):
    return smith_uncorrelated(D["ggx"], pair(g), ((roughness / 2 + mpf(1) / 2) ** 2,))


def disney(shadowing, g: Geometry, roughness, anisotropic, gloss, base, metallic, specular, subsurface, sheen, clearcoat):
    s, rise = g.rest**5, roughness * g.mu**2
    towards = (1 - g.ci) ** 5, (1 - g.co) ** 5
    fd = (1 + (2 * rise - mpf(1) / 2) * towards[0]) * (1 + (2 * rise - mpf(1) / 2) * towards[1])
    fss = (1 + (rise - 1) * towards[0]) * (1 + (rise - 1) * towards[1])
    flat = mpf("1.25") * (fss * (1 / (g.ci + g.co) - mpf(1) / 2) + mpf(1) / 2)
    body = base / pi * ((1 - subsurface) * fd + subsurface * flat) + sheen * s
    f0 = mpf("0.08") * specular * (1 - metallic) + base * metallic
    aspect = sqrt(1 - mpf("0.9") * anisotropic)
    m = roughness**2 / aspect, roughness**2 * aspect
    ggx = D["ggx"]
    highlight = D["ggx-anisotropic"].density(m, g) * shadowing(g, roughness, m)
    coat = D["gtr"].density((mpf("0.1") - mpf("0.099") * gloss, mpf(1)), g) * smith_uncorrelated(ggx, pair(g), (mpf("0.25"),))
    coated = clearcoat / 4 * coat * (mpf("0.04") * (1 - s) + s)
    return (1 - metallic) * body + highlight * (f0 * (1 - s) + s) + coated


BASE = ("kd", "ks")
MODELS = [
    *cook_torrances(),
    Whole(
        "cook-torrance-1982",
        ("kd", "s", "m", "f0"),
        numbers(
            (0, 1, "1e-5", "0.04"), (1, "1e-9", "0.02", 0), (0, "0.04", "1e-3", "1e-9"), ("0.5", "0.3", "0.2", "0.05"), (2, 0, "0.1", "0.5"),
            (0, "0.5", 1, 1), ("1e-9", 1, "0.5", 0), ("0.04", 1, 2, "0.95"),
        ),
        cook_torrance_1982,
        beckmann_exponent,
    ),
    Whole(
        "low-cook-torrance",
        (*BASE, "m", "eta"),
        numbers(
            (0, 1, "1e-5", "1.5"), (1, "1e-9", "1e-3", "1.000000001"), (0, "0.04", "0.02", 100), ("0.5", "0.3", "0.2", 2), (2, 0, "0.1", "1.3"),
            (0, 1000, 1, "1.01"),
        ),
        low_cook_torrance,
        beckmann_exponent,
    ),
    Whole(
        "ngan-cook-torrance",
        (*BASE, "f0", "m"),
        numbers(
            (0, 1, "0.04", "1e-5"), (1, "1e-9", 0, "1e-3"), (0, "0.04", "1e-9", "0.02"), ("0.5", "0.3", "0.05", "0.2"), (2, 0, 1, "0.1"),
            (0, 1000, 1, 1),
        ),
        ngan_cook_torrance,
        lambda g, kd, ks, f0, m: slope2((m,), g.h),
    ),
    retro("ggx", "neumann", M),
    retro("beckmann", "smith", M),
    Whole(
        "ashikhmin-shirley",
        ("rd", "rs", "nu", "nv"),
        numbers(
            (0, 0, 10, 10), (1, "1e-9", "1e6", "1e6"), ("1e-9", "0.04", "0.01", "0.01"), ("0.04", 1, 1000, 10), ("0.3", "0.5", "0.01", "1e6"),
            (1, 0, 100, 300), (0, "0.04", "1e5", 1),
        ),
        ashikhmin_shirley,
        lambda g, rd, rs, nu, nv: facets_power(g, nu, nv),
    ),
    Whole(
        "ngan-ashikhmin-shirley",
        (*BASE, "f0", "n"),
        numbers((0, 1, "0.04", "1e6"), (1, "1e-9", 0, 1000), (0, "0.04", "1e-9", "0.01"), ("0.5", "0.3", 1, 30), (2, 0, "0.5", 100)),
        ngan_ashikhmin_shirley,
        lambda g, kd, ks, f0, n: facets_power(g, n, n),
    ),
    Whole(
        "low-ashikhmin-shirley",
        (*BASE, "n", "eta"),
        numbers((0, 1, "1e6", "1.5"), (1, "1e-9", 1000, "1.000000001"), (0, "0.04", "0.001", 100), ("0.5", "0.3", 30, 2), (2, 0, 100, "1.3")),
        low_ashikhmin_shirley,
        lambda g, kd, ks, n, eta: facets_power(g, n, n),
    ),
    Whole(
        "low-microfacet",
        ("kd", "a", "b", "c", "eta"),
        numbers(
            (0, 1, "0.01", "0.01", "1.5"), (0, "1e-9", "1e9", 20, "1.000000001"), (1, "0.04", 1000, "1.2", 100), ("1e-9", "1e5", "1e6", "0.5", 2),
            ("0.04", 0, 10, 2, "1.3"), ("0.5", 3, 300, 5, "1.01"),
        ),
        low_microfacet,
        lambda g, kd, a, b, c, eta: c * log1p(b * (1 - g.h[2])),
    ),
    Whole(
        "low-smooth",
        ("kd", "a", "b", "c", "eta"),
        numbers(
            (0, 1, "0.01", "0.01", "1.5"), (0, "1e-9", "1e9", 20, "1.000000001"), (1, "0.04", 1000, "1.2", 100), ("1e-9", "1e5", "1e6", "0.5", 2),
            ("0.04", 0, 10, 2, "1.3"), ("0.5", 3, 300, 5, "1.01"),
        ),
        low_smooth,
        lambda g, kd, a, b, c, eta: c * log1p(b * deviation2(g)),
    ),
    Whole(
        "bagher-sgd",
        (*BASE, "f0", "f1", "alpha", "p", "lambda", "c", "k", "theta0"),
        numbers(
            (0, 1, "0.04", 0, "0.05", "0.5", 3, "0.1", 15, "0.1"), ("0.3", "0.2", "0.5", "-0.3", "1e-4", "1.6", "0.5", "0.5", 5, "-0.2"),
            (0, "1e-9", "8.5", "1e-9", "1e-6", 4, 100, "1e-5", 50, "0.4"), (1, "0.04", 0, "-0.5", "0.5", -1, "1e-9", "1e-9", "0.5", -1),
            ("0.04", 0, "1", "0.1", 10, 1, "1e9", "1e-9", 1000, "0.3"), ("1e-9", 1000, "0.2", "0.05", "0.003", "0.2", 10, "0.01", 10, 0),
        ),
        bagher,
        bagher_powers,
    ),
    Whole(
        "ngan-blinn-phong",
        (*BASE, "n"),
        numbers((0, 1, "1e6"), (1, "1e-9", 1000), (0, "0.04", "0.01"), ("0.5", "0.3", 30), (2, 0, 100)),
        lambda g, kd, ks, n: kd / pi + lobes.blinn_phong(g, ks, n),
        lambda g, kd, ks, n: power_of(g.h[2], n),
    ),
    Whole(
        "ngan-lafortune",
        (*BASE, "cxy", "cz", "n"),
        numbers((0, 1, -1, "0.8", 30), (1, "1e-9", "-0.577", "0.575", 1000), (0, "0.04", -1, "0.99", "1e6"), ("0.5", "0.3", 1, 10, 1), (2, 0, -1, -1, 10)),
        lambda g, kd, *p, place=None: kd / pi + lobes.lafortune(g, *p, place=place),
        lambda g, kd, *p: lobes.lafortune_power(g, *p),
        lambda g, kd, *p: [1 / pi, *lobes.lafortune_slopes(lobes.lafortune, g, *p)],
    ),
    *[
        Whole(
            f"ngan-{name}",
            (*BASE, "m"),
            numbers((0, 1, "1e-5"), (1, "1e-9", "1e-3"), (0, "0.04", "0.02"), ("0.5", "0.3", "0.2"), (2, 0, 1), (0, 1000, 2)),
            lambda g, kd, ks, m, of=of: kd / pi + of(g, ks, m),
            lambda g, kd, ks, m: slope2((m,), g.h),
        )
        for name, of in (("ward", ward), ("ward-duer", ward_duer))
    ],
    *[
        Whole(
            f"disney-2012-{name}",
            ("roughness", "anisotropic", "clearcoat_gloss", "base", "metallic", "specular", "subsurface", "sheen", "clearcoat"),
            numbers(
                ("0.4", 0, 1, "0.2", 0, "0.5", 0, 0, 0), ("0.032", "0.9", "0.5", "1e-9", "0.04", 0, "0.3", "0.5", 1), (1, 1, 0, 1, "0.5", 1, 1, 1, 1),
                ("0.1", "0.3", "0.9", "0.04", 1, "0.5", "0.04", "1e-9", "0.04"), ("0.01", 0, 1, 0, "1e-9", "1e-9", 1, "0.1", "1e-9"),
            ),
            partial(disney, shadowing),
        )
        for name, shadowing in (("revised", revised), ("original", original))
    ],
    *OPENPBR,
    *TARGETS,
]


def tables():
    for model in (*diffuse.MODELS, *lobes.MODELS, *MODELS):
        yield model.table()
