#!/usr/bin/env python3
"""Evaluates RGL tensor files (.bsdf) a second time, apart from brdfit, and writes the small files that tests/rgl.rs compares with.

    python scripts/reference/rgl.py                     writes tests/rgl/*.bsdf and *.csv
    python scripts/reference/rgl.py --check FILE CSV    the largest difference from a table of f
    python scripts/reference/rgl.py --mitsuba FILE...   the same from Mitsuba 3's plugin `measured`

The parameterisation is that of Dupuy and Jakob 2018, doi:10.1145/3272127.3275059; the layout that of
https://github.com/rgl-epfl/brdf-loader. Everything is computed in double precision from the definition: distribution functions by
exact integration of the bilinear density, slice by slice, and interpolated between directions of incidence.

A table has theta_i, phi_i, theta_o, phi_o in radians and f in 1/sr by channel. numpy comes from scripts/requirements.txt, mitsuba from
scripts/requirements-renderers.txt.
"""

from __future__ import annotations

import argparse
import struct
import sys
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).resolve().parents[2] / "tests" / "rgl"
TYPES = {1: "u1", 2: "i1", 3: "<u2", 4: "<i2", 5: "<u4", 6: "<i4", 7: "<u8", 8: "<i8", 9: "<f2", 10: "<f4", 11: "<f8"}

# ------------------------------------------------------------------------------------------------- the container


def read(path) -> dict[str, np.ndarray]:
    """The fields of a file."""
    data = Path(path).read_bytes()
    magic, major, minor, count = struct.unpack_from("<12sBBI", data)
    assert magic == b"tensor_file\0" and (major, minor) == (1, 0), path
    at, fields = 18, {}
    for _ in range(count):
        (length,) = struct.unpack_from("<H", data, at)
        name = data[at + 2 : at + 2 + length].decode()
        at += 2 + length
        dimensions, kind, offset = struct.unpack_from("<HBQ", data, at)
        shape = struct.unpack_from(f"<{dimensions}Q", data, at + 11)
        at += 11 + 8 * dimensions
        fields[name] = np.frombuffer(data, TYPES[kind], int(np.prod(shape)), offset).reshape(shape)
    return fields


def write(path, fields: dict[str, np.ndarray]):
    """Writes the fields in their order."""
    kinds = {np.dtype(name): kind for kind, name in TYPES.items()}
    size = 18 + sum(13 + len(name) + 8 * array.ndim for name, array in fields.items())
    header, body = struct.pack("<12sBBI", b"tensor_file", 1, 0, len(fields)), b""
    for name, array in fields.items():
        body += b"\0" * (-(size + len(body)) % 8)
        header += struct.pack(f"<H{len(name)}sHBQ", len(name), name.encode(), array.ndim, kinds[array.dtype], size + len(body))
        header += struct.pack(f"<{array.ndim}Q", *array.shape)
        body += array.tobytes()
    Path(path).write_bytes(header + body)


# ------------------------------------------------------------------------------------------------- the evaluation


def corners(nodes, x):
    """For each x, the two neighbours among the nodes with their weights; beyond the ends, the end."""
    nodes, x = np.asarray(nodes, float), np.asarray(x, float)
    if len(nodes) == 1:
        return [(np.zeros(x.shape, int), np.ones(x.shape))]
    low = np.clip(np.searchsorted(nodes, x, side="right") - 1, 0, len(nodes) - 2)
    part = np.clip((x - nodes[low]) / (nodes[low + 1] - nodes[low]), 0, 1)
    return [(low, 1 - part), (low + 1, part)]


def bilinear(table, u, v):
    """table[v, u] between its nodes on the unit square."""
    rows, columns = (corners(np.linspace(0, 1, size), w) for size, w in zip(table.shape, (v, u)))
    return sum(table[y, x] * a * b for y, a in rows for x, b in columns)


def integrals(density):
    """The bilinear density's integral along each row from the left to each node, and of the rows' integrals from the first row."""
    along = np.concatenate([np.zeros((len(density), 1)), np.cumsum(density[:, 1:] + density[:, :-1], axis=1) / 2], axis=1)
    rows = along[:, -1]
    return along, np.concatenate([[0], np.cumsum(rows[1:] + rows[:-1]) / 2])


