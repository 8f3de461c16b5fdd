"""The jobs of the campaign: from a number a random program, machine, tolerance, interpolation period and method.

Programs of lines and arcs in three axes (never_slower.py), of up to nine axes (axes_campaign.py), of everything that moves in one
program (`mixed`), of points on a curve (`dense`), and those that are compared with LinuxCNC's interpreter: cycles, offsets, feed
modes, lathe, cutter compensation, splines, and all of these in subprograms, loops and branches (tests/nc/random_nc.py,
random_splines.py, random_together.py).

A job whose motion would have more than `SAMPLES` samples gets a larger period, and then faster limits and feeds, which make the same
motion in less time; dwells are cut. So a job is a small one, whatever its program asks for.
"""

from __future__ import annotations

import dataclasses
import importlib
import itertools
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import axes_campaign, never_slower
from planner.base.errors import InputError
from planner.machine import Axis, Fir, Machine, Mode
from planner.nc.program import Program
from planner.nc.reader import parse_program

TESTS = Path(__file__).resolve().parent.parent / "tests" / "nc"
BLOCKS = 40  # of a program, at most
SAMPLES = 4000  # of a motion from stop to stop, about
PERIOD_MAX = 0.016  # [s]
DWELL_MAX = 0.05  # [s]
DRAWS = 60  # of a program until one has few blocks and moves
STREAM = 41  # of random numbers
PERIODS = (0.00025, 0.0005, 0.001, 0.001, 0.002, 0.004, 0.008, 0.016)  # [s]
# Methods with their settings, and how often each is drawn.
METHODS: tuple[tuple[float, str, dict[str, Any]], ...] = (
    (30, "optimal", {"effort": "quick"}),
    (14, "optimal", {}),
    (3, "optimal", {"corner": "bezier"}),
    (3, "optimal", {"corner": "fir"}),
    (3, "optimal", {"corner": "kinematic"}),
    (3, "optimal", {"geometry": "spline", "effort": "quick"}),
    (3, "optimal", {"effort": "quick", "shaped": True}),
    (6, "second-order", {}),
    (2, "second-order", {"corner": "bezier"}),
    (8, "kinematic", {}),
    (7, "stop", {}),
    (5, "bezier", {}),
    (5, "fir", {}),
    (2, "fir-plain", {}),
    (3, "fir-spline", {}),
    (1, "fir-spline-plain", {}),
    (2, "tube", {}),
)
SOURCES = {
    "lines and arcs": 18,
    "axes": 14,
    "mixed": 26,
    "dense": 10,
    "compensated": 5,
    "cycles": 6,
    "offsets": 4,
    "feeds": 4,
    "lathe": 4,
    "splines": 5,
    "together": 4,
}
Rng = np.random.Generator


@dataclass(frozen=True, eq=False, kw_only=True)
class Job:
    """What is planned: a program, or the message with which it was refused, on a machine.

    tolerance : that is given beside program and machine [mm], or None
    """

    seed: int
    source: str
    text: str
    program: Program | None
    refusal: str
    machine: Machine
    method: str
    settings: dict[str, Any] = field(default_factory=dict)
    tolerance: float | None = None

    @property
    def way(self) -> str:
        """Method and settings in a word."""
        return "/".join(
            [self.method, *(str(value) if key != "shaped" else key for key, value in self.settings.items())]
        )


def job(seed: int) -> Job:
    """The job of that number: the first that can be drawn whose machine has limits that there may be."""
    for attempt in itertools.count():
        try:
            return _job(seed, np.random.default_rng([STREAM, seed, attempt]))
        except ValueError:  # of an axis that is refused
            continue
    raise AssertionError


