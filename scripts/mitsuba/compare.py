#!/usr/bin/env python3
"""Compares means of our renders with Mitsuba's (rung 5 of the verification):

    python scripts/mitsuba/compare.py [--quick] [SCENE.toml ...]

Every scene is rendered in several independent runs by our pt and bpt and by Mitsuba's `path` (`volpath` where there are
media), to the same path length.
The means of 8x8 tiles and of the whole image are compared by Welch's t-tests over the runs, channel by channel. All
tests together raise a false alarm with the probability --level, half of it for the images and half for the tiles,
shared out by Šidák. "Detects" is the relative bias that would be found nine times in ten. Without scenes, those of
scripts/mitsuba/scenes are taken, and the references in ../shared/cases/mitsuba are compared too where they are there.
Ends with exit code 1 where a difference is significant. Program: $TYNDALL, or the newest in target/.
"""

import argparse
import os
import sys
import time
from dataclasses import dataclass

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")

from convert import load
from renders import ROOT, binary, ours, theirs
from tables import Refused
from welch import Welch, moments, sidak

HERE = os.path.dirname(os.path.abspath(__file__))
# With the share of samples that each needs for the same precision.
SCENES = {"metals": 2.0, "glass": 1.0, "beckmann": 1.0, "lights": 4.0, "lens": 0.5, "sky": 1.0,
          "haze": 1.0, "milk": 1.0, "coloured": 1.0, "grids": 1.0, "fibres": 1.0,
          "nested": 1.0}
# Left out with --quick.
LONG = {"nested"}
CASE_FOLDER = os.path.join(ROOT, "..", "shared", "cases", "mitsuba")
# What ../shared has references of, each beside our scene of the same name, with the longest paths.
CASES = {"surface_box": 128, "fog_box": 128, "index_matched_ball": 128}
ESTIMATORS = ["pt", "bpt"]
TILE = 8
# Means may differ by this, relatively, through rounding: Mitsuba sums up thousands of samples in single precision, which
# shows (at 1e-5) where a tile sees nothing but a lamp and has no variance.
ROUNDING = 1e-4
# The case's standard errors come from at least eight batches.
CASE_FREEDOM = 7


@dataclass
class Comparison:
    """Of one estimator with Mitsuba in one scene."""

    scene: str
    estimator: str
    image: Welch
    tiles: Welch


