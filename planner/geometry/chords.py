"""Arcs and curves as chords, for motions that consist of straight legs and corners.

A chord of an arc of radius R that turns by phi stays within the sagitta R (1 - cos(phi/2)) of it; helices
rise linearly along arc and chord alike. A chord over h of a curve's parameter stays within b h^2/8 of it, for
the largest second derivative b. The sagitta is a given fraction of the tolerance of the segment, and is
subtracted from the tolerance at the joints of the chords: corners rounded inside the polygon then keep the
tolerance of the segment.
"""

import dataclasses

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.geometry.build import COLLINEAR_ANGLE, turning_angle
from planner.geometry.toolpath import Joint, Toolpath, lesser_end

# A chord turns by at most this much [rad]: of an arc no larger than the tolerance eight chords are left.
CHORD_ANGLE_MAX = np.pi / 4
OF_SEGMENT = ("feed", "rapid", "held", "exact", "block", "line")  # what all chords of a segment have


def chord_angle(radius: FloatArray, sagitta: FloatArray) -> FloatArray:
    """(n,) angle by which a chord turns [rad], at most `CHORD_ANGLE_MAX`.

    radius  : (n,) of the arc [mm]
    sagitta : (n,) largest distance of the chord from the arc [mm]
    """
    # acos(1 - x) = 2 asin(sqrt(x/2)), which keeps its digits for small x
    return np.minimum(4.0 * np.arcsin(np.sqrt(np.minimum(sagitta / (2.0 * radius), 1.0))), CHORD_ANGLE_MAX)


def arc_sagitta(toolpath: Toolpath, fraction: float) -> tuple[Array, FloatArray]:
    """Into how many chords each segment is cut.

    fraction : sagitta over tolerance [-]

    Returns the number of chords (M,), 1 for lines, and their largest distance from the segment (M,) [mm].
    """
    arcs, curved = toolpath.arcs, toolpath.arc >= 0
    # of what its joints may use too: chords take it from them
    least = np.minimum(toolpath.along, lesser_end(toolpath.tolerance))
    count, sagitta = np.ones(len(toolpath), np.int64), np.zeros(len(toolpath))
    row = toolpath.arc[curved]
    budget = fraction * least[curved]
    sweep = np.abs(arcs.rate[row]) * toolpath.length[curved]
    count[curved] = np.maximum(1, np.ceil(sweep / chord_angle(arcs.radius[row], budget) * (1.0 - 1e-9)))
    sagitta[curved] = 2.0 * arcs.radius[row] * np.sin(sweep / count[curved] / 4.0) ** 2
    curve = toolpath.curve >= 0
    bend, length = toolpath.curvature[curve], toolpath.length[curve]
    most = np.minimum(np.sqrt(8.0 * fraction * least[curve] / bend), CHORD_ANGLE_MAX / bend)
    count[curve] = np.maximum(1, np.ceil(length / most))
    sagitta[curve] = bend * (length / count[curve]) ** 2 / 8.0
    return count, sagitta


