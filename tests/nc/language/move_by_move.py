"""The moves of a program as a second reading has them."""

from __future__ import annotations

import numpy as np

from planner.nc.program import Kind, Program


def moves_of(read: Program) -> list[tuple[float, ...]]:
    """Kind, place and angle of every move that leads somewhere."""
    sweep = dict(zip(read.arc_block.tolist(), read.arc_sweep.tolist(), strict=True))
    kinds = {Kind.RAPID: 0, Kind.LINE: 1}
    found = []
    for k, (kind, end) in enumerate(zip(read.kind.tolist(), read.end.tolist(), strict=True)):
        if kind in (Kind.RAPID, Kind.LINE, Kind.ARC):
            angle = sweep.get(k, 0.0)
            found.append((kinds.get(kind, 3 if angle > 0 else 2), *end, angle))
    return found


def leading(moves: list[tuple[float, ...]]) -> np.ndarray:
    """(n, 5) without moves that stay where they are."""
    kept, before = [], np.zeros(3)
    for move in moves:
        if move[4] or np.abs(np.array(move[1:4]) - before).max() > 1e-9:
            kept.append(move)
        before = np.array(move[1:4])
    return np.array(kept)
