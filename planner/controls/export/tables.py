"""Setpoints in files that a control or drives play: a stream for LinuxCNC's HAL, and tables of positions over time.

LinuxCNC's own planner has no jerk limit and another idea of a corner, so a program cannot make it move as
planned. Its HAL plays setpoints as they are: `halstreamer` feeds the rows of a file into a FIFO, and
`streamer` puts one of them on its pins in every servo period. Three files:

    setpoints.txt  rows of axis positions, in mm or inch, rotary axes in degrees
    stream.hal     loads the streamer and names its signals; to be sourced in a machine's HAL configuration
    try.hal        plays and records the rows without a machine: `halrun -f try.hal` writes played.txt

The last period of a plan may be shorter than the others; its row comes a whole period after the one before
it. The tables:

    pvt               pvt.csv: t, then position and velocity of each axis; between two rows an axis moves on a cubic
    pt                pt.csv: t and positions; between two rows an axis moves straight
    twincat           a file for each axis, AXIS.txt: a time and a position a line, as tables of a master's and a slave's
                      position are read; straight between them
    joint-trajectory  trajectory.json: trajectory_msgs/JointTrajectory of ROS, in m and rad, with velocities and without
                      accelerations, between which its controllers go on cubics

With p0, v0 at the start of an interval of length h and p1, v1 at its end, u = (t - t0) / h, the cubic is

    p(u) = (1 + 2u)(1 - u)^2 p0 + u (1 - u)^2 h v0 + u^2 (3 - 2u) p1 - u^2 (1 - u) h v1

which is the motion itself where its jerk is constant in the interval. So a few rows are enough:
`longest_interval` finds the longest interval, a whole number of interpolation periods, with which the motion
between rows stays within a given distance of every setpoint on every axis.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import InputError
from planner.base.sizes import SIZES
from planner.base.units import MICROMETRE, MILLISECOND, MM_PER_INCH, RAD_PER_DEG
from planner.machine import ROTARY_AXES
from planner.motion.trajectory import Trajectory, require_rest
from planner.nc.program import Kind, Program

WITHIN = 1e-3  # [mm]: a thousandth of a millimetre, below what contour tolerances are
PERIODS_MAX = 64  # interpolation periods between two rows at most: feedback and feed override need some rows
PVT, PT, TWINCAT, ROS = "pvt", "pt", "twincat", "joint-trajectory"
STRAIGHT = (PT, TWINCAT)  # tables between whose rows axes move straight
_WHOLE = 1e-6  # of a period: what a cycle may be off a whole number of them
_NANOSECONDS = 10**9  # in a second
DEPTH = 4000  # rows that wait in the FIFO: four seconds at 1 ms, while the disk may be busy
_ROWS_AT_ONCE = SIZES.text_rows
# mm in a length unit of the streamed positions.
UNITS = {"mm": 1.0, "inch": MM_PER_INCH}
_MM_PER_M = 1000.0


@dataclass(frozen=True, kw_only=True)
class Table:
    """What a table holds."""

    kind: str = PVT  # or `PT`, `TWINCAT`, `ROS`
    unit: str = "mm"  # of lengths, or inch; rotary axes: degrees. Of joint trajectories always m and rad
    # how far the motion between rows may be from the setpoints [mm], > 0, on rotary axes the same number in
    # degrees; None for `WITHIN`, and for any distance where a cycle is given
    within: float | None = None
    cycle: float | None = None  # time between rows [s]; None for the longest that stays within
    joints: tuple[str, ...] = ()  # names of the axes in a joint trajectory; () for their letters
    power: FloatArray | None = None  # (T,) the power of a laser at each setpoint, a column more


def write_table(directory: Path, trajectory: Trajectory, table: Table) -> tuple[int, float]:
    """Write the files into an existing directory; returns the interpolation periods between two rows, and the
    largest distance found [mm].

    Raises InputError for another unit than mm or inch, a distance that is not above 0 or that the cycle exceeds, a cycle
    that is no whole number of interpolation periods, and as many names of joints as there are no axes;
    for a motion that is not from rest to rest too.
    """
    require_rest(trajectory.from_rest_to_rest)
    scale = scale_of(trajectory, table.unit)
    within = WITHIN if table.within is None else table.within
    if not within > 0:
        raise InputError(f"--within must be above 0 mm, found {within:g}")
    rotary = np.array([axis in ROTARY_AXES for axis in trajectory.axes])
    allowed = np.where(rotary, within * RAD_PER_DEG * trajectory.radius, within)
    straight = table.kind in STRAIGHT
    if table.cycle is None:
        periods, miss = longest_interval(trajectory, allowed, straight=straight)
    else:
        dt = trajectory.dt
        periods = round(table.cycle / dt)
        if periods < 1 or abs(table.cycle / dt - periods) > _WHOLE:
            raise InputError(
                f"--cycle {table.cycle / MILLISECOND:g} ms is no whole number of interpolation periods of {dt / MILLISECOND:g} ms; "
                "plan with a machine file whose dt divides it"
            )
        off = _miss(trajectory, _rows(len(trajectory), periods), straight=straight)
        miss = float(off.max(initial=0.0))
        if table.within is not None and (off > allowed).any():
            raise InputError(
                f"rows every {table.cycle / MILLISECOND:g} ms are up to {miss / MICROMETRE:.3g} um off the setpoints, "
                f"--within allows {within / MICROMETRE:.3g}"
            )
    rows = _rows(len(trajectory), periods)
    if table.kind == ROS:
        _write_joints(directory, trajectory, rows, table.joints)
        return periods, miss
    columns = {"t": trajectory.t[rows]}
    for k, axis in enumerate(trajectory.axes):
        columns[axis] = trajectory.position[rows, k] * scale[k]
        if table.kind == PVT:
            columns[f"v{axis}"] = trajectory.velocity[rows, k] * scale[k]
    if table.power is not None:
        columns["power"] = table.power[rows]
    if table.kind == TWINCAT:
        t = columns.pop("t")
        for name, column in columns.items():
            np.savetxt(directory / f"{name}.txt", np.stack([t, column], axis=1), fmt="%.9f", delimiter="\t")
        return periods, miss
    with (directory / f"{table.kind}.csv").open("w", encoding="ascii", newline="") as file:
        values = np.stack(list(columns.values()), axis=1)
        np.savetxt(file, values, fmt="%.9f", delimiter=",", header=",".join(columns), comments="")
    return periods, miss


def _write_joints(directory: Path, trajectory: Trajectory, rows: Array, joints: tuple[str, ...]) -> None:
    """Write trajectory.json. Raises InputError for another number of names than of axes, or one that comes twice."""
    names = joints or trajectory.axes
    if len(set(names)) != len(trajectory.axes):
        wanted = f"give {len(trajectory.axes)} different names, of {', '.join(trajectory.axes)}"
        raise InputError(f"--joints {','.join(names)}; {wanted}")
    rotary = [axis in ROTARY_AXES for axis in trajectory.axes]
    scale = np.where(rotary, 1.0 / trajectory.radius, 1.0 / _MM_PER_M)
    position, velocity = trajectory.position[rows] * scale, trajectory.velocity[rows] * scale
    points = []
    for t, p, v in zip(trajectory.t[rows].tolist(), position.tolist(), velocity.tolist(), strict=True):
        sec, nanosec = divmod(round(t * _NANOSECONDS), _NANOSECONDS)
        when = {"sec": sec, "nanosec": nanosec}
        points.append(
            {"positions": p, "velocities": v, "accelerations": [], "effort": [], "time_from_start": when}
        )
    header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    text = json.dumps({"header": header, "joint_names": [*names], "points": points})
    (directory / "trajectory.json").write_text(text + "\n", encoding="utf-8")


def laser_power(program: Program, trajectory: Trajectory) -> FloatArray:
    """(T,) the power of a laser at each setpoint, in the program's units of S: under M4 the S word times the real speed
    over F, under M3 the S word; 0 on rapids, after M5 and before the first S, as grbl's laser mode has it."""
    mode, word = np.zeros(len(program) + 1), np.zeros(len(program) + 1)
    for event in program.events:  # in their order: what comes later holds from its block on
        if event.text[0] == "S":
            word[event.block :] = float(event.text[1:])
        elif event.text in ("M3", "M4", "M5"):
            mode[event.block :] = {"M3": 3, "M4": 4, "M5": 0}[event.text]
    block = trajectory.block
    cuts = np.isin(program.kind, [Kind.LINE, Kind.ARC, Kind.SPLINE])[block]
    real = np.where(cuts, trajectory.feed / np.where(cuts, program.feed[block], 1.0), 0.0)
    share = np.select([mode[block] == 4, mode[block] == 3], [np.minimum(real, 1.0), cuts.astype(float)], 0.0)
    power: FloatArray = word[block] * share
    return power


