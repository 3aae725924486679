#!/usr/bin/env python3
"""The phase function of fog, by Mie's theory: droplets of 18 micrometres, a tenth more or less, averaged over the wavelengths
of daylight. Writes it into scene.toml between its marks, as few pairs [cosine of the deflection, value] as are within 2%:

    python scenes/fogbow/make_phase.py

The coefficients are those of Bohren & Huffman (1983), chapter 4: a_n and b_n with the logarithmic derivative D_n by downward
recurrence, and S1, S2 as sums with π_n and τ_n. One function for all colours: our phase functions have none, and a fogbow
is nearly white, for the droplets are so small that the bows of the colours overlap.
"""

import os

import numpy as np

DIAMETER, SPREAD = 18.0, 0.1
WAVELENGTHS = np.linspace(0.42, 0.68, 14)
HERE = os.path.dirname(os.path.abspath(__file__))
BEGIN, END = "# Made by make_phase.py: from here\n", "# to here.\n"


def refraction(wavelength):
    """Water's index, within 0.001 in the visible."""
    return 1.324 + 0.00305 / wavelength ** 2


def intensity(x, m, mu):
    """|S1|² + |S2|² of a ball of the size parameter x and index m, at the cosines mu; and x² Q_sca."""
    last = int(x + 4.05 * x ** (1 / 3) + 2)
    start = int(max(last, abs(m * x)) + 16)
    derivative = np.zeros(start + 1)
    for n in range(start, 0, -1):
        derivative[n - 1] = n / (m * x) - 1 / (derivative[n] + n / (m * x))
    psi_before, psi = np.cos(x), np.sin(x)
    chi_before, chi = -np.sin(x), np.cos(x)
    pi_before, pi = np.zeros_like(mu), np.ones_like(mu)
    s1, s2 = np.zeros_like(mu, complex), np.zeros_like(mu, complex)
    scattered = 0.0
    for n in range(1, last + 1):
        psi_before, psi = psi, (2 * n - 1) * psi / x - psi_before
        chi_before, chi = chi, (2 * n - 1) * chi / x - chi_before
        xi, xi_before = psi - 1j * chi, psi_before - 1j * chi_before
        a = derivative[n] / m + n / x
        b = derivative[n] * m + n / x
        a = (a * psi - psi_before) / (a * xi - xi_before)
        b = (b * psi - psi_before) / (b * xi - xi_before)
        tau = n * mu * pi - (n + 1) * pi_before
        share = (2 * n + 1) / (n * (n + 1))
        s1 += share * (a * pi + b * tau)
        s2 += share * (a * tau + b * pi)
        scattered += 2 * (2 * n + 1) * (abs(a) ** 2 + abs(b) ** 2)
        pi_before, pi = pi, ((2 * n + 1) * mu * pi - (n + 1) * pi_before) / n
    return abs(s1) ** 2 + abs(s2) ** 2, scattered


def phase(mu):
    """Of the mixture of sizes and wavelengths, per solid angle."""
    total, weights = np.zeros_like(mu), 0.0
    for wavelength in WAVELENGTHS:
        for off in np.linspace(-2.5, 2.5, 31):
            # By how many droplets there are; what each scatters is in the sum.
            count = np.exp(-0.5 * off ** 2)
            x = np.pi * DIAMETER * (1 + SPREAD * off) / wavelength
            value, scattered = intensity(x, refraction(wavelength), mu)
            total += count * wavelength ** 2 * value / (2 * np.pi)
            weights += count * wavelength ** 2 * scattered
    return total / weights


def simplified(x, y, tolerance):
    """Indices of a broken line that is nowhere off by more than a share of y."""
    kept, stack = {0, len(x) - 1}, [(0, len(x) - 1)]
    while stack:
        i, j = stack.pop()
        if j - i < 2:
            continue
        line = y[i] + (y[j] - y[i]) * (x[i + 1:j] - x[i]) / (x[j] - x[i])
        off = np.abs(line / y[i + 1:j] - 1)
        if off.max() > tolerance:
            k = i + 1 + int(off.argmax())
            kept.add(k)
            stack += [(i, k), (k, j)]
    return sorted(kept)


def main():
    # Fine about the peaks at both ends.
    theta = np.concatenate([np.linspace(0, 4, 400), np.linspace(4, 176, 4000)[1:], np.linspace(176, 180, 400)[1:]])
    mu = np.cos(np.radians(theta))[::-1].copy()
    mu[0], mu[-1] = -1, 1
    value = phase(mu)
    whole = 2 * np.pi * np.trapezoid(value, mu)
    indices = simplified(mu, value, 0.02)
    print(f"integral {whole:.5f}, mean cosine {2 * np.pi * np.trapezoid(value * mu, mu):.4f}, {len(indices)} pairs")
    pairs = [f"[{mu[i]:.8g}, {value[i]:.4g}]" for i in indices]
    rows = [", ".join(pairs[i:i + 5]) for i in range(0, len(pairs), 5)]
    table = "phase = { table = [\n    " + ",\n    ".join(rows) + ",\n] }\n"
    path = os.path.join(HERE, "scene.toml")
    with open(path, encoding="utf-8") as file:
        text = file.read()
    before, after = text[:text.index(BEGIN) + len(BEGIN)], text[text.index(END):]
    with open(path, "w", encoding="utf-8") as file:
        file.write(before + table + after)


if __name__ == "__main__":
    main()
