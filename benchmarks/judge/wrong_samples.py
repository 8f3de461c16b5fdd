"""Right motions whose axes or samples are changed, each with a proof of its own that it is wrong then, as in wrong_motions.py.

axes     two exchanged; one late; a rotary one the wrong way, or late; inches for millimetres; a thread of another pitch
samples  all in less time, a drift, a bump, a way out and back behind the end, reversed in time, rounded to a micrometre, NaN,
         inf, times that stand still or go back
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from benchmarks.judge.mutations import PROVED, distance
from benchmarks.judge.wrong_motions import FASTER, Wrong, feed_of, machine_of, motion_of, speeds
from planner.base.arrays import FloatArray
from planner.motion.trajectory import Trajectory

PLACES = 500  # of a motion that are looked at in a proof
DERIVATIVES = ("velocity", "acceleration", "jerk")


def _changed(motion: Trajectory, position: FloatArray) -> Trajectory:
    return dataclasses.replace(motion, position=position)


def _of_lines(random: np.random.Generator, axes: str = "xyz") -> Wrong:
    """A right motion of four lines; in A by degrees."""
    machine, points = (
        machine_of(random, axes),
        np.round(np.cumsum(random.uniform(2, 9, (4, len(axes))), axis=0), 3),
    )
    blocks = [
        "G1 " + " ".join(f"{letter.upper()}{x:.3f}" for letter, x in zip(axes, p, strict=True))
        for p in points
    ]
    text = "\n".join([f"F{60 * feed_of(random):g}", *blocks])
    motion = motion_of(text, machine)
    return Wrong(text, motion, machine, made=motion)


def _leaves(wrong: Wrong, position: FloatArray) -> Wrong | None:
    """With other positions, if they are off the right ones' polyline by more than the tolerance, or miss a part of it."""
    right, most = wrong.motion.position, PROVED * wrong.machine.tolerance
    every = slice(None, None, max(len(right) // PLACES, 1))
    off = distance(position[every], right).max() > most or distance(right[every], position).max() > most
    return wrong._replace(motion=_changed(wrong.motion, position)) if off else None


def axes_exchanged(random: np.random.Generator) -> Wrong | None:
    """X runs as Y and Y as X."""
    wrong = _of_lines(random)
    return _leaves(wrong, wrong.motion.position[:, [1, 0, 2]])


def _late(wrong: Wrong, axis: int, random: np.random.Generator) -> Wrong | None:
    position, by = wrong.motion.position.copy(), int(random.integers(2, 60))
    position[by:, axis], position[:by, axis] = position[:-by, axis].copy(), position[0, axis]
    return _leaves(wrong, position)


def axis_late(random: np.random.Generator) -> Wrong | None:
    """An axis is some periods behind the others."""
    return _late(_of_lines(random), int(random.integers(3)), random)


def rotary_axis_late(random: np.random.Generator) -> Wrong | None:
    """A is some periods behind x."""
    return _late(_of_lines(random, "xya"), 2, random)


def rotary_axis_the_wrong_way(random: np.random.Generator) -> Wrong | None:
    """A turns the other way."""
    wrong = _of_lines(random, "xya")
    return _leaves(wrong, wrong.motion.position * [1.0, 1.0, -1.0])


def inches(random: np.random.Generator) -> Wrong | None:
    """Millimetres are taken for inches."""
    wrong = _of_lines(random)
    return _leaves(wrong, wrong.motion.position / 25.4)


def thread_of_another_pitch(random: np.random.Generator) -> Wrong | None:
    """The pitch is off by 0.1 to 5 %: by more than twice the tolerance over the cut."""
    machine, pitch, cut = machine_of(random), round(random.uniform(0.5, 1.5), 2), random.uniform(15, 40)
    off = 10 ** random.uniform(-3.0, -1.3)
    text = f"M3 S{random.uniform(200, 900):.0f}\nG33 Z-{cut:.3f} K{{:.5f}}"
    own = text.format(pitch * (1 + off))
    motion = motion_of(own, machine)
    return (
        Wrong(text.format(pitch), motion, machine, own) if 0.5 * cut * off > 2.0 * machine.tolerance else None
    )


# ---- samples -----------------------------------------------------------------------------------------------------------------------


def drift(random: np.random.Generator) -> Wrong | None:
    """Positions creep away, to 1 to 10 tolerances at the end."""
    wrong = _of_lines(random)
    way = random.normal(size=3)
    way *= wrong.machine.tolerance * random.uniform(1.05, 10) / np.linalg.norm(way)
    return _leaves(wrong, wrong.motion.position + np.linspace(0, 1, len(wrong.motion))[:, None] * way)


def bump(random: np.random.Generator) -> Wrong | None:
    """A smooth bump of 1 to 10 tolerances on one axis."""
    wrong = _of_lines(random)
    n, count = int(random.integers(20, 200)), len(wrong.motion)
    if n >= count:
        return None
    position, low = wrong.motion.position.copy(), int(random.integers(count - n))
    height = wrong.machine.tolerance * random.uniform(1.05, 10)
    position[low : low + n, int(random.integers(3))] += height * np.sin(np.pi * np.arange(n) / n) ** 4
    return _leaves(wrong, position)


def out_and_back_behind_the_end(random: np.random.Generator) -> Wrong | None:
    """At the end it goes on by 2 to 50 tolerances, smoothly, and comes back."""
    wrong = _of_lines(random)
    motion, n = wrong.motion, int(random.integers(100, 600))
    end, u = motion.position[-1], motion.position[-1] - motion.position[-2]
    if not np.linalg.norm(u) > 0.0:
        u = np.ones(3)
    way = wrong.machine.tolerance * random.uniform(2, 50) * u / np.linalg.norm(u)
    more = end + np.sin(np.pi * np.arange(1, n + 1) / n)[:, None] ** 4 * way
    columns = {name: np.zeros((n, 3)) for name in DERIVATIVES}
    rows = {name: np.concatenate([getattr(motion, name), more]) for name, more in columns.items()}
    t = np.concatenate([motion.t, motion.t[-1] + wrong.machine.dt * np.arange(1, n + 1)])
    others = {
        name: np.concatenate([getattr(motion, name), np.repeat(getattr(motion, name)[-1:], n)])
        for name in ("s", "feed", "block", "line")
    }
    return wrong._replace(
        motion=dataclasses.replace(
            motion, t=t, position=np.concatenate([motion.position, more]), **rows, **others
        )
    )


def reversed_in_time(random: np.random.Generator) -> Wrong | None:
    """From the end to the beginning."""
    wrong = _of_lines(random)
    return wrong._replace(motion=_changed(wrong.motion, wrong.motion.position[::-1]))


def rounded(random: np.random.Generator) -> Wrong | None:
    """To a micrometre, and delivered as exact: the jerk between such places is above the limit."""
    wrong = _of_lines(random)
    position = np.round(wrong.motion.position, 3)
    jerk = np.abs(np.diff(position[:-1], 3, axis=0)).max(axis=0) / wrong.machine.dt**3
    over = bool((jerk > PROVED * wrong.machine.limits("jerk", ("x", "y", "z"))).any())
    return wrong._replace(motion=_changed(wrong.motion, position)) if over else None


def no_number(random: np.random.Generator) -> Wrong | None:
    """NaN or inf among the positions or times."""
    wrong = _of_lines(random)
    columns = {"t": wrong.motion.t.copy(), "position": wrong.motion.position.copy()}
    columns[str(random.choice(["t", "position"]))][int(random.integers(1, len(wrong.motion)))] = (
        random.choice([np.nan, np.inf, -np.inf])
    )
    return wrong._replace(motion=dataclasses.replace(wrong.motion, **columns))


def times_that_do_not_go_on(random: np.random.Generator) -> Wrong | None:
    """Two samples at one time, or the second before the first."""
    wrong = _of_lines(random)
    t, k = wrong.motion.t.copy(), int(random.integers(2, len(wrong.motion) - 1))
    t[k] = t[k - 1] - random.choice([0.0, 0.5 * wrong.machine.dt])
    return wrong._replace(motion=dataclasses.replace(wrong.motion, t=t))


def in_less_time(random: np.random.Generator) -> Wrong | None:
    """All of it 0.005 to 10 % faster."""
    wrong = _of_lines(random)
    quick = dataclasses.replace(wrong.motion, t=wrong.motion.t * (1.0 - 10 ** random.uniform(-4.3, -1.0)))
    feed = float(wrong.text.split("F")[1].split("\n")[0]) / 60.0
    fast = float(speeds(quick).max()) > FASTER * feed
    return wrong._replace(motion=quick) if fast else None


KINDS: tuple[Callable[[np.random.Generator], Wrong | None], ...] = (
    in_less_time, axes_exchanged, axis_late, rotary_axis_late, rotary_axis_the_wrong_way, inches, thread_of_another_pitch, drift, bump,
    out_and_back_behind_the_end, reversed_in_time, rounded, no_number, times_that_do_not_go_on,
)  # fmt: skip