def unwarp(densities, weights, u, v):
    """The point of the unit square that the mixed density maps to (u, v); densities is [slice, row, column]."""
    height, width = densities.shape[1:]
    x, y = u * (width - 1), v * (height - 1)
    column, row = np.clip(x.astype(int), 0, width - 2), np.clip(y.astype(int), 0, height - 2)
    x, y = x - column, y - row
    parts = {}
    for index, density in enumerate(densities):
        density = density.astype(float)
        along, below = integrals(density)
        density, along, below = (array / below[-1] for array in (density, along, below))
        weight = sum(np.where(slices == index, w, 0) for slices, w in weights)
        # The cumulative density along the line at y, up to x: the integral of a function that is linear within the cell.
        line = lambda at: (1 - y) * density[row, at] + y * density[row + 1, at]
        left = (1 - y) * along[row, column] + y * along[row + 1, column]
        new = {
            "part": left + x * line(column) + x**2 / 2 * (line(column + 1) - line(column)),
            "whole": (1 - y) * along[row, -1] + y * along[row + 1, -1],
            "below": below[row] + y * along[row, -1] + y**2 / 2 * (along[row + 1, -1] - along[row, -1]),
        }
        for name, value in new.items():
            parts[name] = parts.get(name, 0) + weight * value
    return parts["part"] / parts["whole"], parts["below"]


def evaluate(fields, wi, wo):
    """f in 1/sr for unit vectors wi and wo, [pair, channel]."""
    phis, thetas = (fields[name].astype(float) for name in ("phi_i", "theta_i"))
    wi, wo = np.array(wi, float), np.array(wo, float)
    cos_o = wo[:, 2]
    if len(phis) > 2:
        reduction = np.rint(2 * np.pi / (phis[-1] - phis[0]))
        if reduction >= 2:
            # The tabulated azimuths of incidence are those with negative y, and with a quarter turn negative x, too.
            sign_y = np.where(np.signbit(wi[:, 1]), 1.0, -1.0)
            sign_x = np.where(np.signbit(wi[:, 0]), 1.0, -1.0) if reduction == 4 else sign_y
            for v in (wi, wo):
                v[:, 0] *= sign_x
                v[:, 1] *= sign_y
    m = wi + wo
    m /= np.linalg.norm(m, axis=1, keepdims=True)
    theta_i, theta_m = (np.arctan2(np.hypot(v[:, 0], v[:, 1]), v[:, 2]) for v in (wi, m))
    phi_i, phi_m = (np.arctan2(v[:, 1], v[:, 0]) for v in (wi, m))
    polar, azimuth = lambda theta: np.sqrt(theta * 2 / np.pi), lambda phi: phi / (2 * np.pi) + 0.5
    u, v = polar(theta_m), azimuth(phi_m - phi_i if len(phis) <= 2 else phi_m) % 1.0
    weights = [(k * len(thetas) + j, a * b) for k, a in corners(phis, phi_i) for j, b in corners(thetas, theta_i)]
    flat = lambda name: fields[name].reshape(-1, *fields[name].shape[2:])
    s = unwarp(flat("vndf"), weights, u, v)
    spectra = flat("spectra" if "wavelengths" in fields else "rgb").astype(float)
    result = np.zeros((len(wi), spectra.shape[1]))
    rows, columns = (corners(np.linspace(0, 1, size), w) for size, w in zip(spectra.shape[2:], s[::-1]))
    for slices, w in weights:
        for y, a in rows:
            for x, b in columns:
                result += (w * a * b)[:, None] * spectra[slices, :, y, x]
    if fields["jacobian"][0]:
        ndf, sigma = (fields[name].astype(float) for name in ("ndf", "sigma"))
        result *= (bilinear(ndf, u, v) / (4 * bilinear(sigma, polar(theta_i), azimuth(phi_i))))[:, None]
    return result / cos_o[:, None]


def mitsuba(path, fields, wi, wo):
    """The same by Mitsuba's plugin; of a spectral file only as many wavelengths as Mitsuba evaluates at a time, four."""
    import mitsuba as mi

    spectral = "wavelengths" in fields
    mi.set_variant("scalar_spectral" if spectral else "scalar_rgb")
    bsdf = mi.load_dict({"type": "measured", "filename": str(path)})
    context, point = mi.BSDFContext(), mi.SurfaceInteraction3f()
    if spectral:
        point.wavelengths = np.resize(fields["wavelengths"], 4).tolist()
    found = []
    for one, other in zip(np.asarray(wi).tolist(), np.asarray(wo).tolist()):
        point.wi = one
        found.append(bsdf.eval(context, point, other))
    return np.array(found)[:, : len(fields["wavelengths"]) if spectral else 3] / np.asarray(wo)[:, 2:]


