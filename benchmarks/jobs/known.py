"""Random jobs whose fastest motion is known, from other code, whatever the tolerance allows.

The tolerance lets a motion leave the path, so what is fastest on the path need not be fastest. It is here:

    capped        a line in parts with F words of their own, along one axis, or in a direction u with the limits of the axes in
                  proportion to its components: then u.v, u.a and u.j have the same limits as on the line. Parts change where the motion
                  is nearest to the vertex, within the tolerance of it: it is so small that this makes less than `SHIFTED` of the time,
                  by eps |1/F_k - 1/F_k+1|. Fastest by a convex problem (solvers/one_axis.py).
    to a point    a line, one axis of which is the slowest by velocity, acceleration and jerk: it has to go its own way from rest to
                  rest. By ruckig.
    turning back  a line there and one back, as far or not. The extreme is within the tolerance of the vertex, the velocity there is 0
                  and the acceleration free: a least over it of two ways by ruckig. Chords between setpoints take a dt^2/8 of the
                  tolerance, which is less than `SHIFTED` of the way.
    stopping      the same under G61.1: a full stop between. By ruckig.
    turns         full circles that the feed holds. From one circle to three the time grows by two circles at the inner edge of the
                  tolerance, where the chords between setpoints touch it, at the feed. Where setpoints would be beyond the outer
                  edge then, chords from edge to edge turn by the most that a period can.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from benchmarks.solvers.one_axis import fastest
from planner.base.arrays import FloatArray
from planner.machine import Axis, Machine
from planner.nc.program import Program
from planner.nc.reader import parse_program

SHIFTED = 1e-5  # [-]
FAST = 300.0  # velocity limits that nothing reaches before its feed [mm/s]
DIGITS = 9  # of programmed positions, so that directions are exact
PLACES = 65  # accelerations that are tried first where a motion turns back
LIMITS = ("velocity", "acceleration", "jerk")


class Known(NamedTuple):
    """A job, what of its time is known exactly [s], and how well [-]; `less` is a job whose time is taken off first."""

    program: Program
    machine: Machine
    least: float
    error: float = 0.0
    less: Program | None = None


def capped(random: np.random.Generator) -> Known:
    """A line with 2 to 5 F words."""
    while True:
        acceleration, jerk = _limits(random)
        parts = int(random.integers(2, 6))
        feed, length = _digits(10 ** random.uniform(0.5, 2.3, parts)), 10 ** random.uniform(-1.0, 1.5, parts)
        tolerance = SHIFTED * (length / feed).sum() / np.abs(np.diff(1.0 / feed)).sum()
        if tolerance > 1e-4:
            break
    axis = random.random() < 0.5
    u = np.eye(3)[random.integers(3)] if axis else _direction(random)
    share = np.ones(3) if axis else np.abs(u)
    machine = _machine(random, acceleration * share, jerk * share, FAST * share, min(tolerance, 0.05))
    ends = np.cumsum(length)[:, None] * u
    blocks = [f"G1 {_place(end)} F{60 * f:.9g}" for end, f in zip(ends, feed, strict=True)]
    least = fastest(length, feed, acceleration, jerk)
    return Known(_program("G64", blocks), machine, least.time, least.error)


def to_a_point(random: np.random.Generator) -> Known:
    """A line from rest to rest."""
    u, (acceleration, jerk) = _direction(random), _limits(random)
    length, velocity = 10 ** random.uniform(-1.0, 2.0), 10 ** random.uniform(0.8, 2.3)
    spare = random.uniform(1.0, 3.0, (3, 3))  # how much stronger an axis is than it needs to be
    spare[:, random.integers(3)] = 1.0
    v, a, j = (one * np.abs(u) * spare[k] for k, one in enumerate((velocity, acceleration, jerk)))
    machine = _machine(random, a, j, v, float(random.choice([0.001, 0.01, 0.05])))
    return Known(
        _program("G64", [f"G1 {_place(length * u)} F{60 * 10 * velocity:.9g}"]),
        machine,
        _way(length, velocity, acceleration, jerk),
    )


def turning_back(random: np.random.Generator) -> Known:
    """A line there and back, the tolerance as it may be used."""
    there, back, feed, acceleration, jerk, machine = _there_and_back(random)
    most = min(acceleration, np.sqrt(2.0 * jerk * feed)) * (
        1.0 - 1e-9
    )  # from more, the feed would be exceeded

    def lasting(at_turn: float) -> float:
        ways = (one - machine.tolerance for one in (there, back))
        return sum(_way(way, feed, acceleration, jerk, at_turn) for way in ways)

    from scipy.optimize import minimize_scalar

    tried = np.linspace(0.0, most, PLACES)
    k = int(np.argmin([lasting(one) for one in tried]))
    between = tried[max(k - 1, 0)], tried[min(k + 1, PLACES - 1)]
    found = minimize_scalar(lasting, bounds=between, method="bounded", options={"xatol": 1e-9 * most})
    least = min(float(found.fun), lasting(float(tried[k])))
    return Known(_back(there, back, feed, "G64"), machine, least)


def stopping(random: np.random.Generator) -> Known:
    """A line there and back, with a full stop between."""
    there, back, feed, acceleration, jerk, machine = _there_and_back(random)
    least = sum(_way(one, feed, acceleration, jerk) for one in (there, back))
    return Known(_back(there, back, feed, "G61.1"), machine, least)


def turns(random: np.random.Generator) -> Known:
    """Full circles at the feed."""
    radius, tolerance = round(10 ** random.uniform(0.3, 1.5), 3), float(random.choice([0.001, 0.01, 0.05]))
    feed = float(_digits(10 ** random.uniform(1.0, 2.0)))
    rate = feed / radius
    acceleration = feed * rate * 10 ** random.uniform(0.2, 1.0)
    jerk = max(2.0 * feed * rate**2, acceleration / 0.05)
    machine = _machine(random, np.full(3, acceleration), np.full(3, jerk), np.full(3, FAST), tolerance)
    inner, outer = radius - tolerance, radius + tolerance
    setpoints = inner / np.cos(0.5 * machine.dt * feed / inner)
    turning = feed / setpoints if setpoints <= outer else 2.0 / machine.dt * np.arccos(inner / outer)
    one, three = (_program(f"G64 F{60 * feed:.9g}", [f"G2 X0 Y0 I{radius} J0"] * n) for n in (1, 3))
    return Known(three, machine, 2.0 * 2.0 * np.pi / turning, less=one)


SORTS: tuple[tuple[Callable[[np.random.Generator], Known], int], ...] = (
    (capped, 400),
    (to_a_point, 1000),
    (turning_back, 900),
    (stopping, 400),
    (turns, 300),
)


def job(sort: Callable[[np.random.Generator], Known], seed: int) -> Known:
    """The job of a sort with that number."""
    return sort(np.random.default_rng([45, [one for one, _ in SORTS].index(sort), seed]))


def _limits(random: np.random.Generator) -> tuple[float, float]:
    """Acceleration [mm/s2] and jerk [mm/s3]."""
    acceleration = 10 ** random.uniform(2.5, 4.0)
    return acceleration, acceleration / 10 ** random.uniform(-2.3, -1.0)


def _direction(random: np.random.Generator) -> FloatArray:
    """(3,) of length 1, no component of which is next to nothing."""
    u = random.uniform(0.1, 1.0, 3) * random.choice([-1.0, 1.0], 3)
    direction: FloatArray = u / np.linalg.norm(u)
    return direction


def _machine(
    random: np.random.Generator, a: FloatArray, j: FloatArray, v: FloatArray, tolerance: float
) -> Machine:
    axes = {
        letter: Axis(velocity=float(v[k]), acceleration=float(a[k]), jerk=float(j[k]))
        for k, letter in enumerate("xyz")
    }
    period = float(random.choice([0.0005, 0.001, 0.002]))
    return Machine(name="known", dt=period, tolerance=float(f"{tolerance:.3g}"), axes=axes)


def _there_and_back(random: np.random.Generator) -> tuple[float, float, float, float, float, Machine]:
    """Both ways [mm], feed, acceleration, jerk, and the machine."""
    while True:
        acceleration, jerk = _limits(random)
        there = 10 ** random.uniform(-0.3, 1.5)
        back = there * 10 ** random.choice([0.0, random.uniform(-0.5, 0.5)])
        there, back, feed = round(there, 4), round(back, 4), float(_digits(10 ** random.uniform(0.8, 2.4)))
        limits = (np.full(3, one) for one in (acceleration, jerk, FAST))
        machine = _machine(random, *limits, float(random.choice([0.001, 0.01, 0.05])))
        chord = acceleration * machine.dt**2 / 8.0
        if chord < SHIFTED * min(there, back) and chord < 0.5 * machine.tolerance:
            return there, back, feed, acceleration, jerk, machine


def _back(there: float, back: float, feed: float, mode: str) -> Program:
    return _program(f"{mode} F{60 * feed:.9g}", [f"G1 X{there:.4f}", f"G1 X{there - back:.4f}"])


def _program(head: str, blocks: list[str]) -> Program:
    return parse_program("\n".join([f"G21 G90 G94 {head}", *blocks, "M2"]) + "\n", source="known")


def _place(point: FloatArray) -> str:
    return " ".join(f"{letter}{x:.{DIGITS}f}" for letter, x in zip("XYZ", point, strict=True))


def _digits(x: FloatArray | float) -> FloatArray:
    """Rounded to five digits, as F words are written."""
    return np.array(np.vectorize(lambda one: float(f"{one:.5g}"))(x))


def _way(length: float, v: float, a: float, j: float, at_end: float = 0.0) -> float:
    """How long a way takes from rest to velocity 0 with the acceleration -at_end, by ruckig [s]."""
    import ruckig

    task = ruckig.InputParameter(1)
    task.current_position, task.target_position, task.target_acceleration = [0.0], [length], [-at_end]
    task.max_velocity, task.max_acceleration, task.max_jerk = [v], [a], [j]
    move = ruckig.Trajectory(1)
    result = ruckig.Ruckig(1).calculate(task, move)
    if result not in (ruckig.Result.Working, ruckig.Result.Finished):
        raise RuntimeError(f"ruckig: {result}")
    return float(move.duration)
