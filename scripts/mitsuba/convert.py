#!/usr/bin/env python3
"""Turns a scene file of ours into a scene of Mitsuba 3, and renders it with Mitsuba's `path`, or `volpath` where there
are media:

    python scripts/mitsuba/convert.py SCENE.toml [--spp 64] [--seed 0] [--max-length 8] [--size WxH] [--out FILE.exr]

What Mitsuba cannot express as we mean it is refused with a message, never approximated. Rough surfaces have to say
`masking = "separable"`, as Mitsuba knows no other (its masking of Beckmann's facets is a fit, up to 0.4% off); spot lights have to have `inner` = `cutoff`, as the falloffs differ.
Surfaces with a null material and nothing inside are left out where there are no media: nothing happens there. For
media see media.py.
"""

import argparse
import os
import re
import sys
import tempfile
import tomllib

import mitsuba as mi
import numpy as np

if __name__ == "__main__":
    mi.set_variant("scalar_rgb")

from media import Body, Media
from shapes import Shapes, compose, transform, affine, frame, rotation, unit
from tables import Refused, color, one_of, rgb, take

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
SHAPES = ["sphere", "rectangle", "disc", "box", "mesh", "lathe"]
LIGHTS = ["point", "spot", "directional", "environment"]
MATERIALS = ["diffuse", "mirror", "conductor", "dielectric", "null"]
# The keys of a rough surface.
FACETS = {"roughness": 0, "distribution": "ggx", "masking": "correlated"}
# Below this our surfaces are smooth.
SMOOTH_BELOW = 1e-3


def metals():
    """Our table of metals: {name or symbol: (eta, k)}."""
    with open(os.path.join(ROOT, "src/bsdf/metals.rs"), encoding="utf-8") as file:
        rows = re.findall(r'metal\("(\w+)", "(\w+)", \[([\d., ]+)\], \[([\d., ]+)\]\)', file.read())
    table = {}
    for name, symbol, *numbers in rows:
        table[name] = table[symbol.lower()] = [[float(x) for x in n.split(",")] for n in numbers]
    return table


