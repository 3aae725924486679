#!/usr/bin/env python3
"""Speed of a whole render, ours against Mitsuba's: `path` on a Cornell box with a glass and a rough metal ball (speed), and
`volpath` on the same box full of fog (speed_fog), with a glass ball of milk (speed_milk), and on smoke on a grid of 256³ values
(speed_smoke; the grid, of 64 MB, is made in target/):

    python scripts/mitsuba/speed.py [--scenes speed speed_fog speed_milk speed_smoke] [--size 256x256] [--spp 32]
        [--runs 5] [--max-length 10]

Same scene, size, samples per pixel and path length, two threads each. Paths are camera paths; a CPU second is one of
user or system time of all threads. Mitsuba is measured about `mi.render` alone, after a first render that compiles
kernels; of our process the start and the writing of the file are taken off, as the difference from a run of one sample per
pixel. Every round runs each program once, and medians are printed. Error is the mean squared error over pixels and
channels, as the variance over the rounds: both programs have the same mean (compare.py). Russian roulette differs, hence the
two settings of Mitsuba's: its default from the fifth segment on, and ours is at work from the first bounce, with
the albedo as the probability of going on, as is nearly Mitsuba's with rr_depth = 1.

llvm_ad_rgb needs a libLLVM of at least version 16 (Debian: libllvm19; DRJIT_LIBLLVM_PATH names another than the
newest); without it that row is missing. Program: $TYNDALL, or the newest
in target/; compare figures only of `cargo build --release`.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time

import mitsuba as mi
import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
SCENES = ["speed", "speed_fog", "speed_milk", "speed_smoke"]
SMOKE = os.path.join(os.path.dirname(os.path.dirname(HERE)), "target", "speed_smoke.vol")
THREADS = 2


def path_of(scene):
    return os.path.join(HERE, "scenes", f"{scene}.toml")


def cpu_time():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def make_smoke(side=256):
    """A grid between -1 and 1: a column of billows, from four octaves of smooth noise. A fifth of its values are 0, and
    the largest is some ten times the mean."""
    random = np.random.default_rng(11)
    axis = (np.arange(side) + 0.5) / side

    def smooth(cells):
        values = random.random((cells + 1,) * 3)
        place = axis * cells
        low = np.minimum(place.astype(int), cells - 1)
        share = place - low
        share = share * share * (3 - 2 * share)
        for dimension in range(3):
            shape = [-1 if d == dimension else 1 for d in range(3)]
            weight = share.reshape(shape)
            values = values.take(low, dimension) * (1 - weight) + values.take(low + 1, dimension) * weight
        return values - 0.5

    noise = sum(smooth(4 * 2 ** octave) * 0.6 ** octave for octave in range(4))
    z, y, x = np.meshgrid(*[2 * axis - 1] * 3, indexing="ij")
    column = 1.3 - np.hypot(x, z) / (0.9 + 0.3 * y)
    density = np.clip(column + 0.9 * noise, 0, None).astype("<f4")
    header = b"VOL\x03" + np.array([1, side, side, side, 1], "<i4").tobytes()
    with open(SMOKE, "wb") as file:
        file.write(header + np.array([-1, -1, -1, 1, 1, 1], "<f4").tobytes() + density.tobytes())
    return density


class Mitsuba:
    """One variant and setting, in a process of its own that waits for orders: variants and thread pools do not mix."""

    def __init__(self, variant, rr_depth, settings):
        self.label = f"Mitsuba {variant}, rr_depth {rr_depth}"
        command = [sys.executable, __file__, "--serve", variant, str(rr_depth), json.dumps(vars(settings))]
        self.errors = tempfile.TemporaryFile(mode="w+")
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.errors,
                                        text=True)
        self.ready = self.process.stdout.readline().strip() == "ready"

    def complaint(self):
        """The first line of what it said before it ended."""
        self.process.wait()
        self.errors.seek(0)
        return self.errors.readline().strip()

    def render(self, seed, folder):
        path = os.path.join(folder, "theirs.npy")
        print(json.dumps([seed, path]), file=self.process.stdin, flush=True)
        cpu, wall = json.loads(self.process.stdout.readline())
        return np.load(path), cpu, wall

    def close(self):
        self.process.stdin.close()
        self.process.wait()


def serve(variant, rr_depth, settings):
    """Renders on request, one line each, until the input ends."""
    mi.set_variant(variant)
    import drjit as dr
    from convert import load

    dr.set_thread_count(THREADS)
    scene, _ = load(path_of(settings["scene"]), tuple(settings["size"]), settings["max_length"], rr_depth)

    def render(seed):
        image = mi.render(scene, spp=settings["spp"], seed=seed)
        # In the LLVM variants this is what waits for the result.
        return np.array(image)

    render(0)
    print("ready", flush=True)
    for line in sys.stdin:
        seed, path = json.loads(line)
        cpu, wall = cpu_time(), time.monotonic()
        image = render(seed)
        spent = [cpu_time() - cpu, time.monotonic() - wall]
        np.save(path, image)
        print(json.dumps(spent), flush=True)


class Ours:
    """One of our estimators."""

    def __init__(self, program, estimator, settings, threads=THREADS):
        self.label = f"tyndall {estimator}" + ("" if threads == THREADS else f", {threads} thread")
        self.program, self.estimator, self.settings, self.threads = program, estimator, settings, threads

    def once(self, spp, seed):
        from renders import ours
        size = "x".join(map(str, self.settings.size))
        return ours(self.program, path_of(self.settings.scene), self.estimator, self.settings.max_length, spp, seed, "--size", size,
                    "--threads", self.threads)

    def render(self, seed, _folder):
        spp = self.settings.spp
        start, whole = self.once(1, seed), self.once(spp, seed)
        # What is left is of spp - 1 samples.
        return whole.image, (whole.cpu - start.cpu) * spp / (spp - 1), whole.seconds

    def close(self):
        pass


def contenders(program, settings):
    """Mitsuba's that can run here, then ours."""
    for variant in ("scalar_rgb", "llvm_ad_rgb"):
        for rr_depth in (5, 1):
            contender = Mitsuba(variant, rr_depth, settings)
            if contender.ready:
                yield contender
            else:
                print(f"{contender.label}: skipped: {contender.complaint()}")
                contender.close()
    for threads in (THREADS, 1):
        for estimator in ("pt", "bpt"):
            yield Ours(program, estimator, settings, threads)


