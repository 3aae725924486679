"""Media of a scene file as Mitsuba's, and which of them is on which side of each shape.

Our solids nest by priority and size, and a shape need not say what is about it; Mitsuba wants the medium on either side of
every shape. So every shape has to lie wholly inside or outside of every solid: what cannot be told is refused.
"""

import os

import mitsuba as mi
import numpy as np

from shapes import affine, compose, transform, uniform_scale
from tables import Refused, color, one_of, rgb, take

# Shapes that touch do not overlap.
TOUCHING = 1e-5


def phase(definition):
    if isinstance(definition, str):
        return {"type": definition}
    (kind, value), = definition.items()
    if kind == "hg":
        return {"type": "hg", "g": float(value)}
    if kind in ("fibres", "flakes"):
        return sggx(kind, *take(value, f"`{kind}`", axis=None, roughness=None))
    if kind != "mixture":
        raise Refused(f"the phase function `{kind}`")
    lobes = [take(lobe, "a mixture", weight=None, phase="isotropic") for lobe in value]
    if any(isinstance(lobe, dict) and {"fibres", "flakes"} & set(lobe) for _, lobe in lobes):
        raise Refused("fibres or flakes in a mixture")
    blend, total = phase(lobes[0][1]), float(lobes[0][0])
    for weight, other in lobes[1:]:
        total += weight
        blend = {"type": "blendphase", "weight": weight / total, "first": blend, "second": phase(other)}
    return blend


def sggx(kind, axis, roughness):
    """Flakes by the matrix of their squared areas: extinction goes with the area in Mitsuba's media as in ours."""
    axis = np.array(axis, float) / np.linalg.norm(axis)
    along, across = (roughness ** 2, 1) if kind == "fibres" else (1, roughness ** 2)
    s = across * np.eye(3) + (along - across) * np.outer(axis, axis)
    numbers = np.array([s[0, 0], s[1, 1], s[2, 2], s[0, 1], s[0, 2], s[1, 2]], np.float32)
    # A grid of the same everywhere: a volume of one value has three numbers at most.
    return {"type": "sggx", "S": {"type": "gridvolume", "grid": mi.VolumeGrid(np.tile(numbers, (2, 2, 2, 1))), "raw": True,
                                  "wrap_mode": "clamp"}}


def homogeneous(table):
    sigma_a, sigma_s, sigma_t, albedo, scale, emission, scattering = take(
        table, "[medium]", sigma_a=None, sigma_s=None, sigma_t=None, albedo=None, scale=1, emission=0, phase="isotropic")
    if any(color(emission)):
        raise Refused("a medium that shines")
    if sigma_t is None:
        sigma_a, sigma_s = np.array(color(sigma_a)), np.array(color(sigma_s))
        sigma_t = sigma_a + sigma_s
        albedo = np.divide(sigma_s, sigma_t, out=np.zeros(3), where=sigma_t > 0)
    # Mitsuba's colours end at 1, its `scale` does not.
    sigma_t, albedo = np.array(color_of(sigma_t)) * scale, color_of(albedo)
    largest = sigma_t.max() or 1.0
    return {"type": "homogeneous", "sigma_t": rgb(list(sigma_t / largest)), "albedo": rgb(albedo),
            "scale": float(largest), "phase": phase(scattering)}


VARYING = ["density", "sigma_t_grid", "albedo_grid"]


def heterogeneous(table, folder):
    """A medium with grids from `.vol` files: a density, or extinction in colours; the albedo constant or a grid."""
    sigma_t, albedo, scale, scattering, density, extinction, albedo_grid = take(
        table, "[medium] with grids", sigma_t=None, albedo=None, scale=1, phase="isotropic", density=None,
        sigma_t_grid=None, albedo_grid=None)
    if density is not None:
        sigma_t = color_of(sigma_t)
        if len(set(sigma_t)) > 1:
            raise Refused("a density times an extinction in colours: Mitsuba wants a grid of colours")
        scale *= sigma_t[0]
        _, extinction = one_of(density, "a density", ["grid"])
    volume, box, more = grid(extinction, folder)
    scale *= more
    if not axis_aligned(box):
        raise Refused("a grid of extinction that is turned against the axes: Mitsuba fills the box about it")
    if albedo_grid is None:
        albedo = rgb(color_of(albedo))
    else:
        albedo, albedo_box, more = grid(albedo_grid, folder)
        if more != 1:
            raise Refused("a `scale` of an `albedo_grid`")
        corners = np.linalg.inv(albedo_box) @ box @ UNIT
        if np.any(corners < -TOUCHING) or np.any(corners > 1 + TOUCHING):
            raise Refused("a grid of albedo that does not cover that of extinction: Mitsuba goes on with its rim")
    return {"type": "heterogeneous", "sigma_t": volume, "albedo": albedo, "scale": float(scale),
            "phase": phase(scattering)}


# The corners of the unit cube.
UNIT = np.array([[i & 1, i >> 1 & 1, i >> 2, 1] for i in range(8)], float).T


def axis_aligned(m):
    """Whether every axis of the unit cube stays along an axis."""
    return np.all((np.abs(m[:3, :3]) > TOUCHING * np.abs(m[:3, :3]).max()).sum(axis=0) == 1)


