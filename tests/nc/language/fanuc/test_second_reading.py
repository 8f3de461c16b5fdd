"""Random programs of Fanuc's mills by the reader and by a second reading (slow_fanuc.py), move by move."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
from move_by_move import leading, moves_of
from slow_fanuc import SlowFanuc

from planner.machine import ToolData, load_machine
from planner.nc.reader import parse_program

ORIGINS = {"G54": (0.0, 0.0, 0.0), "G55": (3.5, -2.0, 1.0), "G56": (-7.25, 11.0, 0.5), "T3": (0.0, 0.0, 7.0)}
MACHINE = load_machine("mill").model_copy(
    update={
        "tools": {"3": ToolData(length=7.0)},
        "work_offsets": {
            name.lower(): dict(zip("xyz", origin, strict=True))
            for name, origin in ORIGINS.items()
            if name[0] == "G"
        },
    }
)
SUBPROGRAMS = (
    "O2000\nG91\nG1 X1.5 Y-.5\nZ-1.\nZ1.\nG90\nM99\nO3000\nG0 X#1 Y#2\nG1 Z[#3-1.]\nX[#1+#7*2.]\nM99\n"
)


def a(low: float = -20.0, high: float = 20.0) -> str:
    """A number with a point."""
    text = f"{random.uniform(low, high):.2f}"
    return text + "1" if text.endswith(".00") else text


def everything() -> str:
    """A rapid move that names all axes."""
    return f"G90 G0 X{a()} Y{a()} Z{a(5, 20)}"


def straight() -> list[str]:
    """Moves of some axes, absolute or incremental."""
    words = " ".join(f"{c}{a()}" for c in random.sample("XYZ", random.randint(1, 3)))
    return [random.choice(["G1 ", "G0 ", "G90 G1 "]) + words, "G91 G1 X" + a(), "Z" + a(-3, 3), "G90"]


def arcs() -> list[str]:
    """Arcs with R, half circles and full ones."""
    x, y = random.uniform(-9, 9), random.uniform(-9, 9)
    radius = math.hypot(x, y) / 2.0 * random.uniform(1.1, 3.0) * random.choice([1, 1, -1])
    code = random.choice(["G2", "G3"])
    return [
        f"G91 {code} X{x:.3f} Y{y:.3f} R{radius:.3f}",
        f"{code} X{2 * x:.4f} Y{2 * y:.4f} I{x:.4f} J{y:.4f} Z{a(-1, 1)}",
        f"{code} I{x:.4f} J{y:.4f}",
        "G90 G1 X" + a(),
    ]


def frame() -> list[str]:
    """Another work system, a shift, a rotation, and back."""
    turned = [f"G68 X{a()} Y{a()} R{a(-170, 170)}", everything(), "G1 X" + a(), *arcs(), "G69", everything()]
    shifted = [f"G52 X{a()} Y{a()} Z{a()}", everything(), "G52 X0 Y0 Z0", everything()]
    return [
        random.choice(["G55", "G56"]),
        everything(),
        *random.choice([turned, shifted]),
        "G54",
        everything(),
    ]


def length() -> list[str]:
    """A tool length."""
    return ["G43 H3", everything(), "G1 Z" + a(), "G49", everything()]


def holes() -> list[str]:
    """A drilling cycle with words that hold, in steps too."""
    first = [
        everything(),
        random.choice(["G98", "G99"]),
        f"G81 X{a()} Y{a()} Z{a(-9, -1)} R{a(1, 4)} F100.",
        f"X{a()}",
        f"Z{a(-9, -5)}",
    ]
    return [*first, f"G91 X{a(1, 5)} Y{a(1, 5)} K3", "G90", "G80", everything()]


def loop() -> list[str]:
    """A loop with parameters, and a jump over a move."""
    number = random.randint(10, 9999)
    jump = [
        f"IF[#2{random.choice(['GT', 'LT', 'EQ', 'NE'])}2]GOTO{number}",
        "G1 X" + a(),
        f"N{number} G1 Y" + a(),
    ]
    body = [f"G1 X[#2*{a(1, 3)}] Y[#3+SIN[#2*30.]]", "#2=#2+1", "#3=#3-#2/2"]
    return ["#2=0", "#3=" + a(), f"WHILE[#2LT{random.randint(1, 4)}]DO1", *body, "END1", *jump]


def call() -> list[str]:
    """Subprograms."""
    return [f"M98 P2000 L{random.randint(1, 3)}", f"G65 P3000 A{a()} B{a()} C{a()} D{a()}"]


def program(seed: int) -> str:
    """A random program."""
    random.seed(seed)
    unit = random.choice(["G21", "G20"])
    pieces = [piece() for piece in random.choices([straight, arcs, frame, length, holes, loop, call], k=12)]
    lines = [line for piece in pieces for line in piece]
    head = ["O1000", f"G17 {unit} G90 G94 G98 G49 G80 G54 F600.", everything()]
    return "\n".join([*head, *lines, "M30", ""]) + SUBPROGRAMS


@pytest.mark.shows("read-fanuc", "sampled: random programs by a second reading that shares no code")
@pytest.mark.parametrize("seed", range(60))
def test_both_readings_move_alike(seed: int) -> None:
    text = program(seed)
    slow = SlowFanuc(text, ORIGINS)
    found, expected = leading(moves_of(parse_program(text, MACHINE))), leading(slow.moves)
    assert len(expected) > 20
    np.testing.assert_allclose(found, expected, atol=1e-6)
