"""Parametrised undersides of the seventeen objects, the twins of the solids in contact/src/objects.

Every shape maps body coordinates x, y (mm) and its sizes (mm) to the signed distance from its footprint (mm, negative
inside), the height of its underside (mm) and the share of the area that is solid.
"""

import numpy as np

# Pose parameters that precede the sizes; bow is the rise of the face at 40 mm from the centre.
POSE = ("row", "col", "rotation_deg", "tilt_x_deg", "tilt_y_deg", "bow_x_mm", "bow_y_mm")


def box(x, y, width, height, radius=0.0):
    qx, qy = np.abs(x) - width / 2 + radius, np.abs(y) - height / 2 + radius
    return np.hypot(np.maximum(qx, 0), np.maximum(qy, 0)) + np.minimum(np.maximum(qx, qy), 0) - radius


def plate(x, y, width, height):
    return box(x, y, width, height), 0.0, 1.0


def disc(x, y, radius):
    return np.hypot(x, y) - radius, 0.0, 1.0


def tee(x, y, bar, bar_width, height, stem_width):
    across = box(x, y - height / 2 + bar_width / 2, bar, bar_width)
    return np.minimum(across, box(x, y, stem_width, height)), 0.0, 1.0


def brain(x, y, a, b, ridge, pitch):
    c = 20.0
    q = (x / a) ** 2 + (y / b) ** 2
    up = np.sqrt(np.maximum(1 - q, 0))
    fold = np.cos(2 * np.pi * x / pitch) * np.cos(2 * np.pi * y / pitch)
    return (np.sqrt(q) - 1) * min(a, b), c * (1 - up) - ridge * up * fold, 1.0


def comb(x, y, blade, back, teeth, tail):
    fill = 0.6
    spine = box(x, y - back / 2, blade, back)
    tines = box(x, y + teeth / 2, blade, teeth)
    rod = box(x + blade / 2 + tail / 2, y - back + 3.0, tail, 6.0)
    distance = np.minimum(np.minimum(spine, tines), rod)
    return distance, 0.0, np.where(tines < np.minimum(spine, rod), fill, 1.0)


def fish(x, y, length, sway, width):
    s = np.clip(x / length + 0.5, 0, 1)
    body = np.sqrt(np.maximum(np.sin(np.pi * np.clip((s - 0.1) / 0.9, 0, 1)), 0))
    half = 0.5 * width * np.maximum(np.maximum(body, 0.8 * np.maximum(0, 1 - s / 0.2)), 0.15)
    return np.maximum(np.abs(y - sway * np.sin(2 * np.pi * x / length)) - half, np.abs(x) - length / 2), 0.0, 1.0


def gel(x, y, radius, length):
    return np.maximum(np.abs(x) - radius, np.abs(y) - length / 2), radius - np.sqrt(np.maximum(radius**2 - x**2, 0)), 1.0


def perfume(x, y, width, height, rim):
    inner = box(x, y, width - 2 * rim, height - 2 * rim, 6.0)
    return box(x, y, width, height, 12.0), np.where(inner < 0, 4.0, 0.0), 1.0


def tape(x, y, outer, hole, off_x, off_y):
    return np.maximum(np.hypot(x, y) - outer, hole - np.hypot(x - off_x, y - off_y)), 0.0, 1.0


def tennis(x, y):
    r2 = x * x + y * y
    return np.sqrt(r2) - 33.4, 33.4 - np.sqrt(np.maximum(33.4**2 - r2, 0)), 1.0


def trig(x, y, side):
    third = side * np.sqrt(0.75) / 3
    sides = [y * -1 - third] + [0.5 * y + sign * np.sqrt(0.75) * x - third for sign in (-1, 1)]
    return np.maximum.reduce(sides), 0.0, 1.0


def cross(x, y, long, short, width):
    return np.minimum(box(x, y, long, width), box(x, y, width, short)), 0.0, 1.0


def corner(x, y, leg_x, leg_y, width):
    upright = box(x - leg_x / 2 + width / 2, y, width, leg_y)
    return np.minimum(upright, box(x, y + leg_y / 2 - width / 2, leg_x, width)), 0.0, 1.0


def center(x, y, width, height, hole, off_x, off_y):
    return np.maximum(box(x, y, width, height, 10.0), hole - np.hypot(x - off_x, y - off_y)), 0.0, 1.0


# name: (shape, (row, col, rotation_deg), bow allowed mm, {parameter: (first guess, low, high)})
SHAPES = {
    "brain": (brain, (4.4, 4.4, 0), 0, {"a": (26, 20, 35), "b": (22, 18, 30), "ridge": (1.5, 0.4, 1.8), "pitch": (14, 10, 24)}),
    "center": (center, (5.2, 5.1, 0), 0.6, {"width": (72, 62, 80), "height": (72, 62, 80), "hole": (11, 8, 14), "x": (0, -8, 8), "y": (3, -8, 8)}),
    "circle": (disc, (4.5, 4.2, 0), 0.6, {"radius": (43, 36, 48)}),
    "comb": (comb, (6.3, 5, -60), 0.6, {"blade": (75, 60, 100), "back": (10, 7, 14), "teeth": (16, 10, 26), "tail": (75, 50, 95)}),
    "corner": (corner, (5.6, 5.6, 0), 0.5, {"leg_x": (54, 42, 70), "leg_y": (54, 42, 70), "width": (24, 18, 32)}),
    "eraser": (plate, (5, 4.5, 0), 0.6, {"width": (54, 44, 64), "height": (98, 85, 115)}),
    "fish": (fish, (4.6, 3.6, 50), 0.6, {"length": (95, 80, 112), "sway": (-6, -14, 14), "width": (18, 12, 28)}),
    "gel": (gel, (5.3, 4.5, 0), 0.6, {"radius": (22, 16, 28), "length": (140, 125, 150)}),
    "line": (plate, (5, 5, -45), 0.5, {"length": (95, 80, 105), "width": (8, 6, 12)}),
    "perfume": (perfume, (5.2, 4.5, -8), 0.6, {"width": (75, 62, 88), "height": (90, 80, 105), "rim": (8, 5, 14)}),
    "rec": (plate, (5, 4.5, 0), 0.6, {"width": (82, 72, 95), "height": (68, 58, 82)}),
    "smallT": (tee, (5, 4.5, 135), 0.5, {"bar": (42, 28, 56), "bar_width": (9, 6, 13), "height": (110, 95, 120), "stem": (9, 6, 13)}),
    "T": (tee, (5, 4.5, 0), 0.6, {"bar": (62, 54, 70), "bar_width": (28, 22, 34), "height": (103, 94, 112), "stem": (24, 16, 34)}),
    "tape": (tape, (4.9, 4.5, 0), 0.3, {"outer": (32, 26, 38), "hole": (9, 7, 14), "x": (0, -6, 6), "y": (0, -6, 6)}),
    "tennis": (tennis, (5, 5, 0), 0, {}),
    "trig": (trig, (4.9, 4.1, 0), 0.6, {"side": (66, 60, 76)}),
    "X": (cross, (6, 4.1, 45), 0.6, {"long": (90, 70, 105), "short": (90, 70, 105), "width": (8, 5, 13)}),
}
