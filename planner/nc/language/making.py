"""Makers of rows: functions of the running program's state and the values of a command that give rows of
words, in the program's coordinates and units, each a list of letters and numbers, and raise ValueError for
values that make no sense.

Also sentences that are said first (`assumed_row`), and holes of several dialects: tapping at lead times speed
as upper limit, with a full stop where the spindle turns round, pecking with decreasing infeeds, milled bores.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from planner.nc.interpreter import Interpreter
from planner.nc.language.rows import TravelRow, require
from planner.nc.language.travel import Travel
from planner.nc.language.tree import MadeRows, SourcePlace, made

ASSUMED = {
    "acceleration": "BRISK and DRIVE are not followed: acceleration and jerk are those of the machine file",
    "drilling level": "R of a lathe's drilling cycle is a place, as Haas has it (Fanuc counts it from where the tool stands)",
    "corner feed": "G621, slower feeds at corners, is not followed",
    "machine code": "an M code that the machine's builder defines is assumed not to move anything",
    "orientation": "the angles of rotary axes change evenly on a block (ORIAXES), not as the tool's direction turns",
    "rapid axes": "rapid moves are straight lines, as with RTLION",
    "spindle position": "positioning the spindle (SPOS) takes no time in this plan",
    "preset": "the datum of cycle 247 is that of the work offset in force: the preset table is the control's",
    "retraction": "MB MAX leads to machine zero in z: where its travel ends the control knows",
    "feed of linear axes": "F of X, Y and Z that move beside rotary axes is their own speed",
    "waits": "waits for other channels and spindles (WAITM, WAITS) take no time",
    "tool offset": "offsets of tools (D) are not added: z is that of the tool's tip",
    "tool centre feed": "F holds for the tool's centre (CFTCP); CFC and CFIN, the control's default, have it on the contour of arcs",
}
TAPPED = "tapping is planned with lead times speed as its upper limit and full stops, not at constant feed"
Row = list[tuple[str, float]]
Given = Mapping[str, float]  # values of a command by name
Cycle = Callable[["Making", Given], Iterable[Row]]
Maker = Callable[["Making", Given], Iterable[Row] | None]
ROWS_MAX = 200_000  # of one cycle: an infeed that small is a mistake
_ROUNDING = 1e-9  # of a number of steps
_COARSE = {
    3: 0.5, 4: 0.7, 5: 0.8, 6: 1.0, 7: 1.0, 8: 1.25, 9: 1.25, 10: 1.5, 11: 1.5, 12: 1.75, 14: 2.0, 16: 2.0, 18: 2.5, 20: 2.5,
    22: 2.5, 24: 3.0, 27: 3.0, 30: 3.5, 33: 3.5, 36: 4.0, 39: 4.0, 42: 4.5, 45: 4.5, 48: 5.0,
}  # fmt: skip  # leads of metric coarse threads by their size [mm], ISO 261
BREAK = 0.2  # mm by which the tool goes back to break a chip, and above the depth drilled where feed begins, unless the program says


def assumed_row(place: SourcePlace, name: str) -> MadeRows:
    """The statement that says a sentence of ASSUMED, and is refused by strict reading."""
    text = ASSUMED[name]
    return made(place, lambda making, given: making.assume(text))


@dataclass(frozen=True)
class Making:
    """interpreter, travel : of the running program
    shared, numbered   : its variables that all calls share, and its parameters by number
    place, frame       : of the command, and its call
    execute            : executes rows
    """

    interpreter: Interpreter
    travel: Travel
    shared: dict[str, float]
    numbered: list[float | None]
    place: SourcePlace
    frame: int
    execute: Callable[[list[TravelRow]], None]
    _rows: list[TravelRow] = field(default_factory=list)

    def take(self, rows: Iterable[Row] | None) -> None:
        """Rows to execute, all of them at the end, or where their maker asks for it by `flush`."""
        for row in rows or ():
            for letter, value in row:
                wrong = "infinite" if math.isinf(value) else "no number"
                require(math.isfinite(value), f"the computed {letter} word is {wrong}")
            words = [(ord(letter), value, self.place.at) for letter, value in row]
            self._rows.append(TravelRow(words, self.place.line, self.frame))
        self.flush()

    def flush(self) -> None:
        """Execute the rows so far."""
        if self._rows:
            self.execute(self._rows)
            self._rows.clear()

    @property
    def unit(self) -> float:
        """mm per unit of the program."""
        return self.interpreter.state.unit

    @property
    def absolute(self) -> bool:
        """True under G90."""
        return self.travel.absolute if self.travel.active else self.interpreter.state.absolute

    def here(self) -> tuple[float, float, float]:
        """The position in the program's coordinates and unit."""
        x, y, z = self.travel.position() / self.unit
        return float(x), float(y), float(z)

    @property
    def per_radius(self) -> float:
        """X words per radius: 2 where they are diameters, else 1."""
        return 2.0 if self.interpreter.state.diameters else 1.0

    def as_radii(self, given: Given) -> Given:
        """The values with those of X as radii."""
        return {c: value / self.per_radius if c[0] == "X" else value for c, value in given.items()}

    def tool_radius(self) -> float:
        """Radius of the loaded tool in the program's unit. Raises ValueError where it is not known."""
        found = self.travel.radius()
        tool = f"the diameter of tool {self.interpreter.state.tool_loaded}"
        require(found != 0.0, f"the cycle needs {tool}; write it into [tools] of the machine file")
        return found / self.unit

    def assume(self, text: str) -> None:
        """Keep an assumption that may change geometry or time. Raises ValueError in strict reading."""
        require(not self.interpreter.findings.strict, f"{text} (assumed without --strict)")
        self.interpreter.findings.assume(text, self.place.line)


