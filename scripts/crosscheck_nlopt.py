#!/usr/bin/env python3
"""Cross-check of brdfit against NLopt: a second implementation and a second optimiser.

What it does
    For every core model, on synthetic data and on measured Cornell paints, this script
      1. lets `brdfit fit` fit the file, and reads the JSON report;
      2. evaluates the same model at the reported parameters with the numpy formulas below, which share no
         code with brdfit, and compares all five reported errors (they must agree to 1e-9 relative);
      3. minimises the same cost, in the EXACT metric, with NLopt: from brdfit's starting values, from seeded
         random starts, and restarted from brdfit's answer.
    It exits 1 if NLopt finds a cost lower than brdfit's by more than 1e-6 relative, or if an error disagrees.

How to run it (numpy and nlopt come from scripts/requirements.txt)
    python scripts/crosscheck_nlopt.py --brdfit target/release/brdfit
    python scripts/crosscheck_nlopt.py --brdfit target/release/brdfit --two-metrics
    python scripts/crosscheck_nlopt.py --brdfit target/release/brdfit --quick
    python scripts/crosscheck_nlopt.py --brdfit target/release/brdfit --only 'garnet_red, 31' --jobs 1
    python scripts/crosscheck_nlopt.py --self-test          the formulas and gradients alone, no brdfit needed

How to read a line
    ok  case | metric | free parameters | cost brdfit | cost nlopt | gain (where from) | own starts
    "cost" is the square of the metric: the mean over samples and channels of (g(f ci) - g(f* ci))^2.
    "gain" is (brdfit - nlopt)/brdfit for the best NLopt result, the restart from brdfit's answer included, so
    it is never negative. "own starts" is the same for the starts that did not see brdfit's answer: about zero
    when they found the same optimum, negative when they ended in a worse one (then only the restart tests
    this case).

Conventions
    n = +z, wi to the light, wo to the viewer, h = normalise(wi + wo); f in 1/sr without the cosine;
    ci = n.wi, co = n.wo, c = n.h, s2 = 1 - c^2, mu = wi.h. Angles are radians inside, degrees in files.

Sources
    Lambert 1760. Torrance & Sparrow 1967 (v-cavity). Blinn 1977 (Gaussian and cosine-power lobes).
    Cook & Torrance 1982. Schlick 1994. Oren & Nayar 1994. Ashikhmin & Shirley 2000. Walter et al. 2007
    (GGX, Beckmann and Blinn-Phong shadowing). Heitz 2014 (height-correlated Smith). Low et al. 2012 (the log
    metric). Squire & Trapp 1998 (complex-step derivative). NLopt: Johnson 2007; SLSQP: Kraft 1988; L-BFGS: Liu &
    Nocedal 1989, Luksan's code; Subplex: Rowan 1990.

Organisation: geometry, microfacet parts, models, expressions, metrics, files, the fit problem, the NLopt
searches, the list of cases, one case from start to end, self-test, command line.
"""

from __future__ import annotations

import os

# Cases run in parallel processes; a threaded BLAS in each of them would only get in the way.
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import csv
import json
import math
import multiprocessing
import re
import subprocess
import sys
import tempfile
import time
import zlib
from dataclasses import dataclass, field
from pathlib import Path

import nlopt
import numpy as np

from common import checked_brdfit

PI = math.pi

# NLopt may be lower than brdfit by at most this much, relative to brdfit's cost.
COST_TOLERANCE = 1e-6
# Reported errors must be reproduced from the reported parameters this well (rounding in sums is about 1e-14).
ERROR_TOLERANCE = 1e-9
# Samples with a steeper direction are left out (brdfit's default), inclusive up to rounding of degrees.
MAX_THETA_DEG = 80.0
MAX_THETA_SLACK_DEG = 1e-9


# ---------------------------------------------------------------------------------------------------- geometry


class Geometry:
    """Everything about N pairs of directions that a model may ask for; each attribute is an (N, 1) column, so
    that it broadcasts against a row of C channels."""

    def __init__(self, theta_i, phi_i, theta_o, phi_o):
        column = lambda a: np.asarray(a, dtype=float).reshape(-1, 1)
        self.theta_i, phi_i = column(theta_i), column(phi_i)
        self.theta_o, phi_o = column(theta_o), column(phi_o)
        self.one = np.ones_like(self.theta_i)
        self.ci, self.co = np.cos(self.theta_i), np.cos(self.theta_o)
        self.cos_dphi = np.cos(phi_i - phi_o)

        wi = np.hstack([np.sin(self.theta_i) * np.cos(phi_i), np.sin(self.theta_i) * np.sin(phi_i), self.ci])
        wo = np.hstack([np.sin(self.theta_o) * np.cos(phi_o), np.sin(self.theta_o) * np.sin(phi_o), self.co])
        h = wi + wo
        h /= np.linalg.norm(h, axis=1, keepdims=True)
        self.hx2, self.hy2, self.c = h[:, :1] ** 2, h[:, 1:2] ** 2, h[:, 2:]
        # sin^2 from x and y: 1 - c^2 would lose the digits that a sharp lobe needs.
        self.s2 = self.hx2 + self.hy2
        self.t2 = self.s2 / self.c**2
        self.theta_h = np.arctan2(np.sqrt(self.s2), self.c)
        self.ln_c = 0.5 * np.log1p(-np.minimum(self.s2, 1 - 1e-16))
        self.mu = np.clip(np.sum(wi * h, axis=1, keepdims=True), 0.0, 1.0)
        self.schlick = (1.0 - self.mu) ** 5
        self.tan2_i, self.tan2_o = np.tan(self.theta_i) ** 2, np.tan(self.theta_o) ** 2


# ------------------------------------------------------------------------------------------- microfacet parts
# All of these accept complex parameters: f(p + i h) gives the derivative Im f / h free of cancellation.


def erfc(x):
    """Complementary error function of x; for x = a + ib with tiny b, its first-order extension (numpy has none)."""
    a = np.real(x)
    value = np.array([math.erfc(v) for v in a.ravel()]).reshape(a.shape)
    if np.iscomplexobj(x):
        return value - 1j * np.imag(x) * (2.0 / math.sqrt(PI)) * np.exp(-a * a)
    return value


def d_beckmann(g, m):
    return np.exp(-g.t2 / m**2) / (PI * m**2 * g.c**4)


def d_ggx(g, m):
    return m**2 / (PI * (m**2 * g.c**2 + g.s2) ** 2)


def d_blinn_phong(g, m):
    """Exponent from roughness: n = 2/m^2 - 2, the exponent with the slope variance of a Beckmann lobe."""
    n = 2.0 / m**2 - 2.0
    return (n + 2.0) / (2.0 * PI) * np.exp(n * g.ln_c)


GAUSS_NODES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(96)


def gaussian_norm(m):
    """N(m) = 2 pi int_0^{pi/2} exp(-(a/m)^2) cos a sin a da, by Gauss-Legendre quadrature."""
    # Beyond 8 m the integrand is below exp(-64) = 2e-28: ending there keeps 96 nodes dense for a small m.
    end = min(PI / 2.0, 8.0 * float(np.real(m)))
    a = 0.5 * end * (GAUSS_NODES + 1.0)
    return 2.0 * PI * 0.5 * end * np.sum(GAUSS_WEIGHTS * np.exp(-((a / m) ** 2)) * np.cos(a) * np.sin(a))


def d_gaussian(g, m):
    return np.exp(-((g.theta_h / m) ** 2)) / gaussian_norm(m)


