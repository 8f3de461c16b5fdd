"""The compiled loop over plain rows: N, G0, G1, X, Y, Z, F and S words, and letters that are refused, left
out or parked whatever stands beside them (rotary axes, extruders; see `planner.nc.faults`). Everything else
stops it.

This is what programs are long with (249,000 of 249,132 lines of a relief, 110,000 S words of a laser
engraving). It follows the same rules as the interpreter: feed first, then S, then the straight move; whatever
is not certainly right is left to the interpreter, which says what is wrong.
"""

from functools import cache

import numpy as np

from planner.base.arrays import Array
from planner.base.kernels import njit
from planner.base.units import SECONDS_PER_MINUTE
from planner.nc.block_table import BlockTable
from planner.nc.faults import LEFT_OUT, PARKED, REFUSED, IgnoredWords
from planner.nc.lexer import Words
from planner.nc.moves import NUMBER_MAX
from planner.nc.program import Kind
from planner.nc.state import State, straight_feed

# Letters by their codes.
_F, _G, _N, _O, _S = 70, 71, 78, 79, 83
_RAPID, _LINE = int(Kind.RAPID), int(Kind.LINE)


def run_plain(words: Words, row: int, state: State, table: BlockTable, ignored: IgnoredWords) -> int:
    """Execute plain rows from `row` on; returns the first row that is not plain."""
    if not state.is_plain:
        return row
    rows = words.letter, words.value, words.line, words.first, words.frame
    wrapped = np.zeros(len(state.letters), dtype=np.bool_)
    for letter in state.wrapped if state.absolute else "":
        wrapped[state.letters.index(letter)] = True
    path = state.feed_factor, int(state.path_control), state.tolerance, state.offset
    axes = _axes(state.letters), state.scale, state.turns, wrapped, state.feeds_all
    fixed = state.absolute, state.unit, *path, *axes
    events = table.events
    begin = row, table.blocks, events, table.refusals, state.motion, state.feed, state.feed_unit
    others = ignored.treatment, ignored.parked
    end = _run(rows, begin, fixed, state.position, table.block, table.event, table.refused_word, others)
    if end[1] > table.blocks:
        state.series = None
    row, table.blocks, table.events, table.refusals, state.motion, state.feed, state.feed_unit = end
    if table.events > events:
        state.spindle.speed = float(table.event.value[table.events - 1])  # plain rows have no other events
    return int(row)


@cache
def _axes(letters: str) -> Array:
    """(256,) index of a letter's axis by its code, -1 for other letters."""
    axis = np.full(256, -1)
    axis[[ord(letter) for letter in letters]] = np.arange(len(letters))
    return axis


@njit(cache=True)
def _run(rows, begin, fixed, position, block, event, refused_word, others):  # pragma: no cover
    """Execute rows from `begin` on into the columns, the position and `refused_word`; says how far.

    rows   : the fields of `Words` that the loop reads
    begin  : state that plain rows change: how far they are read and stored, modal motion and feed
    fixed  : that they do not; `axis_of` (256,) by letter, `scale` (A,) mm or degrees per programmed unit, `wrapped`
             (A,) where coordinates are absolute, `feeds_all` of `State`
    others : of `IgnoredWords`; sets where axes are parked
    """
    letter, value, line, first, frame = rows
    absolute, unit, feed_factor, path_control, tolerance, offset = fixed[:6]
    axis_of, scale, turns, wrapped, together = fixed[6:]
    treatment, parked = others
    row, blocks, events, refusals, motion, feed, feed_unit = begin
    axes = len(position)
    given, way = np.empty(axes), np.empty(axes)
    while row < len(line):
        code, new_feed, speed, moves, is_plain = -1, -1.0, -1.0, False, True
        for axis in range(axes):
            given[axis] = np.nan
        refused = refusals
        for word in range(first[row], first[row + 1]):
            c, v = letter[word], value[word]
            axis = axis_of[c]
            if axis >= 0 and np.isnan(given[axis]) and abs(v) <= NUMBER_MAX:
                given[axis] = v
                moves = True
                is_plain &= not wrapped[axis]
            elif c == _G and code < 0 and (v == 0.0 or v == 1.0):
                code = int(v)
            elif c == _F and new_feed < 0 and 0 < v <= NUMBER_MAX:
                new_feed = v
            elif c == _S and speed < 0 and 0 <= v <= NUMBER_MAX:
                speed = v
            elif treatment[c] == PARKED:
                if absolute and np.isnan(parked[c]):
                    parked[c] = v
                if v != (parked[c] if absolute else 0.0):
                    refused_word[refused] = word
                    refused += 1
            elif treatment[c] == REFUSED and c != _O:
                refused_word[refused] = word
                refused += 1
            elif treatment[c] == LEFT_OUT:
                pass
            elif c != _N or word > first[row]:
                is_plain = False
                break
        code = motion if code < 0 else code
        if new_feed > 0:
            new_feed *= unit / SECONDS_PER_MINUTE * feed_factor
        else:
            new_feed = feed
        if not is_plain or (moves and (code < 0 or code > 1 or (code == 1 and new_feed == 0.0))):
            break

        if new_feed != feed:
            feed_unit = unit
        motion, feed, refusals = code, new_feed, refused
        if speed >= 0:
            event.block[events], event.line[events] = blocks, line[row]
            event.letter[events], event.value[events] = _S, speed
            events += 1
        if moves:
            for axis in range(axes):
                before = position[axis]
                if not np.isnan(given[axis]):
                    step = given[axis] * scale[axis]
                    position[axis] = step + (offset[axis] if absolute else before)
                way[axis] = position[axis] - before
                block.end[blocks, axis] = position[axis]
            block.kind[blocks] = _LINE if motion == 1 else _RAPID
            block.feed[blocks] = np.inf
            if motion == 1:
                block.feed[blocks] = straight_feed(feed, way, turns, feed_unit, together)
            block.line[blocks] = line[row]
            block.path_control[blocks] = path_control
            block.tolerance[blocks] = tolerance
            block.frame[blocks] = frame[row]
            blocks += 1
        row += 1
    return row, blocks, events, refusals, motion, feed, feed_unit
