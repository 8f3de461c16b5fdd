"""The first run on a machine: a second process compiles what the first one will need later.

Compiling is nearly all of a first run, and numba compiles one kernel at a time. So as soon as `planner plan` finds a kernel that is
not compiled yet, it starts another Python, which plans three lines that need not be read, on corners that need no splines: so it comes
to geometry, path, feedrate, samples and verdict while the command itself compiles the reading and the splines.
Both keep their kernels in the same place, on disk, and each loads what it finds there. Neither waits for the other, so that nothing is
lost where the second process fails or is not started: with one core, or where kernels cannot be kept.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from contextlib import suppress
from typing import TYPE_CHECKING

from planner.base.names import OPTIMAL, SECOND_ORDER, SINGLE_CORNERS
from planner.base.threads import cores

if TYPE_CHECKING:
    from planner.job.plan import Plan
    from planner.nc.program import Program

POINTS = ((1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (2.0, 1.0, 0.0))  # [mm]
FEED = 10.0  # [mm/s]
# Plans (method, geometry) that another process makes beside a plan of a method, the first ones first.
BESIDE: dict[str, tuple[tuple[str, str | None], ...]] = {
    method: ((method, SINGLE_CORNERS),) for method in (OPTIMAL, SECOND_ORDER)
}
OTHERS: tuple[tuple[str, str | None], ...] = (("stop", None),)


class Helper:
    """The second process beside a plan; as a context, which ends it."""

    def __init__(self, machine: str, method: str):
        self._asked = [machine, method]
        self._process: subprocess.Popen[bytes] | None = None
        self.started = False

    def start(self) -> None:
        """Start it, once, if there is a core for it."""
        if self.started or cores() < 2 or not sys.executable:
            return
        self.started = True
        path = os.pathsep.join(os.path.abspath(place) for place in sys.path)
        quiet = subprocess.DEVNULL
        with suppress(OSError):
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", "planner.commands.first_run", *self._asked],
                env={**os.environ, "PYTHONPATH": path},
                stdin=subprocess.PIPE,  # its end tells the second process that this one has gone
                stdout=quiet,
                stderr=quiet,
            )

    def __enter__(self) -> Helper:
        return self

    def __exit__(self, *_: object) -> None:
        if self._process is not None:
            self._process.terminate()
            self._process.communicate()


def compile_beside(machine: str, method: str) -> list[Plan]:
    """Make the plans of `BESIDE`."""
    from planner.machine import load_machine
    from planner.methods.registry import plan

    limits, program = load_machine(machine), three_lines()
    return [
        plan(program, limits, method=name, geometry=geometry) for name, geometry in BESIDE.get(method, OTHERS)
    ]


def three_lines() -> Program:
    """G1 moves through `POINTS`, from the origin."""
    import numpy as np

    from planner.nc.program import Kind, PathControl, Program

    count = len(POINTS)
    return Program(
        source="three lines",
        axes=("x", "y", "z"),
        start=np.zeros(3),
        kind=np.full(count, Kind.LINE),
        end=np.array(POINTS),
        feed=np.full(count, FEED),
        dwell=np.zeros(count),
        line=np.arange(1, count + 1),
        path_control=np.full(count, PathControl.BLEND),
        tolerance=np.full(count, np.nan),
        arc_block=np.zeros(0),
        arc_center=np.zeros((0, 3)),
        arc_normal=np.zeros(0),
        arc_sweep=np.zeros(0),
    )


def _end_with_the_first() -> None:
    """End this process when the one that has started it ends, however that happens."""
    os.read(0, 1)
    os._exit(1)


if __name__ == "__main__":
    threading.Thread(target=_end_with_the_first, daemon=True).start()
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C reaches both processes
    compile_beside(*sys.argv[1:])