def lambda_beckmann(tan2, m):
    # At normal incidence x would be infinite; Lambda is 0 to all digits long before x = 1000 / m.
    x = 1.0 / np.maximum(np.sqrt(tan2), 1e-3) / m
    return np.exp(-(x**2)) / (2.0 * math.sqrt(PI) * x) - 0.5 * erfc(x)


def lambda_beckmann_rational(tan2, m):
    """Walter et al. 2007, eq. 27, but not let below 0 short of a = 1.6."""
    a = 1.0 / np.maximum(np.sqrt(tan2), 1e-3) / m
    numerator = 1.0 - 1.259 * a + 0.396 * a**2
    shadowed = (np.real(a) < 1.6) & (np.real(numerator) > 0.0)
    return np.where(shadowed, numerator / (3.535 * a + 2.181 * a**2), 0.0)


def lambda_ggx(tan2, m):
    # (sqrt(1+e) - 1)/2 without its cancellation for small e.
    e = m**2 * tan2
    return 0.5 * e / (1.0 + np.sqrt(1.0 + e))


# name -> (D, Smith's Lambda). Blinn-Phong and Gaussian have no closed Lambda; they use Beckmann's at the same m
# (Walter et al. 2007: x = sqrt(n/2 + 1)/tan theta = 1/(m tan theta)).
DISTRIBUTIONS = {
    "beckmann": (d_beckmann, lambda_beckmann),
    "ggx": (d_ggx, lambda_ggx),
    "blinn-phong": (d_blinn_phong, None),
    "gaussian": (d_gaussian, None),
}


def shadowing(g, kind, smith_lambda, m):
    if kind == "none":
        return g.one
    if kind == "v-cavity":
        return np.minimum(1.0, 2.0 * g.c * np.minimum(g.ci, g.co) / g.mu)
    if kind == "smith-rational":
        smith_lambda = lambda_beckmann_rational
    lambda_i, lambda_o = smith_lambda(g.tan2_i, m), smith_lambda(g.tan2_o, m)
    if kind in ("smith", "smith-rational"):
        return 1.0 / (1.0 + lambda_i + lambda_o)
    if kind == "smith-uncorrelated":
        return 1.0 / ((1.0 + lambda_i) * (1.0 + lambda_o))
    raise ValueError(f"unknown shadowing g={kind}")


def fresnel_schlick(g, f0):
    return f0 + (1.0 - f0) * g.schlick


def fresnel_dielectric(g, f0):
    """Exact unpolarised Fresnel, eta = (1 + sqrt f0)/(1 - sqrt f0), as in Cook & Torrance 1982."""
    # The upper bound f0 = 1 is eta = infinity. Real part only: the complex step must survive.
    f0 = np.where(np.real(f0) > 1.0 - 1e-12, 1.0 - 1e-12 + (f0 - np.real(f0)), f0)
    s = np.sqrt(f0)
    # eta^2 - 1 = 4 s/(1 - s)^2 and (gg - c) = (eta^2 - 1)/(gg + c): no cancellation as eta -> 1.
    eta2_minus_1 = 4.0 * s / (1.0 - s) ** 2
    c = g.mu
    gg = np.sqrt(eta2_minus_1 + c**2)
    gg_minus_c = eta2_minus_1 / (gg + c)
    ratio = (c * (gg + c) - 1.0) / (c * gg_minus_c + 1.0)
    return 0.5 * (gg_minus_c / (gg + c)) ** 2 * (1.0 + ratio**2)


def fresnel_conductor(g, eta, k):
    c, s2 = g.mu, 1.0 - g.mu**2
    q = eta**2 - k**2 - s2
    root = np.sqrt(q**2 + 4.0 * eta**2 * k**2)
    # a^2 = (root + q)/2 and b^2 = (root - q)/2 with a b = eta k: take the larger one and divide.
    larger = np.sqrt(0.5 * (root + np.where(np.real(q) >= 0.0, q, -q)))
    a = np.where(np.real(q) >= 0.0, larger, eta * k / larger)
    a2b2 = root
    rs = (a2b2 - 2.0 * a * c + c**2) / (a2b2 + 2.0 * a * c + c**2)
    rp = rs * (c**2 * a2b2 - 2.0 * a * c * s2 + s2**2) / (c**2 * a2b2 + 2.0 * a * c * s2 + s2**2)
    return 0.5 * (rs + rp)


# ------------------------------------------------------------------------------------------------------ models
# A model is a function (geometry, options, parameters) -> f, an (N, 1) or (N, C) array. Per-channel parameters
# are arrays of C values, shared ones are scalars.


def lambert(g, options, p):
    return g.one * (p["kd"] / PI)


def cook_torrance(g, options, p):
    distribution, smith_lambda = DISTRIBUTIONS[options["d"]]
    m = p["m"]
    shape = distribution(g, m) * shadowing(g, options["g"], smith_lambda, m) / (4.0 * g.ci * g.co)
    if options["f"] == "none":
        return shape * p["ks"]
    if options["f"] == "schlick":
        return shape * (p["ks"] * fresnel_schlick(g, p["f0"]))
    if options["f"] == "dielectric":
        return shape * (p["ks"] * fresnel_dielectric(g, p["f0"]))
    if options["f"] == "conductor":
        return shape * (p["ks"] * fresnel_conductor(g, p["eta"], p["k"]))
    raise ValueError(f"unknown Fresnel f={options['f']}")


def oren_nayar(g, options, p):
    rho, sigma = p["albedo"], p["sigma"] * (PI / 180.0)
    s2 = sigma**2
    a, b = np.maximum(g.theta_i, g.theta_o), np.minimum(g.theta_i, g.theta_o)
    if options["variant"] == "qualitative":
        c1, c2 = 1.0 - 0.5 * s2 / (s2 + 0.33), 0.45 * s2 / (s2 + 0.09)
        return rho / PI * (c1 + c2 * np.maximum(0.0, g.cos_dphi) * np.sin(a) * np.tan(b))
    if options["variant"] != "full":
        raise ValueError(f"unknown oren-nayar variant={options['variant']}")
    c1 = 1.0 - 0.5 * s2 / (s2 + 0.33)
    c2 = 0.45 * s2 / (s2 + 0.09) * np.where(g.cos_dphi >= 0.0, np.sin(a), np.sin(a) - (2.0 * b / PI) ** 3)
    c3 = 0.125 * s2 / (s2 + 0.09) * (4.0 * a * b / PI**2) ** 2
    direct = c1 + g.cos_dphi * c2 * np.tan(b) + (1.0 - np.abs(g.cos_dphi)) * c3 * np.tan(0.5 * (a + b))
    # Light that left one facet, hit another, and only then reached the viewer: quadratic in the albedo.
    interreflected = 0.17 * s2 / (s2 + 0.13) * (1.0 - g.cos_dphi * (2.0 * b / PI) ** 2)
    return rho / PI * direct + rho**2 / PI * interreflected


def ashikhmin_shirley(g, options, p):
    rd, rs, nu, nv = p["rd"], p["rs"], p["nu"], p["nv"]
    # c^{(nu hx^2 + nv hy^2)/(1 - c^2)} = exp((nu hx^2 + nv hy^2) ln c / s2), and ln c / s2 -> -1/2 at h = n.
    ln_c_over_s2 = np.where(g.s2 > 1e-300, g.ln_c / np.maximum(g.s2, 1e-300), -0.5)
    power = np.exp((nu * g.hx2 + nv * g.hy2) * ln_c_over_s2)
    prefactor = np.sqrt((nu + 1.0) * (nv + 1.0)) / (8.0 * PI)
    specular = prefactor * power * fresnel_schlick(g, rs) / (g.mu * np.maximum(g.ci, g.co))
    rim_i, rim_o = 1.0 - (1.0 - g.ci / 2.0) ** 5, 1.0 - (1.0 - g.co / 2.0) ** 5
    return specular + 28.0 / (23.0 * PI) * rd * (1.0 - rs) * rim_i * rim_o


