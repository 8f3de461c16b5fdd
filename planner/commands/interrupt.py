"""Ctrl-C ends the command at once, with exit code 130 and without half-written files.

The handler raises no KeyboardInterrupt, which numba's dispatcher, callbacks of C libraries and destructors swallow or
change. To leave at once is safe: a file takes its place only when it is whole (report/replace.py), and temporaries
are removed first. A running kernel is waited for.
"""

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType

from planner.commands.terminal import INTERRUPTED

CLEAR_LINE_AND_SHOW_CURSOR = b"\r\x1b[2K\x1b[?25h"  # of a terminal, where a progress bar may be drawn


def end_at_interrupts() -> None:
    """Let Ctrl-C end the process, unless interrupts are ignored (jobs in a shell's background) or taken care
    of already."""
    if (
        threading.current_thread() is threading.main_thread()
        and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    ):
        signal.signal(signal.SIGINT, _end)


@contextmanager
def interrupts_raise() -> Iterator[None]:
    """Within, Ctrl-C raises KeyboardInterrupt: for a process that only waits for others, and runs no
    kernel."""
    if (
        threading.current_thread() is not threading.main_thread()
        or signal.getsignal(signal.SIGINT) is not _end
    ):
        yield
        return
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, _end)


def no_more_interrupts() -> None:
    """Let the command, whose work is done, end with its own exit code: Python takes handlers away before it
    leaves."""
    if signal.getsignal(signal.SIGINT) is _end:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _end(_: int, __: FrameType | None) -> None:
    try:
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # a second Ctrl-C does not wait
        replace = sys.modules.get("planner.report.replace")
        if replace is not None:
            replace.remove_temporaries()
        with suppress(OSError):
            if os.isatty(2):
                os.write(2, CLEAR_LINE_AND_SHOW_CURSOR)
            os.write(2, b"interrupted\n")
    finally:
        os._exit(INTERRUPTED)
