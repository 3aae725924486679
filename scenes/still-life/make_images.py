#!/usr/bin/env python3
"""Makes the two pictures of this scene, with nothing but Python: a room towards evening as environment (room.hdr,
Radiance RGBE) and the boards of the table (boards.png). Run it in this folder."""

import math
import random
import struct
import zlib

WIDTH, HEIGHT = 128, 64


def room(azimuth, elevation):
    """Radiance from a direction, angles in degrees: azimuth 0 is -z, 90 is +x. Dark walls, a paler ceiling, a brown
    floor, a window of four panes on the left and a doorway to a lit corridor on the right."""
    if elevation > 48:
        return (0.12, 0.12, 0.13)
    if elevation < -20:
        return (0.05, 0.04, 0.03)
    light = (0.075, 0.07, 0.07)
    x, y = azimuth + 75, elevation - 16
    if abs(x) < 21 and abs(y) < 22 and abs(x) > 1.5 and abs(y) > 1.5:
        sky = (y + 22) / 44
        light = (1.5 + 0.5 * sky, 1.9 + 0.9 * sky, 2.5 + 1.5 * sky)
    if 95 < azimuth < 112 and -20 < elevation < 22:
        light = (1.3, 0.85, 0.45)
    return light


def environment_rows():
    """Row 0 is up (+y), the left edge is -z, a quarter from the left +x, the middle +z; four by four samples a pixel."""
    for row in range(HEIGHT):
        pixels = []
        for column in range(WIDTH):
            total = [0.0, 0.0, 0.0]
            for k in range(16):
                u, v = (column + (k % 4 + 0.5) / 4) / WIDTH, (row + (k // 4 + 0.5) / 4) / HEIGHT
                azimuth = (360 * u + 180) % 360 - 180
                total = [t + c / 16 for t, c in zip(total, room(azimuth, 90 - 180 * v))]
            pixels.append(total)
        yield pixels


def rgbe(color):
    mantissa, exponent = math.frexp(max(color))
    factor = mantissa * 256 / max(color)
    return [min(255, int(c * factor)) for c in color] + [exponent + 128]


def literal(values):
    """A component of a row in Radiance's run-length form, without any runs."""
    return b"".join(bytes([len(part)]) + bytes(part) for part in (values[i:i + 128] for i in range(0, len(values), 128)))


def write_environment(path):
    with open(path, "wb") as file:
        file.write(f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {HEIGHT} +X {WIDTH}\n".encode())
        for row in environment_rows():
            file.write(bytes([2, 2, WIDTH >> 8, WIDTH & 255]))
            pixels = [rgbe(color) for color in row]
            for component in range(4):
                file.write(literal([p[component] for p in pixels]))


def boards(size=512, count=6):
    """Rows of an image of boards side by side: each of its own tone, with a grain along it and a dark joint."""
    draw = random.Random(6)
    tones = [0.82 + 0.3 * draw.random() for _ in range(count)]
    phases = [[draw.uniform(0, 2 * math.pi) for _ in range(6)] for _ in range(count)]
    for j in range(size):
        board, across = divmod(j * count / size, 1)
        board = int(board)
        p = phases[board]
        row = []
        for i in range(size):
            along = 2 * math.pi * i / size
            ring = 9 * across + 0.55 * math.sin(along + p[0]) + 0.25 * math.sin(3 * along + p[1]) + p[2]
            fibre = math.sin(2 * math.pi * (23 * across + 0.15 * math.sin(2 * along + p[3])) + p[4])
            tone = tones[board] * (1 + 0.13 * math.sin(2 * math.pi * ring) + 0.05 * fibre)
            tone *= 0.35 if across < 0.02 else 1
            row += [min(255, round(c * tone)) for c in (128, 92, 62)]
        yield bytes(row)


def write_png(path, rows):
    rows = list(rows)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", len(rows[0]) // 3, len(rows), 8, 2, 0, 0, 0)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"sRGB", b"\0"))
        file.write(chunk(b"IDAT", zlib.compress(b"".join(b"\0" + row for row in rows), 9)) + chunk(b"IEND", b""))


if __name__ == "__main__":
    write_environment("room.hdr")
    write_png("boards.png", boards())
