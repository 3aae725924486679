"""Shapes of a scene file as Mitsuba's, with the conventions of src/geometry: which side is out, texture coordinates,
and the facets of a lathe."""

import os

import mitsuba as mi
import numpy as np

from tables import Refused, color, take

DEFAULT_SEGMENTS = 64
DEFAULT_CREASE = 40.0
DEFAULT_STEPS = 12


def unit(v):
    return np.asarray(v, float) / np.linalg.norm(v)


def affine(linear=None, translation=(0, 0, 0)):
    m = np.eye(4)
    if linear is not None:
        m[:3, :3] = linear
    m[:3, 3] = translation
    return m


def rotation(axis, degrees):
    x, y, z = unit(axis)
    angle = np.radians(degrees)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def step(table):
    """One step of a shape's `transform`."""
    (kind, value), = table.items()
    if kind == "translate":
        return affine(translation=value)
    if kind == "scale":
        return affine(np.diag(color(value)))
    if kind == "rotate":
        axis, angle = take(value, "rotate", axis=None, angle=None)
        return affine(rotation(axis, angle))
    if kind == "matrix":
        return affine(np.array(value, float)[:3, :3], np.array(value, float)[:3, 3])
    if kind == "look_at":
        origin, target, up = take(value, "look_at", origin=None, target=None, up=[0, 1, 0])
        z = unit(np.subtract(target, origin))
        x = unit(np.cross(up, z))
        return affine(np.stack([x, np.cross(z, x), z], axis=1), origin)
    raise Refused(f"transform `{kind}`")


def compose(steps):
    """The first step is applied first."""
    whole = np.eye(4)
    for table in steps:
        whole = step(table) @ whole
    return whole


def uniform_scale(to_world, kind):
    scales = np.linalg.norm(to_world[:3, :3], axis=0)
    gram = to_world[:3, :3].T @ to_world[:3, :3]
    if not np.allclose(gram, np.eye(3) * scales[0] ** 2, rtol=1e-4, atol=1e-4 * scales[0] ** 2):
        raise Refused(f"a {kind} under a transform that is no similarity")
    return scales[0]


def frame(normal):
    """Two directions across `normal`, and itself, as columns."""
    n = unit(normal)
    s = unit(np.cross(n, [1, 0, 0] if abs(n[0]) < 0.5 else [0, 1, 0]))
    return np.stack([s, np.cross(n, s), n], axis=1)


def transform(m):
    return mi.ScalarTransform4f(np.ascontiguousarray(m, dtype=np.float64))


class Mesh:
    """Triangles, counter-clockwise seen from outside."""

    def __init__(self, positions, indices, uvs, normals=None):
        self.positions = np.asarray(positions, float)
        self.indices = np.asarray(indices, np.int32)
        self.uvs = np.asarray(uvs, float)
        self.normals = None if normals is None else np.asarray(normals, float)

    def moved(self, m):
        positions = self.positions @ m[:3, :3].T + m[:3, 3]
        mirrored = np.linalg.det(m[:3, :3]) < 0
        normals = self.normals
        if normals is not None:
            normals = normals @ np.linalg.inv(m[:3, :3])
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return Mesh(positions, self.indices[:, ::-1] if mirrored else self.indices, self.uvs, normals)

    def save(self, path):
        columns = [self.positions, self.uvs] + ([] if self.normals is None else [self.normals])
        names = ["x", "y", "z", "u", "v"] + ([] if self.normals is None else ["nx", "ny", "nz"])
        faces = np.empty(len(self.indices), dtype=[("count", "u1"), ("corners", "<i4", 3)])
        faces["count"], faces["corners"] = 3, self.indices
        with open(path, "wb") as file:
            lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(self.positions)}"]
            lines += [f"property float {name}" for name in names]
            lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", ""]
            file.write("\n".join(lines).encode())
            file.write(np.concatenate(columns, axis=1).astype("<f4").tobytes())
            file.write(faces.tobytes())


