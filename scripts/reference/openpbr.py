"""OpenPBR's base. What its surface lets through is a quadrature, in double precision: the program states five digits."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from mpmath import beta, mpf, pi, sqrt

from .diffuse import eon
from .distributions import DISTRIBUTIONS, numbers
from .fresnel import dielectric_of_index, f82
from .grid import Geometry
from .shadowing import smith
from .whole import Whole

GGX = next(d for d in DISTRIBUTIONS if d.name == "ggx-anisotropic")
# Of differences of quadratures.
STEP = mpf(10) ** -4
NODES = np.polynomial.legendre.leggauss(24)


def over(start, end, count: int):
    """Nodes and weights between arrays of ends, gathered at both where roots end."""
    x, w = NODES
    edges = (1 - np.cos(np.linspace(0, np.pi, count + 1))) / 2
    x = np.concatenate([a + (b - a) * (x + 1) / 2 for a, b in zip(edges, edges[1:])])
    w = np.concatenate([(b - a) / 2 * w for a, b in zip(edges, edges[1:])])
    length = (end - start)[..., None]
    return start[..., None] + length * x, length * w


def reflectance(mu, eta: float):
    inside = np.sqrt(np.maximum(1 - (1 - mu * mu) / eta**2, 0))
    s, p = (mu - eta * inside) / (mu + eta * inside), (eta * mu - inside) / (eta * mu + inside)
    return (s * s + p * p) / 2


@lru_cache(maxsize=None)
def albedo(cos: float, m: float, eta: float) -> float:
    """E: the mean of F G2/G1 over the normals that are seen from wi, which are even on a cap of the sphere when
    the roughness is taken out (Dupuy and Benyoub 2023, Sampling Visible GGX Normals with Spherical Caps).
    """
    sin = np.sqrt(1 - cos * cos)
    length = np.hypot(m * sin, cos)
    seen = m * sin / length, cos / length

    def at(z, phi):
        """mu, co of cap points, elementwise."""
        across = np.sqrt(np.maximum(1 - z * z, 0))
        h = m * (across * np.cos(phi) + seen[0]), m * across * np.sin(phi), z + seen[1]
        # The cap's rim is the opposite of what is seen, and has no normal.
        scale = 1 / np.sqrt(np.maximum(h[0] ** 2 + h[1] ** 2 + h[2] ** 2, 1e-300))
        mu = (h[0] * sin + h[2] * cos) * scale
        return mu, 2 * mu * h[2] * scale - cos

    def integrand(z, phi):
        mu, co = at(z, phi)
        co = np.maximum(co, 0)
        of_i, of_o = length, np.sqrt(co * co + m * m * (1 - co * co))
        # G2/G1(wi) = co (ci + Ci)/(co Ci + ci Co), C = cos (1 + 2 Lambda)
        return reflectance(mu, eta) * co * (cos + of_i) / (co * of_i + cos * of_o)

    def edge(z):
        """The azimuth on a ring from which on wo is below the horizon; co falls or rises monotonously with it."""
        low, high = np.zeros_like(z), np.full_like(z, np.pi)
        above = at(z, low)[1] > 0
        for _ in range(60):
            middle = (low + high) / 2
            same = (at(z, middle)[1] > 0) == above
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        return (low + high) / 2, above

    # Rings where the horizon is met begin and end where co is 0 at an end of the ring.
    probe = -seen[1] + (1 + seen[1]) * (1 - np.cos(np.linspace(0, np.pi, 4001))) / 2
    ends = [probe[0], probe[-1]]
    for phi in (0.0, np.pi):
        signs = at(probe, phi)[1] > 0
        for k in np.nonzero(signs[1:] != signs[:-1])[0]:
            low, high = probe[k], probe[k + 1]
            for _ in range(60):
                middle = (low + high) / 2
                low, high = (middle, high) if (at(middle, phi)[1] > 0) == signs[k] else (low, middle)
            ends.append((low + high) / 2)
    ends = np.array(sorted(ends))
    z, weight = over(ends[:-1], ends[1:], 6)
    z, weight = z.ravel(), weight.ravel()
    middle, above = edge(z)
    start, end = np.where(above, 0.0, middle), np.where(above, middle, np.pi)
    phi, turn = over(start, end, 4)
    inner = (turn * integrand(z[:, None], phi)).sum(axis=1)
    # Both halves of a ring, over the area of the cap
    return float((weight * inner).sum() * 2 / (2 * np.pi * (1 + seen[1])))


@lru_cache(maxsize=None)
def lost(cos: float, m: float) -> float:
    """1 - E of facets that reflect everything: the mean of 1 - G2/G1 over the normals that are seen, and of 1 where wo is below the horizon."""
    sin = np.sqrt(1 - cos * cos)
    length = np.hypot(m * sin, cos)
    across, lowest = m * sin / length, -cos / length

    def co_of(z, phi):
        ring = np.sqrt(np.maximum(1 - z * z, 0))
        h = m * (ring * np.cos(phi) + across), m * ring * np.sin(phi), z - lowest
        square = h[0] ** 2 + h[1] ** 2 + h[2] ** 2
        return 2 * (h[0] * sin + h[2] * cos) * h[2] / square - cos

    # Facets on edge, whose mirror direction grazes, lie next to the lowest ring: its distance on a logarithmic scale. Panels end at
    # the rings whose first or last facet mirrors the light to the horizon, too.
    panels = np.linspace(np.log(1e-13), np.log(1 - lowest), 40)
    probe, roots = np.linspace(panels[0], panels[-1], 4001), []
    for phi in (0.0, np.pi):
        signs = co_of(np.exp(probe) + lowest, phi) > 0
        for k in np.nonzero(signs[1:] != signs[:-1])[0]:
            low, high = probe[k], probe[k + 1]
            for _ in range(60):
                middle = (low + high) / 2
                low, high = (middle, high) if (co_of(np.exp(middle) + lowest, phi) > 0) == signs[k] else (low, middle)
            roots.append((low + high) / 2)
    panels = np.array(sorted([*panels, *roots]))
    t, weight = over(panels[:-1], panels[1:], 1)
    t, weight = t.ravel(), weight.ravel()
    z = np.exp(t) + lowest
    low, high = np.zeros_like(z), np.full_like(z, np.pi)
    above = co_of(z, low) > 0
    for _ in range(60):
        middle = (low + high) / 2
        same = (co_of(z, middle) > 0) == above
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    edge = (low + high) / 2
    total = np.zeros_like(z)
    for start, end in ((np.zeros_like(z), edge), (edge, np.full_like(z, np.pi))):
        phi, turn = over(start, end, 8)
        co = np.maximum(co_of(z[:, None], phi), 0)
        of_o = np.sqrt(co * co + m * m * (1 - co * co))
        stopped = np.where(co > 0, cos * m * m * (1 - co * co) / ((of_o + co) * (co * length + cos * of_o)), 1)
        total += (turn * stopped).sum(axis=1)
    return float((weight * np.exp(t) * total).sum() / (np.pi * (1 - lowest)))


@lru_cache(maxsize=None)
def mean_lost(m: float) -> float:
    x, weight = over(np.array(0.0), np.array(1.0), 3)
    return sum(float(w) * 8 * float(t) ** 7 * lost(float(t) ** 4, m) for t, w in zip(x, weight))


@lru_cache(maxsize=None)
def mean_albedo(m: float, eta: float) -> float:
    # c = x^4: all that happens at grazing
    x, weight = over(np.array(0.0), np.array(1.0), 3)
    return sum(float(w) * 8 * float(t) ** 7 * albedo(float(t) ** 4, m, eta) for t, w in zip(x, weight))


def through(g: Geometry, m, eta) -> mpf:
    m, eta = float(m), float(eta)
    product = (1 - albedo(float(g.ci), m, eta)) * (1 - albedo(float(g.co), m, eta))
    return mpf(product / (1 - mean_albedo(m, eta)))


def roughnesses(roughness, anisotropy):
    mx = roughness**2 * sqrt(2 / (1 + (1 - anisotropy) ** 2))
    return mx, (1 - anisotropy) * mx


def lobe(g: Geometry, m):
    return GGX.density(m, g) * smith(GGX, (*g.wi, *g.wo), m)


def dielectric(g: Geometry, roughness, anisotropy, ior, body, color, tint):
    m = roughnesses(roughness, anisotropy)
    return lobe(g, m) * tint * dielectric_of_index(g.mu, ior) + eon(g, body, color) * through(g, sqrt(m[0] * m[1]), ior)


def metal(g: Geometry, roughness, anisotropy, color, tint):
    return lobe(g, roughnesses(roughness, anisotropy)) * f82(g.mu, color, tint)


def bouncing_metal(g: Geometry, roughness, anisotropy, color, tint):
    """With the light that its facets reflect to one another (Kulla and Conty 2017)."""
    mx, my = roughnesses(roughness, anisotropy)
    m = sqrt(mx * my)
    missing = mpf(mean_lost(float(m)))
    # F82 is Schlick less a dip, and cosine means of (1 - mu)^5 and mu (1 - mu)^6 are 2 B(2, 6) and 2 B(3, 7).
    dip = (color + (1 - color) * (mpf(6) / 7) ** 5) * (1 - tint) / (mpf(1) / 7 * (mpf(6) / 7) ** 6)
    mean = color + (1 - color) * 2 * beta(2, 6) - dip * 2 * beta(3, 7)
    later = mpf(lost(float(g.ci), float(m)) * lost(float(g.co), float(m))) / missing / pi * mean**2 * (1 - missing) / (1 - mean * missing)
    return metal(g, roughness, anisotropy, color, tint) + later


def mixed(g: Geometry, roughness, anisotropy, ior, body, color, metalness, tint):
    below = dielectric(g, roughness, anisotropy, ior, body, color, tint) if metalness != 1 else mpf(0)
    return (1 - metalness) * below + metalness * metal(g, roughness, anisotropy, color, tint)


SURFACE = ("specular_roughness", "specular_roughness_anisotropy")
BODY = ("specular_ior", "base_diffuse_roughness", "base_color")
OPENPBR = [
    Whole(
        "openpbr-dielectric",
        (*SURFACE, *BODY, "specular_color"),
        numbers(
            ("0.3", 0, "1.5", "0.5", "0.2", 1), (1, "0.5", 3, 1, 1, "0.04"), ("0.1", "0.9", "1.1", "0.3", "0.04", 0), ("0.5", 0, "1.33", 0, "0.9", 1)
        ),
        dielectric,
        step=STEP,
    ),
    Whole(
        "openpbr-mixed",
        (*SURFACE, *BODY, "base_metalness", "specular_color"),
        numbers(
            ("0.3", 0, "1.5", "0.5", "0.2", "0.1", 1), ("0.6", "0.3", 2, "0.8", "0.95", "0.5", "0.7"), ("0.2", 0, "1.3", "0.1", "0.5", "1e-9", "0.5")
        ),
        mixed,
        step=STEP,
    ),
    Whole(
        "openpbr-metal",
        (*SURFACE, "base_color", "specular_color"),
        numbers(
            ("0.003", 0, "0.9", "0.8"), ("0.01", "0.99", "0.04", 1), ("0.3", "0.5", "0.5", "0.95"), (1, 0, 1, 1), ("0.1", "0.9", "1e-9", "1"),
            ("0.5", 0, "0.95", "0.6"),
        ),
        metal,
    ),
    Whole(
        "openpbr-metal-multiple",
        (*SURFACE, "base_color", "specular_color"),
        numbers(("0.3", "0.5", "0.5", "0.95"), (1, 0, 1, 1), ("0.7", "0.9", "0.9", "0.8"), ("0.5", 0, "0.95", "0.6")),
        bouncing_metal,
        step=STEP,
    ),
]