# ------------------------------------------------------------------------------------------------- made-up files


def direction(theta, phi):
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)


def made_up(phi_i, theta_i, channels, seed, jacobian=1):
    """Fields with numbers from a random generator: nothing is smooth, so that every index and weight matters."""
    random = np.random.default_rng(seed)
    phi_i, theta_i = np.float32(phi_i), np.float32(theta_i)
    slices, side = (len(phi_i), len(theta_i)), 4
    numbers = lambda *shape: random.uniform(0.2, 1.0, shape).astype("<f4")
    fields = {"description": np.frombuffer(b"Made up,\n no material", "u1"), "phi_i": phi_i, "theta_i": theta_i}
    fields |= {"sigma": numbers(3, 4), "ndf": numbers(5, 4), "vndf": numbers(*slices, 5, 6), "luminance": numbers(*slices, side, side)}
    name = "rgb" if channels == 3 else "spectra"
    fields[name] = random.uniform(-0.2, 1.0, (*slices, channels, side, side)).astype("<f4")
    if channels != 3:
        fields["wavelengths"] = np.float32([412.1 + 50.5 * channel for channel in range(channels)])
    return fields | {"jacobian": np.array([jacobian], "u1")}


def files():
    turn = np.pi
    return {
        "whole": made_up(np.linspace(-turn, turn, 5), [0.1, 0.5, 1.1, np.pi / 2], 2, 1),
        "half": made_up(np.linspace(-turn, 0, 4), [0.0, 0.7, 1.5], 3, 2),
        "quarter": made_up(np.linspace(-turn, -turn / 2, 3), [0.0, 0.6, 1.2], 2, 3, jacobian=0),
        "isotropic": made_up([-0.5, 0.5], [0.3, 1.0], 3, 4),
    }


def pairs(count, seed):
    """Pairs of directions up to 88 degrees from the normal, some of them at the axes and near the normal."""
    random = np.random.default_rng(seed)
    angles = random.uniform([0, -np.pi, 0, -np.pi], [1.536, np.pi, 1.536, np.pi], (count, 4))
    angles[: count // 8, 0] *= 0.05
    angles[count // 8 : count // 4, 1] = np.round(angles[count // 8 : count // 4, 1] / 0.5) * 0.5
    return angles


def check(path, table) -> float:
    rows = np.loadtxt(table, delimiter=",", skiprows=1)
    found = evaluate(read(path), direction(*rows.T[:2]), direction(*rows.T[2:4]))
    return float(np.max(np.abs(found - rows[:, 4:]) / np.maximum(np.abs(rows[:, 4:]), 1e-2)))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", nargs=2, metavar=("FILE", "CSV"))
    parser.add_argument("--mitsuba", nargs="+", metavar="FILE")
    options = parser.parse_args()
    if options.check:
        print(f"{check(*options.check):.2e} at most, relative to f or to 0.01/sr")
    for path in options.mitsuba or []:
        fields, angles = read(path), pairs(5000, 9)
        wi, wo = direction(*angles.T[:2]), direction(*angles.T[2:])
        seen = mitsuba(path, fields, wi, wo)
        expected = evaluate(fields, wi, wo)[:, : seen.shape[1]]
        difference = np.abs(seen - expected) / np.maximum(np.abs(expected), 1e-2)
        quantiles = ", ".join(f"{q:.1e}" for q in np.quantile(difference, [0.5, 0.99, 1]))
        print(f"{path}: median, 99 % and largest difference {quantiles}")
    if not options.check and not options.mitsuba:
        FOLDER.mkdir(exist_ok=True)
        for seed, (name, fields) in enumerate(files().items()):
            write(FOLDER / f"{name}.bsdf", fields)
            angles = pairs(160, seed)
            values = evaluate(fields, direction(*angles.T[:2]), direction(*angles.T[2:]))
            header = ",".join(["theta_i", "phi_i", "theta_o", "phi_o", *(f"f{channel}" for channel in range(values.shape[1]))])
            np.savetxt(FOLDER / f"{name}.csv", np.hstack([angles, values]), fmt="%.9g", delimiter=",", header=header, comments="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