def parallelogram(corner, u, v):
    corner, u, v = (np.array(x, float) for x in (corner, u, v))
    positions = [corner, corner + u, corner + u + v, corner + v]
    return Mesh(positions, [[0, 1, 2], [0, 2, 3]], [[0, 0], [1, 0], [1, 1], [0, 1]])


def cuboid(low, high):
    low, high = np.array(low, float), np.array(high, float)
    positions, uvs, indices = [], [], []
    for axis in range(3):
        for side in (-1, 1):
            n, s = np.eye(3)[axis] * side, np.eye(3)[(axis + 1) % 3]
            t = np.cross(n, s)
            first = len(positions)
            for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                positions.append((low + high) / 2 + (n + s * x + t * y) * (high - low) / 2)
                uvs.append([(x + 1) / 2, (y + 1) / 2])
            indices += [[first, first + 1, first + 2], [first, first + 2, first + 3]]
    return Mesh(positions, indices, uvs)


def profile_points(pieces):
    """The profile of a lathe as one polyline."""
    points = []
    for piece in pieces:
        if isinstance(piece, list):
            points.append(np.array(piece, float))
            continue
        bezier, through, steps = take(piece, "a curve", bezier=None, through=None, steps=DEFAULT_STEPS)
        t = np.arange(1, steps + 1)[:, None] / steps
        knots = [points[-1]] + [np.array(p, float) for p in through or []]
        cubics = [[points[-1]] + [np.array(p, float) for p in bezier]] if bezier else []
        for i in range(1, len(knots)):
            a, d = knots[i - 1], knots[i]
            before, after = knots[max(i - 2, 0)], knots[min(i + 1, len(knots) - 1)]
            cubics.append([a, a + (d - before) / 6, d - (after - a) / 6, d])
        for a, b, c, d in cubics:
            points += list(a * (1 - t) ** 3 + 3 * b * t * (1 - t) ** 2 + 3 * c * t * t * (1 - t) + d * t ** 3)
    return [np.array([max(x, 0.0), y]) for x, y in points]


def profile_normals(points, stretches, crease):
    """The shading normals at either end of each stretch."""
    limit = np.cos(np.radians(crease))
    doubled = {tuple(p) for p, q in zip(points, points[1:]) if tuple(p) == tuple(q)}
    normals = [[n, n] for _, _, n, _ in stretches]
    closed = tuple(stretches[0][0]) == tuple(stretches[-1][1])
    for i, (a, b, n, length) in enumerate(stretches):
        following = (i + 1) % len(stretches)
        _, _, other, other_length = stretches[following]
        if (i + 1 < len(stretches) or closed) and tuple(b) not in doubled and n @ other >= limit:
            normals[i][1] = normals[following][0] = unit(n * other_length + other * length)
    for i, (a, b, n, _) in enumerate(stretches):
        for end, p in enumerate((a, b)):
            if p[0] == 0 and n[1] ** 2 - n[0] ** 2 >= limit and tuple(p) not in doubled:
                normals[i][end] = np.array([0, np.sign(n[1])])
    return normals


def lathe(profile, segments, smooth, crease):
    """The profile turned about the y axis, in as many facets as ours."""
    points = profile_points(profile)
    stretches = []
    for a, b in zip(points, points[1:]):
        length = np.linalg.norm(b - a)
        if length > 0:
            stretches.append((a, b, np.array([b[1] - a[1], a[0] - b[0]]) / length, length))
    shading = profile_normals(points, stretches, crease)
    arcs = np.concatenate([[0], np.cumsum([s[3] for s in stretches])])
    turns = np.arange(segments + 1) % segments / segments * 2 * np.pi
    around = np.stack([np.cos(turns), -np.sin(turns)], axis=1)
    positions, normals, uvs, indices = [], [], [], []
    for i, (a, b, _, _) in enumerate(stretches):
        first = len(positions)
        for end, p in enumerate((a, b)):
            for j, (x, z) in enumerate(around):
                n = shading[i][end]
                positions.append([p[0] * x, p[1], p[0] * z])
                normals.append([n[0] * x, n[1], n[0] * z])
                uvs.append([j / segments, arcs[i + end] / arcs[-1]])
        for low in range(first, first + segments):
            high = low + segments + 1
            indices += [[low, low + 1, high + 1]] if a[0] > 0 else []
            indices += [[low, high + 1, high]] if b[0] > 0 else []
    return Mesh(positions, indices, uvs, normals if smooth else None)