def longest_interval(
    trajectory: Trajectory, within: FloatArray, *, straight: bool = False
) -> tuple[int, float]:
    """Interpolation periods between two rows, at most `PERIODS_MAX`, and by how much the motion between them
    misses the setpoints at most [mm]: on straight moves or cubics, `within` (A,) of them, on the linear axes together
    and on each rotary axis."""
    found, miss = 1, 0.0
    while (periods := 2 * found) <= min(PERIODS_MAX, max(len(trajectory) - 1, 1)):
        off = _miss(trajectory, _rows(len(trajectory), periods), straight=straight)
        if (off > within).any():
            break
        found, miss = periods, float(off.max())
    return found, miss


def _rows(samples: int, periods: int) -> Array:
    """Indices of every so many samples, and of the last one."""
    rows = np.arange(0, samples, periods)
    return rows if samples == 0 or rows[-1] == samples - 1 else np.append(rows, samples - 1)


def _miss(trajectory: Trajectory, rows: Array, *, straight: bool) -> FloatArray:
    """(A,) largest distance of the motion between the rows from the setpoints: of the linear axes together, the same for each,
    and of each rotary axis."""
    t, p, v = trajectory.t, trajectory.position, trajectory.velocity
    k = np.clip(np.searchsorted(rows, np.arange(len(t)), side="right") - 1, 0, max(len(rows) - 2, 0))
    a, b = rows[k], rows[np.minimum(k + 1, len(rows) - 1)]
    h = (t[b] - t[a])[:, None]
    u = np.divide((t - t[a])[:, None], h, out=np.zeros_like(h), where=h > 0)
    if straight:
        between = (1 - u) * p[a] + u * p[b]
    else:
        between = (1 + 2 * u) * (1 - u) ** 2 * p[a] + u * (1 - u) ** 2 * h * v[a]
        between += u**2 * (3 - 2 * u) * p[b] - u**2 * (1 - u) * h * v[b]
    off: FloatArray = np.abs(between - p).max(axis=0)
    linear = [k for k, axis in enumerate(trajectory.axes) if axis not in ROTARY_AXES]
    off[linear] = np.linalg.norm((between - p)[:, linear], axis=1).max()
    return off


