"""What an exported program tells the extruder of a printer: other code than the exporter's."""

from __future__ import annotations

import math
import re

import numpy as np

from benchmarks.controls.export_judge import ARC_STEP
from planner.base.arrays import FloatArray


def filament(text: str, control: str) -> FloatArray:
    """(n, 5) where a printer is after each line with E, and at what F: x y z, mm of filament in all, F; by the control's own rules:
    after G91 E is a step, and Marlin's G90 ends M83. Arcs in the plane of x and y are there in steps of `ARC_STEP`."""
    absolute, steps = True, False
    place, zero, fed, feed = dict.fromkeys("XYZE", 0.0), dict.fromkeys("XYZE", 0.0), 0.0, 0.0
    found = []
    for line in text.splitlines():
        words = re.findall(r"([A-Z])(-?[\d.]+)", line.split(";")[0])
        code = "".join(words[0]) if words else ""
        given = {letter: float(number) for letter, number in words[1:]}
        if code in ("G90", "G91"):
            absolute = code == "G90"
            steps = steps if control == "klipper" and absolute else not absolute
        elif code in ("M82", "M83"):
            steps = code == "M83"
        elif code == "G92":
            zero |= {letter: place[letter] - value for letter, value in given.items()}
        elif code == "G28":
            place |= dict.fromkeys("XYZ", 0.0)
        elif code in ("G0", "G1", "G2", "G3"):
            feed = given.get("F", feed)
            before, start = place["E"], np.array([place[letter] for letter in "XYZ"])
            for letter, value in given.items():
                if letter in place:
                    step = steps or not absolute if letter == "E" else not absolute
                    place[letter] = value + (place[letter] if step else zero[letter])
            amount = place["E"] - before
            if code in ("G2", "G3") and "E" in given:
                end = np.array([place[letter] for letter in "XYZ"])
                for share, point in _bend(start, end, given, clockwise=code == "G2"):
                    found.append([*point, fed + share * amount, feed])
            fed += amount
            if "E" in given:
                found.append([*(place[letter] for letter in "XYZ"), fed, feed])
    return np.array(found).reshape(-1, 5)


def _bend(
    start: FloatArray, end: FloatArray, given: dict[str, float], *, clockwise: bool
) -> list[tuple[float, FloatArray]]:
    """Points (3,) inside an arc of a printer with the share of its length before them; its centre is start + (I, J)."""
    arm = np.array([-given.get("I", 0.0), -given.get("J", 0.0)])
    out = end[:2] - start[:2] + arm
    sweep = math.atan2(arm[0] * out[1] - arm[1] * out[0], arm @ out)
    sweep = sweep % (2.0 * math.pi) or 2.0 * math.pi
    sweep = (sweep - 2.0 * math.pi or -2.0 * math.pi) if clockwise else sweep
    found = []
    for share in np.linspace(0.0, 1.0, 2 + int(abs(sweep) / ARC_STEP))[1:-1].tolist():
        c, s = math.cos(share * sweep), math.sin(share * sweep)
        point = start + share * (end - start)
        point[:2] = start[:2] - arm + (c * arm[0] - s * arm[1], s * arm[0] + c * arm[1])
        found.append((share, point))
    return found
