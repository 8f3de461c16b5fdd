"""Progress of a long job on standard error: one bar over the whole job on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from planner.base import kernels
from planner.commands.terminal import printable, say

if TYPE_CHECKING:
    from planner.commands.time_left import TimeLeft
    from planner.job.trace import Step

PROGRESS_AFTER = 1.0  # [s]: a shorter job needs no bar
# Between lines of progress where there is no terminal: so long at least [s], and so much of the time since the start [-], so that an
# hour has about 30 of them and not 360.
LINE_EVERY, LINE_SHARE = 10.0, 0.15
COMPILING = "compiling, once"
KEPT = "kept for the next run"
WIDTH = 30  # of the bar [columns]


def duration_text(seconds: float) -> str:
    """A time as people say it: "45 s", "12 min", "3.5 h"."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"


class ProgressBar(kernels.Compilation):
    """The bar: clock, share of the time, time left, stage. Elsewhere the same as text.

    quiet           : print nothing
    at_first_kernel : called once when the first kernel is about to be compiled that can be kept
    left            : how much time is left; None where nobody knows, and the bar only shows that work goes on

    Time that compiling takes is no time of the job: the bar's clock runs on, and what is left is told without it.
    """

    def __init__(
        self,
        *,
        quiet: bool = False,
        at_first_kernel: Callable[[], None] | None = None,
        left: TimeLeft | None = None,
    ) -> None:
        self._quiet = quiet
        self._at_first_kernel = at_first_kernel
        self._left = left
        self._compiled = 0
        self._compiling: float | None = None  # since when
        self._compile_time = 0.0
        self._shown = 0.0  # share of the job
        self._bar: Any = None
        self._task: Any = None
        self._times: dict[str, int] = {}
        self._compiling_said = False

    def __enter__(self) -> ProgressBar:
        self._start = time.monotonic()
        self._next_line = self._start + LINE_EVERY
        kernels.at_compilation(self)
        return self

    def __exit__(self, *_: object) -> None:
        kernels.at_compilation(None)
        if self._bar is not None:
            self._bar.stop()
            self._bar = None

    def __call__(self, stage: str, fraction: float) -> None:
        """Show that `stage` is done to `fraction` (0 to 1); 0 begins it, perhaps once more."""
        if fraction == 0.0:
            self._times[stage] = self._times.get(stage, 0) + 1
        if self._left is not None:
            self._left.stage(self._clock(), stage, fraction)
        self._show(self._text(stage, fraction))

    def log(self, step: Step) -> None:
        """Take a step of the planning into account."""
        if self._left is not None:
            self._left.step(self._clock(), step)

    def count(self, there: int, of: int, before: int) -> None:
        """Show that so many of some plans are there, some of them from before, and how much time the others need."""
        left = ""
        if there > before:
            each = (time.monotonic() - self._start) / (there - before)
            left = f", about {duration_text(each * (of - there))} left"
        self._shown = there / of
        self._show(f"{there:,} of {of:,} plans{left}")

    def _clock(self) -> float:
        """Time since the start without compiling [s]."""
        now = self._compiling if self._compiling is not None else time.monotonic()
        return now - self._start - self._compile_time

    def begins(self, is_kept: bool) -> None:
        """Say that a kernel is compiled."""
        self._compiled += 1
        self._compiling = time.monotonic()
        if is_kept and self._at_first_kernel is not None:
            self._at_first_kernel()
            self._at_first_kernel = None
        self._show(f"{COMPILING}: kernel {self._compiled}{f', {KEPT}' if is_kept else ''}")

    def ends(self) -> None:
        """Go on."""
        if self._compiling is not None:
            self._compile_time += time.monotonic() - self._compiling
            self._compiling = None

    def _text(self, stage: str, fraction: float) -> str:
        times = self._times.get(stage, 1)
        part = f", {fraction:.0%}" if 0.0 < fraction < 1.0 else ""
        return f"{stage}, pass {times}{part}" if times > 1 else stage + part

    def seconds_left(self) -> float | None:
        """How much time is left [s]; None where nobody knows, and while kernels are compiled."""
        if self._left is None or self._compiling is not None:
            return None
        now = self._clock()
        left = self._left.left(now)
        if left is not None and now + left > 0.0:
            self._shown = max(self._shown, now / (now + left))
        return left

    def _show(self, text: str) -> None:
        now = time.monotonic()
        if self._quiet or now - self._start < PROGRESS_AFTER:
            return
        if sys.stderr.isatty():
            if self._bar is None:
                self._open()
            self._bar.update(self._task, description=printable(text))
        elif now >= self._next_line or (text.startswith(COMPILING) and not self._compiling_said):
            self._compiling_said |= text.startswith(COMPILING)
            self._next_line = now + max(LINE_EVERY, LINE_SHARE * (now - self._start))
            left = self.seconds_left()
            more = "" if left is None else f", about {duration_text(left)} left"
            say(f"{duration_text(now - self._start)}: {text}{more}", err=True)

    def _open(self) -> None:
        from rich import progress, progress_bar
        from rich.console import Console
        from rich.text import Text

        shown = self

        class Share(progress.ProgressColumn):
            """The bar; it runs to and fro as long as nothing is known."""

            def render(self, task: progress.Task) -> progress_bar.ProgressBar:
                shown.seconds_left()
                return progress_bar.ProgressBar(
                    total=1.0,
                    completed=shown._shown,
                    width=WIDTH,
                    pulse=shown._shown == 0.0,
                    animation_time=task.get_time(),
                )

        class Left(progress.ProgressColumn):
            """The time left, at this moment."""

            def render(self, task: progress.Task) -> Text:
                left = shown.seconds_left()
                return Text("" if left is None else f"about {duration_text(left)} left")

        self._bar = progress.Progress(
            progress.TimeElapsedColumn(),
            Share(),
            Left(),
            progress.TextColumn("{task.description}", markup=False),
            console=Console(stderr=True),
            transient=True,
        )
        self._task = self._bar.add_task("", total=None)  # a task with a total would stop its clock at it
        self._bar.start()
