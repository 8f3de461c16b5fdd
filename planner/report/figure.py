"""The figures of a motion, described once, for matplotlib (profiles_figure.py, plots.py) and plotly (plotly_figure.py):
panels above each other over one axis, of series that each name a column of numbers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.feedrate.constraints.limits import ACCELERATION, JERK, VELOCITY
from planner.machine import ALL_AXES, LINEAR_AXES, ROTARY_AXES
from planner.nc.extents import coordinates_known, travel_of
from planner.nc.program import Kind
from planner.planning.job.at_tip import directions_of, of_axes
from planner.report.units import Units
from planner.report.word_feed import WordFeed

if TYPE_CHECKING:
    from planner.machine import Machine
    from planner.motion.trajectory import Trajectory
    from planner.nc.program import Program
    from planner.planning.job.plan import Plan


# Okabe and Ito (2008), without black; then, for machines with many limits and pages with many methods, the
# four that are farthest from all before them to people with and without red-green blindness, and seen on
# light and dark ground (tests/report/test_colours.py).
COLOURS = (
    "#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#F0E442", "#0000F0", "#901818", "#6060F0", "#30D878",
)  # fmt: skip
GREY, LIGHT = "#606060", "#c4c4c4"
INK, DIM = "#1d2430", "#667085"  # of text, and of what is beside it, on light ground
PRICES = (0.02, "#f6c667"), (0.5, "#e8743b"), (1.0, "#7a1f5c")  # share of the dearest [-], and its colour
# Cividis, from low to high, at ten equal steps.
CIVIDIS = (
    "#00224e", "#123570", "#3b496c", "#575d6d", "#707173", "#8a8678", "#a59c74", "#c3b369", "#e1cc55", "#fee838",
)  # fmt: skip
# The same where they have to be seen against a light or a dark page: without its bright or its dark end, at
# equal steps.
LOW_TO_HIGH = {
    "light": ("#00224e", "#3b496c", "#77766f", "#ad9650", "#d9a900"),
    "dark": ("#4a7ccc", "#6f86b0", "#9a978f", "#cdb969", "#fee838"),
}


OF_LIMITS = (
    *("feed", JERK.called("x"), JERK.called("y"), "tolerance", JERK.called("z")),
    *(quantity.called(axis) for quantity in (ACCELERATION, VELOCITY) for axis in LINEAR_AXES),
)
LIMIT_COLOURS = dict(zip(OF_LIMITS, COLOURS, strict=True)) | {"none": GREY, "rest": LIGHT}


def limit_colours(names: Sequence[str]) -> list[str]:
    """A colour for each limit, the same on every job and picture for those in `LIMIT_COLOURS`; other names take what
    these leave, in their order."""
    free = [colour for name, colour in LIMIT_COLOURS.items() if name not in names and colour in COLOURS]
    others = [name for name in names if name not in LIMIT_COLOURS]
    taken = dict(zip(others, (*free, *COLOURS), strict=False)) | LIMIT_COLOURS
    return [taken.get(name, COLOURS[k % len(COLOURS)]) for k, name in enumerate(names)]


AGAINST = {"t": "time [s]", "s": "length along the path [mm]", "line": "NC line"}
QUANTITIES = {"velocity": "/s", "acceleration": "/s²", "jerk": "/s³"}
TINY = 1e-9  # of a length or a scale, where nothing moves
FLAT = 0.12  # third extent over the largest below which a path is seen along it


@dataclass(frozen=True, kw_only=True)
class Series:
    """A line of a panel."""

    name: str
    column: str  # its numbers, in `unit` once times `scale`
    unit: str
    colour: str
    dashed: bool = False
    scale: float = 1.0
    limit: float = math.nan  # what they are held against in that unit; NaN where there is none
    before: str = ""  # of the column that it is drawn over, before its name in `AGAINST`


@dataclass(frozen=True, kw_only=True)
class Panel:
    """Series over one axis. Those with limits are shown in per cent of them where they share a panel."""

    title: str
    series: tuple[Series, ...]
    top: float = math.nan  # end of its axis in the unit; NaN for that of its numbers
    said: str = ""  # of what is beyond

    @property
    def limited(self) -> bool:
        """Whether all series have limits."""
        return all(math.isfinite(one.limit) for one in self.series)


# Rapids so many times as fast as feed moves end the axis at that multiple of the latter [-].
CLIPPED, ROOM = 3.0, 1.5


def feed_panel(motion: MotionColumns, units: Units) -> Panel:
    """The feed of a motion and the programmed one; where rapids dwarf the feed moves, the axis ends above these."""
    feed = motion["feed"]
    most, per = highest_feed(feed, motion["programmed"]), units.per_feed
    far = float(feed.max(initial=0.0))
    clipped = 0.0 < CLIPPED * most < far
    series = (
        Series(name="programmed", column="programmed", unit=units.feed, colour=DIM, dashed=True, scale=per),
        Series(name="feed", column="feed", unit=units.feed, colour=INK, scale=per),
    )
    if not clipped:
        return Panel(title="feed", series=series)
    said = f"rapids up to {per * far:,.0f} {units.feed}"
    return Panel(title="feed", series=series, top=ROOM * most * per, said=said)


def profile_panels(
    motion: MotionColumns, machine: Machine, axes: Sequence[str], quantities: Sequence[str], units: Units
) -> list[Panel]:
    """The feed, and below it `quantities` of the axes against the machine's limits."""

    def series(quantity: str, axis: str) -> Series:
        unit = ("°" if axis in ROTARY_AXES else "mm") + QUANTITIES[quantity]
        colour, limit = (
            COLOURS[ALL_AXES.index(axis) % len(COLOURS)],
            float(getattr(machine.axes[axis], quantity)),
        )
        return Series(name=axis, column=quantity[0] + axis, unit=unit, colour=colour, limit=limit)

    panels = [Panel(title=name, series=tuple(series(name, axis) for axis in axes)) for name in quantities]
    return [feed_panel(motion, units), *panels]


