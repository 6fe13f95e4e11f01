#!/usr/bin/env python3
"""Computes the constants of src/math/elementary.rs and the reference values of its tests.

    python scripts/elementary_coefficients.py

Each polynomial is the function's Chebyshev expansion, cut off at the degree, which is within a small factor of
the best polynomial of that degree; its coefficients are then rounded to doubles. "Truncation" is what
the polynomial misses of the function, relative to the final result and before any rounding (a double
resolves 1.1e-16). All in 50 digits; mpmath comes from scripts/requirements.txt.
"""

from mpmath import atan, cos, erfc, exp, linspace, log, log1p, mp, mpf, nstr, pi, sqrt

mp.dps = 50


def expand(function, low, high, degree):
    """Coefficients of the powers, constant first, of the Chebyshev expansion up to a degree."""
    # The expansion's coefficients are cosine sums over nodes; 30 more of them leave no visible aliasing.
    middle, half, count = (low + high) / 2, (high - low) / 2, degree + 30
    angles = [pi * (j + mpf(1) / 2) / count for j in range(count)]
    values = [function(middle + half * cos(angle)) for angle in angles]
    # Sum of Chebyshev polynomials by the recurrence T_(k+1) = 2 u T_k - T_(k-1), u = (x - middle)/half.
    u = [-middle / half, 1 / half]

    def times_u(p):
        return [a + b for a, b in zip([u[0] * c for c in p] + [0], [0] + [u[1] * c for c in p])]

    def add(p, q, factor):
        size = max(len(p), len(q))
        p, q = p + [0] * (size - len(p)), q + [0] * (size - len(q))
        return [a + factor * b for a, b in zip(p, q)]

    total, previous, current = [mpf(0)], [mpf(1)], u
    for k in range(degree + 1):
        weight = mpf(2 if k else 1) / count * sum(v * cos(k * a) for v, a in zip(values, angles))
        total = add(total, previous, weight)
        previous, current = current, add([2 * c for c in times_u(current)], previous, -1)
    return total


def show(name, function, low, high, degree, share):
    """Prints the coefficients; `share(x)` is the factor from the polynomial's relative error to the result's."""
    low, high = mpf(low), mpf(high)
    coefficients = [float(c) for c in expand(function, low, high, degree)]
    worst = 0
    for x in linspace(low + (high - low) / 10**9, high - (high - low) / 10**9, 501):
        value = function(x)
        found = sum(mpf(c) * x**i for i, c in enumerate(coefficients))
        worst = max(worst, abs((found / value - 1) * share(x)))
    print(f"{name}, degree {degree}: truncation {nstr(worst, 2)}")
    for c in coefficients:
        print(f"    {c!r},")


def erfcx(x):
    """exp(x^2) erfc(x), beyond 12 by its continued fraction."""
    if x < 12:
        return exp(x * x) * erfc(x)
    tail = mpf(0)
    for n in range(400, 0, -1):
        tail = (mpf(n) / 2) / (x + tail)
    return 1 / (sqrt(pi) * (x + tail))


def exp_rest(r):
    """(e^r - 1 - r)/r^2"""
    if abs(r) < mpf(10) ** -6:
        return mpf(1) / 2 + r / 6 + r * r / 24 + r**3 / 120
    return (exp(r) - 1 - r) / (r * r)


def ln_rest(z):
    """(ln((1 + s)/(1 - s))/s - 2)/z with z = s^2"""
    s = sqrt(z)
    return (log((1 + s) / (1 - s)) / s - 2) / z


def atan_rest(z):
    """(atan(q)/q - 1)/z with z = q^2"""
    q = sqrt(z)
    return (atan(q) / q - 1) / z


MIDDLE = mpf(15) / 4


def erfcx_rest(t):
    """((1 + 2 x) erfcx(x) - 1)/w with w = x/(x + MIDDLE) = (1 + t)/2"""
    w = (1 + t) / 2
    x = MIDDLE * w / (1 - w)
    return ((1 + 2 * x) * erfcx(x) - 1) / w


def inverse_cube_root_start():
    """The constant c that minimises the largest |1 - y t^3| where t has the bits c - (bits of y)/3.

    With y = 2^e (1 + f) the "logarithm" e + f of a double's bits is linear in the bits. The start is
    log2*(t) = c' - log2*(y)/3 in such logarithms; by symmetry e = 0, 1, 2 suffice.
    """

    def worst(c):
        found = []
        for e in range(3):
            for i in range(401):
                f = i / 400
                a = c - (e + f) / 3
                whole = int(a // 1)
                t = 2.0**whole * (1 + (a - whole))
                found.append(abs(1 - 2.0**e * (1 + f) * t**3))
        return max(found)

    low, high = -0.2, 0.1
    for _ in range(8):
        step = (high - low) / 40
        best = min((low + step * i for i in range(41)), key=worst)
        low, high = best - step, best + step
    # Exponents are biased by 1023: c - 1023 = c' - (.. - 1023)/3.
    bits = int((mpf(best) + 1023 + mpf(1023) / 3) * 2**52)
    print(f"inverse cube root, start: {bits:#x}, |h| <= {worst(best):.4f}")


def reference(name, function, arguments):
    """Values of the function at exactly representable arguments."""
    print(name)
    for x in arguments:
        print(f"    ({x!r}, {float(function(mpf(x)))!r}),")


def main():
    half_ln2 = log(2) / 2
    show("exp", exp_rest, -half_ln2 * 1.0001, half_ln2 * 1.0001, 9, lambda r: exp_rest(r) * r * r / exp(r))
    root = (sqrt(2) - 1) / (sqrt(2) + 1)
    show("ln", ln_rest, 0, root**2 * 1.0001, 6, lambda z: ln_rest(z) * z / (2 + ln_rest(z) * z))
    show("atan", atan_rest, 0, mpf(1) / 4, 12, lambda z: atan_rest(z) * z / (1 + atan_rest(z) * z))
    show("erfcx", erfcx_rest, -1, 1, 21, lambda t: 1 - 1 / (1 + (1 + t) / 2 * erfcx_rest(t)))
    inverse_cube_root_start()
    hard = [1e-300, 1e-9, 0.1, 0.25, 0.5, 0.84375, 1.0, 1.25, 1.75, 2.5, 3.5, 3.75, 4.5, 6.0]
    reference("erfc", erfc, [-7.0, -3.0, -1.0, -0.3, *hard, 8.0, 10.0, 13.0, 17.5, 22.0, 26.0])
    reference("erfcx", erfcx, [0.0, *hard, 10.0, 28.0, 100.0, 1e6, 1e18, 1e300])
    reference("exp", exp, [-700.0, -87.5, -10.25, -1.0, -0.35, -1e-9, 0.34, 1.5, 20.0, 300.5, 709.75])
    reference("ln", log, [1e-300, 1e-5, 0.4, 0.70703125, 0.99, 0.9999999, 1.0000001, 1.01, 1.4140625, 3.0, 1e300])
    reference("ln_1p", log1p, [-0.9999999, -0.75, -0.3, -1e-5, -1e-18, 1e-300, 1e-12, 0.01, 0.42, 1e17])
    reference("inverse_cbrt", lambda y: y ** (mpf(-1) / 3), [1e-300, 1e-60, 0.001, 0.3, 1.0, 2.0, 7.9, 12345.0, 1e300])


if __name__ == "__main__":
    main()