def write_stream(directory: Path, trajectory: Trajectory, unit: str = "mm") -> None:
    """Write the three files into an existing directory. Raises InputError for another unit than mm or inch, and for a motion
    that is not from rest to rest."""
    require_rest(trajectory.from_rest_to_rest)
    scale = scale_of(trajectory, unit)
    with (directory / "setpoints.txt").open("w", encoding="ascii") as file:
        file.write(f"# {' '.join(trajectory.axes)} [{unit}, deg], one row every {trajectory.dt:g} s\n")
        position = np.asarray(trajectory.position) * scale
        for first in range(0, len(position), _ROWS_AT_ONCE):
            np.savetxt(file, position[first : first + _ROWS_AT_ONCE], fmt="%.9f")
    (directory / "stream.hal").write_text(_stream_hal(trajectory), encoding="ascii")
    (directory / "try.hal").write_text(_try_hal(trajectory), encoding="ascii")


def scale_of(trajectory: Trajectory, unit: str) -> FloatArray:
    """(A,) units of a file, mm or inch and degrees, per unit of the positions. Raises InputError for
    others."""
    if unit not in UNITS:
        raise InputError(f"no unit '{unit}'; there are {', '.join(UNITS)}")
    rotary = [axis in ROTARY_AXES for axis in trajectory.axes]
    return np.where(rotary, trajectory.in_degrees, 1.0 / UNITS[unit])


def _signals(axes: tuple[str, ...]) -> list[str]:
    return [f"net {axis}-setpoint <= streamer.0.pin.{k}" for k, axis in enumerate(axes)]


def _stream_hal(trajectory: Trajectory) -> str:
    axes = trajectory.axes
    text = f"""\
# Plays the setpoints of a plan: {len(trajectory):,} rows, one in each servo period of {trajectory.dt * 1e3:g} ms.
# Source this file where the thread of the machine exists (here: servo-thread), and connect the signals to the drives:
#     net {axes[0]}-setpoint => hm2_7i96s.0.stepgen.00.position-cmd
# Move the machine to the first row before. Then:
#     halcmd setp streamer.0.enable 0;  halstreamer setpoints.txt &   (fills the FIFO)
#     halcmd setp streamer.0.enable 1                                 (starts the motion)
loadrt streamer depth={DEPTH} cfg={"f" * len(axes)}
setp streamer.0.enable 0
"""
    return "\n".join([text.rstrip(), *_signals(axes), "addf streamer.0 servo-thread", ""])


def _try_hal(trajectory: Trajectory) -> str:
    axes, rows = trajectory.axes, len(trajectory)
    fill = min(1.0, rows / DEPTH)  # [s], while halstreamer fills the FIFO
    signals = [f"{signal} => sampler.0.pin.{k}" for k, signal in enumerate(_signals(axes))]
    joined = "\n".join(signals)
    return f"""\
# Plays the setpoints without a machine and records them, as an ordinary user: halrun -f try.hal
# played.txt then has one row per servo period: {" ".join(axes)}, and 1 where the FIFO was empty.
loadrt threads name1=servo-thread period1={round(trajectory.dt * _NANOSECONDS)}
loadrt streamer depth={DEPTH} cfg={"f" * len(axes)}
loadrt sampler depth={2 * DEPTH} cfg={"f" * len(axes)}b
setp streamer.0.enable 0
{joined}
net empty streamer.0.empty => sampler.0.pin.{len(axes)}
addf streamer.0 servo-thread
addf sampler.0 servo-thread
loadusr halstreamer setpoints.txt
loadusr -w sleep {fill + 0.5:.1f}
loadusr halsampler -n {rows + round(1.0 / trajectory.dt)} played.txt
setp streamer.0.enable 1
start
loadusr -w sleep {trajectory.cycle_time + 2.0:.1f}
"""
