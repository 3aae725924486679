"""Renders by either program, as arrays (rows, columns, 3), row 0 on top."""

import os
import resource
import subprocess
import tempfile

import mitsuba as mi
import numpy as np

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def binary():
    """Our program: $TYNDALL, or the newest that is built."""
    named = os.environ.get("TYNDALL")
    built = [os.path.join(ROOT, "target", profile, "tyndall") for profile in ("release", "fast")]
    built = sorted((path for path in built if os.path.exists(path)), key=os.path.getmtime)
    if not named and not built:
        raise SystemExit("error: build tyndall first (cargo build --release), or name it in TYNDALL")
    return named or built[-1]


def read(path):
    """The default layer of an EXR, and the file's attributes."""
    bitmap = mi.Bitmap(path)
    names = [bitmap.struct_()[i].name for i in range(bitmap.channel_count())]
    data = np.array(bitmap, dtype=np.float64)
    return data[..., [names.index(c) for c in "RGB"]], bitmap.metadata()


class Run:
    """One render by our program: the image, the clock of the render and the CPU time of the process, in seconds."""

    def __init__(self, program, scene, *options):
        with tempfile.TemporaryDirectory() as folder:
            out = os.path.join(folder, "out.exr")
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            command = [program, "render", scene, "--out", out, *map(str, options)]
            done = subprocess.run(command, capture_output=True, text=True)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            if done.returncode != 0:
                raise SystemExit(f"error: {' '.join(command)}\n{done.stderr}")
            if "were not finite" in done.stderr:
                raise SystemExit(f"error: {scene}: {done.stderr}")
            self.image, attributes = read(out)
        self.seconds = float(attributes["tyndall.seconds"])
        self.cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def ours(program, scene, estimator, length, spp, seed, *options):
    """One render by our program."""
    return Run(program, scene, "--estimator", estimator, "--max-length", length, "--spp", spp, "--seed", seed,
               *options)


def theirs(scene, spp, seed):
    """One render by Mitsuba of a scene that it has loaded."""
    return np.array(mi.render(scene, spp=spp, seed=seed), dtype=np.float64)
