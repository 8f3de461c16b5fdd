"""Faults put into correct motions, each with a proof of its own that it is one.

The proofs use divided differences of the delivered positions, distances of points from their polyline, and nothing of the planner or
its verifier. A k-th difference over h^k is a mean of the k-th derivative, so that what it exceeds the motion exceeds. A mutation that
no proof confirms is drawn again: a sample that repeats at rest, or a vertex moved by less than the tolerance, is no fault.

Kinds of mutations, by what they change:

    samples   late, left out, repeated, displaced, beginning or end cut off, whole motion shifted, mirrored, stretched in time, ringing
    machine   each limit of each axis 1 % below what the motion reaches; the same for the feed and the normal acceleration; filters
              behind the setpoints that nobody planned for
    program   the motion of a program with a block left out, a vertex shifted, two vertices exchanged
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.machine import Fir, Machine
from planner.motion.trajectory import COLUMNS, Trajectory
from planner.nc.program import Program
from planner.nc.reader import parse_program
from planner.planning.job.plan import Plan
from planner.planning.methods.stop import StopMethod

# What counts as proved: a limit or a tolerance exceeded by this factor [-], so that rounding is no proof.
PROVED = 1.005
OVER = 1.01  # by how much a limit is exceeded that is put below the motion [-]
QUANTITIES: tuple[Literal["velocity", "acceleration", "jerk"], ...] = ("velocity", "acceleration", "jerk")


@dataclass(frozen=True, kw_only=True)
class Case:
    """A plan on a program of lines.

    points   : (n + 1, 3) the origin, where every program begins, and the ends of its blocks [mm]
    feed     : of all blocks [mm/s]
    plan     : made of it, passed
    jerk     : False if the method does not limit jerk
    """

    points: FloatArray
    feed: float
    machine: Machine
    plan: Plan
    jerk: bool = True

    @property
    def trajectory(self) -> Trajectory:
        """What was delivered."""
        return self.plan.require().trajectory  # type: ignore[return-value]


@dataclass(frozen=True, kw_only=True)
class Fault:
    """A delivered motion, and the program and machine by which it has to be refused.

    columns : True if the derivatives are delivered too
    """

    trajectory: Trajectory
    points: FloatArray
    feed: float
    machine: Machine
    columns: bool = False


Mutation = Callable[[Case, np.random.Generator], Fault | None]


def program_of(points: FloatArray, feed: float) -> Program:
    """The lines from the origin, the first of the points [mm], through the others at a feed [mm/s]."""
    lines = [f"G21 G90 G94 G64 F{60 * feed:.9g}"]
    lines += [f"G1 X{x:.6f} Y{y:.6f} Z{z:.6f}" for x, y, z in points[1:]]
    return parse_program("\n".join([*lines, "M2"]) + "\n", source="trial")


# ---- proofs ------------------------------------------------------------------------------------------------------------------


def peaks(motion: Trajectory) -> FloatArray:
    """(3, A) largest mean velocity, acceleration and jerk of each axis, by differences of the positions at dt."""
    x = (
        motion.position[:-1]
        if len(motion) > 1 and motion.t[-1] - motion.t[-2] < 0.999 * motion.dt
        else motion.position
    )
    return np.array(
        [np.abs(np.diff(x, n, axis=0)).max(axis=0, initial=0.0) / motion.dt**n for n in (1, 2, 3)]
    )


def breaks_limits(motion: Trajectory, case: Case) -> bool:
    """True if the positions show that some limit of an axis is exceeded."""
    limits = np.array([case.machine.limits(name, motion.axes) for name in QUANTITIES])
    return bool((peaks(motion) > PROVED * limits)[: 3 if case.jerk else 2].any())


def distance(points: FloatArray, motion: FloatArray) -> FloatArray:
    """(n,) distance of each point (n, A) from the polyline through the positions (T, A)."""
    a, d = motion[:-1], np.diff(motion, axis=0)
    square = np.maximum((d * d).sum(axis=1), 1e-300)
    u = np.clip(((points[:, None] - a) * d).sum(axis=2) / square, 0.0, 1.0)
    return np.asarray(np.linalg.norm(points[:, None] - (a + u[:, :, None] * d), axis=2).min(axis=1))


def misses_a_vertex(position: FloatArray, points: FloatArray, machine: Machine) -> bool:
    """True if a vertex is further from the polyline of the positions than the tolerance."""
    return bool((distance(points, position) > PROVED * machine.tolerance).any())


def leaves_the_path(position: FloatArray, points: FloatArray, machine: Machine) -> bool:
    """True if a position is further from the lines of the program than the tolerance."""
    return bool((distance(position, points) > PROVED * machine.tolerance).any())


# ---- of the samples ----------------------------------------------------------------------------------------------------------


def _rows(motion: Trajectory, keep: Array) -> Trajectory:
    """The rows `keep`, at times that start at 0 and go on at dt."""
    columns = {name: getattr(motion, name)[keep] for name in COLUMNS}
    return dataclasses.replace(motion, **columns | {"t": np.arange(len(keep)) * motion.dt})


def _given(case: Case, motion: Trajectory) -> Fault:
    return Fault(trajectory=motion, points=case.points, feed=case.feed, machine=case.machine)


def _if_limits_break(case: Case, motion: Trajectory) -> Fault | None:
    return _given(case, motion) if breaks_limits(motion, case) else None


def sample_late(case: Case, random: np.random.Generator) -> Fault | None:
    """A sample comes late by 1 % to 90 % of a period."""
    t = case.trajectory.t.copy()
    t[random.integers(1, len(t) - 2)] += random.uniform(0.01, 0.9) * case.machine.dt
    return _given(case, dataclasses.replace(case.trajectory, t=t))


def sample_left_out(case: Case, random: np.random.Generator) -> Fault | None:
    """A sample is missing, the ones behind it come a period early."""
    count = len(case.trajectory)
    return _if_limits_break(
        case, _rows(case.trajectory, np.delete(np.arange(count), random.integers(1, count - 1)))
    )


def sample_repeated(case: Case, random: np.random.Generator) -> Fault | None:
    """A sample comes twice, the ones behind it a period late."""
    count = len(case.trajectory)
    k = random.integers(1, count - 1)
    return _if_limits_break(case, _rows(case.trajectory, np.insert(np.arange(count), k, k)))


def sample_displaced(case: Case, random: np.random.Generator) -> Fault | None:
    """A sample of one axis is off by 1 um to 1 mm."""
    position = case.trajectory.position.copy()
    position[random.integers(1, len(position) - 1), random.integers(3)] += 10 ** random.uniform(
        -3, 0
    ) * random.choice([-1, 1])
    return _if_limits_break(case, dataclasses.replace(case.trajectory, position=position))


def end_cut_off(case: Case, random: np.random.Generator) -> Fault | None:
    """The last samples are missing."""
    kept = _rows(case.trajectory, np.arange(int(len(case.trajectory) * random.uniform(0.3, 1.0))))
    off = np.linalg.norm(kept.position[-1] - case.points[-1]) if len(kept) > 3 else 0.0
    return _given(case, kept) if off > PROVED * case.machine.tolerance else None


def beginning_cut_off(case: Case, random: np.random.Generator) -> Fault | None:
    """The first samples are missing."""
    count = len(case.trajectory)
    kept = _rows(case.trajectory, np.arange(int(count * random.uniform(0.0, 0.7)), count))
    off = np.linalg.norm(kept.position[0]) if len(kept) > 3 else 0.0
    return _given(case, kept) if off > PROVED * case.machine.tolerance else None


def all_shifted(case: Case, random: np.random.Generator) -> Fault | None:
    """The whole motion is off, by 1 to 20 tolerances."""
    off = random.normal(size=3)
    off *= case.machine.tolerance * random.uniform(1.02, 20.0) / np.linalg.norm(off)
    moved = dataclasses.replace(case.trajectory, position=case.trajectory.position + off)
    return _given(case, moved) if misses_a_vertex(moved.position, case.points, case.machine) else None


def mirrored(case: Case, random: np.random.Generator) -> Fault | None:
    """One axis runs the other way."""
    sign = np.ones(3)
    sign[random.integers(3)] = -1.0
    turned = dataclasses.replace(case.trajectory, position=case.trajectory.position * sign)
    return _given(case, turned) if misses_a_vertex(turned.position, case.points, case.machine) else None


def ringing(case: Case, random: np.random.Generator) -> Fault | None:
    """From some moment on an axis rings, at 20 Hz to a third of the sampling rate, by 0.1 to 10 tolerances, and dies away."""
    motion = case.trajectory
    t = motion.t - motion.t[random.integers(1, len(motion) - 2)]
    w = 2 * np.pi * min(10 ** random.uniform(1.3, 2.5), 0.33 / motion.dt)
    size = case.machine.tolerance * 10 ** random.uniform(-1, 1)
    position = motion.position.copy()
    position[:, random.integers(3)] += np.where(t > 0, size * np.exp(-0.05 * w * t) * np.sin(w * t), 0.0)
    rung = dataclasses.replace(motion, position=position)
    wrong = breaks_limits(rung, case) or leaves_the_path(position, case.points, case.machine)
    return _given(case, rung) if wrong else None


# ---- of the machine ----------------------------------------------------------------------------------------------------------


def limit_exceeded(quantity: str, axis: int) -> Mutation:
    """A limit of the axis lies 1 % below the mean that the motion reaches over a period."""

    def mutated(case: Case, random: np.random.Generator) -> Fault | None:
        order = QUANTITIES.index(quantity)
        reached = float(peaks(case.trajectory)[order, axis])
        if reached <= 0.0 or (quantity == "jerk" and not case.jerk):
            return None
        letter = case.trajectory.axes[axis]
        axes = dict(case.machine.axes)
        axes[letter] = axes[letter].model_copy(update={quantity: reached / OVER})
        machine = case.machine.model_copy(update={"axes": axes})
        return Fault(trajectory=case.trajectory, points=case.points, feed=case.feed, machine=machine)

    mutated.__name__ = f"{quantity}.{'xyz'[axis]} 1 % over its limit"
    return mutated


def feed_exceeded(case: Case, random: np.random.Generator) -> Fault | None:
    """The programmed feed is 1 % below the mean speed that the motion reaches over a period."""
    motion = case.trajectory
    speed = np.linalg.norm(np.diff(motion.position, axis=0), axis=1) / np.diff(motion.t)
    feed = float(speed[np.diff(motion.t) > 0.999 * motion.dt].max(initial=0.0)) / OVER
    if feed <= 0.0:
        return None
    return Fault(trajectory=motion, points=case.points, feed=feed, machine=case.machine)


def normal_acceleration_exceeded(case: Case, random: np.random.Generator) -> Fault | None:
    """The limit of the normal acceleration is 1 % below what the motion reaches, by its columns."""
    v, a = case.trajectory.velocity, case.trajectory.acceleration
    speed = np.linalg.norm(v, axis=1)
    fast = speed > 0.05 * speed.max()
    reached = float((np.linalg.norm(np.cross(v[fast], a[fast]), axis=1) / speed[fast]).max(initial=0.0))
    if reached < 1e-3 * np.linalg.norm(a, axis=1).max():
        return None
    machine = case.machine.model_copy(update={"normal_acceleration": reached / OVER})
    return Fault(
        trajectory=case.trajectory, points=case.points, feed=case.feed, machine=machine, columns=True
    )


def filters_forgotten(case: Case, random: np.random.Generator) -> Fault | None:
    """The machine has moving averages behind the setpoints, of which the plan knew nothing."""
    motion, lengths = case.trajectory, 10 ** random.uniform(-2.3, -0.7, 2)
    x = motion.position
    for length in lengths:
        taps = np.ones(max(round(length / motion.dt), 1))
        ends = len(taps)
        x = np.vstack([np.repeat(x[:1], ends, axis=0), x, np.repeat(x[-1:], ends, axis=0)])
        x = np.stack(
            [np.convolve(x[:, k], taps / len(taps), mode="valid") for k in range(x.shape[1])], axis=1
        )
    if not misses_a_vertex(x, case.points, case.machine) or len(x) > 20_000:
        return None
    # whole periods, so that the convolution here is the filter
    lengths = np.maximum(np.round(lengths / motion.dt), 1.0) * motion.dt
    machine = case.machine.model_copy(update={"fir": Fir(time_constants=tuple(float(v) for v in lengths))})
    return Fault(trajectory=motion, points=case.points, feed=case.feed, machine=machine)


# ---- of the program ----------------------------------------------------------------------------------------------------------


def _motion_of(points: FloatArray, case: Case) -> Trajectory | None:
    if (np.linalg.norm(np.diff(points, axis=0), axis=1) < 1e-3).any():
        return None
    made = StopMethod().plan(program_of(points, case.feed), case.machine)
    return made.trajectory


def _of_program(points: FloatArray, case: Case) -> Fault | None:
    motion = _motion_of(points, case)
    if motion is None or motion.axes != case.trajectory.axes:
        return None
    wrong = misses_a_vertex(motion.position, case.points, case.machine) or leaves_the_path(
        motion.position, case.points, case.machine
    )
    return _given(case, motion) if wrong else None


def block_left_out(case: Case, random: np.random.Generator) -> Fault | None:
    """A vertex is passed by."""
    return _of_program(np.delete(case.points, random.integers(1, len(case.points) - 1), axis=0), case)


def vertex_shifted(case: Case, random: np.random.Generator) -> Fault | None:
    """A vertex is off by 1 to 20 tolerances."""
    points, off = case.points.copy(), random.normal(size=3)
    points[random.integers(1, len(points) - 1)] += (
        off * case.machine.tolerance * random.uniform(1.02, 20) / np.linalg.norm(off)
    )
    return _of_program(points, case)


def vertices_exchanged(case: Case, random: np.random.Generator) -> Fault | None:
    """Two vertices are run in the wrong order."""
    points, k = case.points.copy(), int(random.integers(1, len(case.points) - 2))
    points[[k, k + 1]] = points[[k + 1, k]]
    return _of_program(points, case)


def backwards(case: Case, random: np.random.Generator) -> Fault | None:
    """The vertices are run in reverse order, back to the origin."""
    return _of_program(np.vstack([case.points[:1], case.points[::-1]]), case)


KINDS: tuple[Mutation, ...] = (
    sample_late, sample_left_out, sample_repeated, sample_displaced, beginning_cut_off, end_cut_off, all_shifted, mirrored, ringing,
    *(limit_exceeded(quantity, axis) for quantity in QUANTITIES for axis in range(3)),
    feed_exceeded, normal_acceleration_exceeded, filters_forgotten, block_left_out, vertex_shifted, vertices_exchanged, backwards,
)  # fmt: skip
