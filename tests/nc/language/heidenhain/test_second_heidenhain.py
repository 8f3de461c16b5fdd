"""Random conversational programs by the reader and by a second reading (slow_heidenhain.py), move by move."""

from __future__ import annotations

import random

import numpy as np
import pytest
from move_by_move import leading, moves_of
from slow_heidenhain import SlowHeidenhain

from planner.machine import load_machine
from planner.nc.reader import parse_program

MACHINE = load_machine("mill")


def a(low: float = -20.0, high: float = 20.0) -> str:
    """A number with its sign."""
    return f"{random.uniform(low, high):+.3f}"


def everything() -> str:
    """A rapid move that names all axes."""
    return f"L X{a()} Y{a()} Z{a(5, 20)} R0 FMAX"


def straight() -> list[str]:
    """Moves of some axes."""
    words = " ".join(random.choice(["", "I"]) + c + a() for c in random.sample("XYZ", random.randint(1, 3)))
    return [f"L {words} F600", f"L IX{a()} FMAX", f"L Y{a()} F600"]


def arcs() -> list[str]:
    """Arcs about a pole, with a radius, and tangent ones."""
    x, y = random.uniform(2, 9), random.uniform(-9, 9)
    turn, radius = random.choice("+-"), (x * x + y * y) ** 0.5 / 2.0 * random.uniform(1.1, 3.0)
    size = random.choice(["+", "-"])
    return [
        f"CC IX{x:+.4f} IY{y:+.4f}",
        f"C IX{2 * x:+.4f} IY{2 * y:+.4f} DR{turn} F600",
        f"CR IX{x:+.4f} IY{y:+.4f} R{size}{radius:.4f} DR{turn}",
        f"L IX{x:+.4f}",
        f"CT IX{a(1, 5)} IY{a(1, 5)}",
        f"CT IX{a(1, 5)} IY{a(1, 5)}",
        f"L X{a()}",
    ]


def polar() -> list[str]:
    """Polar moves and a helix."""
    turn = random.choice([-1, 1])
    angle = turn * random.uniform(20, 800)
    return [
        f"CC X{a()} Y{a()}",
        f"LP PR{a(3, 9)} PA{a(-180, 180)} F600",
        f"LP IPA{a(20, 90)}",
        f"CP PA{a(-180, 180)} DR{random.choice('+-')}",
        f"CP IPA{angle:+.3f} IZ{a(-3, 3)} DR{'+' if turn > 0 else '-'}",
        f"LP IPR{a(1, 3)} PA{a(-180, 180)}",
    ]


def frame() -> list[str]:
    """A shift, then a rotation, a mirror image or a scale, and back."""
    begun, ended = random.choice(
        [
            ([f"CYCL DEF 10.1 ROT{a(-170, 170)}"], ["CYCL DEF 10.1 ROT+0"]),
            ([f"CYCL DEF 10.1 ROT{a(10, 80)}", "CYCL DEF 10.1 IROT+15"], ["CYCL DEF 10.1 ROT+0"]),
            ([f"CYCL DEF 8.1 {random.choice('XY')}"], ["CYCL DEF 8.1"]),
            ([f"CYCL DEF 11.1 SCL {random.uniform(0.5, 2.0):.3f}"], ["CYCL DEF 11.1 SCL 1"]),
        ]
    )
    shift = [f"CYCL DEF 7.1 X{a()}", f"CYCL DEF 7.2 Y{a()}", f"CYCL DEF 7.3 Z{a(-3, 3)}"]
    back = ["CYCL DEF 7.1 X+0", "CYCL DEF 7.2 Y+0", "CYCL DEF 7.3 Z+0", everything()]
    inside = [*straight(), *random.choice([arcs, polar])()]
    return [*shift, *begun, everything(), *inside, *ended, *back]


def holes() -> list[str]:
    """Cycle 200 at some places."""
    words = f"Q200=+2 Q201={a(-9, -3)} Q206=+150 Q202=+50 Q210=+0 Q203={a(-2, 2)} Q204=+2 Q211=+0"
    return [
        everything(),
        f"CYCL DEF 200 DRILLING {words}",
        "CYCL CALL",
        f"L X{a()} FMAX",
        "CYCL CALL",
        everything(),
    ]


def computed() -> list[str]:
    """Parameters, a repeat, and a jump over a move."""
    first, second = random.sample(range(10, 9999), 2)
    return [
        "Q1 = 0",
        f"Q2 = {a()}",
        f"LBL {first}",
        f"Q1 = Q1 + 1 + COS Q2 / {a(3, 9)}",
        "L X+Q1 IY-Q2 F600",
        f"CALL LBL {first} REP{random.randint(1, 3)}",
        f"FN 11: IF +Q1 {random.choice(['GT', 'LT'])} +2 GOTO LBL {second}",
        f"L X{a()} F600",
        f"LBL {second}",
        f"L Y{a()} F600",
    ]


def program(seed: int) -> str:
    """A random program with a subprogram."""
    random.seed(seed)
    pieces = [piece() for piece in random.choices([straight, arcs, polar, frame, holes, computed], k=10)]
    lines = [line for piece in pieces for line in [*piece, *["CALL LBL 5"] * random.randint(0, 1)]]
    lines = [line.replace("FN 11: IF +Q1 LT", "FN 12: IF +Q1 LT") for line in lines]
    unit = random.choice(["MM", "MM", "INCH"])
    body = [everything(), *lines, "M30", "LBL 5", "L IX+1.5 F600", "L IY-2.25", "LBL 0"]
    numbered = [f"{n} {line}" for n, line in enumerate(body, start=1)]
    return "\n".join([f"0 BEGIN PGM T {unit}", *numbered, f"{len(body) + 1} END PGM T {unit}", ""])


@pytest.mark.shows("read-heidenhain", "sampled: random programs by a second reading that shares no code")
@pytest.mark.parametrize("seed", range(60))
def test_both_readings_move_alike(seed: int) -> None:
    text = program(seed)
    found, expected = leading(moves_of(parse_program(text, MACHINE))), leading(SlowHeidenhain(text).moves)
    assert len(expected) > 20
    np.testing.assert_allclose(found, expected, atol=1e-6)