def moving_axes(motion: Trajectory) -> list[str]:
    """The axes that a motion moves."""
    return [axis for k, axis in enumerate(motion.axes) if np.ptp(motion.position[:, k]) > 0.0]


# The edges of a box in one line: the corners that it passes, each with the lower (0) or upper (1) end of x, y and z.
EDGES = "000 100 110 010 000 001 101 100 101 111 110 111 011 010 011 001"


def travel_box(plan: Plan) -> FloatArray | None:
    """(n, 3) a line along the edges of the travel of x, y and z [mm]; 0 for an axis that the plan has not. None where
    one of them, or the place of the program in it, is not known, and for motions of the tool's tip."""
    axes = plan.program.axes
    ends = np.array([travel_of(plan.machine, axis) if axis in axes else (0.0, 0.0) for axis in LINEAR_AXES])
    if not np.isfinite(ends).all() or plan.joints is not None or not coordinates_known(plan.machine):
        return None
    corners = np.array([[int(digit) for digit in corner] for corner in EDGES.split()])
    return np.take_along_axis(ends.T, corners, axis=0)


class MotionColumns:
    """Columns of N samples of a plan's motion, each (N,), made when they are asked for: t [s], s [mm], line;
    feed and programmed as F means them, programmed NaN for rapids; x, y ... the place, and vx, ax, jx ... of
    the axes as the machine gets them [mm, deg, s]."""

    def __init__(self, plan: Plan, shown: Trajectory, joints: Trajectory | None = None):
        """joints : the samples as the machine gets them, where they are known"""
        self.shown, self.joints = shown, of_axes(plan, shown) if joints is None else joints
        self._program, self._word = plan.program, WordFeed(plan.toolpath)

    def __getitem__(self, name: str) -> Array:
        if name in AGAINST:
            return np.asarray(getattr(self.shown, name))
        if name == "feed":
            return self._word.of(self.shown)
        if name == "programmed":
            asked = self._word.programmed(self._program, np.clip(self.shown.block, 0, None))
            return np.where(np.isfinite(asked), asked, np.nan)
        if name in self.shown.axes:
            return _in_degrees(self.shown, "position", name)
        (quantity,) = (one for one in QUANTITIES if one[0] == name[0])
        return _in_degrees(self.joints, quantity, name[1:])