class Converter:
    """Converts one scene; `folder` takes the files that Mitsuba reads parts of it from."""

    def __init__(self, path, folder):
        self.dir = os.path.dirname(os.path.abspath(path))
        with open(path, "rb") as file:
            self.toml = tomllib.load(file)
        self.shapes = Shapes(self.dir, folder)

    def convert(self, size, max_length, rr_depth):
        film, camera, render, self.textures, materials, shapes, lights, media, world = take(
            {k: v for k, v in self.toml.items() if k not in ("name", "description")}, "the scene",
            film={}, camera=None, render={}, texture={}, material={}, shape=[], light=[], medium={}, world={})
        own_length, min_length = take(render, "[render]", max_length=None, min_length=1)
        if min_length > 1:
            raise Refused("`min_length` in [render]")
        self.max_length = max_length or own_length
        if self.max_length is None:
            raise Refused("a scene without `max_length`: give --max-length")
        self.materials, self.media = materials, Media(media, world, self.dir)
        bodies = [self.body(table) for table in shapes]
        scene = {
            "type": "scene", **self.media.all(),
            "integrator": {"type": "volpath" if media else "path", "max_depth": self.max_length, "rr_depth": rr_depth,
                           "hide_emitters": False},
            "sensor": self.sensor(camera, film, size),
        }
        if self.media.have_flakes():
            hittable = any("emission" in table for table in shapes) or any("environment" in table for table in lights)
            if self.max_length > 2 or hittable:
                raise Refused("fibres or flakes with paths of more than two segments or lights that can be hit: Mitsuba's `sggx` "
                              "does not sample the density that it tells (its issue 1728)")
        for i, (table, body) in enumerate(zip(shapes, bodies)):
            shape = self.shape(table, body)
            if shape is not None:
                scene[f"shape{i}"] = shape
        for i, table in enumerate(lights):
            scene[f"light{i}"] = self.light(table)
        return scene

    def sensor(self, camera, film, size):
        origin, target, up, fov, axis, lens_radius, focus = take(
            camera, "[camera]", origin=None, target=None, up=[0, 1, 0], fov=45, fov_axis="horizontal",
            lens_radius=0, focus_distance=None)
        width, height, crop = take(film, "[film]", width=512, height=512, crop=None)
        if crop is not None:
            raise Refused("a crop window")
        width, height = size or (width, height)
        sensor = {
            "type": "thinlens" if lens_radius else "perspective",
            "to_world": mi.ScalarTransform4f().look_at(origin, target, up),
            "fov": float(fov), "fov_axis": {"horizontal": "x", "vertical": "y"}[axis],
            "near_clip": 1e-4, "far_clip": 1e6,
            "film": {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"},
                     "pixel_format": "rgb", "component_format": "float32"},
            "sampler": {"type": "independent"},
        }
        if lens_radius:
            distance = float(np.linalg.norm(np.subtract(target, origin)))
            sensor |= {"aperture_radius": float(lens_radius), "focus_distance": float(focus or distance)}
        point = np.array(origin, float)
        if lens_radius and self.media.bodies:
            self.media.about("the lens", point - lens_radius, point + lens_radius)
        return sensor | self.media.reference("medium", self.media.about("the camera", point, point))

    def body(self, table):
        """A shape as a solid; None where it is a mere surface."""
        kind, inner = one_of(table, "a shape", SHAPES)
        medium, definition = table.get("interior"), self.materials.get(table.get("material"), {})
        closed = kind in ("sphere", "box", "mesh", "lathe")
        if medium is None and not (closed and self.media and ("null" in definition or "dielectric" in definition)):
            return None
        refracts = "dielectric" in definition
        return self.media.add(Body(kind, inner, table.get("transform", []), medium, refracts, table.get("priority", 0)))

    def shape(self, table, body):
        _, material, emission, steps, *_ = take(
            table, "[[shape]]", name=None, material=None, emission=None, transform=[], interior=None, priority=0,
            **dict.fromkeys(SHAPES))
        kind, inner = one_of(table, "a shape", SHAPES)
        definition = {"diffuse": {"reflectance": 0}} if material is None else self.materials[material]
        if "null" in definition and body is None:
            return None
        bsdf, textured = self.bsdf(definition)
        shape = self.shapes.convert(kind, inner, compose(steps), textured)
        shape["bsdf"] = bsdf
        shape |= self.media.sides(shape, body)
        if emission is not None:
            radiance, two_sided = emission, False
            if isinstance(emission, dict):
                radiance, two_sided = take(emission, "emission", radiance=None, two_sided=False)
            if two_sided:
                raise Refused("a lamp that emits from both sides")
            shape["emitter"] = {"type": "area", "radiance": rgb(radiance)}
        return shape

    def bsdf(self, definition):
        """A material, and whether it has a texture."""
        kind, table = one_of(definition, "a material", MATERIALS)
        if kind == "null":
            return {"type": "null"}, False
        if kind == "diffuse":
            albedo, = take(table, kind, reflectance=0.5)
            return two_sided({"type": "diffuse", "reflectance": self.albedo(albedo)}), is_textured(albedo)
        if kind == "mirror":
            albedo, = take(table, kind, reflectance=1)
            mirror = {"type": "conductor", "material": "none", "specular_reflectance": self.albedo(albedo)}
            return two_sided(mirror), is_textured(albedo)
        if kind == "conductor":
            metal, eta, k, albedo, *facets = take(
                table, kind, metal=None, eta=None, k=None, reflectance=1, **FACETS)
            bsdf = {"specular_reflectance": self.albedo(albedo)} | rough("conductor", *facets)
            if metal is not None:
                eta, k = metals()[metal.lower()]
            bsdf |= {"material": "none"} if eta is None else {"eta": rgb(eta), "k": rgb(k)}
            return two_sided(bsdf), is_textured(albedo)
        ior, exterior, reflectance, transmittance, *facets = take(
            table, kind, ior=1.5, exterior_ior=1, reflectance=1, transmittance=1, **FACETS)
        bsdf = rough("dielectric", *facets) | {
            "int_ior": float(ior), "ext_ior": float(exterior),
            "specular_reflectance": self.albedo(reflectance), "specular_transmittance": self.albedo(transmittance),
        }
        return bsdf, is_textured(reflectance) or is_textured(transmittance)

    def albedo(self, value):
        if isinstance(value, str):
            value = self.textures[value]
        if not isinstance(value, dict):
            return rgb(value)
        kind, table = one_of(value, "a texture", ["constant", "image", "checker"])
        if kind == "constant":
            return rgb(table)
        if kind == "checker":
            even, odd, squares = take(table, kind, even=None, odd=None, squares=[8, 8])
            # Mitsuba's checkerboard has two squares a unit.
            scale = mi.ScalarTransform4f().scale([squares[0] / 2, squares[1] / 2, 1])
            return {"type": "checkerboard", "color0": rgb(even), "color1": rgb(odd), "to_uv": scale}
        name, encoding, wrap = take(table, kind, file=None, encoding="srgb", wrap="repeat")
        # Our v goes up from the lower edge of a picture, Mitsuba's down from the upper.
        data = np.ascontiguousarray(self.picture(name, encoding)[::-1])
        return {"type": "bitmap", "data": mi.TensorXf(data), "raw": True, "filter_type": "bilinear",
                "wrap_mode": wrap}

    def picture(self, name, encoding):
        """Linear RGB, row 0 on top."""
        bitmap = mi.Bitmap(os.path.join(self.dir, name))
        if name.lower().endswith(".png"):
            bitmap.set_srgb_gamma(encoding == "srgb")
        return np.array(bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))

    def light(self, table):
        take(table, "[[light]]", name=None, **dict.fromkeys(LIGHTS))
        kind, inner = one_of(table, "a light", LIGHTS)
        if kind == "point":
            position, intensity = take(inner, kind, position=None, intensity=None)
            return {"type": "point", "position": position, "intensity": rgb(intensity)}
        if kind == "spot":
            position, target, intensity, cone, cutoff = take(
                inner, kind, position=None, target=None, intensity=None, inner=None, cutoff=30)
            if cone != cutoff:
                raise Refused("a spot light whose `inner` is not its `cutoff`: the falloffs differ")
            axis = frame(np.subtract(target, position))
            return {"type": "spot", "to_world": transform(affine(axis, position)), "intensity": rgb(intensity),
                    "cutoff_angle": float(cutoff), "beam_width": float(cutoff)}
        if kind == "directional":
            direction, irradiance = take(inner, kind, direction=None, irradiance=None)
            return {"type": "directional", "direction": list(unit(direction)), "irradiance": rgb(irradiance)}
        radiance, image, scale, turn = take(inner, kind, radiance=None, image=None, scale=1, rotation=0)
        if image is None:
            return {"type": "constant", "radiance": rgb(radiance)}
        to_world = transform(affine(rotation([0, 1, 0], turn)))
        bitmap = mi.Bitmap(doubled_rows(self.picture(image, "srgb")).astype(np.float32))
        return {"type": "envmap", "bitmap": bitmap, "scale": float(scale), "to_world": to_world}


