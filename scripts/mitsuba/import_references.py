#!/usr/bin/env python3
"""What Mitsuba 3 makes of the scenes in tests/import/scenes: the means of tiles of 8x8 pixels with their standard errors,
into NAME.json beside each NAME.xml. The tests compare with these.

    python scripts/mitsuba/import_references.py [--spp 8192] [--batches 16] [--pictures] [--grids] [NAME …]

`--pictures` makes the picture and the sky that the scenes refer to again, `--grids` the grids.
"""

import argparse
import json
import os

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
FOLDER = os.path.join(ROOT, "tests/import/scenes")
TILE = 8


def tiles(image):
    """Means of tiles: rows, columns, channels."""
    height, width, _ = image.shape
    return image.reshape(height // TILE, TILE, width // TILE, TILE, 3).mean((1, 3))


def reference(path, spp, batches):
    scene = mi.load_file(path)
    runs = [np.array(mi.render(scene, spp=spp // batches, seed=seed))[..., :3].astype(float) for seed in range(batches)]
    means = np.array([tiles(run) for run in runs])
    error = means.std(axis=0, ddof=1) / np.sqrt(batches)
    whole = np.array([run.mean() for run in runs])
    return {
        "made_by": f"Mitsuba {mi.__version__}, {spp} samples a pixel in {batches} batches",
        "batches": batches,
        "image": [float(whole.mean()), float(whole.std(ddof=1) / np.sqrt(batches))],
        "mean": np.round(means.mean(axis=0), 7).tolist(),
        "error": np.round(error, 8).tolist(),
    }


def pictures():
    """A small picture of smooth colours, and a sky with a sun."""
    y, x = np.mgrid[0:16, 0:24] / np.array([16.0, 24.0]).reshape(2, 1, 1)
    picture = np.stack([0.2 + 0.6 * x, 0.2 + 0.5 * y, 0.7 - 0.4 * x * y], axis=-1).astype(np.float32)
    # As bytes they stand for themselves: sRGB for one scene, raw for another.
    mi.Bitmap(np.round(picture * 255).astype(np.uint8)).write(os.path.join(FOLDER, "picture.png"))
    v, u = np.mgrid[0:64, 0:128] / np.array([63.0, 128.0]).reshape(2, 1, 1)
    sun = 20 * np.exp(-((u - 0.3) ** 2 + (v - 0.3) ** 2) / 0.004)
    sky = np.stack([0.3 + sun + 0.2 * np.sin(6.28 * u) ** 2, 0.4 + sun + 0.1 * v, 1.0 - 0.7 * v + 0.8 * sun], axis=-1)
    mi.Bitmap(sky.astype(np.float32)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float16, False).write(
        os.path.join(FOLDER, "sky.exr"))


def grids():
    """Small grids of noise: a density with holes between -1 and 1, extinction and albedo in colours, and a share."""
    random = np.random.default_rng(7)

    def write(name, values, corners):
        z, y, x, channels = values.shape
        header = b"VOL\x03" + np.array([1, x, y, z, channels], "<i4").tobytes() + np.array(corners, "<f4").tobytes()
        with open(os.path.join(FOLDER, name), "wb") as file:
            file.write(header + values.astype("<f4").tobytes())

    unit = [0, 0, 0, 1, 1, 1]
    density = random.random((4, 5, 6, 1))
    write("density.vol", np.where(density < 0.3, 0, density * density), [-1, -1, -1, 1, 1, 1])
    write("extinction.vol", random.random((4, 3, 5, 3)) ** 2 * [0.5, 1.0, 1.5], unit)
    write("albedo.vol", 0.3 + 0.7 * random.random((3, 4, 2, 3)), unit)
    write("share.vol", random.random((2, 3, 3, 1)), unit)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("names", nargs="*")
    parser.add_argument("--spp", type=int, default=8192)
    parser.add_argument("--batches", type=int, default=16)
    parser.add_argument("--pictures", action="store_true")
    parser.add_argument("--grids", action="store_true")
    args = parser.parse_args()
    if args.pictures:
        pictures()
    if args.grids:
        grids()
    names = args.names or sorted(f[:-4] for f in os.listdir(FOLDER) if f.endswith(".xml"))
    for name in names:
        result = reference(os.path.join(FOLDER, name + ".xml"), args.spp, args.batches)
        with open(os.path.join(FOLDER, name + ".json"), "w", encoding="utf-8") as file:
            json.dump(result, file)
        print(f"{name}: {result['image'][0]:.5f} ± {result['image'][1]:.5f}")


if __name__ == "__main__":
    main()
