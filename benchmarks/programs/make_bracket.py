"""Write the program that the package ships: a bracket with two slots, a pocket and a dense free-form rim.

    python benchmarks/programs/make_bracket.py > planner/examples/bracket.ngc

It has in a hundred millimetres what a planner meets: rapids, lines with sharp and flat corners, arcs and a
helix, and a curve of many short lines as CAM systems write it.
"""

from __future__ import annotations

import math

SAFE, DEEP = 5.0, -3.0
RIM_LINES = 240  # chords of about 1 mm


def main() -> None:
    for line in (*_head(), *_pocket(), *_slots(), *_rim(), *_tail()):
        print(line)


def _head() -> list[str]:
    return [
        "%",
        "(Bracket: pocket, two slots, free-form rim. Made by benchmarks/programs/make_bracket.py)",
        "G21 G90 G17 G94 G40 G49 G54",
        "G64 P0.02",
        "T1 M6",
        "S12000 M3",
        f"G0 Z{SAFE:.3f}",
    ]


def _pocket() -> list[str]:
    """Down a helix, then rectangular rounds with rounded corners, from the inside out."""
    lines = ["(pocket)", "G0 X30.000 Y20.000", "G0 Z1.000", "F1800"]
    lines += [f"G3 X30.000 Y20.000 Z{-1.0 * turn:.3f} I-2.000 J0.000" for turn in range(4)]
    lines.append("F6000")
    for k in range(1, 5):
        a, b, r = 3.0 * k + 2.0, 2.5 * k + 1.0, 1.5
        lines += [
            f"G1 X{28 + a:.3f} Y{20 - b + r:.3f}",
            f"G1 X{28 + a:.3f} Y{20 + b - r:.3f}",
            f"G3 X{28 + a - r:.3f} Y{20 + b:.3f} I{-r:.3f} J0.000",
            f"G1 X{28 - a + r:.3f} Y{20 + b:.3f}",
            f"G3 X{28 - a:.3f} Y{20 + b - r:.3f} I0.000 J{-r:.3f}",
            f"G1 X{28 - a:.3f} Y{20 - b:.3f}",
            f"G1 X{28 + a - r:.3f} Y{20 - b:.3f}",
            f"G3 X{28 + a:.3f} Y{20 - b + r:.3f} I0.000 J{r:.3f}",
        ]
    return [*lines, f"G0 Z{SAFE:.3f}"]


def _slots() -> list[str]:
    lines = ["(slots)"]
    for x in (56.0, 68.0):
        lines += [
            f"G0 X{x:.3f} Y12.000",
            "G0 Z1.000",
            f"G1 Z{DEEP:.3f} F600",
            "G1 Y28.000 F6000",
            f"G2 X{x + 5:.3f} Y28.000 R2.500",
            "G1 Y12.000",
            f"G2 X{x:.3f} Y12.000 R2.500",
            f"G0 Z{SAFE:.3f}",
        ]
    return lines


def _rim() -> list[str]:
    """A closed wavy curve in short lines."""
    lines = ["(rim)"]
    for k in range(RIM_LINES + 1):
        angle = 2.0 * math.pi * k / RIM_LINES
        wave = 1.0 + 0.04 * math.cos(9.0 * angle)
        x, y = 42.0 + 46.0 * wave * math.cos(angle), 20.0 + 28.0 * wave * math.sin(angle)
        if k == 0:
            lines += [f"G0 X{x:.3f} Y{y:.3f}", "G0 Z1.000", f"G1 Z{DEEP:.3f} F600", "F9000"]
        else:
            lines.append(f"G1 X{x:.3f} Y{y:.3f}")
    return lines


def _tail() -> list[str]:
    return [f"G0 Z{SAFE:.3f}", "M5", "G0 X0.000 Y0.000", "M30", "%"]


if __name__ == "__main__":
    main()
