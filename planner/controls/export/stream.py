"""Setpoints for LinuxCNC's HAL: one row per servo period, put out by its component `streamer`.

LinuxCNC's own planner has no jerk limit and another idea of a corner, so a program cannot make it move as
planned. Its HAL plays setpoints as they are: `halstreamer` feeds the rows of a file into a FIFO, and
`streamer` puts one of them on its pins in every servo period. Three files:

    setpoints.txt  rows of axis positions, in mm or inch, rotary axes in degrees
    stream.hal     loads the streamer and names its signals; to be sourced in a machine's HAL configuration
    try.hal        plays and records the rows without a machine: `halrun -f try.hal` writes played.txt

The last period of a plan may be shorter than the others; its row comes a whole period after the one before
it.
"""

from pathlib import Path

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.base.sizes import SIZES
from planner.base.units import MM_PER_INCH
from planner.machine import ROTARY_AXES
from planner.motion.trajectory import Trajectory, require_rest

DEPTH = 4000  # rows that wait in the FIFO: four seconds at 1 ms, while the disk may be busy
_NANOSECONDS = 1e9  # in a second: HAL gives a thread's period in them
_ROWS_AT_ONCE = SIZES.text_rows
# mm in a length unit of the streamed positions.
UNITS = {"mm": 1.0, "inch": MM_PER_INCH}


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