# name -> (function, options and their defaults)
MODELS = {
    "lambert": (lambert, {}),
    "cook-torrance": (cook_torrance, {"d": "ggx", "g": "smith", "f": "schlick"}),
    "oren-nayar": (oren_nayar, {"variant": "full"}),
    "ashikhmin-shirley": (ashikhmin_shirley, {}),
}


@dataclass
class Lobe:
    name: str  # as the report names it: the model, from the second of its kind on with "#2", "#3"
    model: str
    options: dict

    def __call__(self, geometry, parameters):
        return MODELS[self.model][0](geometry, self.options, parameters)


def parse_expression(text):
    """`lambert + cook-torrance(d=ggx, g=smith)` -> list of Lobe. Constraints on parameters, such as ks=free, are left out."""
    choices = {key for _, options in MODELS.values() for key in options}
    lobes, seen = [], {}
    for term in re.split(r"\+(?![^(]*\))", text):
        match = re.fullmatch(r"\s*([a-z0-9-]+)\s*(?:\(([^)]*)\))?\s*", term)
        if not match or match[1] not in MODELS:
            raise ValueError(f"cannot read the term '{term.strip()}' of the model '{text}'")
        options = dict(MODELS[match[1]][1])
        for item in filter(None, (part.strip() for part in (match[2] or "").split(","))):
            key, _, value = (part.strip() for part in item.partition("="))
            if key not in choices:
                continue
            if key not in options:
                raise ValueError(f"this script knows no option '{key}' of {match[1]}")
            options[key] = value
        seen[match[1]] = seen.get(match[1], 0) + 1
        suffix = "" if seen[match[1]] == 1 else f"#{seen[match[1]]}"
        lobes.append(Lobe(match[1] + suffix, match[1], options))
    return lobes


# ----------------------------------------------------------------------------------------------------- metrics

METRICS = ("l2", "log", "cbrt")
UNBIASED = "unbiased-cbrt"


def transform(metric, x, smoothing, slope_floor):
    """g(x) and g'(x) of a metric. `smoothing` (per channel) softens the cube root; 0 is the exact metric.
    `slope_floor` (per channel) is the |x| below which the infinite slope of the exact cube root stops growing:
    it touches the gradient only, never the value."""
    if metric == "l2":
        return x, np.ones_like(x)
    if metric == "log":
        x = np.maximum(x, -0.99)
        return np.log1p(x), 1.0 / (1.0 + x)
    if metric != "cbrt":
        raise ValueError(f"unknown metric {metric}")
    if np.any(smoothing > 0.0):
        root = np.cbrt(x * x + smoothing**2)
        return x / root, (x * x / 3.0 + smoothing**2) / root**4
    return np.cbrt(x), 1.0 / (3.0 * np.cbrt(np.maximum(np.abs(x), slope_floor)) ** 2)


NEAREST = 12
RIDGE = 1e-2
SAME = 1e-7


def several_azimuths(angles):
    """Whether neither all light nor all viewing lies in one plane through the normal, to half a degree."""

    def planes(theta, phi):
        horizontal = np.column_stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi)])
        lengths = np.linalg.norm(horizontal, axis=1)
        horizontal, lengths = horizontal[lengths > np.sin(np.radians(1))], lengths[lengths > np.sin(np.radians(1))]
        if len(lengths) == 0:
            return None
        x, y = horizontal[0] / lengths[0]
        return bool(np.any(np.abs(x * horizontal[:, 1] - y * horizontal[:, 0]) > np.sin(np.radians(0.5)) * lengths))

    light, viewer = planes(angles[:, 0], angles[:, 1]), planes(angles[:, 2], angles[:, 3])
    return light is not False and viewer is not False and not (light is None and viewer is None)


def places(angles, isotropic):
    """The coordinates in which samples are near each other: docs/use/image.md."""
    direction = lambda theta, phi: np.column_stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    wi, wo = direction(angles[:, 0], angles[:, 1]), direction(angles[:, 2], angles[:, 3])
    half, difference = (wi + wo) / 2, (wi - wo) / 2
    h = half / np.linalg.norm(half, axis=1, keepdims=True)
    sin_h = np.hypot(h[:, 0], h[:, 1])
    safe = np.where(sin_h > 0, sin_h, 1)
    x, y = np.where(sin_h > 0, h[:, 0] / safe, 1.0), np.where(sin_h > 0, h[:, 1] / safe, 0.0)
    u = np.sqrt(np.arctan2(sin_h, h[:, 2]) / (PI / 2))
    if not isotropic:
        return np.column_stack([2 * u * x, 2 * u * y, difference])
    theta_d = np.arctan2(np.linalg.norm(difference, axis=1), np.linalg.norm(half, axis=1))
    along = (difference[:, 0] * x + difference[:, 1] * y) * h[:, 2] - difference[:, 2] * sin_h
    across = difference[:, 1] * x - difference[:, 0] * y
    return np.column_stack([2 * u, theta_d, u * along / 2, u * np.abs(across) / 2])


def predictions(measurement):
    """What the neighbours of each sample predict for it, f: the value there of the linear function that fits cbrt(f) of the
    nearest samples in other directions, within their range, and at least 0."""
    points = places(measurement.angles, not several_azimuths(measurement.angles))
    roots = np.cbrt(measurement.values)
    predicted = np.empty_like(roots)
    for index, point in enumerate(points):
        distance = np.linalg.norm(points - point, axis=1)
        near = np.argsort(distance, kind="stable")
        near = near[distance[near] > SAME][: NEAREST + 1]
        d, step, values = distance[near], points[near] - point, roots[near]
        reach = 1.0001 * d[-1]
        weights = ((reach - d) / (reach * d)) ** 2
        weights /= weights.sum()
        mean = weights @ step
        apart = step - mean
        covariance = (apart * weights[:, None]).T @ apart
        covariance += np.eye(len(point)) * RIDGE * np.trace(covariance)
        weights = weights * (1 - apart @ np.linalg.solve(covariance, mean))
        predicted[index] = np.clip(weights @ values, values.min(axis=0), values.max(axis=0))
    return np.maximum(predicted**3, 0.0)