def tile_means(image):
    """(rows of tiles, columns of tiles, 3)."""
    h, w, _ = image.shape
    if h % TILE or w % TILE:
        raise Refused(f"an image of {w}x{h}: a whole number of tiles of {TILE}x{TILE} is needed (--size)")
    return image.reshape(h // TILE, TILE, w // TILE, TILE, 3).mean(axis=(1, 3))


def samples(spp, share):
    return max(round(spp * share), 1)


def our_runs(program, path, estimator, length, settings, size, share=1.0):
    options = ["--size", f"{size[0]}x{size[1]}"] if size else []
    runs = range(1, settings.runs + 1)
    return np.array([tile_means(ours(program, path, estimator, length, samples(settings.spp, share), seed, *options).image)
                     for seed in runs])


def with_mitsuba(program, path, settings, share):
    """Our runs against runs of Mitsuba, of a `share` of the samples."""
    scene, length = load(path, settings.size, settings.max_length)
    spp = samples(settings.mitsuba_spp, share)
    reference = np.array([tile_means(theirs(scene, spp, seed)) for seed in range(1, settings.runs + 1)])
    name = os.path.basename(path).removesuffix(".toml")
    if name == "scene":
        name = os.path.basename(os.path.dirname(os.path.abspath(path)))
    for estimator in ESTIMATORS:
        runs = our_runs(program, path, estimator, length, settings, settings.size, share)
        image = Welch.of_runs(runs.mean(axis=(1, 2)), reference.mean(axis=(1, 2)))
        yield Comparison(name, estimator, image, Welch.of_runs(runs, reference))


def with_case(program, name, settings):
    """Our runs against the stored means and standard errors of each pixel."""
    case, length = np.load(os.path.join(settings.cases, f"{name}.npz")), CASES[name]
    path = os.path.join(HERE, "scenes", f"{name}.toml")
    mean, variance = case["mean"].astype(float), case["se"].astype(float) ** 2
    # Pixels are independent; their freedom adds up as Satterthwaite has it.
    pixels = mean.shape[0] * mean.shape[1]
    tile_freedom = CASE_FREEDOM * TILE ** 2 * tile_means(variance) ** 2 / np.maximum(tile_means(variance ** 2), 1e-300)
    image_freedom = CASE_FREEDOM * pixels * variance.mean(axis=(0, 1)) ** 2 / (variance ** 2).mean(axis=(0, 1))
    of_tiles = tile_means(mean), np.sqrt(tile_means(variance)) / TILE, np.maximum(tile_freedom, CASE_FREEDOM)
    of_image = mean.mean(axis=(0, 1)), np.sqrt(variance.mean(axis=(0, 1)) / pixels), image_freedom
    for estimator in ESTIMATORS:
        runs = our_runs(program, path, estimator, length, settings, None)
        image = Welch(*moments(runs.mean(axis=(1, 2))), *of_image)
        yield Comparison(f"{name}.npz", estimator, image, Welch(*moments(runs), *of_tiles))


def verdicts(comparisons, level):
    """Prints the table; True where nothing is significant."""
    image_level = sidak(level / 2, sum(c.image.difference.size for c in comparisons))
    tile_level = sidak(level / 2, sum(c.tiles.difference.size for c in comparisons))
    print(f"significant: p < {image_level:.1e} for a channel of an image, p < {tile_level:.1e} for one of a tile")
    print(f"{'':30}{'image mean, worst channel':^38}{'tiles, worst of all':^42}")
    print(f"{'scene':24}{'ours':6}{'difference':>12}{'p':>10}{'detects':>10}      "
          f"{'difference':>12}{'p':>10}{'detects (median)':>20}")
    good = True
    for c in comparisons:
        cells = []
        for test, of_test in ((c.image, image_level), (c.tiles, tile_level)):
            p, bias = test.p_values(ROUNDING), test.detectable(of_test)
            worst = np.unravel_index(np.argmin(p), p.shape)
            scale = test.scale[worst]
            difference = 100 * test.difference[worst] / scale if scale > 0 else 0.0
            cells.append((difference, p[worst], 100 * bias.max(), 100 * np.median(bias), worst, p[worst] < of_test))
        (d, p, seen, _, channel, bad), (td, tp, _, tile_seen, tile, tile_bad) = cells
        print(f"{c.scene:24}{c.estimator:6}{d:+11.3f}%{p:10.2g}{seen:9.2f}%      "
              f"{td:+11.3f}%{tp:10.2g}{tile_seen:19.2f}%")
        if bad:
            print(f"    DIFFERS in the mean of channel {'RGB'[channel[0]]}")
        if tile_bad:
            print(f"    DIFFERS in channel {'RGB'[tile[2]]} of the tile in row {tile[0]}, column {tile[1]}; in "
                  f"{int((c.tiles.p_values(ROUNDING) < tile_level).sum())} of {c.tiles.difference.size} in all")
        good &= not (bad or tile_bad)
    return good


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("scenes", nargs="*", metavar="SCENE.toml")
    parser.add_argument("--quick", action="store_true", help="fewer samples, for CI")
    parser.add_argument("--runs", type=int, default=16, help="independent runs of each program")
    parser.add_argument("--spp", type=int, help="samples per pixel of one of our runs")
    parser.add_argument("--mitsuba-spp", type=int, help="samples per pixel of one run of Mitsuba")
    parser.add_argument("--max-length", type=int, help="longest paths, in segments; default: the scene's")
    parser.add_argument("--size", type=lambda text: tuple(int(n) for n in text.split("x")), metavar="WxH")
    parser.add_argument("--cases", default=CASE_FOLDER, help="where the references of ../shared are")
    parser.add_argument("--level", type=float, default=1e-3, help="probability of a false alarm")
    settings = parser.parse_args()
    settings.spp = settings.spp or (192 if settings.quick else 2048)
    settings.mitsuba_spp = settings.mitsuba_spp or settings.spp
    return settings


def main():
    settings, program, start = arguments(), binary(), time.monotonic()
    own = not settings.scenes
    scenes = [(path, 1.0) for path in settings.scenes]
    if own:
        scenes = [(os.path.join(HERE, "scenes", f"{name}.toml"), share) for name, share in SCENES.items()
                  if not (settings.quick and name in LONG)]
    comparisons = []
    try:
        for path, share in scenes:
            comparisons += with_mitsuba(program, path, settings, share)
        for name in CASES if own else []:
            if os.path.exists(os.path.join(settings.cases, f"{name}.npz")):
                comparisons += with_case(program, name, settings)
            else:
                print(f"{name}.npz: skipped, it is not in {settings.cases}")
    except (Refused, OSError) as error:
        sys.exit(f"error: {error}")
    print(f"{settings.runs} runs of {settings.spp} samples per pixel, Mitsuba {mi.__version__} {settings.mitsuba_spp}"
          f"{' (times a share for each of these scenes)' if own else ''}; "
          f"{time.monotonic() - start:.0f} s")
    good = verdicts(comparisons, settings.level)
    print("no significant difference" if good else "significant differences: ours and Mitsuba's disagree")
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
