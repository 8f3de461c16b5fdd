"""The jobs of the campaign: from a number a random program, machine, tolerance, interpolation period and method.

Programs of eleven sources: of lines and arcs in three axes (jobs/random_lines.py), of up to nine axes (axes.py), of everything that
moves in one program and of points on a curve (programs.py), and those that are compared with LinuxCNC's interpreter: cycles,
offsets, feed modes, lathe, cutter compensation, splines, and all of these in subprograms, loops and branches (tests/nc/random_nc.py,
random_splines.py, random_together.py).

From seed 200,000 on programs are as other people's are (others.py).

Most jobs are small, so that many can be made: a few blocks and some hundred samples; one in `LARGE` has up to `BLOCKS` and `SAMPLES`. A
job whose motion would have more samples than it may gets a larger period, and then faster limits and feeds, which make the same motion
in less time; dwells are cut (shortened.py).
"""

from __future__ import annotations

import functools
import hashlib
import importlib
import itertools
import re
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.campaign import axes as axes_campaign
from benchmarks.campaign import others
from benchmarks.campaign.programs import BLOCKS, dense, mixed
from benchmarks.campaign.shortened import shortened
from benchmarks.jobs import random_lines
from planner.base.errors import InputError
from planner.machine import ROTARY_AXES, Axis, Fir, Machine, Mode
from planner.nc.program import Program
from planner.nc.reader import parse_program

TESTS = Path(__file__).resolve().parents[2] / "tests" / "nc"
SAMPLES = 2000  # of a motion from stop to stop, about
SMALL_SAMPLES, SMALL_BLOCKS, LARGE = (
    (30, 400),
    4.0,
    30,
)  # of a usual job, the blocks on the mean above 2, and one in so many is larger
# Of jobs with more axes or blocks than these only a share is planned in the ways that take tens of seconds for them.
AXES_OF_SLOW, BLOCKS_OF_SLOW, SHARE_OF_SLOW = 4, 8, 0.1
SHARE_OF_NARROW = 0.8  # of the programs that move no rotary axis, on machines that have none [-]
PERIOD_MAX = 0.008  # to which a period may be lengthened [s]
DRAWS = 60  # of a program until one has few blocks and moves; the least one counts where none has
STREAM = 41  # of random numbers
FIRST_SEEDS = 20  # by whose jobs the draws are known again
DIGITS = 6  # of their numbers
PERIODS = (0.00025, 0.0005, 0.001, 0.001, 0.002, 0.004, 0.008)  # [s]
QUICK: dict[str, Any] = {"effort": "quick"}
# Methods with their settings, and how often each is drawn.
METHODS: tuple[tuple[float, str, dict[str, Any]], ...] = (
    (36, "optimal", QUICK),
    (4, "optimal", {}),
    (3, "optimal", {"corner": "bezier"}),
    (3, "optimal", {"corner": "fir"}),
    (3, "optimal", {"corner": "kinematic"}),
    (3, "optimal", {"geometry": "spline"} | QUICK),
    (3, "optimal", QUICK | {"shaped": True}),
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
DEFAULT: dict[str, Any] = {}
# From this seed on two jobs of four are planned as `planner plan` does without options, however long that takes; the draws of the
# seeds before stay as they were, because tests name jobs by them.
HALF_DEFAULT_FROM = 100_000
OTHERS_FROM = 200_000
SLOW = (("optimal", {}), ("optimal", QUICK | {"shaped": True}), ("tube", {}))
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
    "together": 2,
}
Rng = np.random.Generator


@dataclass(frozen=True, eq=False, kw_only=True)
class Job:
    """What is planned: a program, or the message with which it was refused, on a machine.

    machine   : it is planned on; `drawn`, the one from which it was made quicker for some `samples` (`_short`)
    tolerance : that is given beside program and machine [mm], or None
    """

    seed: int
    source: str
    text: str
    program: Program | None
    refusal: str
    machine: Machine
    drawn: Machine
    samples: int
    method: str
    settings: dict[str, Any] = field(default_factory=dict)
    tolerance: float | None = None

    @property
    def way(self) -> str:
        """Method and settings in a word."""
        return "/".join(
            [self.method, *(str(value) if key != "shaped" else key for key, value in self.settings.items())]
        )

    def data(self) -> dict[str, Any]:
        """As JSON has it, for tests that are to stay when seeds draw other jobs. Programs that have no text are not in it."""
        keys = ("seed", "source", "method", "settings", "tolerance", "samples")
        machine = self.drawn.model_dump(mode="json", exclude_defaults=True)
        return {key: getattr(self, key) for key in keys} | {
            "machine": machine,
            "text": self.text.splitlines(),
        }