def _in_degrees(motion: Trajectory, quantity: str, axis: str) -> FloatArray:
    k = motion.axes.index(axis)
    return np.asarray(getattr(motion, quantity)[:, k] * motion.in_degrees[k])


def highest_feed(feed: FloatArray, programmed: FloatArray) -> float:
    """The highest feed (n,) of moves with a programmed one (n,): rapids have its colour, and leave the others
    theirs."""
    asked = np.isfinite(programmed)
    return float(feed[asked].max() if asked.any() else feed.max(initial=0.0))


def flat_view(extent: FloatArray) -> list[int] | None:
    """The two axes, to the right and up, that show a nearly flat path of an `extent` (3,) best; turned parts lie. None
    for a path that needs three."""
    thin = int(extent.argmin())
    if extent[thin] > FLAT * max(float(extent.max()), TINY):
        return None
    return [2, 0] if thin == 1 and extent[2] > extent[0] else [k for k in range(len(extent)) if k != thin]


DWARFED, BESIDE = 2.0, 0.08  # of the extent of the feed moves: what hides them, what is shown around them [-]


def shown_part(program: Program, block: Array, points: FloatArray) -> FloatArray:
    """(2, 3) the least and the greatest place that a picture shows of `points` (n, 3) in the blocks `block` (n,) [mm]: of
    all, but where rapids, and travel of printers, make it more than `DWARFED` as large as the part, around that."""
    whole = np.stack([points.min(axis=0), points.max(axis=0)])
    at = np.clip(block, 0, None)
    works = (program.extruded > 0.0) if np.any(program.extruded > 0.0) else program.kind != Kind.RAPID
    part = points[works[at]] if works[at].any() else points
    near = np.stack([part.min(axis=0), part.max(axis=0)])
    size = float(np.ptp(near, axis=0).max())
    if not 0.0 < DWARFED * size < np.ptp(whole, axis=0).max():
        return whole
    return np.stack(
        [np.maximum(near[0] - BESIDE * size, whole[0]), np.minimum(near[1] + BESIDE * size, whole[1])]
    )


def three(shown: Trajectory) -> FloatArray:
    """(N, 3) x, y, z of samples [mm]; 0 for those that are not among the axes."""
    places = dict(zip(shown.axes, shown.position.T, strict=True))
    return np.stack([places.get(axis, np.zeros(len(shown))) for axis in LINEAR_AXES], axis=1)


TOOL = "#D55E00"
SEEN = 50  # samples looked at for each place: a long motion is not evaluated as a whole
SHARE = 0.12  # length of a line, of the largest extent of the path [-]


def tool_lines(plan: Plan, most: int) -> FloatArray | None:
    """(n, 2, 3) the tip and a point on the tool on feed moves, at up to `most` places that are as far from
    each other along the path [mm]; None where the trajectory is not one of the tip. The plan must have a
    trajectory."""
    trajectory = plan.trajectory
    if plan.joints is None or trajectory is None:
        return None
    seen = trajectory.rows(np.unique(np.linspace(0, len(trajectory) - 1, SEEN * most).astype(np.int64)))
    at = np.searchsorted(seen.s, np.linspace(0.0, float(seen.s[-1]), most))
    places = seen.rows(np.unique(np.minimum(at, len(seen) - 1)))
    places = places.rows(np.flatnonzero(plan.program.kind[places.block] != Kind.RAPID))
    directions = directions_of(plan, places)
    if directions is None:
        return None
    linear = [k for k, axis in enumerate(trajectory.axes) if axis in LINEAR_AXES]
    tip = places.position[:, linear]
    length = SHARE * float(np.ptp(seen.position[:, linear], axis=0).max())
    return np.stack([tip, tip + length * directions], axis=1)
