"""Renderers' own surface lobes, transcribed from the specification or source that each names."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from mpmath import exp, fabs, log, mpf, pi, sqrt

from .diffuse import disney_diffuse, eon, fujii, qualitative
from .distributions import DISTRIBUTIONS, numbers
from .fresnel import conductor, dielectric_of_index, f82, schlick
from .grid import Geometry
from .openpbr import STEP, over, reflectance
from .shadowing import smith, smith_uncorrelated
from .whole import Whole

D = {d.name: d for d in DISTRIBUTIONS}
GGX = D["ggx-anisotropic"]


def index_to_f0(ior):
    return ((ior - 1) / (ior + 1)) ** 2


def lobe(g: Geometry, mx, my, visibility=smith) -> mpf:
    """D G/(4 ci co) of GGX."""
    return GGX.density((mx, my), g) * visibility(GGX, (*g.wi, *g.wo), (mx, my))


def mix(a, b, t):
    return (1 - t) * a + t * b


# glTF 2.0, specification Appendix B with the correlated G of its pull request 2541; KHR_materials_ior, _specular,
# _anisotropy and _clearcoat, "Implementation" of each. wo is the direction of the viewer.


def gltf(g: Geometry, roughness, strength, base_color, metallic, ior, specular, specular_color):
    s = g.rest**5
    alpha = roughness**2
    surface = lobe(g, mix(alpha, 1, strength**2), alpha)
    f0 = min(index_to_f0(ior) * specular_color, 1) * specular
    fresnel = mix(f0, specular, s)
    dielectric = fresnel * surface + (1 - fresnel) * base_color / pi
    return mix(dielectric, mix(base_color, 1, s) * surface, metallic)


def gltf_coated(g: Geometry, roughness, strength, coat_roughness, base_color, metallic, ior, specular, specular_color, coat):
    below = gltf(g, roughness, strength, base_color, metallic, ior, specular, specular_color)
    return mix(below, lobe(g, coat_roughness**2, coat_roughness**2), coat * schlick(g.co, mpf("0.04")))


# KHR_materials_sheen, "Implementation Notes", with the visibility "Charlie". The cosines in it are at least 2^-12, which the program
# departs by. What the sheen sends back, E, is a quadrature in double precision: the program states four digits.

LEAST_COSINE = mpf(2) ** -12


def charlie_exponent(x, a):
    """l(x)"""
    t = (1 - a) ** 2
    rows = (("21.5473", "25.3245"), ("3.82987", "3.32435"), ("0.19823", "0.16801"), ("-1.97760", "-1.27393"), ("-4.32054", "-4.85967"))
    number = mpf if isinstance(a, mpf) else float
    k = [mix(number(rough), number(smooth), t) for rough, smooth in rows]
    return k[0] / (1 + k[1] * x ** k[2]) + k[3] * x + k[4]


def charlie_lambda(c, a):
    half = mpf(1) / 2
    return exp(charlie_exponent(c, a)) if c < half else exp(2 * charlie_exponent(half, a) - charlie_exponent(1 - c, a))


def charlie(g: Geometry, a):
    ci, co = (max(c, LEAST_COSINE) for c in (g.ci, g.co))
    power = 1 / (2 * a)
    density = (2 + 1 / a) * g.sin2_h**power / (2 * pi)
    return density / ((1 + charlie_lambda(ci, a) + charlie_lambda(co, a)) * 4 * ci * co)


@lru_cache(maxsize=None)
def charlie_albedo(cos: float, a: float) -> float:
    """E: over all outgoing directions, in panels that get shorter towards the horizon and towards the direction opposite to the light."""
    least = float(LEAST_COSINE)
    cos = max(cos, least)

    def of_cosine(c):
        below, above = np.minimum(c, 0.5), np.maximum(c, 0.5)
        upper = np.exp(2 * charlie_exponent(0.5, a) - charlie_exponent(1 - above, a))
        return np.where(c < 0.5, np.exp(charlie_exponent(below, a)), upper)

    edges = np.array([0, *2.0 ** np.arange(-12, 0), 0.7, 0.9, 0.98, 1])
    co, width = (x.reshape(-1, 1) for x in over(edges[:-1], edges[1:], 1))
    edges = np.pi * np.array([*(1 - 0.5 ** np.arange(14)), 1])
    phi, turn = (x.reshape(1, -1) for x in over(edges[:-1], edges[1:], 1))
    sin, so = np.sqrt(1 - cos * cos), np.sqrt(1 - co * co)
    x, y, z = sin + so * np.cos(phi), so * np.sin(phi), cos + co
    density = (2 + 1 / a) / (2 * np.pi) * ((x * x + y * y) / (x * x + y * y + z * z)) ** (0.5 / a)
    seen = np.maximum(co, least)
    visibility = 1 / ((1 + of_cosine(np.array(cos)) + of_cosine(seen)) * 4 * cos * seen)
    return float(2 * (density * visibility * co * width * turn).sum())


def below_charlie(g: Geometry, a, below, strength, color):
    most = max(min(mpf(charlie_albedo(float(c), float(a))), 1) for c in (g.ci, g.co))
    return strength * color * charlie(g, a) + (1 - strength * most) * below


def charlie_log_factor(g: Geometry, a):
    return fabs(log(g.sin2_h)) / (2 * a) if g.sin2_h > 0 else mpf(0)


def gltf_sheen(g: Geometry, roughness, strength, sheen_roughness, base_color, metallic, ior, specular, specular_color, sheen, sheen_color):
    below = gltf(g, roughness, strength, base_color, metallic, ior, specular, specular_color)
    return below_charlie(g, sheen_roughness**2, below, sheen, sheen_color)


def gltf_coated_sheen(
    g: Geometry, roughness, strength, coat_roughness, sheen_roughness, base_color, metallic, ior, specular, specular_color, coat, sheen, sheen_color
):
    below = gltf_sheen(g, roughness, strength, sheen_roughness, base_color, metallic, ior, specular, specular_color, sheen, sheen_color)
    return mix(below, lobe(g, coat_roughness**2, coat_roughness**2), coat * schlick(g.co, mpf("0.04")))


# Mitsuba 3, src/bsdfs/principled.cpp eval(), principledhelpers.h; G and F in include/mitsuba/render/microfacet.h, fresnel.h.


def principled(g: Geometry, roughness, anisotropic, specular, clearcoat_gloss, base_color, metallic, flatness, sheen, clearcoat):
    eta = 2 / (1 - sqrt(mpf("0.08") * specular)) - 1
    aspect = sqrt(1 - mpf("0.9") * anisotropic)
    floor = mpf("0.001")
    surface = lobe(g, max(floor, roughness**2 / aspect), max(floor, roughness**2 * aspect), smith_uncorrelated)
    f = surface * mix(dielectric_of_index(g.mu, eta), mix(base_color, 1, g.rest**5), metallic)
    rise = roughness * g.mu**2
    fss = mix(1, rise, (1 - g.ci) ** 5) * mix(1, rise, (1 - g.co) ** 5)
    subsurface = mpf("1.25") / pi * (fss * (1 / (g.ci + g.co) - mpf("0.5")) + mpf("0.5"))
    body = base_color * mix(disney_diffuse(g, 1, roughness), subsurface, flatness)
    # Not over 4 ci co, unlike Disney's code
    m = mix(mpf("0.1"), floor, clearcoat_gloss)
    shadowing = 4 * g.ci * g.co * smith_uncorrelated(GGX, (*g.wi, *g.wo), (mpf("0.25"), mpf("0.25")))
    coat = clearcoat / 4 * schlick(g.mu, mpf("0.04")) * D["gtr"].density((m, mpf(1)), g) * shadowing
    return f + (1 - metallic) * (body + sheen * g.rest**5) + coat


# UsdPreviewSurface, in the form of Storm, USD's own renderer: pxr/usd/plugin/usdShaders/shaders/previewSurface.glslfx,
# evaluateLight(). Its EPSILON, which is its least roughness as well, is 0.001; 0 in D and 4 ci co is the plain form.

EPSILON = mpf("0.001")


def preview_lobe(g: Geometry, roughness, epsilon) -> mpf:
    alpha = max(EPSILON, roughness) ** 2
    k = alpha / 2
    d = (alpha**2 + epsilon) / (pi * (g.h[2] ** 2 * (alpha**2 - 1) + 1) ** 2)
    shadowing = g.ci / mix(g.ci, 1, k) * g.co / mix(g.co, 1, k)
    return d * shadowing / (4 * g.ci * g.co + epsilon)


def preview(g: Geometry, epsilon, roughness, coat_roughness, diffuse, f0, f90, ior, coat):
    s = g.rest**5
    fresnel = mix(f0, f90, s)
    coated = coat * mix(index_to_f0(ior), 1, s) * preview_lobe(g, coat_roughness, epsilon)
    return diffuse / pi * (1 - fresnel) + fresnel * preview_lobe(g, roughness, epsilon) + coated


def preview_metallic(g: Geometry, roughness, coat_roughness, color, metallic, ior, coat, epsilon=mpf(0)):
    f90 = mix(1, color, metallic)
    f0 = mix(index_to_f0(ior) * f90, f90, metallic)
    return preview(g, epsilon, roughness, coat_roughness, (1 - metallic) * color, f0, f90, ior, coat)


def preview_specular(g: Geometry, roughness, coat_roughness, color, specular, ior, coat, epsilon=mpf(0)):
    return preview(g, epsilon, roughness, coat_roughness, color, specular, 1, ior, coat)


# standard_surface 1.0.1 of MaterialX 1.39.5, libraries/bxdf/standard_surface.mtlx with the GLSL of libraries/pbrlib/genglsl:
# mx_{roughness_anisotropy, dielectric_bsdf, conductor_bsdf, sheen_bsdf, artistic_ior, layer_bsdf}.glsl, lib/mx_microfacet_*.glsl.
# wo is the direction of the viewer.


def coefficients(rows: str):
    return [[mpf(x) for x in row.split()] for row in rows.split(",")]


# Of 1, x, y, xy, x^2, y^2, x^2 y, x y^2, x^2 y^2
GGX_ALBEDO = coefficients(
    "0.1003 -0.6303 9.748 -2.038 29.34 -8.245 -26.44 19.99 -5.448, 0.9345 -2.323 2.229 -3.748 1.424 -0.7684 1.436 0.2913 0.6286,"
    "1 -1.765 8.263 11.53 28.96 -7.507 -36.11 15.86 33.37, 1 0.2281 15.94 -55.83 13.08 41.26 54.9 300.2 -285.1"
)


def polynomials(rows, x, y):
    powers = 1, x, y, x * y, x**2, y**2, x**2 * y, x * y**2, x**2 * y**2
    return [sum(a * power for a, power in zip(row, powers)) for row in rows]


def clamp(x, low=0, high=1):
    return min(max(x, low), high)


def split_albedo(g: Geometry, alpha):
    """Factors of f0 and f90 in the fit of the directional albedo."""
    a, b, c, d = polynomials(GGX_ALBEDO, g.co, alpha)
    return clamp(a / c), clamp(b / d)


def two_alphas(roughness, anisotropy):
    aspect = sqrt(1 - min(anisotropy, mpf("0.98")))
    return min(roughness**2 / aspect, 1), roughness**2 * aspect


def coloured(g: Geometry, roughness, anisotropy, fresnel):
    """Lobe with Fresnel and the light of later bounces; factor of the latter."""
    m = two_alphas(roughness, anisotropy)
    alpha = sqrt(m[0] * m[1])
    albedo = sum(split_albedo(g, alpha))
    later = 1 + fresnel * (1 - albedo) / albedo
    return GGX.density(m, g) * smith(GGX, (*g.wi, *g.wo), (alpha, alpha)) * fresnel * later, later, alpha


def dielectric_layer(g: Geometry, roughness, anisotropy, ior):
    """The lobe, and what part of light it lets through."""
    response, later, alpha = coloured(g, roughness, anisotropy, dielectric_of_index(g.mu, ior))
    a, b = split_albedo(g, alpha)
    return response, 1 - (index_to_f0(ior) * a + b) * later


def standard_dielectric(g: Geometry, roughness, anisotropy, ior, sigma, color, specular, specular_color):
    return specular_over(g, roughness, anisotropy, ior, specular, specular_color, qualitative(g, color, sigma))


def specular_over(g: Geometry, roughness, anisotropy, ior, specular, specular_color, below):
    response, through = dielectric_layer(g, roughness, anisotropy, ior)
    return specular * specular_color * response + below * mix(1, through, specular)


# Of 1, x, z, x z, x^2, z^2
SHEEN_ALBEDO = coefficients(
    "13.67300 -68.78018 799.08825 -905.00061 60.28956 1086.96473, 1.0 61.57746 442.78211 2597.49308 121.81241 3045.55075"
)


def sheen_over(g: Geometry, sheen_roughness, sheen, sheen_color, below):
    inverse = 1 / max(sheen_roughness, mpf("0.005"))
    density = (2 + inverse) * g.sin2_h ** (inverse / 2) / (2 * pi)
    response = sheen * sheen_color * density / (4 * (g.ci + g.co - g.ci * g.co))
    powers = 1, g.co, sheen_roughness, g.co * sheen_roughness, g.co**2, sheen_roughness**2
    top, bottom = (sum(a * power for a, power in zip(row, powers)) for row in SHEEN_ALBEDO)
    return response + (1 - sheen * clamp(top / bottom)) * below


def standard_sheen(
    g: Geometry, roughness, anisotropy, ior, sigma, sheen_roughness, color, specular, specular_color, sheen, sheen_color
):
    below = sheen_over(g, sheen_roughness, sheen, sheen_color, qualitative(g, color, sigma))
    return specular_over(g, roughness, anisotropy, ior, specular, specular_color, below)


def standard_coat_sheen(
    g: Geometry, roughness, anisotropy, ior, sigma, coat_roughness, coat_ior, sheen_roughness, color, specular, specular_color, coat,
    sheen, sheen_color,
):  # fmt: skip
    below = standard_sheen(g, roughness, anisotropy, ior, sigma, sheen_roughness, color, specular, specular_color, sheen, sheen_color)
    return specular_over(g, coat_roughness, mpf(0), coat_ior, coat, 1, below)


def standard_metal_coat(g: Geometry, roughness, anisotropy, reflectivity, edge, coat_roughness, coat_ior, coat):
    below = standard_metal(g, roughness, anisotropy, reflectivity, edge)
    return specular_over(g, coat_roughness, mpf(0), coat_ior, coat, 1, below)


def standard_metal(g: Geometry, roughness, anisotropy, reflectivity, edge):
    r = min(reflectivity, mpf("0.99"))
    eta = mix((1 + sqrt(r)) / (1 - sqrt(r)), (1 - r) / (1 + r), edge)
    k = sqrt(max(0, ((eta + 1) ** 2 * r - (eta - 1) ** 2) / (1 - r)))
    return coloured(g, roughness, anisotropy, conductor(g.mu, eta, k))[0]


# Blender 5.0.1, Principled BSDF with distribution GGX: intern/cycles/kernel/svm/closure.h, closure/bsdf_microfacet.h,
# bsdf_util.h, bsdf_oren_nayar.h. wo is the direction of the viewer. How much of the specular layer's Fresnel factor is that
# of grazing, is a table of 16 nodes each way, interpolated linearly; app/cycles_precompute.cpp says what of.

NODES = 16


def roots(x, y):
    """Where y(x), given at many x, changes sign."""
    k = np.nonzero((y[1:] > 0) != (y[:-1] > 0))[0]
    return x[k] - y[k] * (x[k + 1] - x[k]) / (y[k + 1] - y[k])


@lru_cache(maxsize=None)
def grazing_node(i: int, j: int, k: int) -> mpf:
    """Mean over the normals seen from wo, even on a cap of the sphere (openpbr.py), of s where the mirrored direction is up."""
    if k == 0:
        # In single precision its index is 1.
        return mpf(0)
    rough, cos, z = (min(max(n / (NODES - 1), 1e-4), top) for n, top in ((i, 1.0), (j, 1.0), (k, 0.99)))
    m, f0 = rough**2, z**4
    eta = (1 + np.sqrt(f0)) / (1 - np.sqrt(f0))
    sin = np.sqrt(1 - cos * cos)
    length = np.hypot(m * sin, cos)
    seen = m * sin / length, cos / length

    def at(z, phi):
        across = np.sqrt(np.maximum(1 - z * z, 0))
        h = m * (across * np.cos(phi) + seen[0]), m * across * np.sin(phi), z + seen[1]
        scale = 1 / np.sqrt(np.maximum(h[0] ** 2 + h[1] ** 2 + h[2] ** 2, 1e-300))
        mu = (h[0] * sin + h[2] * cos) * scale
        return mu, 2 * mu * h[2] * scale - cos

    # Rings on which a part is up, between where all is and nothing is.
    probe = -seen[1] + (1 + seen[1]) * (1 - np.cos(np.linspace(0, np.pi, 40001))) / 2
    # Towards the bottom facets turn to the horizon within a height of the size of m.
    steps = probe[0] + m * 4.0 ** np.arange(12)
    ends = np.concatenate([[probe[0], probe[-1]], steps[steps < probe[-1]], *(roots(probe, at(probe, phi)[1]) for phi in (0.0, np.pi))])
    ends = np.sort(ends)
    z, weight = (a.ravel() for a in over(ends[:-1], ends[1:], 4))
    low, high = np.zeros_like(z), np.full_like(z, np.pi)
    above = at(z, low)[1] > 0
    for _ in range(50):
        middle = (low + high) / 2
        same = (at(z, middle)[1] > 0) == above
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    phi, turn = over(np.where(above, 0.0, low), np.where(above, low, np.pi), 3)
    mu, co = at(z[:, None], phi)
    s = np.where(co > 0, np.clip((reflectance(mu, eta) - f0) / (1 - f0), 0, 1), 0)
    return mpf(float((weight * (turn * s).sum(axis=1)).sum() / (np.pi * (1 + seen[1]))))


def grazing(roughness, cos, ior) -> mpf:
    places = [min(max(x, 0), 1) * (NODES - 1) for x in (roughness, cos, sqrt((ior - 1) / (ior + 1)))]
    low = [min(int(x), NODES - 2) for x in places]
    total = mpf(0)
    for corner in range(8):
        up = [corner >> axis & 1 for axis in range(3)]
        weight = mpf(1)
        for x, n, one in zip(places, low, up):
            weight *= x - n if one else n + 1 - x
        total += weight * grazing_node(*(n + one for n, one in zip(low, up))) if weight else 0
    return total


def blender(g: Geometry, roughness, anisotropic, ior, sigma, color, metallic, tint):
    aspect = sqrt(1 - mpf("0.9") * anisotropic)
    m = min(roughness**2 / aspect, 1), roughness**2 * aspect
    surface = lobe(g, *m)
    f0 = index_to_f0(ior)
    s = (dielectric_of_index(g.mu, ior) - f0) / (1 - f0)
    through = 1 - mix(f0 * tint, 1, grazing(sqrt(sqrt(m[0] * m[1])), g.co, ior))
    # EON, but that its later bounces have the colour once more
    single = fujii(g, color, sigma)
    body = single + color * (eon(g, sigma, color) - single)
    metal = surface * clamp(f82(g.mu, color, tint))
    return mix(mix(f0 * tint, 1, s) * surface + through * body, metal, metallic)


TARGETS = [
    Whole(
        "gltf",
        ("roughness", "anisotropy_strength", "base_color", "metallic", "ior", "specular", "specular_color"),
        numbers(
            ("0.4", 0, "0.2", 0, "1.5", 1, 1), ("0.032", "0.3", "0.04", "0.04", "1.3", "0.5", "0.7"), (1, 1, 1, "0.5", 2, 0, 1),
            ("0.1", "0.7", "0.9", 1, "1.5", 1, 1), ("0.6", 0, 0, "1e-9", "1.01", "1e-9", "0.04"), ("0.2", 1, "1e-9", 0, 3, 1, 0),
            ("0.3", 0, "0.3", 0, "1.5", 1, 30),
        ),
        gltf,
    ),
    Whole(
        "gltf-coated",
        (
            "roughness", "anisotropy_strength", "clearcoat_roughness", "base_color", "metallic", "ior", "specular", "specular_color",
            "clearcoat",
        ),
        numbers(
            ("0.4", 0, "0.1", "0.2", 0, "1.5", 1, 1, 1), ("0.1", "0.7", "0.032", "0.04", "0.5", "1.3", "0.5", "0.7", "0.04"),
            ("0.2", 1, 1, 1, "0.04", 2, 0, 1, "0.5"), ("0.032", "0.3", "0.5", "0.9", 1, "1.5", 1, 1, 0),
        ),
        gltf_coated,
    ),
    Whole(
        "gltf-sheen",
        (
            "roughness", "anisotropy_strength", "sheen_roughness", "base_color", "metallic", "ior", "specular", "specular_color", "sheen",
            "sheen_color",
        ),
        numbers(
            ("0.4", 0, "0.5", "0.2", "0.1", "1.5", 1, 1, "0.3", 1), ("0.1", "0.7", "0.3", "0.04", "0.5", "1.3", "0.5", "0.7", "0.9", "0.4"),
            ("0.9", "0.2", "0.95", "0.9", "0.2", 2, "0.1", 1, 1, 1),
        ),
        gltf_sheen,
        log_factor=lambda g, roughness, strength, sheen_roughness, *others: charlie_log_factor(g, sheen_roughness**2),
        step=STEP,
    ),
    Whole(
        "gltf-coated-sheen",
        (
            "roughness", "anisotropy_strength", "clearcoat_roughness", "sheen_roughness", "base_color", "metallic", "ior", "specular",
            "specular_color", "clearcoat", "sheen", "sheen_color",
        ),
        numbers(
            ("0.4", 0, "0.1", "0.5", "0.2", "0.1", "1.5", 1, 1, "0.5", "0.3", 1),
            ("0.5", "0.3", "0.3", "0.25", "0.5", "0.04", "1.4", "0.9", "0.8", 1, "0.8", "0.6"),
        ),
        gltf_coated_sheen,
        log_factor=lambda g, roughness, strength, coat_roughness, sheen_roughness, *others: charlie_log_factor(g, sheen_roughness**2),
        step=STEP,
    ),
    Whole(
        "principled",
        (
            "roughness", "anisotropic", "specular", "clearcoat_gloss", "base_color", "metallic", "flatness", "sheen", "clearcoat",
        ),
        numbers(
            ("0.4", 0, "0.5", 1, "0.2", "1e-9", 0, 0, 0), ("0.1", "0.9", "0.04", "0.5", "1e-9", "0.04", "0.3", "0.5", 1),
            (1, 1, 1, 0, 1, "0.5", 1, 1, 1), ("0.2", "0.3", "0.5", "0.9", "0.04", 1, "0.04", "1e-9", "0.04"),
            ("0.032", 0, "1e-9", 1, 0, "1e-9", 1, "0.1", "1e-9"),
        ),
        principled,
    ),
    *[
        Whole(
            f"usd-preview-surface-{workflow}",
            ("roughness", "clearcoatRoughness", "diffuseColor", fourth, "ior", "clearcoat"),
            numbers(
                ("0.4", "0.1", "0.2", "0", "1.5", 0), ("0.1", "0.032", "0.04", "0.04", "1.3", 1), (1, 1, 1, "0.5", 2, "0.04"),
                ("0.032", "0.5", "0.9", 1, "1.5", "1e-9"), ("0.6", "0.3", 0, "1e-9", "1.01", "0.5"),
            ),
            of,
        )
        for workflow, fourth, of in (("metallic", "metallic", preview_metallic), ("specular", "specularColor", preview_specular))
    ],
    Whole(
        "standard-surface-dielectric",
        ("specular_roughness", "specular_anisotropy", "specular_IOR", "diffuse_roughness", "base_color", "specular", "specular_color"),
        numbers(
            ("0.4", 0, "1.5", 0, "0.2", 1, 1), ("0.1", "0.5", "1.3", "0.3", "0.04", "0.5", "0.7"), ("0.95", 0, 2, 1, 1, 1, "0.04"),
            ("0.2", "0.9", "1.1", "0.5", "0.9", 0, 1), ("0.032", 0, 3, "1e-3", "1e-9", "1e-9", 1),
        ),
        standard_dielectric,
    ),
    Whole(
        "standard-surface-metal",
        ("specular_roughness", "specular_anisotropy", "base_color", "specular_color"),
        numbers(
            ("0.4", 0, "0.9", 1), ("0.1", "0.5", "0.5", "0.5"), ("0.95", 0, "0.04", "1e-9"), ("0.2", "0.9", "0.95", "0.9"), ("0.032", 0, "0.8", "0.04")
        ),
        standard_metal,
    ),
    Whole(
        "standard-surface-metal-coat",
        ("specular_roughness", "specular_anisotropy", "base_color", "specular_color", "coat_roughness", "coat_IOR", "coat"),
        numbers(
            ("0.4", 0, "0.9", 1, "0.1", "1.5", "0.5"), ("0.1", "0.5", "0.5", "0.5", "0.7", "1.3", 1), ("0.2", "0.9", "0.95", "0.9", "0.05", 2, "1e-9")
        ),
        standard_metal_coat,
    ),
    Whole(
        "standard-surface-sheen",
        (
            "specular_roughness", "specular_anisotropy", "specular_IOR", "diffuse_roughness", "sheen_roughness", "base_color", "specular",
            "specular_color", "sheen", "sheen_color",
        ),
        numbers(
            ("0.4", 0, "1.5", 0, "0.3", "0.2", 1, 1, "0.3", 1), ("0.1", "0.5", "1.3", "0.3", "0.08", "0.04", "0.5", "0.7", 1, "0.2"),
            ("0.95", "0.2", 2, 1, 1, 1, "0.04", "0.5", "1e-9", 1),
        ),
        standard_sheen,
        log_factor=lambda g, roughness, anisotropy, ior, sigma, sheen_roughness, *others: charlie_log_factor(g, sheen_roughness),
    ),
    Whole(
        "standard-surface-coat-sheen",
        (
            "specular_roughness", "specular_anisotropy", "specular_IOR", "diffuse_roughness", "coat_roughness", "coat_IOR", "sheen_roughness",
            "base_color", "specular", "specular_color", "coat", "sheen", "sheen_color",
        ),
        numbers(
            ("0.4", 0, "1.5", "0.2", "0.1", "1.5", "0.3", "0.2", 1, 1, "0.5", "0.3", 1),
            ("0.1", "0.5", "1.3", "0.3", "0.6", "1.8", "0.6", "0.9", "0.5", "0.7", 1, "0.8", "0.4"),
        ),
        standard_coat_sheen,
        log_factor=lambda g, a, b, c, d, coat_roughness, coat_ior, sheen_roughness, *others: charlie_log_factor(g, sheen_roughness),
    ),
    Whole(
        "blender-principled",
        ("roughness", "anisotropic", "ior", "diffuse_roughness", "base_color", "metallic", "specular_tint"),
        # Away from the table's nodes and where the metal's reflectance is cut off at 1, where there is no derivative
        numbers(
            ("0.37", 0, "1.5", 0, "0.2", "1e-9", 1), ("0.1", "0.5", "1.3", "0.3", "0.04", "0.04", "0.5"), ("0.93", "0.1", 2, 1, "0.98", "0.5", "0.04"),
            ("0.23", "0.9", "1.1", "0.5", "0.9", 1, "0.9"), ("0.51", "0.2", 3, "1e-3", "1e-9", "1e-9", "1e-9"),
        ),
        blender,
    ),
]