@functools.cache
def fingerprint() -> str:
    """A word for what seeds draw: another one where the first of them draw other jobs.

    Numbers count with `DIGITS` digits: powers and sines differ in their last bit between processors. Keys of a machine that are not
    set do not count, or a new one would be another draw.
    """
    drawn = [
        (made.text, made.machine.model_dump(exclude_defaults=True), made.way, made.tolerance)
        for made in map(job, range(FIRST_SEEDS))
    ]
    rounded = re.sub(r"\d+\.\d+(e[-+]?\d+)?", lambda number: f"{float(number[0]):.{DIGITS}g}", repr(drawn))
    return hashlib.sha256(rounded.encode()).hexdigest()[:12]


def job_from(data: dict[str, Any]) -> Job:
    """The job of `Job.data`."""
    drawn, text = Machine.model_validate(data["machine"]), "\n".join(data["text"])
    program, machine = _short(
        parse_program(text, drawn, source=f"{data['source']} job"), drawn, data["samples"], data["seed"]
    )
    return Job(**data | {"text": text, "program": program, "refusal": "", "machine": machine, "drawn": drawn})


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
    source = names[rng.choice(len(names), p=weights / weights.sum())] if seed < OTHERS_FROM else ""
    shares = np.array([share for share, _, _ in METHODS])
    _, method, settings = METHODS[rng.choice(len(METHODS), p=shares / shares.sum())]
    large = bool(rng.random() < 1.0 / LARGE)
    most = int(min(2 + rng.exponential(BLOCKS / 3 if large else SMALL_BLOCKS), BLOCKS))  # of most draws
    samples = SAMPLES if large or seed >= OTHERS_FROM else int(rng.integers(*SMALL_SAMPLES))
    if seed < OTHERS_FROM:
        text, machine, program, refusal = _drawn(source, rng)
    else:
        source, text, machine = others.drawn(rng)
        program, refusal = _read(source, text, machine)
    for _ in range(DRAWS - 1 if seed < OTHERS_FROM else 0):
        if program is None or 0 < len(program) <= most:
            break
        other = _drawn(source, rng)
        if other[2] is None or len(program) == 0 or 0 < len(other[2]) < len(program):
            text, machine, program, refusal = other
    by_default = seed >= HALF_DEFAULT_FROM and seed % 4 < 2
    if by_default:
        method, settings = "optimal", DEFAULT
    wide = program is not None and (len(machine.axes) > AXES_OF_SLOW or len(program) > BLOCKS_OF_SLOW)
    if (method, settings) in SLOW and wide and not by_default and rng.random() > SHARE_OF_SLOW:
        method, settings = "optimal", QUICK
    if settings.get("shaped"):
        modes = tuple(
            Mode(frequency=float(10 ** rng.uniform(0.7, 2.0)), damping=float(rng.uniform(0, 0.2)))
            for _ in range(rng.integers(1, 3))
        )
        machine = machine.model_copy(update={"modes": modes})
    tolerance = float(10 ** rng.uniform(-3.0, 0.0)) if rng.random() < 0.3 else None
    if program is not None and len(program) > BLOCKS:
        program, refusal = None, f"{len(program)} blocks are too many for this campaign"
    drawn = machine
    if program is not None:
        program, machine = _short(program, machine, samples, seed)
    return Job(
        seed=seed, source=source, text=text, program=program, refusal=refusal, machine=machine, drawn=drawn,
        samples=samples, method=method, settings=dict(settings), tolerance=tolerance,
    )  # fmt: skip


def _drawn(source: str, rng: Rng) -> tuple[str, Machine, Program | None, str]:
    """Text, machine, and program or refusal."""
    if source == "lines and arcs":
        program, _ = random_lines.job(int(rng.integers(1 << 30)))
        return "", machine_of(rng, "xyz"), program, ""
    if source == "axes":
        text, other = axes_campaign.job(int(rng.integers(1 << 30)))
        machine = machine_of(rng, "".join(other.axes))
    else:
        machine = machine_of(rng, "xyz" if source in ("mixed", "dense") and rng.random() < 0.8 else "xyzabc")
        text = _text(source, rng, machine)
        if rng.random() < SHARE_OF_NARROW:
            linear = _linear(machine)
            try:
                return text, linear, parse_program(text, linear, source=f"{source} job"), ""
            except InputError:  # it may be that the program moves a rotary axis
                pass
    return text, machine, *_read(source, text, machine)


def _read(source: str, text: str, machine: Machine) -> tuple[Program | None, str]:
    """Program, or refusal."""
    try:
        return parse_program(text, machine, source=f"{source} job"), ""
    except InputError as fault:
        return None, str(fault)


def _linear(machine: Machine) -> Machine:
    """The machine without its rotary axes."""
    axes = {letter: axis for letter, axis in machine.axes.items() if letter not in ROTARY_AXES}
    return machine.model_copy(update={"axes": axes})


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


def _short(program: Program, machine: Machine, samples: int, seed: int) -> tuple[Program, Machine]:
    """The job within so many samples; other people's machines keep their period."""
    return shortened(program, machine, samples, machine.dt if seed >= OTHERS_FROM else PERIOD_MAX)
