"""The extruder of a 3-D printer as an axis that follows the path: what it feeds on each block of a program.

    X and Y with E     the block feeds that much filament, in proportion to the way along it
    E alone            nothing else moves: a full stop for as long as it takes (geometry/extrusion.py), at the F in force
    M82, M83           E is a place, or a step. After G91 it is a step whatever holds, as in Klipper; Marlin's G90 also ends M83
    G92 E0             what E is called from here on; nothing moves
    M221 S95           the flow: what follows feeds 95 % of its E
    M200 D1.75         E is a volume of filament of that diameter; D0 or S0: a length again
    G10, G11           back by S of M207, forward again by that and S of M208, at their F, once each; RETRACT_LENGTH ...
                       of SET_RETRACTION; where none of them stands before, they feed nothing, with a note
    RESTORE_GCODE_STATE   M82 or M83, G90 or G91, F, the flow and the place of E as SAVE_GCODE_STATE kept them

E is in the program's units, and starts at 0. The words are gone through once more, for E alone, after the
blocks are known: a row of the program has one block at most where E stands beside G0 to G3.
"""

from __future__ import annotations

import dataclasses
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import InputError
from planner.base.kernels import njit
from planner.base.units import MM_PER_INCH, SECONDS_PER_MINUTE
from planner.nc.lexer import Words
from planner.nc.program import MOVES, EventTable, Kind, Program, renumbered
from planner.nc.settings import PRINTER_FEED, SET_RETRACTION

_FLOW, _VOLUME = 221.0, 200.0  # M codes
_PERCENT = 100.0
# Words of these codes, from which value on they are read, and what is allowed.
_FLOWS = (
    (_FLOW, "S", np.nextafter(0.0, 1.0), "the flow is a percentage above 0, such as M221 S95"),
    (_VOLUME, "D", 0.0, "the filament's diameter is above 0, such as M200 D1.75, or D0 where E is a length"),
)
_D, _E, _F, _G, _M, _S = (ord(letter) for letter in "DEFGMS")
_KEYS = {
    "M207": {"s": "length", "f": "speed", "r": "extra", "t": "speed_forward"},  # R and T are RepRapFirmware's
    "M208": {"s": "extra", "f": "speed_forward"},
    SET_RETRACTION: {
        "retract_length": "length",
        "retract_speed": "speed",
        "unretract_extra_length": "extra",
        "unretract_speed": "speed_forward",
    },
}
# G codes in tenths beside which E is the extruder's: straight moves, arcs, planes, units, distance and feed
# modes.
_WITH_MOVES = np.array([0, 10, 20, 30, 50, 170, 180, 190, 200, 210, 640, 900, 910, 911, 940])


class Retraction(NamedTuple):
    """From a row on: the length that G10 takes back, what G11 adds to it [mm], and their speeds [mm/s]."""

    row: int = 0
    length: float = 0.0
    speed: float = PRINTER_FEED
    extra: float = 0.0
    speed_forward: float = 0.0

    def changed(self, name: str, given: Mapping[str, float], row: int) -> Retraction:
        """As a command of `RETRACTIONS` changes it."""
        per = 1.0 if name == SET_RETRACTION else SECONDS_PER_MINUTE
        found = {of: given[key] for key, of in _KEYS[name].items() if given.get(key, -1.0) >= 0.0}
        speeds = {of: value / per for of, value in found.items() if of.startswith("speed")}
        return self._replace(row=row, **found | speeds)


class _Fed(NamedTuple):
    """Extruder words by row: amount (R,) [mm], 0 on most; feed in force (R,) [mm/s], 0 before the first F."""

    amount: FloatArray
    feed: FloatArray


def with_extruder(
    program: Program,
    row: Array,
    words: Words,
    rows: int,
    factors: Sequence[tuple[int, float]] = (),
    states: Sequence[tuple[int, str, bool]] = (),
    retractions: Sequence[Retraction] = (),
) -> Program:
    """The program with what the extruder feeds on each block, and full stops where it moves alone. Raises
    InputError for an E word beside more than one move or beside another G code, for one alone before the
    first F word, and for a flow or diameter that makes no sense.

    row     : (B,) that each block comes from
    words   : of the program; of these the first `rows` rows
    factors : by which F counts from a row on (M220)
    states  : row, name, and whether it is brought back, of the states that are kept (set_limits.py)
    retractions : how G10 and G11 feed from a row on
    """
    _check_flows(words, rows, program.source)
    state = np.zeros(rows, dtype=np.int64)
    names = list(dict.fromkeys(name for _, name, _ in states))
    for of, name, back in states:
        state[of] = (1 + names.index(name)) * (-1 if back else 1)
    fed = _Fed(*_fed(words.letter, words.value, words.first[: rows + 1], _WITH_MOVES, state))
    of_row, factor = zip((0, 1.0), *factors, strict=True)
    fed.feed[:] *= np.array(factor)[np.searchsorted(of_row, np.arange(rows), side="right") - 1]
    _retract(fed, words, rows, retractions)
    if not fed.amount.any():
        return program
    given = np.flatnonzero(fed.amount)
    line, unknown = words.line[given], np.isnan(fed.amount[given])
    _refuse_any(program, line[unknown], "an E word beside a G code that is none of G0 to G3, G5 and G92")
    of_moves = np.flatnonzero(np.isin(program.kind, MOVES))
    first, last = (np.searchsorted(row[of_moves], given, side=side) for side in ("left", "right"))
    alone, several = last == first, last - first > 1
    text = "an E word beside more than one move; write G0 to G3 alone on its line"
    _refuse_any(program, line[several], text)
    without = alone & (fed.feed[given] == 0.0)
    _refuse_any(program, line[without], "an E word alone before the first F word; write its feed")
    extruded = np.zeros(len(program))
    extruded[of_moves[first[~alone]]] = fed.amount[given[~alone]]
    at = np.searchsorted(row, given[alone], side="right")
    return _with_stops(program, extruded, at, line[alone], _Fed(*(c[given[alone]] for c in fed)))


