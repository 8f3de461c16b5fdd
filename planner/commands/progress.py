"""Progress of a long job on standard error: a bar of the stage that runs on a terminal, a line now and then elsewhere.
Share and time left are those of the stage."""

from __future__ import annotations

import sys
import time
from typing import Any

from planner.base import kernel_files
from planner.commands.terminal import printable, say

PROGRESS_AFTER = 1.0  # [s]: a shorter job needs no bar
# Between lines of progress where there is no terminal: so long at least [s], and so much of the time since
# the start [-], so that an hour has about 30 of them and not 360.
LINE_EVERY, LINE_SHARE = 10.0, 0.15
COMPILING = "compiling, once"
KEPT = "kept for the next run"


def duration_text(seconds: float) -> str:
    """A time as people say it: "45 s", "12 min", "3.5 h"."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"


class ProgressBar(kernel_files.Compilation):
    """The bar: clock, share of the stage, time left of it, stage. Elsewhere clock and stage as text.

    quiet : print nothing
    """

    def __init__(self, *, quiet: bool = False) -> None:
        self._quiet = quiet
        self._compiled = 0
        self._bar: Any = None
        self._task: Any = None
        self._stage = ""
        self._times: dict[str, int] = {}
        self._compiling_said = False

    def __enter__(self) -> ProgressBar:
        self._start = time.monotonic()
        self._next_line = self._start + LINE_EVERY
        kernel_files.at_compilation(self)
        return self

    def __exit__(self, *_: object) -> None:
        kernel_files.at_compilation(None)
        if self._bar is not None:
            self._bar.stop()
            self._bar = None

    def __call__(self, stage: str, fraction: float) -> None:
        """Show that `stage` is done to `fraction` (0 to 1); 0 begins it, perhaps once more."""
        if fraction == 0.0:
            self._times[stage] = self._times.get(stage, 0) + 1
        times = self._times.get(stage, 1)
        self._show(f"{stage}, pass {times}" if times > 1 else stage, fraction)

    def count(self, there: int, of: int) -> None:
        """Show that so many of some plans are there."""
        self._show(f"{there:,} of {of:,} plans", there / of, stage="plans")

    def begins(self, is_kept: bool) -> None:
        """Say that a kernel is compiled."""
        self._compiled += 1
        self._show(f"{COMPILING}: kernel {self._compiled}{f', {KEPT}' if is_kept else ''}", 0.0)

    def ends(self) -> None:
        """A kernel is compiled; the next stage shows itself."""

    def _show(self, text: str, fraction: float, stage: str = "") -> None:
        now = time.monotonic()
        if self._quiet or now - self._start < PROGRESS_AFTER:
            return
        if sys.stderr.isatty():
            self._draw(printable(text), fraction, stage or text)
        elif now >= self._next_line or (text.startswith(COMPILING) and not self._compiling_said):
            self._compiling_said |= text.startswith(COMPILING)
            self._next_line = now + max(LINE_EVERY, LINE_SHARE * (now - self._start))
            part = f", {fraction:.0%}" if 0.0 < fraction < 1.0 and not stage else ""
            say(f"{duration_text(now - self._start)}: {text}{part}", err=True)

    def _draw(self, text: str, fraction: float, stage: str) -> None:
        if self._bar is None:
            self._open()
        if stage != self._stage:  # another task, so that rich's estimate begins anew
            self._bar.remove_task(self._task)
            self._task, self._stage = self._bar.add_task(text, total=None), stage
        # without a total rich's bar runs to and fro, and tells no time left
        self._bar.update(
            self._task, description=text, completed=fraction, total=1.0 if fraction > 0.0 else None
        )

    def _open(self) -> None:
        from rich import progress
        from rich.console import Console
        from rich.text import Text

        start = self._start

        class Clock(progress.ProgressColumn):
            """The time since the job began; rich's own is that of the stage."""

            def render(self, task: progress.Task) -> Text:
                return Text(duration_text(time.monotonic() - start))

        self._bar = progress.Progress(
            Clock(),
            progress.BarColumn(),
            progress.TimeRemainingColumn(compact=True),
            progress.TextColumn("{task.description}", markup=False),
            console=Console(stderr=True),
            transient=True,
        )
        self._task = self._bar.add_task("", total=None)
        self._bar.start()
