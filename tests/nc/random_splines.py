"""Splines beside LinuxCNC's: programs of them by chance, and its points on their curves."""

from __future__ import annotations

import numpy as np

from planner.base.arrays import Array
from planner.nc.bezier import at as bezier_at
from planner.nc.bezier import homogeneous
from planner.nc.program import Kind, Program

NEAR = 1e-9  # [mm]


def with_splines_whole(program: Program, blocks: Array, move: Array) -> Array:
    """LinuxCNC's moves with one row for each spline, where it makes lines between points of the curve that are evenly apart in its
    parameter: all of them are on the program's curve at those parameters.

    blocks : of the program, as many as moves where a spline counts once
    """
    out, at = [], 0
    for block in blocks:
        assert at < len(move)
        if program.kind[block] != Kind.SPLINE:
            out.append(move[at])
            at += 1
            continue
        rows = program.splines.block == block
        pieces = homogeneous(program.splines.points[rows], program.splines.weights[rows])
        count = int(np.argmax(np.append(move[at:, 1] != move[at, 1], True)))
        u = len(pieces) * np.arange(1, count + 1) / count
        piece = np.minimum(u.astype(int), len(pieces) - 1)
        points = [
            bezier_at(pieces[k : k + 1], np.array([x - k]))[0][0, 0] for k, x in zip(piece, u, strict=True)
        ]
        np.testing.assert_allclose(move[at : at + count, 2:5], points, rtol=1e-12, atol=NEAR)
        out.append(move[at + count - 1].copy())
        out[-1][[0, 1]] = Kind.SPLINE, program.line[block]
        at += count
    assert at == len(move)
    return np.array(out).reshape(-1, move.shape[1])


def random_splines(rng: np.random.Generator) -> str:
    """G5, G5.1 and G5.2 in series, in both units, absolute and incremental."""
    lines = [rng.choice(["G20", "G21"]), "G0 X1 Y2 Z3", "F120"]

    def number() -> str:
        return f"{rng.uniform(-20, 20):.{rng.integers(1, 5)}f}"

    for _ in range(rng.integers(1, 6)):
        choice = rng.integers(4)
        if choice == 0:
            lines.append(rng.choice(["G90", "G91"]))
            lines.append(f"G5 X{number()} Y{number()} I{number()} J{number()} P{number()} Q{number()}")
            lines += [f"G5 X{number()} Y{number()} P{number()} Q{number()}"] * int(rng.integers(2))
        elif choice == 1:
            lines.append(f"{rng.choice(['G90', 'G91'])} G5.1 X{number()} Y{number()} I{number()} J{number()}")
        elif choice == 2:
            order = rng.integers(3, 5)
            lines.append(f"G90 G5.2 P{rng.uniform(0.3, 3):.3f} L{order}")
            lines += [
                f"X{number()} Y{number()} P{rng.uniform(0.3, 3):.3f}" for _ in range(order + rng.integers(4))
            ]
            lines.append("G5.3")
        else:
            lines.append(f"G90 G1 X{number()} Z{number()} F{rng.uniform(1, 900):.2f}")
    return "\n".join(lines) + "\nM2\n"
