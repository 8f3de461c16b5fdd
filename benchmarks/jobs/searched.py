"""The jobs on which the joint search is measured: generated ones, and programs of ../shared or windows of them where
these are there."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

import planner
from benchmarks.jobs import problems
from planner.machine import Machine
from planner.nc.program import Program

SHARED = Path(__file__).resolve().parents[3] / "shared" / "nc"
# File, first motion block, blocks, feed [mm/s].
WINDOWS = {
    "stellabee1, 121 blocks": ("LinuxCNC__linuxcnc__stellabee1.ngc", 18158, 121),
    "trochoidal, 300 blocks": ("LinuxCNC__linuxcnc__trochoidal.ngc", 200, 300),
    "vcarve, 300 blocks": ("CauldronDevelopmentLLC__CAMotics__vcarve.ngc", 1000, 300),
}
TIGHT = SHARED / "LinuxCNC__linuxcnc__tight-corner-tolerance.ngc"
BRACKET = Path(planner.__file__).parent / "examples" / "bracket.ngc"
COARSE_DT = 0.002  # of the window that is planned at two periods [s]


def window(name: str, machine: Machine) -> Program:
    """Consecutive blocks of a program as a job of its own, as straight lines from its first point at rest."""
    file, first, count = WINDOWS[name]
    program = planner.read_program(SHARED / file, machine)
    points = np.asarray(program.end)[first - 1 : first + count, :3]
    feed = float(program.feed[first])
    return problems.polyline(
        points - points[0], feed=feed if np.isfinite(feed) else problems.FEED, source=name
    )


def relief(blocks: int) -> Program:
    """A generated relief of steps of 0.3 mm, 400 a row, one run without stops."""
    rng = np.random.default_rng(3)
    amplitude, wave, phase = rng.normal(size=12), rng.uniform(0.05, 0.6, (12, 2)), rng.uniform(0, 6.28, 12)
    n = np.arange(blocks + 1)
    row, column = n // 400, n % 400
    x, y = 0.3 * np.where(row % 2, 399 - column, column), 0.4 * row
    z = 0.4 * (amplitude * np.sin(wave[:, 0] * x[:, None] + wave[:, 1] * y[:, None] + phase)).sum(axis=1)
    z = np.where(z > 0.8, 0.8 + 0.3 * (z - 0.8), z)
    points = np.round(np.stack([x, y, z], axis=1), 3)
    return problems.polyline(points - points[0], source=f"relief of {blocks}")


def jobs() -> dict[str, tuple[Callable[[], Program], Machine]]:
    """The named jobs and their machines."""
    mill, peers = planner.load_machine("mill"), problems.machine()
    made: dict[str, tuple[Callable[[], Program], Machine]] = {
        "pentagon, mill": (problems.pentagon, mill),
        "zig-zag, mill": (problems.zigzag, mill),
        "bracket, mill": (lambda: planner.read_program(BRACKET, mill), mill),
        "relief of 1,000, mill": (lambda: relief(1000), mill),
        "pentagon, peers": (problems.pentagon, peers),
        "zig-zag, peers": (problems.zigzag, peers),
        "circle, peers": (problems.chord_circle, peers),
        "spiral of 1,000, peers": (problems.star_spiral, peers),
        "relief of 1,000, peers": (lambda: relief(1000), peers),
    }
    if SHARED.exists():
        for name in WINDOWS:
            made[f"{name}, mill"] = (lambda name=name: window(name, mill), mill)  # type: ignore[misc]
        coarse, name = mill.model_copy(update={"dt": COARSE_DT}), next(iter(WINDOWS))
        made[f"{name}, mill, {1e3 * COARSE_DT:g} ms"] = (lambda: window(name, coarse), coarse)
        made["tight-corner-tolerance, mill"] = (lambda: planner.read_program(TIGHT, mill), mill)
    return made