def has_normals(path):
    with open(path, "rb") as file:
        if path.endswith(".ply"):
            header = file.read(65536).split(b"end_header")[0].split()
            return b"nx" in header
        return any(line.startswith(b"vn ") for line in file)


def from_file(scene_dir, to_world, table):
    name, smooth = take(table, "mesh", file=None, smooth=None)
    path = os.path.join(scene_dir, name)
    given = has_normals(path)
    if smooth and not given:
        raise Refused("a mesh with `smooth = true` whose file has no normals: averages differ")
    if np.linalg.det(to_world[:3, :3]) < 0:
        raise Refused("a mesh from a file under a reflection")
    kind = "ply" if path.endswith(".ply") else "obj"
    return {
        "type": kind, "filename": path, "to_world": transform(to_world), "flip_tex_coords": False,
        "face_normals": smooth is False or not given,
    }


class Shapes:
    """Converts shapes; `folder` takes the meshes that have to pass through a file."""

    def __init__(self, scene_dir, folder):
        self.scene_dir, self.folder, self.files = scene_dir, folder, 0

    def mesh(self, mesh):
        path = os.path.join(self.folder, f"{self.files}.ply")
        self.files += 1
        mesh.save(path)
        return {"type": "ply", "filename": path, "face_normals": mesh.normals is None}

    def convert(self, kind, table, to_world, textured):
        """Mitsuba's shape for `kind = table`. Where it is `textured`, its texture coordinates have to be ours."""
        if textured and kind in ("sphere", "disc"):
            raise Refused(f"a texture on a {kind}: its texture coordinates differ")
        if kind == "sphere":
            center, radius = take(table, kind, center=[0, 0, 0], radius=None)
            center = to_world @ np.append(center, 1)
            return {"type": "sphere", "center": list(center[:3]), "radius": radius * uniform_scale(to_world, kind)}
        if kind == "disc":
            center, normal, radius = take(table, kind, center=[0, 0, 0], normal=[0, 1, 0], radius=None)
            if np.linalg.det(to_world[:3, :3]) < 0:
                raise Refused("a disc under a reflection")
            uniform_scale(to_world, kind)
            return {"type": "disk", "to_world": transform(to_world @ affine(frame(normal) * radius, center))}
        if kind == "rectangle":
            return self.rectangle(*take(table, kind, corner=None, u=None, v=None), to_world)
        if kind == "box":
            low, high = take(table, kind, min=None, max=None)
            return self.mesh(cuboid(low, high).moved(to_world))
        if kind == "lathe":
            profile, segments, smooth, crease = take(
                table, kind, profile=None, segments=DEFAULT_SEGMENTS, smooth=True, crease=DEFAULT_CREASE)
            return self.mesh(lathe(profile, segments, smooth, crease).moved(to_world))
        if kind == "mesh":
            return from_file(self.scene_dir, to_world, table)
        raise Refused(f"shape `{kind}`")

    def rectangle(self, corner, u, v, to_world):
        u, v = to_world[:3, :3] @ u, to_world[:3, :3] @ v
        corner = (to_world @ np.append(corner, 1))[:3]
        across = np.linalg.norm(u) * np.linalg.norm(v)
        if abs(u @ v) > 1e-6 * across or np.linalg.det(to_world[:3, :3]) < 0:
            mesh = parallelogram(corner, u, v)
            if np.linalg.det(to_world[:3, :3]) < 0:
                mesh.indices = mesh.indices[:, ::-1]
            return self.mesh(mesh)
        n = np.cross(u, v) / across
        middle = corner + (u + v) / 2
        return {"type": "rectangle", "to_world": transform(affine(np.stack([u / 2, v / 2, n], axis=1), middle))}
