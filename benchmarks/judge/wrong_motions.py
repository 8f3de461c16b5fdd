"""Motions of one program judged by another: faults of standstills, circles, ways back and feeds, each with a proof of its own.

A kind is a program, a motion that is wrong for it, and a proof by numpy from the delivered samples: where they are, how long they
rest, how far they turn about a centre, how fast they are. It needs nothing of the planner or its verifier. What no proof confirms
is drawn again. The motions are those of `stop`, which rests at the end of every block, or of `kinematic`, which does not; before
they are changed, and judged by their own program, they have to pass.

    standstills  a dwell left out, or too short; a full stop run through; G61 rounded off
    circles      one left out, run twice, the other way, as its chord; one more turn of a helix; two exchanged
    turning back a way there and back left out, or too short
    feed         a slow block run at the feed of the others, or faster than its F; a feed as a rapid

`wrong_samples.py` has those of axes and samples.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from benchmarks.judge.mutations import PROVED, distance
from planner.base.arrays import FloatArray
from planner.machine import Axis, Machine
from planner.motion.trajectory import Trajectory
from planner.nc.reader import parse_program
from planner.planning.methods.kinematic import KinematicMethod
from planner.planning.methods.stop import StopMethod

FASTER = 1.0 + 2e-5  # over a programmed feed: what is no rounding [-]
AT_REST = 1e-7  # samples no further apart stand still [mm]
UNKNOWN = 16.0  # bows, of the length of a block on which it may be run through unseen [-]


class Wrong(NamedTuple):
    """A motion, the program by which it is wrong, the machine, and by which program (`own`, "" for the same one) what (`made`, None
    for the motion itself) was right."""

    text: str
    motion: Trajectory
    machine: Machine
    own: str = ""
    made: Trajectory | None = None


def machine_of(random: np.random.Generator, axes: str = "xyz") -> Machine:
    """A machine of random limits."""
    acceleration, delay = 10 ** random.uniform(2.7, 3.8), 10 ** random.uniform(-2.3, -1.3)
    limits = {
        letter: Axis(velocity=random.uniform(80, 300), acceleration=a, jerk=a / delay)
        for letter, a in zip(axes, acceleration * random.uniform(0.6, 1.5, len(axes)), strict=True)
    }
    dt, tolerance = float(random.choice([0.001, 0.002, 0.004])), float(random.choice([0.01, 0.05]))
    return Machine(name="trial", dt=dt, tolerance=tolerance, axes=limits)


def program(text: str) -> str:
    """Lines as a program."""
    return f"G21 G90 G94 G17\n{text}\nM2\n"


def motion_of(text: str, machine: Machine, *, running: bool = False) -> Trajectory:
    """That of `stop`, or of `kinematic` if it is to run on from block to block."""
    method = KinematicMethod() if running else StopMethod()
    made = method.plan(parse_program(program(text), machine, source="trial"), machine).require().trajectory
    assert made is not None
    return made


def feed_of(random: np.random.Generator) -> float:
    """[mm/s]"""
    return float(f"{10 ** random.uniform(0.7, 1.9):.3g}")


def _rests(motion: Trajectory, place: FloatArray) -> float:
    """How long samples stand at a place [s]."""
    there = np.linalg.norm(motion.position - place, axis=1) < AT_REST
    return float(np.diff(motion.t)[there[1:] & there[:-1]].sum())


def _crossed(motion: Trajectory, x: float) -> float:
    """When a motion along x first comes by a place [s]."""
    k = int(np.argmax(motion.position[:, 0] >= x))
    x0, x1 = motion.position[k - 1 : k + 1, 0]
    return float(motion.t[k - 1] + (x - x0) / (x1 - x0) * (motion.t[k] - motion.t[k - 1]))


def _swept(motion: Trajectory, centre: tuple[float, float], within: float) -> float:
    """By which angle the samples within that distance turn about a centre [rad]."""
    r = motion.position[:, :2] - np.array(centre)
    r = r[np.linalg.norm(r, axis=1) <= within]
    angle = np.unwrap(np.arctan2(r[:, 1], r[:, 0]))
    return float(angle[-1] - angle[0]) if len(angle) else 0.0


def _far(motion: Trajectory, point: tuple[float, ...], tolerance: float) -> bool:
    """True if a point is further from the samples' polyline than the tolerance."""
    return bool((distance(np.array([point]), motion.position[:, : len(point)]) > PROVED * tolerance).any())


