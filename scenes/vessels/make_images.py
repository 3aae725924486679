#!/usr/bin/env python3
"""Makes the two pictures of this scene, with nothing but Python: a photographer's studio as environment
(studio.hdr, Radiance RGBE) and a painted band for the bowl (glaze.png). Run it in this folder."""

import math
import struct
import zlib

WIDTH, HEIGHT = 192, 96


def direction(column, row):
    """Of a pixel: row 0 is up (+y), the left edge is -z, a quarter from the left +x, the middle +z."""
    phi = 2 * math.pi * (column + 0.5) / WIDTH
    theta = math.pi * (row + 0.5) / HEIGHT
    return (math.sin(phi) * math.sin(theta), math.cos(theta), -math.cos(phi) * math.sin(theta))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def unit(a):
    length = math.sqrt(dot(a, a))
    return tuple(x / length for x in a)


def softbox(d, middle, width, height, color):
    """A rectangle of light about a direction, seen from the origin; width and height at distance 1."""
    axis = unit(middle)
    right = unit(cross(axis, (0, 1, 0)))
    up = cross(right, axis)
    cos = dot(d, axis)
    if cos <= 0:
        return (0, 0, 0)
    x, y = abs(dot(d, right) / cos) / width, abs(dot(d, up) / cos) / height
    edge = min(max((1 - max(x, y)) / 0.12, 0), 1)
    return tuple(c * edge * edge * (3 - 2 * edge) for c in color)


def studio(d):
    """Radiance from a direction: a dim room, brighter above, with three softboxes."""
    above = 0.5 + 0.5 * d[1]
    room = (0.05 + 0.13 * above, 0.055 + 0.145 * above, 0.07 + 0.17 * above)
    boxes = [
        softbox(d, (-0.9, 0.8, 0.5), 0.42, 0.42, (9.0, 8.4, 7.4)),
        softbox(d, (1.0, 0.55, -0.35), 0.16, 0.6, (4.0, 4.6, 5.6)),
        softbox(d, (0.25, 1.0, -0.7), 0.5, 0.12, (3.2, 3.0, 2.7)),
    ]
    return tuple(r + sum(b[i] for b in boxes) for i, r in enumerate(room))


def rgbe(color):
    largest = max(color)
    if largest < 1e-32:
        return (0, 0, 0, 0)
    mantissa, exponent = math.frexp(largest)
    return tuple(min(255, int(c * mantissa * 256 / largest)) for c in color) + (exponent + 128,)


def run_lengths(values):
    """Radiance's compression of one component of a row: runs as 128 + length, others as length and values."""
    out, i = bytearray(), 0
    while i < len(values):
        run = 1
        while run < 127 and i + run < len(values) and values[i + run] == values[i]:
            run += 1
        if run >= 4:
            out += bytes((128 + run, values[i]))
            i += run
            continue
        start = i
        while i < len(values) and i - start < 128:
            if values[i:i + 4] == values[i:i + 1] * 4:
                break
            i += 1
        out += bytes((i - start,)) + values[start:i]
    return bytes(out)


def write_hdr(path):
    with open(path, "wb") as file:
        file.write(f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {HEIGHT} +X {WIDTH}\n".encode())
        for row in range(HEIGHT):
            pixels = [rgbe(studio(direction(column, row))) for column in range(WIDTH)]
            file.write(bytes((2, 2, WIDTH >> 8, WIDTH & 255)))
            for component in range(4):
                file.write(run_lengths(bytes(p[component] for p in pixels)))


def glaze(u, v):
    """Colour of the painted bowl: a band of waves and dots between two lines."""
    cream, blue, rust = (238, 230, 211), (38, 74, 130), (168, 70, 38)
    wave = 0.5 + 0.16 * math.sin(2 * math.pi * 8 * u)
    if abs(v - 0.16) < 0.03 or abs(v - 0.86) < 0.03:
        return blue
    if abs(v - wave) < 0.05:
        return blue
    x = (8 * u + 0.25) % 1 - 0.5
    for middle, y in ((0.0, 0.72), (0.5, 0.28), (-0.5, 0.28)):
        if (x - middle) ** 2 * 4 + ((v - y) * 2.2) ** 2 < 0.035:
            return rust
    return cream


def write_png(path, width=256, height=64):
    rows = b"".join(
        b"\0" + bytes(c for column in range(width) for c in glaze((column + 0.5) / width, 1 - (row + 0.5) / height))
        for row in range(height)
    )

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header))
        file.write(chunk(b"sRGB", b"\0") + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


if __name__ == "__main__":
    write_hdr("studio.hdr")
    write_png("glaze.png")
