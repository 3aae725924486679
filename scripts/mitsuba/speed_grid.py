#!/usr/bin/env python3
"""What a grid costs pt by delta tracking and exactly, beside Mitsuba's `volpath` (`scalar_rgb`):

    python scripts/mitsuba/speed_grid.py [--sigma 8 32] [--size 128x128] [--spp 65] [--runs 4] [--max-length 10] [--program FILE]

Smoke with empty space about it, of a density from 0 to 1 on 256³ trilinear values in the unit box, over a floor and under a lamp;
σ_t is `--sigma` times the density, 1/m, and the albedo 0.9. One thread each, same size, samples and lengths, in turns. Times are user
CPU seconds of `spp` samples a pixel less those of one, so that loading is out of them. Error is the variance of a pixel over the rounds. `--program`
names another of our binaries for a row more, such as one of before a change.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile

import mitsuba as mi
import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
TARGET = os.path.join(os.path.dirname(os.path.dirname(HERE)), "target")
GRID = os.path.join(TARGET, "speed_grid.vol")
SCENE = """
[film]
width = 128
height = 128
[camera]
origin = [0, 0.2, 2.3]
target = [0, 0, 0]
fov = 30
[medium.smoke]
sigma_t = SIGMA
albedo = 0.9
phase = { hg = 0.5 }
density = { grid = { file = "speed_grid.vol" } }
[material.white]
diffuse = { reflectance = 0.6 }
[material.nothing]
null = {}
[[shape]]
rectangle = { corner = [-2, -0.6, 2], u = [4, 0, 0], v = [0, 0, -4] }
material = "white"
[[shape]]
rectangle = { corner = [-0.8, 1.2, -0.5], u = [0.75, 0, 0], v = [0, 0, 0.75] }
emission = [17, 15, 12]
[[shape]]
box = { min = [-0.5, -0.5, -0.5], max = [0.5, 0.5, 0.5] }
material = "nothing"
interior = "smoke"
"""


def make_grid():
    """The billows of speed.py in half the size, 1 at the densest."""
    import speed
    speed.SMOKE = GRID
    density = speed.make_smoke()
    density /= density.max()
    header = b"VOL\x03" + np.array([1, *density.shape, 1], "<i4").tobytes()
    with open(GRID, "wb") as file:
        file.write(header + np.array([-0.5] * 3 + [0.5] * 3, "<f4").tobytes() + density.tobytes())
    print(f"made {GRID}: mean density {density.mean():.3f}, empty {(density == 0).mean():.2f}")


def scene_of(sigma):
    path = os.path.join(TARGET, f"speed_grid_{sigma}.toml")
    with open(path, "w") as file:
        file.write(SCENE.replace("SIGMA", str(sigma)))
    return path


def user(who):
    return resource.getrusage(who).ru_utime


class Ours:
    def __init__(self, label, program, options, scene, settings):
        self.label, self.program, self.options, self.scene, self.settings = label, program, options, scene, settings

    def render(self, spp, seed):
        from renders import ours
        size = "x".join(map(str, self.settings.size))
        before = user(resource.RUSAGE_CHILDREN)
        run = ours(self.program, self.scene, "pt", self.settings.max_length, spp, seed, "--threads", 1, "--size", size,
                   *self.options)
        return run.image, user(resource.RUSAGE_CHILDREN) - before


class Mitsuba:
    """In a process of its own that waits for orders: its pool of threads does not bear that others are started beside it."""

    def __init__(self, rr_depth, scene, settings):
        self.label = f"Mitsuba volpath, rr_depth {rr_depth}"
        order = json.dumps([scene, settings.size, settings.max_length, rr_depth])
        self.process = subprocess.Popen([sys.executable, __file__, "--serve", order], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, text=True)

    def render(self, spp, seed):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "theirs.npy")
            print(json.dumps([spp, seed, path]), file=self.process.stdin, flush=True)
            seconds = json.loads(self.process.stdout.readline())
            return np.load(path), seconds

    def close(self):
        self.process.stdin.close()
        self.process.wait()


def serve(scene, size, max_length, rr_depth):
    """Renders on request, one line each, until the input ends."""
    mi.set_variant("scalar_rgb")
    import drjit as dr
    from convert import load
    dr.set_thread_count(1)
    loaded, _ = load(scene, tuple(size), max_length, rr_depth)
    for line in sys.stdin:
        spp, seed, path = json.loads(line)
        before = user(resource.RUSAGE_SELF)
        image = np.array(mi.render(loaded, spp=spp, seed=seed))
        spent = user(resource.RUSAGE_SELF) - before
        np.save(path, image)
        print(spent, flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--sigma", type=float, nargs="+", default=[8, 32])
    parser.add_argument("--size", type=lambda text: [int(n) for n in text.split("x")], default=[128, 128])
    parser.add_argument("--spp", type=int, default=65)
    parser.add_argument("--runs", type=int, default=4)
    parser.add_argument("--max-length", type=int, default=10)
    parser.add_argument("--program")
    settings = parser.parse_args()
    mi.set_variant("scalar_rgb")
    from renders import binary
    if not os.path.exists(GRID):
        make_grid()
    paths = settings.size[0] * settings.size[1] * (settings.spp - 1)
    for sigma in settings.sigma:
        scene = scene_of(sigma)
        entries = [Ours(f"tyndall, {t}", binary(), ["--tracking", t], scene, settings) for t in ("delta", "exact")]
        if settings.program:
            entries.append(Ours("tyndall, the other", settings.program, [], scene, settings))
        entries += [Mitsuba(rr_depth, scene, settings) for rr_depth in (5, 1)]
        times, images = {e.label: [] for e in entries}, {e.label: [] for e in entries}
        for seed in range(1, settings.runs + 1):
            for entry in entries:
                few = entry.render(1, seed + 1000)[1]
                image, whole = entry.render(settings.spp, seed)
                times[entry.label].append(whole - few)
                images[entry.label].append(image)
        for entry in entries[-2:]:
            entry.close()
        print(f"\nσ_t = {sigma} x density, {settings.size[0]}x{settings.size[1]}, {settings.spp} - 1 samples, paths of at most "
              f"{settings.max_length} segments, medians of {settings.runs}; Mitsuba {mi.__version__}")
        print(f"{'':28}{'user s':>8}{'± half spread':>15}{'kpaths/s':>10}{'x Mitsuba':>11}{'mean':>9}{'variance':>11}"
              f"{'var x time / exact':>20}")
        base = np.median(times[entries[-2].label])
        of = {label: np.var(images[label], axis=0, ddof=1).mean() for label in times}
        exact = np.median(times["tyndall, exact"]) * of["tyndall, exact"]
        for label, seconds in times.items():
            median = np.median(seconds)
            print(f"{label:28}{median:8.2f}{np.ptp(seconds) / 2:15.2f}{paths / median / 1e3:10.1f}{base / median:11.2f}"
                  f"{np.mean(images[label]):9.5f}{of[label]:11.3e}{of[label] * median / exact:20.2f}", flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--serve"]:
        serve(*json.loads(sys.argv[2]))
    else:
        main()