def grid(table, folder):
    """A grid as a volume, from its box as the unit cube to the world, and what its values are multiplied by."""
    file, interpolation, scale, low, high, steps = take(
        table, "a grid", file=None, interpolation="trilinear", scale=1, min=None, max=None, transform=[])
    if not file.endswith(".vol"):
        raise Refused(f"the grid `{file}`: Mitsuba reads .vol alone")
    path = os.path.join(folder, file)
    if low is None:
        low, high = np.fromfile(path, "<f4", count=6, offset=24).reshape(2, 3)
        if not np.all(low < high):
            low, high = np.zeros(3), np.ones(3)
    m = compose(steps) @ affine(np.diag(np.subtract(high, low)), low)
    volume = {"type": "gridvolume", "filename": path, "to_world": transform(m),
              "filter_type": {"trilinear": "trilinear", "constant": "nearest"}[interpolation]}
    return volume, m, scale


def color_of(value):
    return color(value) if np.ndim(value) == 0 else [float(x) for x in value]


class Body:
    """What a shape is as a solid: a ball, or a box along the axes."""

    def __init__(self, kind, inner, steps, medium, refracts, priority):
        m = compose(steps)
        self.medium, self.refracts, self.priority = medium, refracts, priority
        if kind == "sphere":
            self.centre = (m @ np.append(inner.get("center", [0, 0, 0]), 1))[:3]
            self.radius = inner["radius"] * uniform_scale(m, kind)
            self.low, self.high = self.centre - self.radius, self.centre + self.radius
        elif kind == "box" and np.allclose(m[:3, :3], np.diag(np.diag(m[:3, :3]))):
            corners = np.array([inner["min"], inner["max"]]) @ m[:3, :3].T + m[:3, 3]
            self.low, self.high, self.radius = corners.min(axis=0), corners.max(axis=0), None
        else:
            self.low = self.high = None

    def surface(self):
        a, b, c = np.maximum(self.high - self.low, 0)
        return a * b + b * c + c * a

    def holds(self, low, high, ball):
        """Whether all of a box, or of the ball in it, is inside; None where part of it is."""
        slack = TOUCHING * np.linalg.norm(self.high - self.low)
        if self.radius is None:
            if np.all(low >= self.low - slack) and np.all(high <= self.high + slack):
                return True
            return False if np.any(low >= self.high - slack) or np.any(high <= self.low + slack) else None
        if ball is not None:
            distance = np.linalg.norm(ball[0] - self.centre)
            if distance + ball[1] <= self.radius + slack:
                return True
            return False if distance >= self.radius + ball[1] - slack else None
        farthest = np.maximum(np.abs(low - self.centre), np.abs(high - self.centre))
        nearest = np.clip(self.centre, low, high) - self.centre
        if np.linalg.norm(farthest) <= self.radius + slack:
            return True
        return False if np.linalg.norm(nearest) >= self.radius - slack else None


class Media:
    """The media of a scene, and the solids that hold them."""

    def __init__(self, definitions, world, folder):
        self.definitions, self.folder = definitions, folder
        self.world, = take(world, "[world]", medium=None)
        self.bodies = []

    def __bool__(self):
        return bool(self.definitions)

    def have_flakes(self):
        return any(isinstance(table.get("phase"), dict) and {"fibres", "flakes"} & set(table["phase"])
                   for table in self.definitions.values())

    def all(self):
        """For the scene's dictionary, before all that refers to them."""
        return {self.name(name): self.medium(table) for name, table in self.definitions.items()}

    def medium(self, table):
        if any(key in table for key in VARYING):
            return heterogeneous(table, self.folder)
        return homogeneous(table)

    @staticmethod
    def name(medium):
        return f"medium_{medium}"

    def reference(self, side, medium):
        return {} if medium is None else {side: {"type": "ref", "id": self.name(medium)}}

    def add(self, body):
        self.bodies.append(body)
        return body

    def about(self, what, low, high, own=None):
        """The medium about something with these bounds, as far as it is not `own`."""
        ball = None if own is None or own.radius is None else (own.centre, own.radius)
        around = []
        for body in self.bodies:
            if body is own:
                continue
            if body.low is None:
                raise Refused("a medium in a shape that is neither a sphere nor a box along the axes")
            held = body.holds(low, high, ball)
            if held is None and own is not None:
                # It may be the smaller one of the two.
                held = None if own.holds(body.low, body.high, body.radius and (body.centre, body.radius)) is None else False
            if held is None:
                raise Refused(f"{what} is partly inside of a solid")
            if held:
                around.append(body)
        if not around:
            return self.world
        if own is not None and own.refracts and any(body.refracts for body in around):
            raise Refused("a refracting solid in another")
        return min(around, key=lambda body: (-body.priority, body.surface())).medium

    def sides(self, shape, own):
        """The references of a shape, which `own` is as a solid."""
        if not self:
            return {}
        bounds = mi.load_dict({key: value for key, value in shape.items() if key not in ("bsdf", "emitter")}).bbox()
        outside = self.about("a shape", np.array(bounds.min, float), np.array(bounds.max, float), own)
        inside = outside if own is None else own.medium
        return self.reference("interior", inside) | self.reference("exterior", outside)
