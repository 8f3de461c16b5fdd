"""How a command reports: exit codes, messages, tables on standard output, progress on standard error."""

from __future__ import annotations

import codecs
import functools
import io
import os
import sys
import time
import unicodedata
import warnings
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import typer

from planner.base import kernels
from planner.base.errors import InputError, NotSolvedError
from planner.commands.interrupt import INTERRUPTED

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

# Exit codes. The last two are those of sysexits.h (EX_SOFTWARE) and of a shell (128 + SIGPIPE).
FAILED, BAD_INPUT, NOT_SOLVED, BUG, BROKEN_PIPE = 1, 2, 3, 70, 141
PROGRESS_AFTER = 1.0  # [s]: a shorter job needs no bar
LINE_EVERY = 10.0  # [s] between lines of progress where there is no terminal
# Columns where the output is no terminal: rows are for other programs there, and are not cut or folded.
PIPE_WIDTH = 1000
COMPILING = "compiling"
KEPT = "once: they are kept for the next run"
PLAIN = {"µ": "u", "²": "2", "³": "3", "°": "deg", "…": "..."}  # for encodings that lack them


def prepare_streams() -> None:
    """Let the output take any text, whatever its encoding, and print warnings on one line."""
    codecs.register_error("planner", _plain_text)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="planner")
    warnings.showwarning = _show_warning


def _plain_text(fault: UnicodeError) -> tuple[str, int]:
    """What an encoding lacks: plain letters for units, escapes for the rest, file names that are no UTF-8 among them."""
    if not isinstance(fault, UnicodeEncodeError):
        raise fault
    lacking = fault.object[fault.start : fault.end]
    return "".join(PLAIN.get(c) or c.encode("ascii", "backslashreplace").decode() for c in lacking), fault.end


def _show_warning(message: Warning | str, *_: object, **__: object) -> None:
    say(f"warning: {message}", err=True)


def guarded(command: Callable[..., None]) -> Callable[..., None]:
    """Turn the exceptions of a command into a message and an exit code."""

    @functools.wraps(command)
    def run(*args: Any, **kwargs: Any) -> None:
        try:
            command(*args, **kwargs)
        except InputError as fault:
            say(str(fault), err=True)
            raise typer.Exit(BAD_INPUT) from None
        except NotSolvedError as fault:
            say(f"not solved: {fault}", err=True)
            raise typer.Exit(NOT_SOLVED) from None
        except MemoryError as fault:
            say(f"not solved: {memory_used_up(fault)}", err=True)
            raise typer.Exit(NOT_SOLVED) from None
        except KeyboardInterrupt:
            say("interrupted", err=True)
            raise typer.Exit(INTERRUPTED) from None
        except BrokenPipeError:
            _drop_output()
            raise typer.Exit(BROKEN_PIPE) from None
        except typer.Exit:
            raise
        except Exception:
            import traceback

            say(traceback.format_exc(), err=True)
            say(
                "This is a bug in planner, not in your program. Please report it with the lines above, "
                "the NC program and the machine file.",
                err=True,
            )
            raise typer.Exit(BUG) from None

    return run


def memory_used_up(fault: MemoryError) -> str:
    """The message for a job that needs more memory than there is, and what to do about it."""
    said = f"the memory is used up ({fault})" if str(fault) else "the memory is used up"
    return f"{said}; split the program, or use --geometry spline or a faster --method (kinematic, stop)"


def say(text: str, *, err: bool = False) -> None:
    """Print one or more lines. Control characters, which a terminal might obey, are printed as escapes.

    Raises InputError if the output cannot be written, BrokenPipeError if its reader has gone.
    """
    _write(printable(text), err=err)


def _write(text: str, *, err: bool = False) -> None:
    stream = sys.stderr if err else sys.stdout
    if stream is None:  # closed by the caller: >&-
        return
    try:
        stream.write(text + "\n")
        stream.flush()
    except BrokenPipeError:
        raise
    except OSError as fault:
        _drop_output()
        raise InputError(f"the output cannot be written: {fault.strerror}") from fault


def _drop_output() -> None:
    """Without this the flush at exit would fail once more."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def printable(text: str) -> str:
    """The text with control characters other than line ends and tabs written as \\x1b and the like."""
    if text.isprintable():
        return text
    return "".join(c if c in "\n\t" or unicodedata.category(c) != "Cc" else f"\\x{ord(c):02x}" for c in text)


def show(*tables: RenderableType) -> None:
    """Print tables, folded to the width of a terminal; elsewhere a row is one line."""
    from rich.console import Console
    from rich.segment import Segment, Segments

    terminal = sys.stdout is not None and sys.stdout.isatty()
    # Into a string, since rich's own writing ends the process on a broken pipe, with exit code 1.
    console: Console = Console(
        file=io.StringIO(), force_terminal=terminal, width=None if terminal else PIPE_WIDTH
    )
    for table in tables:
        rendered = [
            Segment(printable(text), style, control) for text, style, control in console.render(table)
        ]
        console.print(Segments(rendered), end="")
    assert isinstance(console.file, io.StringIO)
    lines = console.file.getvalue().removesuffix("\n").split("\n")
    _write("\n".join(lines if terminal else [line.rstrip() for line in lines]))


class ProgressBar:
    """Progress of a long job on standard error: a bar with a clock on a terminal, a line now and then elsewhere.

    quiet           : print nothing
    at_first_kernel : called once when the first kernel is about to be compiled that can be kept

    The number of rounds is not known beforehand, so the bar only shows that work goes on. The text beside it names the stage, the pass,
    and how much of the pass is done.
    """

    def __init__(self, *, quiet: bool = False, at_first_kernel: Callable[[], None] | None = None) -> None:
        self._quiet = quiet
        self._at_first_kernel = at_first_kernel
        self._compiled = 0
        self._bar: Any = None
        self._task: Any = None
        self._times: dict[str, int] = {}
        self._compiling_said = False

    def __enter__(self) -> ProgressBar:
        self._start = time.monotonic()
        self._next_line = self._start + LINE_EVERY
        kernels.at_compilation(self._compile)
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
        self._show(self._text(stage, fraction))

    def _compile(self, kept: bool) -> None:
        """Called before a kernel is compiled."""
        self._compiled += 1
        if kept and self._at_first_kernel is not None:
            self._at_first_kernel()
            self._at_first_kernel = None
        self._show(f"{COMPILING} kernel {self._compiled}{f', {KEPT}' if kept else ''}")

    def _text(self, stage: str, fraction: float) -> str:
        times = self._times.get(stage, 1)
        part = f", {fraction:.0%}" if 0.0 < fraction < 1.0 else ""
        return f"{stage}, pass {times}{part}" if times > 1 else stage + part

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
            self._next_line = now + LINE_EVERY
            say(f"{now - self._start:.0f} s: {text}", err=True)

    def _open(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        self._bar = Progress(
            TimeElapsedColumn(),
            BarColumn(),
            TextColumn("{task.description}", markup=False),
            console=Console(stderr=True),
            transient=True,
        )
        self._task = self._bar.add_task("", total=None)  # a task with a total would stop its clock at it
        self._bar.start()
