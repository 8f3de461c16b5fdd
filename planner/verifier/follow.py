"""Positions alone, matched with a path (matching.py): no limits, no standstills."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.verifier.findings import Look
from planner.verifier.kernel import kernel
from planner.verifier.matching import SEARCH_MAX, SEARCHED, Located, match_samples, new_match, nowhere
from planner.verifier.pieces import ProgramPieces, reach_piece
from planner.verifier.stops import AtStop
from planner.verifier.stream import Observed
from planner.verifier.worst import Worst

Each = Callable[[FloatArray, FloatArray, Located], None]


def follow(
    parts: Iterable[tuple[FloatArray, FloatArray]],
    pieces: ProgramPieces,
    note: str = "",
    *,
    each: Each | None = None,
    search: bool = True,
) -> Look:
    """Match a motion with a path.

    parts  : of its samples, in order: times (T,) [s], positions (T, A) [mm]
    each   : called with times (T,) [s], distance over budget (T,) and places of every part
    search : whether a motion that was lost is looked for on the pieces ahead; if not, it is lost for good
    """
    axes = pieces.vertex.shape[1]
    seen = Observed(match=new_match(pieces), worst=Worst((), axes))
    if not search:
        seen.match.tally[SEARCHED] = SEARCH_MAX
    free = np.full(axes, np.inf)
    anywhere = AtStop(free, free, np.zeros(axes))  # the motion need not rest
    carried_t, carried = np.empty(0), np.empty((0, axes))
    for new_t, new in parts:
        t, position = np.concatenate([carried_t, new_t]), np.concatenate([carried, new])
        skip = len(carried_t)
        seen.take(t, position, skip)
        place = nowhere(len(t))
        match_samples(pieces, seen.match, t, position, skip, 1, position[:0], anywhere, place)
        if each is not None:
            ratio = np.empty(len(t))
            _ratios(pieces, place.piece, position, ratio)
            each(t[skip:], ratio[skip:], Located(*(column[skip:] for column in place)))
        carried_t, carried = t[-1:], position[-1:]
    return Look(seen, note)


@kernel()
def _ratios(pieces: ProgramPieces, piece: Array, position: FloatArray, ratio: FloatArray) -> None:
    """Distance of each position from its piece over the piece's budget, into `ratio` (n,)."""
    for k in range(len(piece)):
        _, _, distance = reach_piece(pieces, piece[k], position[k], 0.0)
        ratio[k] = distance / pieces.piece[piece[k]]["budget"]
