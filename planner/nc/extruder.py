"""The extruder of a 3-D printer as an axis that follows the path: what it feeds on each block of a program.

    X and Y with E     the block feeds that much filament, in proportion to the way along it
    E alone            nothing else moves: a full stop for as long as it takes (geometry/extrusion.py), at the F in force
    M82, M83           E is a place, or a step. After G91 it is a step whatever holds, as in Klipper; Marlin's G90 also ends M83
    G92 E0             what E is called from here on; nothing moves
    RESTORE_GCODE_STATE   M82 or M83, G90 or G91, F and the place of E as SAVE_GCODE_STATE kept them

E is in the program's units, and starts at 0. The words are gone through once more, for E alone, after the
blocks are known: a row of the program has one block at most where E stands beside G0 to G3.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import InputError
from planner.base.kernels import njit
from planner.base.units import MM_PER_INCH, SECONDS_PER_MINUTE
from planner.nc.lexer import Words
from planner.nc.program import MOVES, EventTable, Kind, Program, renumbered

_FLOW, _WHOLE_FLOW = 221.0, 100.0  # M221 S100
_E, _F, _G, _M = ord("E"), ord("F"), ord("G"), ord("M")
# G codes in tenths beside which E is the extruder's: straight moves, arcs, planes, units, distance and feed
# modes.
_WITH_MOVES = np.array([0, 10, 20, 30, 50, 170, 180, 190, 200, 210, 640, 900, 910, 911, 940])


class _Fed(NamedTuple):
    """Extruder words by row: amount (R,) [mm], 0 on most; feed in force (R,) [mm/s], 0 before the first F."""

    amount: FloatArray
    feed: FloatArray


def with_extruder(
    program: Program,
    words: Words,
    rows: int,
    factors: Sequence[tuple[int, float]] = (),
    states: Sequence[tuple[int, str, bool]] = (),
) -> Program:
    """The program with what the extruder feeds on each block, and full stops where it moves alone. Raises
    InputError for a flow that is not 100 % (M221), for an E word beside more than one move or beside another
    G code, and for one alone before the first F word.

    words   : of the program; of these the first `rows` rows
    factors : by which F counts from a line on (M220)
    states  : line, name, and whether it is brought back, of the states that are kept (saved_states.py)
    """
    state = np.zeros(rows, dtype=np.int64)
    names = list(dict.fromkeys(name for _, name, _ in states))
    for of, name, back in states:
        state[words.line[:rows] == of] = (1 + names.index(name)) * (-1 if back else 1)
    fed = _Fed(*_fed(words.letter, words.value, words.first[: rows + 1], _WITH_MOVES, state))
    if not fed.amount.any():
        return program
    of_line, factor = zip((0, 1.0), *factors, strict=True)
    fed.feed[:] *= np.array(factor)[np.searchsorted(of_line, words.line[:rows], side="right") - 1]
    for row in words.rows_with(words.find("M", _FLOW)):
        letter, value = words.of_rows(row)
        if row < rows and (value[letter == ord("S")] != _WHOLE_FLOW).any():
            _refuse_any(program, words.line[row : row + 1], "a flow that is not 100 % (M221)")
    given = np.flatnonzero(fed.amount)
    line, unknown = words.line[given], np.isnan(fed.amount[given])
    _refuse_any(program, line[unknown], "an E word beside a G code that is none of G0 to G3, G5 and G92")
    of_moves = np.flatnonzero(np.isin(program.kind, MOVES))
    first, last = (np.searchsorted(program.line[of_moves], line, side=side) for side in ("left", "right"))
    alone, several = last == first, last - first > 1
    text = "an E word beside more than one move; write G0 to G3 alone on its line"
    _refuse_any(program, line[several], text)
    without = alone & (fed.feed[given] == 0.0)
    _refuse_any(program, line[without], "an E word alone before the first F word; write its feed")
    extruded = np.zeros(len(program))
    extruded[of_moves[first[~alone]]] = fed.amount[given[~alone]]
    at = np.searchsorted(program.line, line[alone], side="right")
    return _with_stops(program, extruded, at, line[alone], _Fed(*(c[given[alone]] for c in fed)))


def _refuse_any(program: Program, line: Array, what: str) -> None:
    """Raise InputError for the first of the lines (n,), if there are any."""
    if len(line):
        raise InputError(f"{what}; or give --extruder ignore", source=program.source, line=int(line[0]))


def _with_stops(program: Program, extruded: FloatArray, at: Array, line: Array, alone: _Fed) -> Program:
    """The program with a full stop before each of the blocks `at` (n,), not decreasing, on lines (n,), where
    the extruder moves alone; `extruded` (B,) are those of the blocks that are there."""

    def put(values: Array, new: Any) -> Array:
        return np.insert(values, at, new, axis=0)

    def later(block: Array) -> Array:
        return block + np.searchsorted(at, block, side="right")

    before = np.maximum(at - 1, 0)
    place = np.vstack([program.start, program.end])[at]
    columns: dict[str, Any] = {
        "kind": put(program.kind, Kind.STOP),
        "end": put(program.end, place),
        "feed": put(program.feed, alone.feed),
        "dwell": put(program.dwell, 0.0),
        "line": put(program.line, line),
        "extruded": put(extruded, alone.amount),
    }
    for name, where_none in (("path_control", 0.0), ("tolerance", np.nan)):
        old = getattr(program, name)
        columns[name] = put(old, old[before] if len(program) else where_none)
    events = program.events
    if isinstance(events, EventTable):
        low, high = (np.searchsorted(at, events.block, side=side) for side in ("left", "right"))
        stops = np.clip(np.searchsorted(line, events.line), low, high)  # that come before the event
        events = dataclasses.replace(events, block=events.block + stops)
    return renumbered(program, later, events=events, **columns)


@njit(cache=True, error_model="numpy")
def _fed(letter, value, first, with_moves, state):
    """Filament by row (R,) [mm], NaN beside G codes not in `with_moves`; feed in force (R,) [mm/s].

    state : (R,) k in rows that keep the state of the number k, -k in those that bring it back, else 0
    """
    rows = len(first) - 1
    amount, feeds = np.zeros(rows), np.zeros(rows)
    absolute, absolute_moves, unit, feed, place = True, True, 1.0, 0.0, 0.0
    kept = np.zeros((1 + np.abs(state).max() if rows else 1, 4))
    for row in range(rows):
        if state[row] > 0:
            kept[state[row], 0], kept[state[row], 1] = absolute, absolute_moves
            kept[state[row], 2], kept[state[row], 3] = feed, place
        elif state[row] < 0:
            back = kept[-state[row]]
            absolute, absolute_moves, feed, place = back[0] > 0.0, back[1] > 0.0, back[2], back[3]
        has, sets, others, unknown, e, before = False, False, False, False, 0.0, unit
        for word in range(first[row], first[row + 1]):
            c, v = letter[word], value[word]
            if c == _E:
                has, e = True, v
            elif c == _F and v > 0.0:
                feed = v * before / SECONDS_PER_MINUTE
            elif c == _M:
                others = others or not (v == 82.0 or v == 83.0)
                if v == 82.0 or v == 83.0:
                    absolute = v == 82.0
            elif c == _G:
                code = int(np.rint(v * 10.0))
                if code == 900 or code == 910:
                    absolute_moves = code == 900
                elif code == 200 or code == 210:
                    unit = MM_PER_INCH if code == 200 else 1.0
                sets = sets or code == 920
                known = False
                for k in range(len(with_moves)):
                    known = known or code == with_moves[k]
                unknown = unknown or not (known or code == 920)
        feeds[row] = feed
        if not has or others:
            continue
        if unknown:
            amount[row] = np.nan
        elif sets:
            place = e * unit
        elif absolute and absolute_moves:
            amount[row] = e * unit - place
            place = e * unit
        else:
            amount[row] = e * unit
            place += e * unit
    return amount, feeds
