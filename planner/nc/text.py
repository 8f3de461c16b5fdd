"""A program written out as NC text, for those that were read from something else (HPGL): the reader reads the
same program again.

The text is RS274NGC in mm: G0 for rapids, G1, G2 and G3 with F words, G4 for dwells and full stops, M and T
words for the events, of which M0, M1, M6 and M60 are full stops by themselves. Coordinates are rounded to
`flat.DECIMALS`, a tenth of what the reader may be off.
"""

from planner.base.arrays import FloatArray
from planner.base.units import SECONDS_PER_MINUTE
from planner.nc.language.flat import flat_number, in_comment
from planner.nc.program import Kind, PathControl, Program, plain
from planner.nc.writer import FEED_MIN, round_down

STOPPING = frozenset(("M0", "M1", "M6", "M60"))  # events with a full stop of their own
_CONTROL = {PathControl.EXACT_PATH: "G61", PathControl.EXACT_STOP: "G61.1"}


def program_text(program: Program, feeds: FloatArray, tolerance: float) -> str:
    """The NC text of a program in the plane z = 0.

    feeds     : (B,) feed of each block [mm/s]; looked at where a block moves at a feed, and finite and not
                negative there
    tolerance : contour error budget [mm], for G64 P
    """
    words = [f"({in_comment(program.source)}, written by feedrate-planner)"]
    words += ["G21 G17 G90 G91.1 G94 G40 G49"]
    mode = PathControl(int(program.path_control[0])) if len(program) else PathControl.BLEND
    words += [_CONTROL.get(mode, f"G64 P{plain(tolerance)}")]
    return "\n".join([*words, *_blocks(program, feeds), "M2", ""])


def _blocks(program: Program, feeds: FloatArray) -> list[str]:
    lines: list[str] = []
    position = program.start
    arc = dict(zip(program.arc_block.tolist(), range(len(program.arc_block)), strict=True))
    events = list(program.events)
    next_event, last_feed = 0, ""
    for block, kind in enumerate(program.kind.tolist()):
        stopped = False
        while next_event < len(events) and events[next_event].block <= block:
            stopped = events[next_event].text in STOPPING
            lines.append(events[next_event].text)
            next_event += 1
        end = program.end[block]
        if kind == Kind.STOP and stopped:
            pass  # by the last event
        elif kind in (Kind.STOP, Kind.DWELL):
            lines.append(f"G4 P{plain(float(program.dwell[block]))}")
        elif kind == Kind.RAPID:
            lines.append(f"G0 {_xy(end)}")
        else:
            feed = round_down(max(float(feeds[block]), FEED_MIN) * SECONDS_PER_MINUTE)
            code = f"G1 {_xy(end)}" if kind == Kind.LINE else _arc(program, arc[block], position, end)
            lines.append(code if feed == last_feed else f"{code} F{feed}")
            last_feed = feed
        position = end
    return [*lines, *(event.text for event in events[next_event:])]


def _xy(end: FloatArray) -> str:
    return f"X{flat_number(end[0])} Y{flat_number(end[1])}"


def _arc(program: Program, row: int, position: FloatArray, end: FloatArray) -> str:
    centre = program.arc_center[row] - position
    code = "G3" if program.arc_sweep[row] > 0 else "G2"
    return f"{code} {_xy(end)} I{flat_number(centre[0])} J{flat_number(centre[1])}"