def _job(seed: int, rng: Rng) -> Job:
    names, weights = list(SOURCES), np.array([*SOURCES.values()], dtype=float)
    source = names[rng.choice(len(names), p=weights / weights.sum())]
    shares = np.array([share for share, _, _ in METHODS])
    _, method, settings = METHODS[rng.choice(len(METHODS), p=shares / shares.sum())]
    found: tuple[str, Machine, Program | None, str] | None = None
    for _ in range(DRAWS):
        found = _drawn(source, rng)
        if found[2] is None or 0 < len(found[2]) <= BLOCKS:
            break
    assert found is not None
    text, machine, program, refusal = found
    if settings.get("shaped"):
        modes = tuple(
            Mode(frequency=float(10 ** rng.uniform(0.7, 2.0)), damping=float(rng.uniform(0, 0.2)))
            for _ in range(rng.integers(1, 3))
        )
        machine = machine.model_copy(update={"modes": modes})
    tolerance = float(10 ** rng.uniform(-3.0, 0.0)) if rng.random() < 0.3 else None
    if program is not None and len(program) > BLOCKS:
        program, refusal = None, f"{len(program)} blocks are too many for this campaign"
    if program is not None:
        program, machine = _short(program, machine)
    return Job(
        seed=seed, source=source, text=text, program=program, refusal=refusal,
        machine=machine, method=method, settings=dict(settings), tolerance=tolerance,
    )  # fmt: skip


def _drawn(source: str, rng: Rng) -> tuple[str, Machine, Program | None, str]:
    """Text, machine, and program or refusal."""
    if source == "lines and arcs":
        program, _ = never_slower.job(int(rng.integers(1 << 30)))
        return "", machine_of(rng, "xyz"), program, ""
    if source == "axes":
        text, other = axes_campaign.job(int(rng.integers(1 << 30)))
        machine = machine_of(rng, "".join(other.axes))
    else:
        machine = machine_of(rng, "xyz" if source in ("mixed", "dense") and rng.random() < 0.8 else "xyzabc")
        text = _text(source, rng, machine)
    try:
        return text, machine, parse_program(text, machine, source=f"{source} job"), ""
    except InputError as fault:
        return text, machine, None, str(fault)


def _text(source: str, rng: Rng, machine: Machine) -> str:
    if source == "mixed":
        return mixed(rng, machine)
    if source == "dense":
        return dense(rng)
    if str(TESTS) not in sys.path:
        sys.path.insert(0, str(TESTS))
    if source == "splines":
        return str(importlib.import_module("random_splines").random_splines(rng))
    if source == "together":
        return str(importlib.import_module("random_together").together(rng))
    return str(importlib.import_module("random_nc").KINDS[source](rng))


# ---- machines ----------------------------------------------------------------------------------------------------------------


def machine_of(rng: Rng, letters: str) -> Machine:
    """A machine with limits over decades, and sometimes filters, vibration modes, a normal acceleration, a largest feed."""
    velocity, acceleration = 10 ** rng.uniform(1.0, 3.0), 10 ** rng.uniform(2.0, 4.5)
    delay = 10 ** rng.uniform(-3.0, -0.7)  # acceleration / jerk [s]
    apart = rng.uniform(0.0, 0.6)  # of the axes, in decades to both sides
    axes = {}
    for letter in letters:
        own = 10 ** rng.uniform(-apart, apart, 3)
        a = acceleration * own[1]
        axes[letter] = Axis(velocity=velocity * own[0], acceleration=a, jerk=a / (delay * own[2]))
    more: dict[str, Any] = {}
    if rng.random() < 0.2:
        more["feed_max"] = 10 ** rng.uniform(0.5, 2.5)
    if rng.random() < 0.2:
        more["normal_acceleration"] = acceleration * 10 ** rng.uniform(-1.0, 0.3)
    if rng.random() < 0.3:
        more["blend_rapids"] = True
    if rng.random() < 0.15:
        more["path_control"] = str(rng.choice(["exact_path", "exact_stop"]))
    if set(letters) & set("abc"):
        more["rotary_radius"] = 10 ** rng.uniform(0.5, 2.5)
    if rng.random() < 0.15:
        lag = {"phase_lag_max": rng.uniform(5.0, 60.0)} if rng.random() < 0.3 else {}
        more["fir"] = Fir(time_constants=tuple(10 ** rng.uniform(-3.0, -1.3, rng.integers(1, 4))), **lag)
    if rng.random() < 0.15:
        more["modes"] = tuple(
            Mode(frequency=10 ** rng.uniform(0.5, 2.2), damping=rng.uniform(0.0, 0.3))
            for _ in range(rng.integers(1, 3))
        )
    if rng.random() < 0.1 and set(letters) == set("xyz"):
        axes["e"] = Axis(velocity=velocity, acceleration=acceleration, jerk=acceleration / delay)
    return Machine(
        name="random", dt=float(rng.choice(PERIODS)), tolerance=float(10 ** rng.uniform(-3.0, 0.0)),
        feed_default=10.0, axes=axes, tools={str(n): {"length": 5.0 * n, "diameter": 1.0 * n} for n in range(1, 5)}, **more,
    )  # fmt: skip