def noise_floors(x, x_predicted):
    """By channel: three times the median distance from the prediction among the eighth of the samples that are predicted darkest."""
    floors = []
    for own, predicted in zip(x.T, x_predicted.T):
        apart = np.abs(own - predicted)
        darkest = np.lexsort([apart, predicted])[: -(-len(own) // 8)]
        floors.append(max(3 * np.sort(apart[darkest])[len(darkest) // 2], 1e-6 * np.mean(np.sort(predicted)[: -(-19 * len(own) // 20)]), 1e-30))
    return np.array(floors)


def unbiased(x, x_measured, x_predicted, floors):
    """The signed root of the cost of unbiased-cbrt, and its derivative with respect to x: docs/use/conventions.md."""
    alpha, kappa = (3 + math.sqrt(3)) / 4, (1 + math.sqrt(3)) / 2
    c = np.cbrt(np.maximum(x + floors, 1e-3 * floors))
    a, k = np.cbrt(x_measured + floors), kappa * np.cbrt(x_predicted + floors)
    b = np.maximum(a, 0) + k
    cost = alpha / (c + k) ** 2 * np.where(
        a >= 0, (a - c) ** 2 * (c * (c + 2 * a) + 3 * k * a**2 / b), c * (c**3 - a**3 * (3 * c + 4 * k) / k)
    )
    weight = alpha * (c + 2 * k) / (3 * c**2 * (c + k) ** 3)
    residual = np.copysign(np.sqrt(np.maximum(cost, 0)), c - a)
    # Half the derivative of the cost over its root; at the root's zero, the limit.
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = (c**3 - a**3) * weight / residual
    return residual, np.where(np.abs(c - a) > 1e-9 * np.abs(c), slope, np.sqrt(weight))


def all_errors(f, f_measured, ci, co):
    """The five errors of a report, in their exact form, with uniform weights."""
    x, x_measured = f * ci, f_measured * ci
    errors = {}
    for metric in METRICS:
        a, _ = transform(metric, x, np.zeros(1), np.full(1, 1e-300))
        b, _ = transform(metric, x_measured, np.zeros(1), np.full(1, 1e-300))
        errors[metric] = math.sqrt(np.mean((a - b) ** 2))
    e = 1e-3
    q = np.maximum(ci * co, e)
    ratio = np.log((np.maximum(f, 0.0) * q + e) / (np.maximum(f_measured, 0.0) * q + e))
    errors["log_ratio"] = float(np.mean(np.abs(ratio)))
    errors["relative"] = float(np.sum(np.abs(x - x_measured)) / np.sum(x_measured))
    return errors


# ------------------------------------------------------------------------------------------------------- files


@dataclass
class Measurement:
    angles: np.ndarray  # (N, 4): theta_i, phi_i, theta_o, phi_o in radians
    values: np.ndarray  # (N, C), 1/sr
    channels: list[str]

    def within_max_theta(self):
        limit = math.radians(MAX_THETA_DEG + MAX_THETA_SLACK_DEG)
        keep = (self.angles[:, 0] <= limit) & (self.angles[:, 2] <= limit)
        return Measurement(self.angles[keep], self.values[keep], self.channels)


def read_cornell(path):
    """Count of wavelengths, the wavelengths, then rows of four angles (radians) and one value per wavelength."""
    text = "\n".join(line.split("#")[0] for line in Path(path).read_text().splitlines())
    numbers = text.split()
    count = int(numbers[0])
    rows = np.array(numbers[1 + count :], dtype=float).reshape(-1, 4 + count)
    return Measurement(rows[:, :4], rows[:, 4:], numbers[1 : 1 + count])


def read_csv(path):
    """Header theta_i,phi_i,theta_o,phi_o (degrees), a column per channel, optional sigma columns; `#` comments."""
    with open(path, newline="") as stream:
        rows = list(csv.reader(line for line in stream if line.strip() and not line.startswith("#")))
    header = [name.strip() for name in rows[0]]
    table = np.array(rows[1:], dtype=float)
    angle_columns = [header.index(name) for name in ("theta_i", "phi_i", "theta_o", "phi_o")]
    channels = [
        i for i, name in enumerate(header) if i not in angle_columns and not re.fullmatch(r"sigma(_.*)?", name)
    ]
    return Measurement(np.radians(table[:, angle_columns]), table[:, channels], [header[i] for i in channels])


def read_measurement(path):
    return read_csv(path) if str(path).endswith(".csv") else read_cornell(path)


def write_csv(path, measurement):
    """Floats are written so that they read back exactly: both programs see the same samples."""
    with open(path, "w") as stream:
        stream.write(",".join(["theta_i", "phi_i", "theta_o", "phi_o", *measurement.channels]) + "\n")
        for angles, values in zip(np.degrees(measurement.angles), measurement.values):
            stream.write(",".join(repr(float(v)) for v in (*angles, *values)) + "\n")


# ------------------------------------------------------------------------------------------------- fit problem

# Size of the imaginary step. It only has to vanish beside 1 when squared; there is no cancellation to fear.
COMPLEX_STEP = 1e-30
# Scale parameters are searched by their logarithm.
LOGARITHMIC = ("m", "nu", "nv")


@dataclass
class Variable:
    """One free scalar of the problem: a shared parameter, or one channel of a per-channel parameter."""

    lobe: int
    name: str
    channel: int | None
    lower: float
    upper: float
    initial: float
    value: float

    @property
    def logarithmic(self):
        return self.name in LOGARITHMIC

    @property
    def shift(self):  # an exponent may be exactly zero: search ln(1 + nu) then
        return 0.0 if self.lower > 0.0 else 1.0

    def to_search(self, p):
        p = min(max(p, self.lower), self.upper)
        return math.log(p + self.shift) if self.logarithmic else p

    def from_search(self, t):
        p = math.exp(t) - self.shift if self.logarithmic else t
        return min(max(p, self.lower), self.upper)

    def slope(self, p):  # d parameter / d search coordinate
        return p + self.shift if self.logarithmic else 1.0


class Problem:
    """The cost of a model on a measurement as a function of the free parameters, with its gradient."""

    def __init__(self, report, measurement):
        self.lobes = parse_expression(report["model"])
        self.metric = report["metric"]
        names = [str(name) for name in report["data"]["channels"]]
        if len(names) != measurement.values.shape[1]:
            raise ValueError(f"the report has {len(names)} channels, the file {measurement.values.shape[1]}")
        self.channels = len(names)
        angles = measurement.angles
        self.geometry = Geometry(angles[:, 0], angles[:, 1], angles[:, 2], angles[:, 3])
        self.f_measured = measurement.values
        self.x_measured = measurement.values * self.geometry.ci
        if self.metric == UNBIASED:
            self.x_predicted = predictions(measurement) * self.geometry.ci
            self.floors = noise_floors(self.x_measured, self.x_predicted)
        self.x_scale = np.maximum(np.mean(np.abs(self.x_measured), axis=0), 1e-300)
        self.variables, self.base = [], [{} for _ in self.lobes]
        self._read_parameters(report["parameters"], names)
        self.values = np.array([v.value for v in self.variables])
        self.initial = np.array([v.initial for v in self.variables])
        self.lower = np.array([v.lower for v in self.variables])
        self.upper = np.array([v.upper for v in self.variables])

    def _read_parameters(self, parameters, channel_names):
        lobe_index = {lobe.name: i for i, lobe in enumerate(self.lobes)}
        for entry in parameters:
            lobe, name, value = lobe_index[entry["lobe"]], entry["name"], float(entry["value"])
            channel = None if entry["channel"] is None else channel_names.index(str(entry["channel"]))
            if channel is None:
                self.base[lobe][name] = value
            else:
                self.base[lobe].setdefault(name, np.full(self.channels, math.nan))[channel] = value
            if entry["status"] == "fixed":
                continue
            if entry["status"] not in ("free", "at-lower", "at-upper"):
                raise ValueError(f"status '{entry['status']}' of {entry['lobe']}.{name} is not handled here")
            low, high = entry["bounds"]
            initial = value if entry.get("initial") is None else float(entry["initial"])
            low, high = (-math.inf if low is None else low), (math.inf if high is None else high)
            self.variables.append(Variable(lobe, name, channel, low, high, initial, value))

    def parameters(self, p):
        """The parameter dictionaries of all lobes with the free ones set to the vector p."""
        lobes = [
            {name: value.copy() if isinstance(value, np.ndarray) else value for name, value in lobe.items()}
            for lobe in self.base
        ]
        for variable, value in zip(self.variables, p):
            if variable.channel is None:
                lobes[variable.lobe][variable.name] = float(value)
            else:
                lobes[variable.lobe][variable.name][variable.channel] = value
        return lobes

    def evaluate(self, p):
        lobes = self.parameters(p)
        f = sum(lobe(self.geometry, values) for lobe, values in zip(self.lobes, lobes))
        return np.broadcast_to(f, self.f_measured.shape)

    def compared(self, p, smoothing):
        """The residuals and their slopes in x. `smoothing` is relative to the mean measured |x| of each channel."""
        x = self.evaluate(p) * self.geometry.ci
        if self.metric == UNBIASED:
            return unbiased(x, self.x_measured, self.x_predicted, self.floors)
        transformed = lambda x: transform(self.metric, x, smoothing * self.x_scale, 1e-9 * self.x_scale)
        g, slope = transformed(x)
        return g - transformed(self.x_measured)[0], slope

    def cost(self, p, smoothing=0.0):
        residual, _ = self.compared(p, smoothing)
        return float(np.mean(residual**2))

    def derivatives(self, p):
        """Yields (indices of the variables, d f / d parameter): one complex-step evaluation of ONE lobe gives the
        derivatives by a shared parameter, or by all channels of a per-channel parameter at once."""
        lobes = self.parameters(p)
        groups = {}
        for index, variable in enumerate(self.variables):
            groups.setdefault((variable.lobe, variable.name), []).append(index)
        for (lobe, name), indices in groups.items():
            stepped = dict(lobes[lobe])
            stepped[name] = stepped[name] + 1j * COMPLEX_STEP
            yield indices, np.imag(self.lobes[lobe](self.geometry, stepped)) / COMPLEX_STEP

    def _gather(self, field, indices, out):
        """Sums an (N, C) field into the entries of `out`: over everything, or channel by channel."""
        if self.variables[indices[0]].channel is None:
            out[indices[0]] = np.sum(field)
        else:
            by_channel = np.sum(np.broadcast_to(field, self.f_measured.shape), axis=0)
            for index in indices:
                out[index] = by_channel[self.variables[index].channel]

    def cost_and_gradient(self, p, smoothing=0.0):
        residual, slope = self.compared(p, smoothing)
        weight = 2.0 / residual.size * residual * slope * self.geometry.ci
        gradient = np.zeros(len(self.variables))
        for indices, df in self.derivatives(p):
            self._gather(weight * df, indices, gradient)
        return float(np.mean(residual**2)), gradient

    def curvature(self, p):
        """Diagonal of the Gauss-Newton Hessian. The cube root is softened: its exact slope at a zero sample would
        make every step tiny."""
        _, slope = self.compared(p, 1e-2)
        diagonal = np.zeros(len(self.variables))
        for indices, df in self.derivatives(p):
            self._gather(2.0 / slope.size * (slope * self.geometry.ci * df) ** 2, indices, diagonal)
        return diagonal


# ----------------------------------------------------------------------------------------------- NLopt searches

ALGORITHMS = {
    name: getattr(nlopt, name) for name in ("LD_SLSQP", "LD_LBFGS", "LD_CCSAQ", "LN_SBPLX")
}
# A derivative-free search is worth its evaluations only in few dimensions.
DERIVATIVE_FREE_LIMIT = 8


@dataclass
class Answer:
    cost: float
    p: np.ndarray
    origin: str


def minimise(problem, p_start, algorithm, smoothing, max_evaluations, max_seconds):
    """One NLopt run from p_start; returns the best point it visited, also when NLopt stops on an error."""
    variables = problem.variables
    t_start = np.array([v.to_search(p) for v, p in zip(variables, p_start)])
    lower = np.array([v.to_search(v.lower) if math.isfinite(v.lower) else -math.inf for v in variables])
    upper = np.array([v.to_search(v.upper) if math.isfinite(v.upper) else math.inf for v in variables])

    to_parameters = lambda t: np.array([v.from_search(x) for v, x in zip(variables, t)])
    cost_start = max(problem.cost(p_start, smoothing), 1e-300)
    # Scale every variable so that the Gauss-Newton curvature along it is about one. One that the data do not
    # see here (f0 while ks = 0, say) gets a tenth of its range instead.
    slopes = np.array([v.slope(p) for v, p in zip(variables, p_start)])
    curvature = problem.curvature(p_start) * slopes**2 / cost_start
    tenth = np.where(np.isfinite(upper - lower), 0.1 * (upper - lower), 0.1 * (1.0 + np.abs(t_start)))
    scale = np.minimum(1.0 / np.sqrt(np.maximum(curvature, 1e-300)), tenth)
    scale = np.where(np.isfinite(scale) & (scale > 0.0), scale, tenth)

    best_cost, best_t = math.inf, t_start

    def objective(u, gradient):
        nonlocal best_cost, best_t
        t = np.clip(u * scale, lower, upper)
        p = to_parameters(t)
        if gradient.size:
            cost, dcost_dp = problem.cost_and_gradient(p, smoothing)
            slope = np.array([v.slope(x) for v, x in zip(variables, p)])
            gradient[:] = np.nan_to_num(dcost_dp * slope * scale / cost_start)
        else:
            cost = problem.cost(p, smoothing)
        if not math.isfinite(cost):
            return 1e30
        if cost < best_cost:
            best_cost, best_t = cost, t
        return cost / cost_start

    optimiser = nlopt.opt(ALGORITHMS[algorithm], len(variables))
    optimiser.set_min_objective(objective)
    optimiser.set_lower_bounds(lower / scale)
    optimiser.set_upper_bounds(upper / scale)
    optimiser.set_ftol_rel(1e-13)
    optimiser.set_xtol_rel(1e-11)
    optimiser.set_maxeval(max_evaluations)
    optimiser.set_maxtime(max_seconds)
    if algorithm.startswith("LN_"):
        optimiser.set_initial_step(np.full(len(variables), 0.03))
    try:
        optimiser.optimize(np.clip(t_start / scale, lower / scale, upper / scale))
    except (nlopt.runtime_error, nlopt.RoundoffLimited):
        pass  # "no further progress possible" ends as an error; the best point visited stands
    return to_parameters(best_t)


def descend(problem, p_start, origin, effort, polish):
    """A chain of NLopt algorithms from one start, each from the best point so far; the exact cost decides."""
    best = Answer(problem.cost(p_start), np.array(p_start), origin)

    def attempt(p, algorithm, smoothing, evaluations):
        nonlocal best
        p = minimise(problem, p, algorithm, smoothing, evaluations, effort.seconds_per_run)
        cost = problem.cost(p)
        if cost < best.cost:
            best = Answer(cost, p, f"{origin}, {algorithm}")
        return p

    if problem.metric == "cbrt" and not polish:
        # From afar the exact cube root has needle-like dips where the model crosses zero: soften it first.
        attempt(p_start, "LD_SLSQP", 1e-2, effort.evaluations)
    for _ in range(effort.rounds):
        before = best.cost
        for algorithm in ("LD_SLSQP", "LD_LBFGS"):
            attempt(best.p, algorithm, 0.0, effort.evaluations)
        if polish:
            attempt(best.p, "LD_CCSAQ", 0.0, effort.evaluations // 4)
            if effort.derivative_free and len(problem.variables) <= DERIVATIVE_FREE_LIMIT:
                attempt(best.p, "LN_SBPLX", 0.0, effort.evaluations)
        if best.cost >= before * (1.0 - 1e-9):
            break
    return best


def random_start(problem, rng):
    """A start inside the bounds: log-uniform for roughness and exponents, and for amplitudes, whose bounds are far
    wider than any material, uniform over a plausible range."""
    plausible = {"kd": (0.0, 1.0), "albedo": (0.0, 1.0), "ks": (0.05, 2.0), "eta": (0.2, 4.0), "k": (0.5, 6.0)}
    logarithmic = {"m": (0.01, 1.0), "nu": (3.0, 3000.0), "nv": (3.0, 3000.0)}
    p = []
    for v in problem.variables:
        if v.name in logarithmic:
            low, high = logarithmic[v.name]
            value = math.exp(rng.uniform(math.log(low), math.log(high)))
        else:
            low, high = plausible.get(v.name, (v.lower, v.upper))
            value = rng.uniform(max(low, v.lower), min(high, v.upper))
        p.append(min(max(value, v.lower), v.upper))
    return np.array(p)


@dataclass
class Effort:
    random_starts: int = 4
    evaluations: int = 1200
    seconds_per_run: float = 6.0
    rounds: int = 3
    derivative_free: bool = True


def search(problem, effort, seed):
    """Returns (best answer from starts of our own, best answer restarted from brdfit's)."""
    starts = [("brdfit's start", problem.initial)]
    rng = np.random.default_rng(seed)
    starts += [(f"random start {i + 1}", random_start(problem, rng)) for i in range(effort.random_starts)]
    own = min((descend(problem, p, origin, effort, polish=False) for origin, p in starts), key=lambda a: a.cost)
    restart = descend(problem, problem.values, "restart", effort, polish=True)
    # Whatever won its way down from elsewhere also gets the full polish before it is compared.
    if own.cost < restart.cost * (1.0 + 1e-4):
        own = min(own, descend(problem, own.p, own.origin.split(",")[0], effort, polish=True), key=lambda a: a.cost)
    return own, restart


# ------------------------------------------------------------------------------------------------ list of cases

RGB = "rgb"
CT = "cook-torrance"


@dataclass
class Core:
    """A core model and the parameter values its synthetic data are made from, each as (r, g, b) or shared."""

    expression: str
    truth: dict
    free: list = field(default_factory=list)
    # Two models of this list are also fitted to all 31 wavelengths of the measured paints.
    spectral: bool = False


def core_models():
    kd = {"lambert.kd": (0.45, 0.2, 0.06)}
    m, f0 = {f"{CT}.m": 0.28}, {f"{CT}.f0": (0.05, 0.12, 0.4)}
    with_lambert = lambda options="": f"lambert + {CT}{options}"
    plastic = {**kd, **m, **f0}
    oren_nayar_truth = {"oren-nayar.albedo": (0.6, 0.3, 0.1), "oren-nayar.sigma": 25.0}
    gloss = {**m, **f0}
    return [
        Core("lambert", kd),
        Core(with_lambert("(d=ggx)"), plastic, spectral=True),
        Core(with_lambert("(d=beckmann)"), plastic),
        # Smith's shadowing of these is tabulated, to 1e-6, and checked by the tests: here D itself, to all digits.
        Core(with_lambert("(d=blinn-phong, g=v-cavity)"), plastic),
        Core(with_lambert("(d=gaussian, g=v-cavity)"), plastic),
        Core(with_lambert("(g=v-cavity)"), plastic),
        Core(with_lambert("(g=smith-uncorrelated)"), plastic),
        Core(with_lambert("(d=beckmann, g=smith-rational)"), plastic),
        Core(with_lambert("(g=none)"), plastic),
        Core(with_lambert("(f=dielectric)"), plastic),
        Core(
            with_lambert("(f=conductor)"),
            {**kd, **m, f"{CT}.eta": (0.3, 0.9, 1.6), f"{CT}.k": (3.5, 2.5, 1.9)},
        ),
        Core(with_lambert("(f=none)"), {**kd, **m, f"{CT}.ks": (0.3, 0.15, 0.6)}),
        Core(with_lambert(), {**plastic, f"{CT}.ks": (0.7, 0.5, 0.9)}, free=["ks"]),
        Core(with_lambert("(d=beckmann, g=v-cavity)"), plastic, spectral=True),
        Core("oren-nayar(variant=full)", oren_nayar_truth),
        Core("oren-nayar(variant=qualitative)", oren_nayar_truth),
        Core(f"oren-nayar(variant=full) + {CT}", {**oren_nayar_truth, **gloss}),
        Core(f"oren-nayar(variant=qualitative) + {CT}", {**oren_nayar_truth, **gloss}),
        Core(
            "ashikhmin-shirley",
            {
                "ashikhmin-shirley.rd": (0.5, 0.25, 0.08),
                "ashikhmin-shirley.rs": (0.04, 0.1, 0.3),
                "ashikhmin-shirley.nu": 60.0,
                "ashikhmin-shirley.nv": 25.0,
            },
            # Light from a single azimuth, as in the measured paints, ties it to nu by default.
            free=["nv"],
        ),
    ]


PAINTS = ("garnet_red", "cayman", "krylon_blue")
EXCERPT_NM = ("450", "550", "650", "700")


@dataclass
class Case:
    name: str
    core: Core
    metric: str
    effort: Effort
    paint: str | None = None  # None: synthetic data
    wavelengths: tuple | None = None  # None: the file as it is
    channels: str = ""  # of synthetic data: "rgb", or "" for one unnamed channel


def list_cases(quick, measured, two_metrics=False):
    cases = []

    def add(data, core, metric, effort, **where):
        free = f", free {' '.join(core.free)}" if core.free else ""
        cases.append(Case(f"{data}: {core.expression}{free}", core, metric, effort, **where))

    every_metric = (*METRICS, UNBIASED)
    # What the three channels of a synthetic case show in every metric need not be shown again.
    some_metrics = ("l2", UNBIASED) if two_metrics else every_metric
    effort = Effort(random_starts=1, rounds=2, evaluations=600) if quick else Effort()
    # 63 parameters on 31 x 1439 values: gradient algorithms only, fewer starts.
    spectral_effort = Effort(random_starts=1, rounds=2, evaluations=400, seconds_per_run=8.0, derivative_free=False)
    for index, core in enumerate(core_models()):
        layouts = (RGB, "") if not quick else ((RGB,) if index % 2 else ("",))
        for channels in layouts:
            for metric in (UNBIASED,) if quick else every_metric if channels else some_metrics:
                label = "synthetic, rgb" if channels else "synthetic, one channel"
                add(label, core, metric, effort, channels=channels)
    if not measured:
        return cases
    for paint in PAINTS if not quick else PAINTS[:1]:
        for core in core_models():
            if quick and not core.spectral:
                continue
            for metric in (UNBIASED,) if quick else some_metrics:
                add(f"{paint}, 4 wavelengths", core, metric, effort, paint=paint, wavelengths=EXCERPT_NM)
    for paint in PAINTS if not quick else ():
        for core in core_models():
            if core.spectral:
                for metric in METRICS:
                    add(f"{paint}, 31 wavelengths", core, metric, spectral_effort, paint=paint)
    return cases


# --------------------------------------------------------------------------------- one case from start to end


class Failure(Exception):
    """brdfit did something that this check counts as a failure; the message says what."""


def run_brdfit(brdfit, arguments, codes=(0,)):
    done = subprocess.run([brdfit, *arguments], capture_output=True, text=True, timeout=300)
    if done.returncode not in codes or (done.returncode and not done.stdout.strip()):
        last = (done.stderr.strip().splitlines() or ["nothing on stderr"])[-1]
        raise Failure(f"`brdfit {' '.join(arguments)}` exited {done.returncode}: {last}")
    return done.stdout


def synthesise(brdfit, core, channels, path):
    settings = []
    for name, value in core.truth.items():
        if not isinstance(value, tuple):
            settings += ["--set", f"{name}={value}"]
        elif channels:
            settings += [item for c, v in zip(channels, value) for item in ("--set", f"{name}.{c}={v}")]
        else:
            settings += ["--set", f"{name}={value[0]}"]
    seed = zlib.crc32(f"{core.expression} {channels}".encode()) % 100000
    options = ["--directions", "400", "--noise", "0.02", "--seed", str(seed), "-o", str(path)]
    run_brdfit(brdfit, ["synth", "-m", core.expression, *settings, *options])


def prepare_data(case, brdfit, data, folder):
    """The path of the file that both programs fit."""
    if case.paint is None:
        path = Path(folder) / "synthetic.csv"
        synthesise(brdfit, case.core, case.channels, path)
        return path
    original = Path(data) / "cornell" / f"{case.paint}.brdf"
    if case.wavelengths is None:
        return original
    full = read_cornell(original)
    columns = [full.channels.index(w) for w in case.wavelengths]
    path = Path(folder) / f"{case.paint}.csv"
    write_csv(path, Measurement(full.angles, full.values[:, columns], list(case.wavelengths)))
    return path


def compare_errors(problem, report):
    """Our own five errors at brdfit's parameters against its report; returns the worst relative difference."""
    g = problem.geometry
    ours = all_errors(problem.evaluate(problem.values), problem.f_measured, g.ci, g.co)
    worst = 0.0
    for name, value in ours.items():
        reported = report["errors"][name]
        if reported is None:
            raise Failure(f"the report's error '{name}' is null; numpy finds {value:.12g}")
        difference = abs(reported - value) / max(abs(value), 1e-300)
        worst = max(worst, difference)
        if not difference <= ERROR_TOLERANCE:
            raise Failure(
                f"the reported error '{name}' is {reported:.15g}, numpy finds {value:.15g} at the same parameters"
                f" (relative difference {difference:.1e})"
            )
    return worst


@dataclass
class Result:
    case: Case
    ok: bool
    message: str = ""
    parameters: int = 0
    brdfit_cost: float = math.nan
    nlopt_cost: float = math.nan
    origin: str = ""
    gain: float = math.nan
    own_gain: float = math.nan
    error_difference: float = math.nan
    seconds: float = 0.0

    def line(self):
        head = f"{'ok  ' if self.ok else 'FAIL'} {self.case.name} | {self.case.metric}"
        if not math.isfinite(self.gain):
            return f"{head} | {self.message}"
        text = (
            f"{head} | {self.parameters} free | brdfit {self.brdfit_cost:.9e} | nlopt {self.nlopt_cost:.9e}"
            f" | gain {self.gain:.1e} ({self.origin}) | own starts {self.own_gain:+.1e}"
        )
        return f"{text} | {self.message}" if self.message else text


def check_report(case, report, measurement):
    """Everything after `brdfit fit`: needs the report as a dictionary and the samples, nothing else."""
    if report["metric"] != case.metric:
        raise Failure(f"asked for the metric {case.metric}, the report says {report['metric']}")
    if report["data"]["used"] != len(measurement.values):
        raise Failure(f"the report used {report['data']['used']} samples, expected {len(measurement.values)}")
    problem = Problem(report, measurement)
    error_difference = compare_errors(problem, report)

    brdfit_cost = problem.cost(problem.values)
    # A repeatable seed of its own for every case.
    own, restart = search(problem, case.effort, zlib.crc32(f"{case.name} {case.metric}".encode()))
    best = min(restart, own, key=lambda a: a.cost)
    scale = max(brdfit_cost, 1e-300)
    gain = (brdfit_cost - best.cost) / scale
    result = Result(
        case, gain <= COST_TOLERANCE, "", len(problem.variables), brdfit_cost, best.cost, best.origin, gain,
        (brdfit_cost - own.cost) / scale, error_difference,
    )
    if not result.ok:
        # What NLopt changed, the largest relative change first.
        moved = sorted(zip(problem.variables, best.p), key=lambda vp: -abs(vp[1] - vp[0].value) / (abs(vp[1]) + 1e-9))
        changes = [
            f"{problem.lobes[v.lobe].name}.{v.name}"
            + ("" if v.channel is None else f"[{measurement.channels[v.channel]}]")
            + f" {v.value:.8g} -> {p:.8g}"
            for v, p in moved[:5]
        ]
        shown = "; ".join(changes) + ("; ..." if len(moved) > 5 else "")
        result.message = f"nlopt is lower by more than {COST_TOLERANCE:g}: {shown}"
    if not report["termination"]["usable"]:
        result.message = "; ".join(filter(None, [result.message, "brdfit calls its fit not usable"]))
    return result


def run_case(job):
    case, brdfit, data = job
    began = time.monotonic()
    try:
        with tempfile.TemporaryDirectory() as folder:
            path = prepare_data(case, brdfit, data, folder)
            arguments = ["fit", str(path), "-m", case.core.expression, "--metric", case.metric, "--json", "-q"]
            for name in case.core.free:
                arguments += ["--free", name]
            # Exit code 1 still writes the whole report ("not usable"); the comparison stands on its own.
            report = json.loads(run_brdfit(brdfit, arguments, codes=(0, 1)))
            measurement = read_measurement(path).within_max_theta()
        with np.errstate(all="ignore"):  # exp underflows to 0 in the tails, as it should
            result = check_report(case, report, measurement)
    except Failure as failure:
        result = Result(case, False, str(failure))
    except Exception as error:  # one broken case must not hide the others
        result = Result(case, False, f"{type(error).__name__}: {error}")
    result.seconds = time.monotonic() - began
    return result


# --------------------------------------------------------------------------------------------------- self-test


def self_test():
    """Formulas against reference values (mpmath, 30 digits), against their integrals, and gradients against
    central differences."""
    degrees = lambda *angles: Geometry(*([math.radians(a)] for a in angles))

    def expect(what, value, reference, tolerance=1e-12):
        value = float(np.real(np.ravel(value)[0]))
        if not abs(value - reference) <= tolerance * abs(reference):
            raise SystemExit(f"self-test: {what} is {value!r}, expected {reference!r}")

    # theta_h = 30 degrees: light and viewer both there. mu of a pair mirrored about n is cos(theta).
    half = degrees(30, 0, 30, 0)
    expect("D beckmann", d_beckmann(half, 0.3), 0.15487702934586575)
    expect("D ggx", d_ggx(half, 0.3), 0.28418763476015783)
    expect("D blinn-phong, n = 50", d_blinn_phong(half, math.sqrt(2 / 52)), 0.0062280925854382949)
    expect("N gaussian, m = 0.1", gaussian_norm(0.1), 0.031207, 2e-5)
    expect("N gaussian, m = 0.3", gaussian_norm(0.3), 0.26637, 2e-5)
    tan2_75 = np.array([[math.tan(math.radians(75)) ** 2]])
    expect("Lambda beckmann", lambda_beckmann(tan2_75, 0.3), 0.03896361576439213)
    expect("Lambda ggx", lambda_ggx(tan2_75, 0.3), 0.25058948346029933)
    for eta, table in {
        1.5: {0: 0.04, 60: 0.089186712802212783, 80: 0.38770435469147268, 89: 0.90418494978018913},
        1.33: {0: 0.020059312199524766, 60: 0.059125599247392293, 80: 0.34691609626225365, 89: 0.89604650521443553},
    }.items():
        f0 = np.array([((eta - 1) / (eta + 1)) ** 2])
        for angle, reference in table.items():
            value = fresnel_dielectric(degrees(angle, 0, angle, 180), f0)
            expect(f"F dielectric {eta} {angle}", value, reference, 1e-11)
    for angle, reference in {0: 0.92337164750957854, 60: 0.9184110846593691, 80: 0.93855836971114986}.items():
        value = fresnel_conductor(degrees(angle, 0, angle, 180), np.array([0.2]), np.array([3.0]))
        expect(f"F conductor {angle}", value, reference, 1e-11)
    expect("F schlick", fresnel_schlick(degrees(60, 0, 60, 180), 0.04), 0.07)

    # Every distribution is normalised: the integral of D c over the hemisphere is 1. With wi = wo = h the angle
    # theta_h is theta_i; t = sin^2(theta) makes the integral pi int_0^1 D dt, in u = ln t for sharp lobes.
    nodes, weights = np.polynomial.legendre.leggauss(600)
    low = math.log(1e-12)
    t = np.exp(0.5 * low * (1.0 - nodes))
    theta = np.arcsin(np.sqrt(np.minimum(t, 1.0)))
    sphere = Geometry(theta, 0 * theta, theta, 0 * theta)
    for name, (distribution, _) in DISTRIBUTIONS.items():
        for m in (0.02, 0.1, 0.5):
            integral = np.sum(PI * distribution(sphere, m).ravel() * t * weights * -0.5 * low)
            # The part below t = 1e-12 is missing: at most 1e-12/m^2.
            expect(f"int D c, {name}, m = {m}", integral, 1.0, 1e-6)

    # Models without tabulated values: limits and reciprocity.
    rng = np.random.default_rng(1)
    ti, to = np.radians(rng.uniform(0, 80, 40)), np.radians(rng.uniform(0, 80, 40))
    phi_i, phi_o = rng.uniform(0, 2 * PI, 40), rng.uniform(0, 2 * PI, 40)
    there, back = Geometry(ti, phi_i, to, phi_o), Geometry(to, phi_o, ti, phi_i)
    smooth = {"albedo": np.array([0.5]), "sigma": 0.0}
    expect("oren-nayar at sigma 0", oren_nayar(there, {"variant": "full"}, smooth), 0.5 / PI)
    samples = Measurement(np.column_stack([ti, phi_i, to, phi_o]), rng.uniform(0.05, 0.5, (40, 3)), list(RGB))
    for core in core_models():
        parameters = report_parameters(core)
        report = {"model": core.expression, "metric": "cbrt", "data": {"channels": list(RGB)}, "parameters": parameters}
        problem = Problem(report, samples)
        values = problem.evaluate(problem.values)
        problem.geometry = back
        if np.max(np.abs(problem.evaluate(problem.values) / values - 1)) > 1e-10:
            raise SystemExit(f"self-test: {core.expression} is not reciprocal")
        problem.geometry = there
        for metric in METRICS:
            problem.metric = metric
            for smoothing in (0.0, 0.1):
                _, gradient = problem.cost_and_gradient(problem.values, smoothing)
                for i, value in enumerate(problem.values):
                    step = 1e-5 * value * np.eye(len(problem.values))[i]
                    up, down = (problem.cost(problem.values + s, smoothing) for s in (step, -step))
                    # Differences lose digits against the cost itself; 1e-5 still catches any wrong term.
                    slack = 1e-5 * (np.max(np.abs(gradient * problem.values)) + up) / value
                    if abs((up - down) / (2e-5 * value) - gradient[i]) > slack:
                        raise SystemExit(f"self-test: gradient of {core.expression} ({metric}), parameter {i}")


def report_parameters(core):
    """The `parameters` of a report for a core model at its true values: all a Problem needs, without brdfit."""
    bounds = {"ks": [0, 1000], "m": [1e-4, 1], "sigma": [0, 90], "kd": [0, 2], "albedo": [0, 2]}
    bounds |= {"nu": [0, 1e6], "nv": [0, 1e6], "eta": [0.05, 10], "k": [0, 15]}
    truth = dict(core.truth)
    if CT in core.expression:
        truth.setdefault(f"{CT}.ks", (1.0, 1.0, 1.0))
    parameters = []
    for key, value in truth.items():
        lobe, name = key.split(".")
        fixed = key not in core.truth
        for channel, v in zip(RGB, value) if isinstance(value, tuple) else [(None, value)]:
            parameters.append(
                {"lobe": lobe, "name": name, "channel": channel, "value": v, "initial": v,
                 "bounds": bounds.get(name, [0, 1]), "status": "fixed" if fixed else "free"}
            )
    return parameters


# ------------------------------------------------------------------------------------------------ command line


def main():
    root = Path(__file__).resolve().parents[1]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--brdfit", help="the brdfit binary")
    parser.add_argument("--data", type=Path, default=root / "../shared/data", help="folder that holds cornell/")
    parser.add_argument("--two-metrics", action="store_true", help="paints and single channels in l2 and the default metric only")
    parser.add_argument("--quick", action="store_true", help="fewer cases and starts, under a minute")
    parser.add_argument("--jobs", type=int, default=2, help="cases run at the same time")
    parser.add_argument("--only", default="", help="only the cases whose 'case | metric' contains this text")
    parser.add_argument("--self-test", action="store_true", help="check the formulas of this script and stop")
    options = parser.parse_args()

    began = time.monotonic()
    with np.errstate(all="ignore"):
        self_test()
    print(f"self-test passed ({time.monotonic() - began:.1f} s)", flush=True)
    if options.self_test:
        return 0
    brdfit = checked_brdfit(parser, options.brdfit)

    measured = (options.data / "cornell").is_dir()
    if not measured:
        print(f"SKIPPED: no {options.data}/cornell, so nothing is checked on measured data", flush=True)
    cases = [c for c in list_cases(options.quick, measured, options.two_metrics) if options.only in f"{c.name} | {c.metric}"]
    if not cases:
        print(f"no case contains '{options.only}'")
        return 1

    results = []
    with multiprocessing.Pool(options.jobs) as pool:
        for result in pool.imap(run_case, [(case, brdfit, str(options.data)) for case in cases]):
            print(result.line(), flush=True)
            results.append(result)

    failed = [r for r in results if not r.ok]
    compared = [r for r in results if math.isfinite(r.gain)]
    skipped = "" if measured else ", measured data SKIPPED"
    print(f"\n{len(results)} cases, {len(failed)} failed{skipped}, {time.monotonic() - began:.0f} s")
    if compared:
        worst = max(compared, key=lambda r: r.gain)
        print(f"largest gain of nlopt over brdfit: {worst.gain:.1e} ({worst.case.name} | {worst.case.metric})")
        reached = sum(r.own_gain > -COST_TOLERANCE for r in compared)
        print(f"nlopt reached brdfit's cost without its answer in {reached} of {len(compared)} cases")
        print(f"largest relative difference of a reported error: {max(r.error_difference for r in compared):.1e}")
    for r in failed:
        print(f"FAILED: {r.case.name} | {r.case.metric}: {r.message}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