def doubled_rows(image):
    """Mitsuba's first and last row stand on the poles, ours half a pixel before: the same interpolation between
    twice the rows and one more."""
    height = len(image)
    y = np.clip(np.arange(2 * height + 1) / 2 - 0.5, 0, height - 1)
    above = np.floor(y).astype(int)
    below = np.minimum(above + 1, height - 1)
    share = (y - above)[:, None, None]
    return image[above] * (1 - share) + image[below] * share


def two_sided(bsdf):
    return {"type": "twosided", "bsdf": bsdf}


def rough(kind, roughness, distribution, masking):
    if roughness < SMOOTH_BELOW:
        return {"type": kind}
    if masking != "separable":
        raise Refused(f'a rough {kind} without `masking = "separable"`')
    return {"type": "rough" + kind, "distribution": distribution, "alpha": float(roughness)}


def is_textured(albedo):
    return isinstance(albedo, str) or (isinstance(albedo, dict) and "constant" not in albedo)


def load(path, size=None, max_length=None, rr_depth=5):
    """The scene for Mitsuba's current variant, and its longest path in segments."""
    try:
        with tempfile.TemporaryDirectory() as folder:
            converter = Converter(path, folder)
            return mi.load_dict(converter.convert(size, max_length, rr_depth)), converter.max_length
    except Refused as refusal:
        raise Refused(f"{path}: Mitsuba has not what we have: {refusal}") from None


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("scene")
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--max-length", type=int)
    parser.add_argument("--size", type=lambda text: tuple(int(n) for n in text.split("x")))
    parser.add_argument("--out", default="mitsuba.exr")
    args = parser.parse_args()
    try:
        scene, _ = load(args.scene, args.size, args.max_length)
    except (Refused, OSError) as error:
        sys.exit(f"error: {error}")
    mi.Bitmap(mi.render(scene, spp=args.spp, seed=args.seed)).write(args.out)
    print(f"wrote {args.out}")


if __name__ == "__main__":
    main()
