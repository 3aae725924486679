#!/usr/bin/env python3
"""Compares our FLIP with the official implementation on random and structured images.

Needs a Python with `pip install flip-evaluator OpenEXR numpy`, and a built `tyndall`:

    python scripts/check_flip.py [PATH/TO/tyndall]

Ends with exit code 1 where a mean differs by more than 1e-3. Also prints the values that the unit test of
src/experiment/metrics/flip/mod.rs expects.
"""

import json
import os
import subprocess
import sys
import tempfile

import flip_evaluator
import numpy as np
import OpenEXR

TOLERANCE = 1e-3


def srgb(linear):
    linear = np.clip(linear, 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def unit_test_images(scale):
    y, x, c = np.meshgrid(np.arange(40), np.arange(48), np.arange(3), indexing="ij")
    wave = 0.5 + 0.45 * np.sin(0.3 * x + c) * np.cos(0.2 * y)
    disc = (x - 30.0) ** 2 + (y - 12.0) ** 2 < 36
    reference = wave * scale * np.where(disc, 8, 1)
    noise = 0.8 + 0.4 * ((x * 73 + y * 179 + c * 283) % 101) / 101
    return reference * noise, reference


def cases():
    yield "unit test, hdr", *unit_test_images(1.0)
    yield "unit test, ldr", *unit_test_images(0.7)
    rng = np.random.default_rng(7)
    for size in [(16, 16), (61, 83), (200, 150)]:
        reference = rng.exponential(size=(*size, 3))
        yield f"exponential noise {size}", rng.exponential(size=(*size, 3)), reference
        yield f"10% brighter {size}", 1.1 * reference, reference
    y, x = np.mgrid[0:128, 0:160]
    ramp = np.repeat((2.0 ** (x / 16 - 6))[..., None], 3, axis=2)
    yield "ramp of 10 stops, noisy", ramp * rng.gamma(4, 0.25, ramp.shape), ramp
    checks = np.where(((x // 8 + y // 8) % 2 == 0)[..., None], [1.0, 0.2, 0.1], [0.05, 0.3, 0.9])
    yield "coloured checks, shifted by a pixel", np.roll(checks, 1, axis=1), checks
    fireflies = checks.copy()
    fireflies[rng.random(x.shape) < 0.01] = 50.0
    yield "fireflies", fireflies, checks
    yield "pure green for pure blue", np.tile([0.0, 1.0, 0.0], (32, 32, 1)), np.tile([0.0, 0.0, 1.0], (32, 32, 1))


def write_exr(path, pixels):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {"RGB": np.ascontiguousarray(pixels, np.float32)}) as file:
        file.write(path)


def ours(binary, directory, test, reference):
    paths = [os.path.join(directory, name) for name in ("test.exr", "reference.exr")]
    for path, pixels in zip(paths, (test, reference)):
        write_exr(path, pixels)
    out = subprocess.run([binary, "compare", *paths, "--json"], check=True, capture_output=True, text=True)
    metrics = json.loads(out.stdout)["metrics"]
    return metrics["flip"], metrics["ldr-flip"]


def official(test, reference):
    def mean(r, t, dynamic_range):
        r, t = (np.ascontiguousarray(v, np.float32) for v in (r, t))
        return flip_evaluator.evaluate(r, t, dynamic_range, applyMagma=False)[1:]

    hdr, parameters = mean(reference, test, "HDR")
    ldr, _ = mean(srgb(reference), srgb(test), "LDR")
    return hdr, ldr, parameters


def main():
    binary = sys.argv[1] if len(sys.argv) > 1 else "target/release/tyndall"
    worst = 0.0
    with tempfile.TemporaryDirectory() as directory:
        for name, test, reference in cases():
            hdr, ldr, parameters = official(test, reference)
            our_hdr, our_ldr = ours(binary, directory, test, reference)
            worst = max(worst, abs(hdr - our_hdr), abs(ldr - our_ldr))
            exposures = parameters["startExposure"], parameters["stopExposure"], parameters["numExposures"]
            print(f"{name:40} HDR {hdr:.6f} ours {our_hdr:.6f}   LDR {ldr:.6f} ours {our_ldr:.6f}  {exposures}")
    print(f"largest difference {worst:.1e}")
    sys.exit(worst > TOLERANCE)


if __name__ == "__main__":
    main()
