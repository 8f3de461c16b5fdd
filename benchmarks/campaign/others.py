"""Jobs of the campaign as other people's programs are: from what CAM writes for a pocket to a fourth axis, on machines of all sorts.

A kind of program is drawn, then what may stand over any of them: inches, an F in every block, coordinates far from the origin, a
part of some hundredths of a millimetre or of metres, a path control. Machines have axes of unequal limits, periods from 0.25 to 8 ms,
and three of ten filters of 1 to 60 ms.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from planner.machine import Axis, Fir, Machine

Rng = np.random.Generator
Way = list[tuple[str, dict[str, float]]]  # blocks: code, and words in millimetres or degrees
PERIODS = (0.00025, 0.0005, 0.001, 0.002, 0.004, 0.008)  # [s]
ROUND = "XYZIJR"  # words that are lengths
INCH = 25.4  # [mm]
PLACES = 5  # digits behind the point: what CAM writes for inches, and more than it writes for millimetres


def _pocket(rng: Rng) -> Way:
    """Inwards in rings whose corners are arcs, after a helix down to the floor."""
    width, height = rng.uniform(10, 40, 2)
    radius, step = rng.uniform(1.0, 4.0), rng.uniform(1.0, 2.0)
    way: Way = [("G0", {"X": width / 2 + 1, "Y": height / 2, "Z": 1.0})]
    turns = {"P": float(rng.integers(1, 4))}
    way += [("G3", {"X": width / 2 + 1, "Y": height / 2, "Z": -1.0, "I": -1.0, "J": 0.0} | turns)]
    for ring in range(int(rng.integers(1, 4))):
        a, b = ring * step, radius
        right, top = width - a, height - a
        way += [("G1", {"X": a + b, "Y": a}), ("G1", {"X": right - b, "Y": a})]
        way += [("G3", {"X": right, "Y": a + b, "I": 0.0, "J": b}), ("G1", {"X": right, "Y": top - b})]
        way += [("G3", {"X": right - b, "Y": top, "I": -b, "J": 0.0}), ("G1", {"X": a + b, "Y": top})]
        way += [("G3", {"X": a, "Y": top - b, "I": 0.0, "J": -b}), ("G1", {"X": a, "Y": a + b})]
        way += [("G3", {"X": a + b, "Y": a, "I": b, "J": 0.0})]
    return way


def _drilling(rng: Rng) -> Way:
    """Holes, each by a rapid, a feed down in pecks, and a rapid up."""
    way: Way = []
    for _ in range(int(rng.integers(2, 6))):
        x, y = rng.uniform(-50, 50, 2)
        way += [("G0", {"X": x, "Y": y}), ("G0", {"Z": 1.0})]
        for peck in range(int(rng.integers(1, 4))):
            way += [("G1", {"Z": -2.0 * (peck + 1)}), ("G0", {"Z": 1.0})]
    return way


def _lettering(rng: Rng) -> Way:
    """Strokes of segments of some hundredths to tenths of a millimetre, with the pen up between them."""
    way: Way = []
    for _ in range(int(rng.integers(1, 4))):
        at, heading = rng.uniform(-5, 5, 2), rng.uniform(0, 2 * np.pi)
        way += [("G0", {"Z": 0.5}), ("G0", {"X": at[0], "Y": at[1]}), ("G1", {"Z": -0.1})]
        for _ in range(int(rng.integers(3, 9))):
            heading += rng.normal() * 0.6
            at = at + 10 ** rng.uniform(-2.0, -0.3) * np.array([np.cos(heading), np.sin(heading)])
            way += [("G1", {"X": at[0], "Y": at[1]})]
    return way


def _relief(rng: Rng) -> Way:
    """Rows there and back over a surface."""
    step, way = 10 ** rng.uniform(-1.0, 0.3), Way()
    for row in range(int(rng.integers(1, 4))):
        x = np.arange(int(rng.integers(4, 10))) * step
        x = x if row % 2 == 0 else x[::-1]
        z = step * np.sin(x / step * rng.uniform(0.2, 1.5) + row)
        way += [("G1", {"X": a, "Y": row * step, "Z": b}) for a, b in zip(x, z, strict=True)]
    return way


def _trochoid(rng: Rng) -> Way:
    """Circles that go on by a part of their radius."""
    radius, way = 10 ** rng.uniform(-0.5, 1.0), Way()
    step = radius * rng.uniform(0.05, 0.5)
    for turn in range(int(rng.integers(2, 10))):
        x = turn * step
        way += [("G1", {"X": x, "Y": 0.0}), ("G3", {"X": x, "Y": 0.0, "I": 0.0, "J": radius})]
    return way


def _helix(rng: Rng) -> Way:
    """Helices of several turns, and circles from micrometres to decimetres."""
    way: Way = []
    x = 0.0
    for _ in range(int(rng.integers(1, 4))):
        radius = 10 ** rng.uniform(-2.3, 1.8)
        x += 2 * radius
        down = -radius * rng.uniform(0.0, 2.0)
        turns = {"P": float(rng.integers(1, 4))}
        code = f"G{rng.integers(2, 4)}"
        way += [("G1", {"X": x, "Y": 0.0, "Z": 0.0})]
        way += [(code, {"X": x, "Y": 0.0, "Z": down, "I": -radius, "J": 0.0} | turns)]
    return way


def _contour(rng: Rng) -> Way:
    """One contour of lines and arcs, again and again, deeper each time."""
    count = int(rng.integers(3, 7))
    angle = np.sort(rng.uniform(0, 2 * np.pi, count))
    points = rng.uniform(5, 30, count)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    way: Way = [("G0", {"X": points[-1, 0], "Y": points[-1, 1]})]
    for level in range(int(rng.integers(2, 4))):
        way += [("G1", {"Z": -0.5 * (level + 1)})]
        before = points[-1]
        for k, (x, y) in enumerate(points):
            half = float(np.hypot(x - before[0], y - before[1])) / 2
            bent = {"R": half * 1.5} if k == 0 and half > 1.0 else {}
            way += [("G2" if bent else "G1", {"X": x, "Y": y} | bent)]
            before = points[k]
    return way


def _fourth_axis(rng: Rng) -> Way:
    """Indexed, wrapped round and turned while it moves along."""
    way: Way = []
    turned, x = 0.0, 0.0
    for _ in range(int(rng.integers(3, 12))):
        kind = rng.random()
        turned += rng.normal() * 60 * (kind < 0.8)
        x += rng.normal() * 5 * (kind > 0.2)
        way += [("G0" if kind < 0.15 else "G1", {"X": x, "A": turned})]
    return way


KINDS = {
    "others: pocket": _pocket,
    "others: drilling": _drilling,
    "others: lettering": _lettering,
    "others: relief": _relief,
    "others: trochoid": _trochoid,
    "others: helix": _helix,
    "others: contour, repeated": _contour,
    "others: fourth axis": _fourth_axis,
}


def drawn(rng: Rng) -> tuple[str, str, Machine]:
    """Kind, text and machine. Raises ValueError for a machine of limits that there may not be."""
    kind = str(rng.choice(list(KINDS)))
    way = KINDS[kind](rng)
    return kind, text_of(way, rng), machine_of(rng, "xyza" if kind.endswith("axis") else "xyz")


def text_of(way: Way, rng: Rng) -> str:
    """The program: in millimetres or inches, with one F or an F in every block, scaled, moved far away."""
    inch, often = rng.random() < 0.25, rng.random() < 0.3
    scale = 10 ** rng.uniform(-2.5, 1.6) if rng.random() < 0.2 else 1.0
    away = rng.normal(size=3) * 10 ** rng.uniform(2, 5) if rng.random() < 0.15 else np.zeros(3)
    feed = 60 * 10 ** rng.uniform(0.5, 2.3)  # [mm/min]
    unit = INCH if inch else 1.0
    place = dict(zip("XYZ", away, strict=True))
    control = [str(rng.choice(["G61", "G61.1", "G64", f"G64 P{10 ** rng.uniform(-3, -0.7) / unit:.5f}"]))]
    lines = [
        f"G{20 if inch else 21} G17 G90 G94 F{feed / unit:.3f}",
        *(control if rng.random() < 0.7 else []),
    ]
    lines.append("G0 " + " ".join(f"{letter}{value / unit:.{PLACES}f}" for letter, value in place.items()))
    for code, words in way:
        told = "".join(
            f" {letter}{_word(letter, value, scale, place, unit)}" for letter, value in words.items()
        )
        fed = f" F{feed * 10 ** rng.uniform(-0.5, 0.5) / unit:.3f}" if often and code != "G0" else ""
        lines.append(f"{code}{told}{fed}")
    return "\n".join([*lines, "M2"]) + "\n"


def _word(letter: str, value: float, scale: float, place: dict[str, float], unit: float) -> str:
    if letter == "P":
        return str(int(value))
    if letter not in ROUND:
        return f"{value:.4f}"
    return f"{(value * scale + place.get(letter, 0.0)) / unit:.{PLACES}f}"


def machine_of(rng: Rng, letters: str) -> Machine:
    """A machine whose axes have limits of their own, from a heavy portal to a small engraver."""
    velocity, acceleration, rise = (
        10 ** rng.uniform(1.0, 3.0),
        10 ** rng.uniform(2.0, 4.3),
        10 ** rng.uniform(-2.7, -0.8),  # acceleration / jerk [s]
    )
    own = 10 ** rng.uniform(-0.5, 0.5, (len(letters), 3))
    axes = {
        letter: Axis(velocity=velocity * v, acceleration=acceleration * a, jerk=acceleration * a / (rise * j))
        for letter, (v, a, j) in zip(letters, own, strict=True)
    }
    more: dict[str, Any] = {}
    if rng.random() < 0.3:
        more["normal_acceleration"] = acceleration * 10 ** rng.uniform(-1.0, 0.3)
    if rng.random() < 0.3:
        longest = 10 ** rng.uniform(-3.0, np.log10(0.06))
        more["fir"] = Fir(time_constants=tuple(longest * rng.uniform(0.2, 1.0, rng.integers(1, 4))))
    if "a" in letters:
        more["rotary_radius"] = 10 ** rng.uniform(0.7, 2.0)
    return Machine(
        name="of others", dt=float(rng.choice(PERIODS)), tolerance=float(10 ** rng.uniform(-2.7, -0.7)),
        feed_default=10.0, axes=axes, **more,
    )  # fmt: skip