def speeds(motion: Trajectory) -> FloatArray:
    """Of all whole periods [mm/s]."""
    period = np.diff(motion.t)
    speed: FloatArray = np.linalg.norm(np.diff(motion.position, axis=0), axis=1) / period
    return speed[period > 0.999 * period.max()]


# ---- standstills -------------------------------------------------------------------------------------------------------------------


def dwell_left_out(random: np.random.Generator) -> Wrong | None:
    """The motion does not wait, or not as long as it should."""
    machine, a, seconds = machine_of(random), random.uniform(1, 20), random.uniform(0.1, 0.5)
    share = random.choice([0.0, random.uniform(0.1, 0.9)])
    text = f"F{60 * feed_of(random):g}\nG1 X{a:.3f}\nG4 P{{}}\nG1 Y{a:.3f}"
    own = text.format(f"{share * seconds:.4f}")
    motion = motion_of(own, machine)
    short = _rests(motion, np.array([round(a, 3), 0.0, 0.0])) < seconds - 4.0 * machine.dt
    return Wrong(text.format(f"{seconds:.4f}"), motion, machine, own) if short else None


def stop_run_through(random: np.random.Generator) -> Wrong | None:
    """A full stop on a straight line is passed."""
    machine, a, feed = machine_of(random), random.uniform(3, 20), feed_of(random)
    text = f"{{}} F{60 * feed:g}\nG1 X{a:.3f}\nG1 X{2 * a:.3f}"
    motion = motion_of(text.format("G64"), machine, running=True)
    k = int(np.argmax(motion.position[:, 0] >= round(a, 3)))
    slowest = float((np.diff(motion.position[k - 3 : k + 4, 0]) / machine.dt).min())
    fast = slowest > 2.0 * machine.dt * float(machine.limits("acceleration", ("x",))[0])
    return Wrong(text.format("G61.1"), motion, machine, text.format("G64")) if fast else None


def exact_path_rounded(random: np.random.Generator) -> Wrong | None:
    """A corner under G61 is cut."""
    machine, a, feed = machine_of(random), random.uniform(3, 20), feed_of(random)
    text = f"{{}} F{60 * feed:g}\nG1 X{a:.3f}\nG1 X{2 * a:.3f} Y{a:.3f}"
    motion = motion_of(text.format("G64"), machine, running=True)
    bow = float(np.linalg.norm(machine.limits("acceleration", motion.axes))) * machine.dt**2 / 8.0
    missed = distance(np.array([[round(a, 3), 0.0, 0.0]]), motion.position)[0] > 1.5 * bow + 1e-5
    return Wrong(text.format("G61"), motion, machine, text.format("G64")) if missed else None


# ---- circles -----------------------------------------------------------------------------------------------------------------------


def _circle(
    random: np.random.Generator, wrong: str, right: str
) -> tuple[str, str, float, Machine, Trajectory]:
    """Text and that of the wrong motion, with the radius in them, machine and wrong motion."""
    machine, radius = machine_of(random), round(random.uniform(0.5, 8.0), 3)
    around = f"F{60 * feed_of(random):g}\nG1 X10 Y3\n{{}}\nG1 X20 Y0"
    own = around.format(wrong.format(r=radius, x=10 + 2 * radius))
    return (
        around.format(right.format(r=radius, x=10 + 2 * radius)),
        own,
        radius,
        machine,
        motion_of(own, machine),
    )


def circle_left_out(random: np.random.Generator) -> Wrong | None:
    """A full circle is not run."""
    text, own, radius, machine, motion = _circle(random, "", "G2 I{r} J0")
    return (
        Wrong(text, motion, machine, own)
        if _far(motion, (10.0 + 2 * radius, 3.0), machine.tolerance)
        else None
    )


def circle_twice(random: np.random.Generator) -> Wrong | None:
    """A full circle is run twice."""
    text, own, radius, machine, motion = _circle(random, "G2 I{r} J0\nG2 I{r} J0", "G2 I{r} J0")
    turned = _swept(motion, (10.0 + radius, 3.0), radius + machine.tolerance)
    return Wrong(text, motion, machine, own) if abs(turned) > 2.5 * np.pi else None


def circle_the_other_way(random: np.random.Generator) -> Wrong | None:
    """G3 for G2."""
    text, own, radius, machine, motion = _circle(random, "G3 I{r} J0", "G2 I{r} J0")
    turned = _swept(motion, (10.0 + radius, 3.0), radius + machine.tolerance)
    return Wrong(text, motion, machine, own) if turned > 0.5 * np.pi else None