def _short(program: Program, machine: Machine) -> tuple[Program, Machine]:
    """The job with a larger period, faster limits and shorter dwells, if its motion would have more than `SAMPLES` samples."""
    program = dataclasses.replace(program, dwell=np.minimum(program.dwell, DWELL_MAX))
    time = duration(program, machine)
    dt = float(np.clip(time / SAMPLES, machine.dt, PERIOD_MAX))
    machine = machine.model_copy(update={"dt": dt})
    faster = time / (SAMPLES * dt)
    return (program, machine) if faster <= 1.0 else quicker(program, machine, faster)


def quicker(program: Program, machine: Machine, by: float) -> tuple[Program, Machine]:
    """The same motion in a time that is shorter by a factor: feeds, velocities, accelerations and jerks by its powers."""
    axes = {
        letter: Axis(
            velocity=a.velocity * by,
            acceleration=a.acceleration * by**2,
            jerk=a.jerk * by**3,
            wrapped=a.wrapped,
        )
        for letter, a in machine.axes.items()
    }
    update: dict[str, Any] = {"axes": axes}
    if machine.feed_max is not None:
        update["feed_max"] = machine.feed_max * by
    if machine.normal_acceleration is not None:
        update["normal_acceleration"] = machine.normal_acceleration * by**2
    return dataclasses.replace(program, feed=program.feed * by), machine.model_copy(update=update)


def duration(program: Program, machine: Machine) -> float:
    """How long the program takes from stop to stop, about [s]."""
    position = np.vstack([program.start, program.end])
    way = np.abs(np.diff(position, axis=0))
    for k, block in enumerate(program.arc_block):
        radius = np.linalg.norm((position[block] - program.arc_center[k])[:3])
        way[block, :3] = np.maximum(way[block, :3], radius * abs(program.arc_sweep[k]))
    for block, points in zip(program.splines.block, program.splines.points, strict=True):
        way[block] += np.abs(np.diff(points, axis=0)).sum(axis=0)
    rotary = np.array([letter in "abc" for letter in program.axes])
    angular = np.where(rotary, 180.0 / np.pi, 1.0)
    total = float(program.dwell.sum())
    feed = np.where(np.isfinite(program.feed), program.feed, np.inf)
    total += float((np.linalg.norm(way, axis=1) / feed).sum())
    for k, letter in enumerate(program.axes):
        if letter in machine.axes:
            axis, run = machine.axes[letter], way[:, k] * angular[k]
            total += float(
                (
                    run / axis.velocity + 2 * np.sqrt(run / axis.acceleration) + 3 * np.cbrt(run / axis.jerk)
                ).sum()
            )
    if machine.feed_max is not None:
        total += float(np.linalg.norm(way, axis=1).sum()) / machine.feed_max
    return total


# ---- programs ----------------------------------------------------------------------------------------------------------------