def around(making: Making, rows: Iterable[Row], *, feed: bool) -> Iterator[Row]:
    """The rows of a cycle under G90, then G91, the motion code and with `feed` the feed as before."""
    state, travel, absolute = making.interpreter.state, making.travel, making.absolute
    before = state.word_feed
    motion = travel.motion if travel.active else state.motion
    if not absolute:
        yield [("G", 90.0)]
        making.flush()
    yield from rows
    making.flush()
    if not absolute:
        yield [("G", 91.0)]
    if motion in (0, 1) and motion != state.motion:
        yield [("G", float(motion))]
    if feed and state.feed_mode == "per minute" and before > 0.0:
        yield [("F", before)]


def equal_steps(whole: float, step_max: float) -> int:
    """How many equal steps of at most `most` make a length; 1 where `most` is 0. Raises ValueError."""
    if whole <= 0.0 or step_max <= 0.0:
        return 1
    count = whole / step_max
    if count > ROWS_MAX:
        raise ValueError(f"{step_max:g} is too small an infeed for {whole:g}: more than {ROWS_MAX:,} passes")
    return max(1, -int(-(count - _ROUNDING) // 1))


@dataclass(frozen=True)
class HolePlan:
    """A hole at the present place: z of the clearance, the surface, the bottom and the end; the feed; dwell
    at the bottom [s]. Raises ValueError if the bottom is not below the surface."""

    clear: float
    top: float
    bottom: float
    retract: float
    feed: float | None = 0.0  # None for that of the program
    dwell: float = 0.0
    what: str = "hole"  # for messages

    def __post_init__(self) -> None:
        require(self.bottom < self.top, f"the bottom of the {self.what} lies at or above its surface")


def coarse_lead(size: float, unit: float) -> float:
    """The lead of a metric thread in the program's unit. Raises ValueError for sizes without one."""
    if size not in _COARSE:
        raise ValueError(f"M{size:g} is no size of a metric coarse thread here; give the lead itself (PIT)")
    return _COARSE[int(size)] / unit


def go(z: float, feed: float | None = None) -> Row:
    """To z, at a feed or at rapid speed."""
    return [("G", 0.0), ("Z", z)] if feed is None else feed_to(z, feed)


def left(hole: HolePlan) -> Iterator[Row]:
    """From the clearance of a hole to the height where its cycle ends, if that is above it."""
    if hole.retract > hole.clear:
        yield go(hole.retract)


def dwell_rows(seconds: float) -> Iterator[Row]:
    """A dwell, if it is one."""
    if seconds > 0.0:
        yield [("G", 4.0), ("P", seconds)]


def feed_to(z: float, feed: float | None) -> Row:
    """To z at a feed; None for that of the program."""
    return [("G", 1.0), *([] if feed is None else [("F", feed)]), ("Z", z)]


def drilled(hole: HolePlan) -> Iterator[Row]:
    """To the clearance, at the feed to the bottom, and the dwell."""
    yield go(hole.clear)
    yield feed_to(hole.bottom, hole.feed)
    yield from dwell_rows(hole.dwell)


def tapped(
    making: Making,
    hole: HolePlan,
    lead: float,
    speed: float,
    *,
    back: float = 0.0,
    up: float | None = None,
    start: bool = True,
) -> Iterator[Row]:
    """In with lead * speed, out with lead * back (0: the same speed). Raises ValueError without a lead or a
    speed.

    lead  : negative for a left-hand thread
    up    : where the way out ends, else at the clearance
    start : the tool goes to the clearance first
    """
    require(speed > 0.0 and lead != 0.0, "tapping needs the lead of the thread and the speed of the spindle")
    size = abs(lead)
    making.assume(TAPPED)
    first, second = (3.0, 4.0) if lead > 0.0 else (4.0, 3.0)
    if start:
        yield go(hole.clear)
    yield [("S", speed), ("M", first)]
    yield go(hole.bottom, size * speed)
    yield [("G", 4.0), ("P", max(hole.dwell, 0.0))]
    yield [("S", back or speed), ("M", second)]
    yield go(hole.clear if up is None else up, size * (back or speed))
    yield [("G", 4.0), ("P", 0.0)]
    yield [("S", speed), ("M", first)]


@dataclass(frozen=True)
class Pecks:
    """Infeeds of a deep hole.

    infeed : the first, 0 for all at once;  less : by which each is less than the one before;  least : but at least this
    breaks : how many infeeds (inf for all) end with a retract by `back` alone, before one that leads out to the clearance
    chip   : depth between two such retracts within an infeed, 0 for none
    above, below : dwells outside, and at the end of each infeed [s]
    ahead  : how far above the depth already drilled rapid speed ends, at the first and at the last infeed
    halves : where `less` is an infeed and less than two of it are left, the last two are equal
    first  : feed of the first infeed; None for that of the hole
    """

    infeed: float
    back: float
    ahead: tuple[float, float]
    less: float = 0.0
    least: float = 0.0
    breaks: float = 0
    chip: float = 0.0
    above: float = 0.0
    below: float = 0.0
    halves: bool = False
    first: float | None = None

    def depths(self, depth: float) -> list[float]:
        """Where the infeeds end, down to a depth. Raises ValueError for infeeds that never reach it."""
        step = self.infeed if self.infeed > 0.0 else depth
        least = self.least if self.less > 0.0 else step
        require(least > 0.0, "the least of decreasing infeeds is to be above 0")
        equal_steps(depth, least)
        found: list[float] = []
        while not found or found[-1] < depth:
            found.append(min((found[-1] if found else 0.0) + step, depth))
            step = max(step - self.less, least)
            rest = depth - found[-1]
            if self.halves and step == self.less < rest < 2.0 * self.less:
                step = least = rest / 2.0
        return found


def pecked(hole: HolePlan, pecks: Pecks) -> Iterator[Row]:
    """By infeeds down to the bottom; the tool stays there. Raises ValueError."""
    depths = pecks.depths(hole.top - hole.bottom)
    yield go(hole.clear)
    broken, done = 0, 0.0
    for k, deep in enumerate(depths):
        for part in range(1, equal_steps(deep - done, pecks.chip)):
            yield feed_to(hole.top - done - part * pecks.chip, hole.feed)
            yield go(hole.top - done - part * pecks.chip + pecks.back)
        yield feed_to(hole.top - deep, pecks.first if k == 0 and pecks.first is not None else hole.feed)
        done = deep
        if k == len(depths) - 1:
            break
        yield from dwell_rows(pecks.below)
        if broken < pecks.breaks:
            broken += 1
            yield go(hole.top - deep + pecks.back)
            continue
        broken = 0
        yield go(hole.clear)
        yield from dwell_rows(pecks.above)
        gap = pecks.ahead[0] + (pecks.ahead[1] - pecks.ahead[0]) * k / max(len(depths) - 2, 1)
        yield go(min(hole.top - deep + gap, hole.clear))
    yield from dwell_rows(hole.dwell)


def helix(
    at: complex, centre: complex, heights: tuple[float, float], pitch: float, turning: int, feed: float
) -> Iterator[Row]:
    """Down at a place round a centre, in equal turns of at most a pitch, and once round on the ground; `turning`
    1 counter-clockwise, -1 clockwise. Raises ValueError."""
    top, bottom = heights
    count, code, spoke = equal_steps(top - bottom, pitch), 3.0 if turning > 0 else 2.0, centre - at
    for k in range(1, count + 2):
        z = bottom if k >= count else top + (bottom - top) * k / count
        place: Row = [("X", at.real), ("Y", at.imag), ("Z", z), ("I", spoke.real), ("J", spoke.imag)]
        yield [("G", code), ("F", feed), *place]


def milled(making: Making, hole: HolePlan, diameter: float, infeed: float, turning: int) -> Iterator[Row]:
    """A bore on a helix: infeed per turn, once round on the ground, to the middle. Raises ValueError."""
    radius = making.tool_radius()
    size = diameter / 2.0 - radius
    require(size > 0.0, "the bore is to be wider than the tool")
    core = f"leaves a core where the tool has a radius of {radius:.6g} only; use a pocket"
    require(size <= radius, f"a helix of radius {size:.6g} {core}")
    (x, y, _), feed = making.here(), hole.feed or 0.0
    yield go(hole.clear)
    yield [("G", 1.0), ("F", feed), ("X", x + size), ("Y", y)]
    yield go(hole.top, feed)
    yield from helix(complex(x + size, y), complex(x, y), (hole.top, hole.bottom), infeed, turning, feed)
    yield [("G", 1.0), ("X", x), ("Y", y)]