def _check_flows(words: Words, rows: int, source: str) -> None:
    """Raise InputError for a flow that is not positive, and a diameter below 0."""
    for code, letter, least, allowed in _FLOWS:
        for row in words.rows_with(words.find("M", code)):
            letters, values = words.of_rows(row)
            wrong = np.flatnonzero((letters == ord(letter)) & (values < least)) + words.first[row]
            if len(wrong) and row < rows:
                found = f"M{code:g} {words.text(int(wrong[0]))}"
                place = int(words.line[row]), words.column(int(wrong[0]))
                raise InputError(f"{found}: {allowed}", source=source, line=place[0], column=place[1])


def _retract(fed: _Fed, words: Words, rows: int, retractions: Sequence[Retraction]) -> None:
    """Put what G10 and G11 feed into the rows: of two that are the same in turn the first."""
    back, of_row = 0.0, [of.row for of in retractions]
    for row in words.rows_with(words.find("G", 10.0, 11.0)) if retractions else ():
        letter, value = words.of_rows(row)
        known = bisect_right(of_row, row) - 1
        if row >= rows or known < 0 or np.isin(letter, [ord("L"), ord("P")]).any():
            continue
        of, forward = retractions[known], bool((value[letter == _G] == 11.0).any())
        if forward == (back > 0.0):
            fed.amount[row] = back + of.extra if forward else -of.length
            fed.feed[row] = of.speed_forward or of.speed if forward else of.speed
            back = 0.0 if forward else of.length


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
    control, tolerance = program.path_control, program.tolerance
    columns: dict[str, Any] = {
        "kind": put(program.kind, Kind.STOP),
        "end": put(program.end, np.vstack([program.start, program.end])[at]),
        "feed": put(program.feed, alone.feed),
        "dwell": put(program.dwell, 0.0),
        "line": put(program.line, line),
        "extruded": put(extruded, alone.amount),
        "path_control": put(control, control[before] if len(program) else 0.0),
        "tolerance": put(tolerance, tolerance[before] if len(program) else np.nan),
    }
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
    flow, per_volume = 1.0, 1.0
    kept = np.zeros((1 + np.abs(state).max() if rows else 1, 5))
    for row in range(rows):
        if state[row] > 0:
            kept[state[row], 0], kept[state[row], 1] = absolute, absolute_moves
            kept[state[row], 2:] = feed, place, flow
        elif state[row] < 0:
            back = kept[-state[row]]
            absolute, absolute_moves = back[0] > 0.0, back[1] > 0.0
            feed, place, flow = back[2], back[3], back[4]
        has, sets, others, unknown, e, before = False, False, False, False, 0.0, unit
        m, s, d = 0.0, -1.0, -1.0
        for word in range(first[row], first[row + 1]):
            c, v = letter[word], value[word]
            if c == _E:
                has, e = True, v
            elif c == _F and v > 0.0:
                feed = v * before / SECONDS_PER_MINUTE
            elif c == _S:
                s = v
            elif c == _D:
                d = v
            elif c == _M:
                m = v
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
        if m == _FLOW and s > 0.0:
            flow = s / _PERCENT
        elif m == _VOLUME and (d >= 0.0 or s == 0.0):
            per_volume = 4.0 / (np.pi * d**2) if d > 0.0 and s != 0.0 else 1.0
        feeds[row] = feed
        if not has or others:
            continue
        if unknown:
            amount[row] = np.nan
        elif sets:
            place = e * unit
        elif absolute and absolute_moves:
            amount[row] = (e * unit - place) * flow * per_volume
            place = e * unit
        else:
            amount[row] = e * unit * flow * per_volume
            place += e * unit
    return amount, feeds