def mixed(rng: Rng, machine: Machine) -> str:
    """Lines, arcs, helices, splines, rapids and dwells under changing path control, feeds and tolerances."""
    scale = 10 ** rng.uniform(-1.5, 1.7)  # of the blocks [mm]
    lines = [
        f"G21 G17 G90 G94 M83 F{_feed(rng)}" if "e" in machine.axes else f"G21 G17 G90 G94 F{_feed(rng)}"
    ]
    if rng.random() < 0.5:
        lines.append(_control(rng))
    at, heading = np.zeros(3), rng.uniform(0, 2 * np.pi)
    rotary = [letter for letter in "ABC" if letter.lower() in machine.axes]
    for _ in range(int(rng.integers(2, 30))):
        size = scale * 10 ** rng.uniform(-1.0, 0.5) * (1e-2 if rng.random() < 0.05 else 1.0)
        heading += float(
            rng.choice(
                [0.0, np.pi / 2, np.pi, rng.normal(), 0.01 * rng.normal()], p=[0.2, 0.15, 0.05, 0.4, 0.2]
            )
        )
        new = at + size * np.array([np.cos(heading), np.sin(heading), rng.normal() * (rng.random() < 0.2)])
        new = np.round(new, int(rng.choice([2, 3, 4, 6], p=[0.1, 0.5, 0.3, 0.1])))
        choice, more = rng.random(), ""
        if "e" in machine.axes and rng.random() < 0.5:
            more += f" E{rng.normal() * 0.05 * size:.5f}"
        if rotary and rng.random() < 0.5:
            more += "".join(f" {letter}{rng.normal() * 20:.3f}" for letter in rotary if rng.random() < 0.6)
        if rng.random() < 0.15:
            more += f" F{_feed(rng)}"
        place = f"X{new[0]:.6f} Y{new[1]:.6f} Z{new[2]:.6f}"
        if choice < 0.5:
            lines.append(f"G1 {place}{more}")
        elif choice < 0.72:
            radius = float(np.hypot(*(new - at)[:2])) * rng.uniform(0.51, 4.0)
            if radius < 1e-3:
                continue
            lines.append(
                f"G{rng.integers(2, 4)} {place} R{'-' if rng.random() < 0.15 else ''}{radius:.6f}{more}"
            )
        elif choice < 0.78:
            i, j, p, q = size * rng.normal(size=4) * 0.5
            new[2] = at[2]
            lines.append(f"G5 X{new[0]:.6f} Y{new[1]:.6f} I{i:.6f} J{j:.6f} P{p:.6f} Q{q:.6f}")
        elif choice < 0.83:
            turn = "".join(f"{'IJ'[k]}{size * rng.normal():.5f} " for k in range(2))
            new = at + np.array([0.0, 0.0, size * rng.normal() * (rng.random() < 0.5)])
            lines.append(
                f"G{rng.integers(2, 4)} X{new[0]:.6f} Y{new[1]:.6f} Z{new[2]:.6f} {turn}P{rng.integers(1, 3)}"
            )
        elif choice < 0.9:
            lines.append(f"G0 {place}")
        elif choice < 0.94:
            lines.append(f"G4 P{10 ** rng.uniform(-4, -1):.5f}")
            continue
        else:
            lines.append(_control(rng))
            continue
        at = new
    return "\n".join([*lines, "M2"]) + "\n"


def dense(rng: Rng) -> str:
    """Points on a wave, as CAM writes curves, with noise and rounding of the coordinates."""
    count, size = int(rng.integers(4, BLOCKS - 1)), 10 ** rng.uniform(-1.0, 1.7)
    u = np.linspace(0.0, rng.uniform(1.0, 7.0), count + 1)
    bent, phase = rng.uniform(0.2, 1.0), rng.uniform(0, 6.28)
    points = size * np.stack([np.cos(u + phase), np.sin((1 + bent) * u), 0.2 * bent * np.sin(3 * u)], axis=1)
    points = points - points[0] + rng.normal(size=points.shape) * size * 10 ** rng.uniform(-7, -2.5)
    digits = int(rng.choice([2, 3, 4, 6]))
    lines = [f"G21 G17 G90 G94 F{_feed(rng)}"] + ([_control(rng)] if rng.random() < 0.3 else [])
    lines += [f"G1 X{x:.{digits}f} Y{y:.{digits}f} Z{z:.{digits}f}" for x, y, z in points[1:]]
    return "\n".join([*lines, "M2"]) + "\n"


def _feed(rng: Rng) -> str:
    return f"{60 * 10 ** rng.uniform(0.0, 2.7):.1f}"


def _control(rng: Rng) -> str:
    return str(rng.choice(["G61", "G61.1", "G64", f"G64 P{10 ** rng.uniform(-3, 0):.4f}"]))
