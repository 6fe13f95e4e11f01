"""Directions and the geometry of a pair, by the definitions of src/geometry/mod.rs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from mpmath import cos, mpf, pi, sin, sqrt

Vector = tuple[mpf, mpf, mpf]
PAIR = ("wi_x", "wi_y", "wi_z", "wo_x", "wo_y", "wo_z")
# The direction closest to the horizon.
GRAZING = mpf("89.9999")


def degrees(x) -> mpf:
    return mpf(x) * pi / 180


def direction(theta, phi) -> Vector:
    """The unit vector at these angles in degrees."""
    theta, phi = degrees(theta), degrees(phi)
    # Whole quarter turns have exact cosines.
    x = mpf(0) if phi == pi / 2 else cos(phi)
    y = mpf(0) if phi == pi else sin(phi)
    return sin(theta) * x, sin(theta) * y, cos(theta)


def about_half_vector(theta_h, phi_h, theta_d, phi_d) -> tuple[Vector, Vector]:
    """The pair with this half vector and these difference angles, in degrees (Rusinkiewicz 1998)."""
    h = direction(theta_h, phi_h)
    along = direction(mpf(theta_h) + 90, phi_h)
    across = direction(90, mpf(phi_h) + 90)
    d = direction(theta_d, phi_d)
    wi = tuple(a * d[0] + b * d[1] + c * d[2] for a, b, c in zip(along, across, h))
    wo = tuple(-a * d[0] - b * d[1] + c * d[2] for a, b, c in zip(along, across, h))
    return wi, wo


@dataclass(frozen=True)
class Geometry:
    """A pair of directions and its half vector, exactly; or in a type of numpy's, as a textbook has it."""

    wi: tuple
    wo: tuple
    h: tuple
    cos_d: object

    @property
    def ci(self):
        return self.wi[2]

    @property
    def co(self):
        return self.wo[2]

    @property
    def rest(self):
        """1 - wi.h by the angle between the directions, which does not feel that rounding has left their lengths off 1."""
        apart, along = (sum((a + sign * b) ** 2 for a, b in zip(self.wi, self.wo)) for sign in (-1, 1))
        return 1 - sqrt(along / (along + apart))

    @property
    def mu(self):
        return 1 - self.rest

    @property
    def sin2_h(self):
        return self.h[0] ** 2 + self.h[1] ** 2

    @property
    def tan2_h(self):
        return self.sin2_h / self.h[2] ** 2


@lru_cache(maxsize=4096)
def geometry(arguments: tuple) -> Geometry:
    """Half vector wi + wo over its length, of which wi.h is one half."""
    wi, wo = arguments[:3], arguments[3:]
    total = tuple(a + b for a, b in zip(wi, wo))
    length = sqrt(sum(x * x for x in total))
    return Geometry(wi, wo, tuple(x / length for x in total), length / 2)


def textbook_geometry(arguments: list) -> Geometry:
    """The same in numpy, with wi.h as a product."""
    wi, wo = arguments[:3], arguments[3:]
    total = [a + b for a, b in zip(wi, wo)]
    length = np.sqrt(total[0] ** 2 + total[1] ** 2 + total[2] ** 2)
    h = tuple(x / length for x in total)
    return Geometry(tuple(wi), tuple(wo), h, wi[0] * h[0] + wi[1] * h[1] + wi[2] * h[2])


def facets() -> list[tuple[mpf, ...]]:
    """Pairs whose half vectors go from the normal to the horizon."""
    tiny = mpf("1e-6") * 180 / pi
    angles = [
        *[(0, 0, theta_d, 90) for theta_d in (0, 40)],
        *[(tiny, 30, theta_d, 90) for theta_d in (0, 40)],
        (mpf("1e-4") * 180 / pi, 200, 0, 0),
        (mpf("0.02"), 0, 60, 70),
        (mpf("0.2"), 100, 25, 10),
        (2, 90, 0, 0),
        (2, 300, 80, 100),
        (10, 45, 30, 0),
        (30, 17, 50, 30),
        (55, 120, 20, 200),
        (75, 250, 10, 160),
        (85, 60, 70, 90),
        (mpf("89.5"), 10, 0, 0),
        (GRAZING, 30, 0, 0),
    ]
    return [(*wi, *wo) for wi, wo in (about_half_vector(*angle) for angle in angles)]


def views() -> list[tuple[mpf, ...]]:
    """Pairs from along the normal to grazing, on the same side, across and opposed."""
    tiny = mpf("1e-6") * 180 / pi
    angles = [
        ((0, 0), (0, 0)),
        ((tiny, 0), (30, 70)),
        ((mpf("0.1"), 50), (mpf("0.1"), 230)),
        ((10, 30), (25, 130)),
        ((40, 0), (40, 180)),
        ((35, 200), (60, 290)),
        ((70, 10), (80, 10)),
        ((86, 100), (20, 20)),
        ((89, 45), (89, 225)),
        ((mpf("89.9"), 75), (mpf("89.99"), 300)),
        ((GRAZING, 15), (0, 0)),
        ((GRAZING, 60), (45, 180)),
        ((GRAZING, 130), (GRAZING, 130)),
        ((GRAZING, 0), (GRAZING, 100)),
    ]
    return [(*direction(*light), *direction(*viewer)) for light, viewer in angles]


def cosines() -> list[tuple[mpf]]:
    """wi.h from 1 to grazing."""
    angles = ["1e-3", "0.1", 1, 10, 30, 45, 60, 75, 82, 87, "89.5", "89.99", GRAZING]
    return [(mpf(1),), *[(cos(degrees(angle)),) for angle in angles]]


def corners() -> list[tuple[mpf, ...]]:
    """For whole models: along the normal, next to it, mirror directions, back to the light and next to it, grazing."""
    tiny = mpf("1e-6") * 180 / pi
    opposed = [
        ((0, 0), (0, 0)),
        ((mpf("0.1"), 50), (mpf("0.1"), 230)),
        ((40, 0), (40, 180)),
        ((60, 110), (60, 110)),
        ((mpf("60.001"), 25), (60, 25)),
        ((35, 200), (60, 290)),
        ((70, 10), (80, 10)),
        ((89, 45), (89, 225)),
        ((GRAZING, 15), (0, 0)),
        ((GRAZING, 60), (45, 180)),
        ((GRAZING, 130), (GRAZING, 310)),
        ((GRAZING, 0), (GRAZING, 100)),
    ]
    halves = [(tiny, 30, 40, 90), (mpf("0.2"), 100, 25, 10), (10, 45, 30, 0), (30, 17, 50, 30)]
    pairs = [(*direction(*light), *direction(*viewer)) for light, viewer in opposed]
    return pairs + [(*wi, *wo) for wi, wo in (about_half_vector(*half) for half in halves)]