def measure(settings):
    """{label: (error, CPU seconds, wall seconds)}: the variance over rounds and medians."""
    from renders import binary
    mi.set_variant("scalar_rgb")
    entries = list(contenders(binary(), settings))
    rounds = {entry.label: [] for entry in entries}
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(1, settings.runs + 1):
            for entry in entries:
                rounds[entry.label].append(entry.render(seed, folder))
    for entry in entries:
        entry.close()
    table = {}
    for label, runs in rounds.items():
        images, cpu, wall = zip(*runs)
        table[label] = (np.var(images, axis=0, ddof=1).mean(), np.median(cpu), np.median(wall), np.ptp(cpu))
    return table


def report(table, settings):
    paths = settings.size[0] * settings.size[1] * settings.spp
    of_scalar = table["Mitsuba scalar_rgb, rr_depth 5"]
    print(f"\n{settings.scene}: {settings.size[0]}x{settings.size[1]}, {settings.spp} samples per pixel, paths of at most "
          f"{settings.max_length} segments, {THREADS} threads, medians of {settings.runs}; Mitsuba {mi.__version__}")
    print(f"{'':34}{'CPU s':>8}{'± spread/2':>12}{'Mpaths/CPU s':>14}{'ratio':>8}{'MSE':>11}{'1/(MSE·CPU)':>14}")
    for label, (error, cpu, _, spread) in table.items():
        efficiency = (of_scalar[0] * of_scalar[1]) / (error * cpu)
        print(f"{label:34}{cpu:8.2f}{spread / 2:12.2f}{paths / cpu / 1e6:14.2f}{of_scalar[1] / cpu:8.2f}{error:11.3g}"
              f"{efficiency:14.2f}")
    print("ratio and 1/(MSE·CPU) are relative to the first row")
    pt, bpt = table["tyndall pt"], table["tyndall bpt"]
    print(f"bpt takes {bpt[1] / pt[1]:.2f} times pt's CPU time a sample")
    for estimator, two in (("pt", pt), ("bpt", bpt)):
        one = table[f"tyndall {estimator}, 1 thread"]
        print(f"{estimator} from 1 to 2 threads, by the render's clock: {one[2]:.2f} s to {two[2]:.2f} s, "
              f"{one[2] / two[2]:.2f} times as fast")
    print(f"load of this machine over the last five minutes: {os.getloadavg()[1]:.1f} (with {os.cpu_count()} processors); "
          "the clocks of threads mean something only where it is idle")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--size", type=lambda text: [int(n) for n in text.split("x")], default=[256, 256])
    parser.add_argument("--spp", type=int, default=32)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--max-length", type=int, default=10)
    parser.add_argument("--scenes", nargs="+", default=SCENES, metavar="NAME")
    settings = parser.parse_args()
    if settings.runs < 2 or settings.spp < 2:
        parser.error("at least 2 runs and 2 samples per pixel are needed")
    if "speed_smoke" in settings.scenes and not os.path.exists(SMOKE):
        make_smoke()
    for settings.scene in settings.scenes:
        report(measure(settings), settings)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--serve"]:
        serve(sys.argv[2], int(sys.argv[3]), json.loads(sys.argv[4]))
    else:
        main()
