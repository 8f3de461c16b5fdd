"""The geometries a motion can run on, by name: rounded corners, each by itself, or splines in their place.

A run of corners may have a place where no spline fits: the curve leaves the tolerance there, has no
certificate, or has a cusp because the path turns back within the tolerance. Instead of giving up the spline
for the whole run, the motion gets a full stop there, which divides the run in two. The stops change the runs
around them, which may then have no spline elsewhere. The second time such a place is fenced off by two full
stops, and only the corners between them stay single.
"""

from planner.base.errors import InputError
from planner.base.names import AUTO, SMOOTHINGS, SPLINE
from planner.corners.bezier import BezierCorner
from planner.corners.fir import FirCorner
from planner.corners.kinematic import KinematicCorner
from planner.corners.smooth import CornerShape, SmoothPath, round_corners
from planner.geometry.toolpath import Joint, Toolpath
from planner.machine import Machine
from planner.planning.job.trace import Tell, tell_nobody
from planner.smoothing.spline_path import SplineShape, lost_joints, spline_shape

Laid = tuple[SmoothPath, SplineShape]  # a path with rounded corners, and the splines over it
# Rounds of placing full stops; in the last one a run without a spline is fenced by two.
STOP_ROUNDS = 2


def corner_shape(
    corner: str | CornerShape, machine: Machine, toolpath: Toolpath, bezier: CornerShape | None = None
) -> CornerShape:
    """The corner shape of that name with the machine's settings; `bezier`: the one of "bezier" and beside
    splines, None for the usual one. Raises InputError for an unknown name."""
    if corner in (AUTO, SPLINE, "bezier"):
        return bezier or BezierCorner()
    if corner == "fir":
        return FirCorner.from_machine(machine, toolpath.axes)
    if corner == "kinematic":
        return KinematicCorner.from_machine(machine, toolpath.axes)
    if isinstance(corner, str):
        raise InputError(f"no corner shape '{corner}'; there are {', '.join(SMOOTHINGS)}")
    return corner


def splined_with_stops(
    rounded: SmoothPath, machine: Machine, blend_tangents: bool, tell: Tell = tell_nobody
) -> Laid:
    """The splines of a path, as they are laid, and the path with full stops where runs get none (module text)."""
    shape = spline_shape(rounded, machine)
    tell_splines(shape, tell, 0)
    for again in range(STOP_ROUNDS):
        at = lost_joints(rounded, shape, fence=again == STOP_ROUNDS - 1)
        if not len(at):
            break
        stopping = rounded.toolpath.with_joints(at, Joint.STOP)
        rounded = round_corners(stopping, machine, rounded.corner, blend_tangents=blend_tangents)
        shape = spline_shape(rounded, machine, shape)
        tell_splines(shape, tell, len(at))
    return rounded, shape.laid()


def tell_splines(shape: SplineShape, tell: Tell, stops: int) -> None:
    """Tell of splines as they are laid, for which so many full stops were added."""
    fits = shape.splines.fits
    tell(
        "splines",
        runs=len(fits),
        with_a_spline=int(fits.sum()),
        spans=int(shape.splines.span_first[-1]),
        stops_added=stops,
    )