def arc_as_chord(random: np.random.Generator) -> Wrong | None:
    """A line for half a circle."""
    text, own, radius, machine, motion = _circle(random, "G1 X{x} Y3", "G2 X{x} Y3 I{r} J0")
    missed = _far(motion, (10.0 + radius, 3.0 + radius), machine.tolerance)
    return Wrong(text, motion, machine, own) if missed else None


def helix_one_more_turn(random: np.random.Generator) -> Wrong | None:
    """Two turns down for one."""
    text, own, radius, machine, motion = _circle(
        random, "G2 I{r} J0 Z-0.75\nG2 I{r} J0 Z-1.5", "G2 I{r} J0 Z-1.5"
    )
    turned = _swept(motion, (10.0 + radius, 3.0), radius + machine.tolerance)
    return Wrong(text, motion, machine, own) if abs(turned) > 2.5 * np.pi else None


def circles_exchanged(random: np.random.Generator) -> Wrong | None:
    """The second of two circles from one place is run first."""
    one, two = "G2 I{r} J0", "G2 I-{r} J0"
    text, own, radius, machine, motion = _circle(random, f"{two}\n{one}", f"{one}\n{two}")
    first, second = (
        int(np.linalg.norm(motion.position[:, :2] - [10.0 + side * 2 * radius, 3.0], axis=1).argmin())
        for side in (1, -1)
    )
    return Wrong(text, motion, machine, own) if first > second else None


# ---- turning back ------------------------------------------------------------------------------------------------------------------


def way_back_too_short(random: np.random.Generator) -> Wrong | None:
    """A way there and back on a line is left out, or run in part."""
    machine, a = machine_of(random), random.uniform(3, 20)
    back = a * random.uniform(0.1, 0.9)
    kept = random.choice([0.0, random.uniform(0.05, 0.95)])
    text = f"F{60 * feed_of(random):g}\nG1 X{a:.3f}\nG1 X{{:.3f}}\nG1 X{1.5 * a:.3f}"
    own = text.format(a - kept * back)
    motion = motion_of(own, machine)
    x = motion.position[:, 0]
    behind = int(np.argmax(x > a - machine.tolerance))
    high = bool(x[behind:].min() > round(a - back, 3) + PROVED * machine.tolerance)
    return Wrong(text.format(a - back), motion, machine, own) if high else None


# ---- feed --------------------------------------------------------------------------------------------------------------------------


def slow_block_run_fast(random: np.random.Generator) -> Wrong | None:
    """A block with a low F, of 0.03 to 3 mm, at the feed of those beside it, or at 1 to 10 % more than its own."""
    machine, fast, slow = machine_of(random), random.uniform(40, 80), random.uniform(0.5, 5.0)
    length = 10 ** random.uniform(-1.5, 0.5)
    much = random.choice([fast / slow, random.uniform(1.01, 1.1)])
    text = f"G1 X5 F{60 * fast:.6g}\nG1 X{5 + length:.4f} F{{:.6g}}\nG1 X12 F{60 * fast:.6g}"
    own = text.format(60 * slow * much)
    motion = motion_of(own, machine, running=True)
    lasting = _crossed(motion, round(5 + length, 4)) - _crossed(motion, 5.0)
    # between samples the motion may leave its chords by this, and so may the places nearest to the vertices
    bow = float(np.linalg.norm(machine.limits("acceleration", motion.axes))) * machine.dt**2 / 8.0
    quick = (lasting + 2.0 * machine.dt) * FASTER < (round(5 + length, 4) - 5.0 - UNKNOWN * bow) / slow
    return Wrong(text.format(60 * slow), motion, machine, own) if quick else None


def rapid_for_a_feed(random: np.random.Generator) -> Wrong | None:
    """G0 for G1."""
    machine, a, feed = machine_of(random), random.uniform(3, 40), feed_of(random)
    text = f"F{60 * feed:g}\nG1 X5\n{{}} X{5 + a:.3f} Y{a:.3f}\nG1 X{5 + 2 * a:.3f}"
    motion = motion_of(text.format("G0"), machine)
    fast = float(speeds(motion).max()) > FASTER * feed
    return Wrong(text.format("G1"), motion, machine, text.format("G0")) if fast else None


KINDS: tuple[Callable[[np.random.Generator], Wrong | None], ...] = (
    dwell_left_out, stop_run_through, exact_path_rounded, circle_left_out, circle_twice, circle_the_other_way, arc_as_chord,
    helix_one_more_turn, circles_exchanged, way_back_too_short, slow_block_run_fast, rapid_for_a_feed,
)  # fmt: skip
