#!/usr/bin/env python3
"""Times NumPy that brdfit wrote for Cook-Torrance with GGX, Smith and Schlick beside NumPy as one writes it by hand.

How to run it (benches/suite does, with --baseline)
    brdfit models "cook-torrance(d=ggx, g=smith, f=schlick)" --code python-numpy > generated.py
    python scripts/baseline_numpy_ggx.py generated.py

It prints JSON: the medians of seven turns on a million pairs of directions, and the median of their ratios. Both must agree to 1e-9.
"""

import importlib.util
import json
import sys
import time

import numpy as np

PAIRS, TURNS = 1_000_000, 7
M, F0 = 0.2, 0.05


def by_hand(wi, wo):
    h = wi + wo
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    cos_i, cos_o, cos_h = wi[:, 2], wo[:, 2], h[:, 2]
    cos_d = np.sum(wi * h, axis=1)
    m2 = M * M
    d = m2 / (np.pi * (cos_h * cos_h * (m2 - 1.0) + 1.0) ** 2)
    smith = 0.5 / (cos_o * np.sqrt(m2 + (1.0 - m2) * cos_i**2) + cos_i * np.sqrt(m2 + (1.0 - m2) * cos_o**2))
    fresnel = F0 + (1.0 - F0) * (1.0 - cos_d) ** 5
    return d * smith * fresnel


def directions(rng):
    cos = rng.uniform(0.05, 1.0, PAIRS)
    phi = rng.uniform(0.0, 2.0 * np.pi, PAIRS)
    sin = np.sqrt(1.0 - cos * cos)
    return np.stack([sin * np.cos(phi), sin * np.sin(phi), cos], axis=1)


def main():
    spec = importlib.util.spec_from_file_location("generated", sys.argv[1])
    generated = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(generated)
    rng = np.random.default_rng(25)
    wi, wo = directions(rng), directions(rng)
    np.testing.assert_allclose(generated.f(wi, wo)[:, 0], by_hand(wi, wo), rtol=1e-9)
    turns = []
    for _ in range(TURNS):
        row = []
        for f in (by_hand, generated.f):
            start = time.perf_counter()
            f(wi, wo)
            row.append(time.perf_counter() - start)
        turns.append(row)
    hand, ours = np.array(turns).T
    found = {"by_hand_s": np.median(hand), "generated_s": np.median(ours), "ratio": np.median(ours / hand)}
    print(json.dumps({key: float(value) for key, value in found.items()}))


if __name__ == "__main__":
    main()