def chorded(toolpath: Toolpath, fraction: float, whole: Array) -> Toolpath:
    """The same path with its arcs and curves cut into chords, and full stops where it turns right back.

    fraction : sagitta over tolerance, 0 < fraction < 1 [-]
    whole    : (M,) True for arcs that stay arcs and get a full stop at both ends
    """
    count, sagitta = arc_sagitta(toolpath, fraction)
    count[whole], sagitta[whole] = 1, 0.0
    cut = ~toolpath.straight & ~whole
    segment = np.repeat(np.arange(len(toolpath)), count)
    first = np.cumsum(count) - count
    number = np.arange(len(segment)) - first[segment]  # of a chord within its segment
    start = toolpath.start[segment].copy()
    inner = np.flatnonzero(number > 0)
    at = segment[inner]
    along = toolpath.length[at] * number[inner] / count[at]
    start[inner] = points_on(toolpath, at, along)
    end = np.vstack([start[1:], toolpath.end[-1:]])
    straight = toolpath.straight[segment]
    chord = cut[segment]
    length = toolpath.length[segment].copy()
    length[chord] = np.linalg.norm(end - start, axis=1)[chord]
    tangent_start, tangent_end = toolpath.tangent_start[segment].copy(), toolpath.tangent_end[segment].copy()
    tangent_start[chord] = tangent_end[chord] = (end - start)[chord] / length[chord, None]

    theta = np.zeros(len(segment) + 1)
    theta[1:-1] = turning_angle(tangent_end[:-1], tangent_start[1:])
    joint = np.full(len(segment) + 1, Joint.CORNER, np.uint8)
    joint[first], joint[-1] = toolpath.resting().joint[:-1], Joint.STOP
    bends = np.append(cut, False) | np.insert(cut, 0, False)  # joints of the program with a chord at one side
    turned = first[(bends[:-1] & (toolpath.joint[:-1] == Joint.SMOOTH))]
    joint[turned] = Joint.CORNER
    joint[(joint == Joint.CORNER) & (theta < COLLINEAR_ANGLE)] = Joint.SMOOTH
    stop = np.append(whole, False) | np.insert(whole, 0, False)
    joint[np.append(first, len(segment))[stop]] = Joint.STOP

    tolerance, dwell = np.zeros(len(segment) + 1), np.zeros(len(segment) + 1)
    tolerance[:-1] = toolpath.along[segment]
    tolerance[first], tolerance[-1] = toolpath.tolerance[:-1], toolpath.tolerance[-1]
    left = np.append(sagitta[segment], 0.0)
    tolerance -= np.maximum(left, np.insert(left[:-1], 0, 0.0))
    dwell[first], dwell[-1] = toolpath.dwell[:-1], toolpath.dwell[-1]
    return dataclasses.replace(
        toolpath,
        extrusion=None,
        inside=None,
        start=start,
        end=end,
        length=length,
        **{name: getattr(toolpath, name)[segment] for name in OF_SEGMENT},
        arc=np.where(straight | chord, -1, toolpath.arc[segment]),
        curve=np.full(len(segment), -1),
        tangent_start=tangent_start,
        tangent_end=tangent_end,
        curvature=np.where(chord, 0.0, toolpath.curvature[segment]),
        joint=joint,
        theta=theta,
        tolerance=tolerance,
        dwell=dwell,
    )


def parted_by_feed(toolpath: Toolpath) -> Toolpath:
    """The same path with a corner of angle 0 where the feed changes on a line, so that a leg ends there."""
    same_way = toolpath.joint[1:-1] == Joint.SMOOTH
    change = np.flatnonzero(same_way & (toolpath.feed[1:] != toolpath.feed[:-1])) + 1
    return toolpath.with_joints(change, Joint.CORNER)


def points_on(toolpath: Toolpath, segment: Array, x: FloatArray) -> FloatArray:
    """(n, A) points [mm] of arcs and curves.

    segment : (n,) the arcs and curves, as segments of the toolpath
    x       : (n,) their parameters [mm]
    """
    on_arc, out = toolpath.arc[segment] >= 0, np.empty((len(segment), len(toolpath.axes)))
    at = segment[on_arc]
    out[on_arc] = toolpath.arcs.center[toolpath.arc[at]] + arc_point(toolpath, at, x[on_arc])
    at = segment[~on_arc]
    out[~on_arc] = toolpath.curves.at(toolpath.curve[at], toolpath.length[at], x[~on_arc])[:, 0]
    return out


def polyline(toolpath: Toolpath, count: Array) -> tuple[FloatArray, Array]:
    """The path as a polyline: its points (N+1, A) [mm], the start first, and the segment (N,) of each behind it.

    count : (M,) points on every segment, evenly along it, the last at its end; 1 on lines
    """
    segment = np.repeat(np.arange(len(toolpath)), count)
    number = np.arange(len(segment)) - np.repeat(np.cumsum(count) - count, count) + 1
    points = toolpath.end[segment].copy()
    inner = np.flatnonzero(number < count[segment])
    at = segment[inner]
    points[inner] = points_on(toolpath, at, toolpath.length[at] * number[inner] / count[at])
    return np.vstack([toolpath.start[:1], points]), segment


def arc_point(toolpath: Toolpath, segment: Array, x: FloatArray) -> FloatArray:
    """(n, A) points of arcs [mm], relative to their centres.

    segment : (n,) the arcs, as segments of the toolpath
    x       : (n,) their parameters [mm]
    """
    arcs, row = toolpath.arcs, toolpath.arc[segment]
    angle = arcs.rate[row] * x
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    circle = arcs.radius[row][:, None] * (cos * arcs.e1[row] + sin * arcs.e2[row])
    return circle + arcs.drift[row] * x[:, None]
