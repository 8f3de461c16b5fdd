"""How a command reports: messages, tables on standard output, progress on standard error; and whether a failure comes of
too little memory, which libraries say in many ways, some only that one cannot be loaded (under `ulimit -v`).
"""

from __future__ import annotations

import codecs
import errno
import functools
import io
import json
import mmap
import os
import sys
import warnings
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import typer

from planner.base.errors import InputError, NotSolvedError, printable

if TYPE_CHECKING:
    from rich.console import Console, RenderableType


# Columns where the output is no terminal: rows are for other programs there, and are not cut or folded.
PIPE_WIDTH = 1000
PLAIN = {"µ": "u", "²": "2", "³": "3", "°": "deg", "…": "..."}  # for encodings that lack them


def prepare_streams() -> None:
    """Let the output take any text, whatever its encoding, and print warnings on one line."""
    codecs.register_error("planner", _plain_text)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="planner")
    warnings.showwarning = _show_warning


def _plain_text(fault: UnicodeError) -> tuple[str, int]:
    """Substitutes for what an encoding lacks: plain letters for units, escapes for the rest, file names that
    are no UTF-8 among them."""
    if not isinstance(fault, UnicodeEncodeError):
        raise fault
    lacking = fault.object[fault.start : fault.end]
    return "".join(PLAIN.get(c) or c.encode("ascii", "backslashreplace").decode() for c in lacking), fault.end


def _show_warning(message: Warning | str, *_: object, **__: object) -> None:
    say(f"warning: {message}", err=True)


def guarded(command: Callable[..., None]) -> Callable[..., None]:
    """Turn the exceptions of a command into a message and an exit code."""

    judging = command.__name__ == "verify_command"

    @functools.wraps(command)
    def run(*args: Any, **kwargs: Any) -> None:
        try:
            command(*args, **kwargs)
        except typer.Exit:
            raise
        except BrokenPipeError:
            _drop_output()
            raise typer.Exit(BROKEN_PIPE) from None
        except (Exception, KeyboardInterrupt) as fault:
            code, text = _end_by(fault, judging)
            say(text, err=True)
            raise typer.Exit(code) from None

    return run


def _end_by(fault: BaseException, judging: bool) -> tuple[int, str]:
    """The exit code and the message for what ended a command."""
    match fault:
        case InputError():
            return BAD_INPUT, str(fault)
        case NotSolvedError():
            return NOT_SOLVED, f"not solved: {fault}"
        case KeyboardInterrupt():
            return INTERRUPTED, "interrupted"
    if is_of_memory(fault):
        used_up = fault if isinstance(fault, MemoryError) else MemoryError()
        return NOT_SOLVED, f"not solved: {memory_used_up(used_up, judging)}"
    import traceback

    return BUG, "".join(traceback.format_exception(fault)) + BUG_SAID


def memory_used_up(fault: MemoryError, judging: bool = False) -> str:
    """The message for a job that needs more memory than there is, and what to do about it; `judging` a file
    that was planned."""
    text = f"the memory is used up ({fault})" if str(fault) else "the memory is used up"
    if judging:
        return f"{text}; verify a part of the motion at a time"
    return f"{text}; split the program, or use --geometry spline or a faster --method (kinematic, stop)"


def say(text: str, *, err: bool = False) -> None:
    """Print one or more lines. Control characters, which a terminal might obey, are printed as escapes.

    Raises InputError if the output cannot be written, BrokenPipeError if its reader has gone.
    """
    _write(printable(text), err=err)


def say_json(value: object) -> None:
    """Print a value as JSON."""
    say(json.dumps(value, indent=2, allow_nan=False))


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


def show(*tables: RenderableType) -> None:
    """Print tables, folded to the width of a terminal; elsewhere a row is one line."""
    from rich.console import Console
    from rich.segment import Segment, Segments

    terminal = sys.stdout is not None and sys.stdout.isatty()
    # Into a string, since rich's own writing ends the process on a broken pipe, with exit code 1.
    console: Console = Console(
        file=io.StringIO(),
        force_terminal=terminal,
        width=None if terminal else PIPE_WIDTH,
        markup=False,  # [mm] is a unit
    )
    for table in tables:
        rendered = [
            Segment(printable(text), style, control) for text, style, control in console.render(table)
        ]
        console.print(Segments(rendered), end="")
    assert isinstance(console.file, io.StringIO)
    lines = console.file.getvalue().removesuffix("\n").split("\n")
    _write("\n".join(lines if terminal else [line.rstrip() for line in lines]))


# What loaders, threads and C++ say, in lower case.
_SAID = (
    *("failed to map segment", "cannot allocate memory", "bad_alloc"),
    *("can't start new thread", "out of memory"),
)
_LIBRARY = 256 << 20  # bytes: more than the largest library that planning loads (libllvmlite, 130 MB)


def is_of_memory(fault: BaseException) -> bool:
    """True if an exception, or one that it came of, is of too little memory."""
    seen: list[BaseException] = []
    one: BaseException | None = fault
    while one is not None and one not in seen:
        seen.append(one)
        if isinstance(one, MemoryError) or (isinstance(one, OSError) and one.errno == errno.ENOMEM):
            return True
        if any(words in str(one).lower() for words in _SAID):
            return True
        one = one.__cause__ or one.__context__
    # Python's own modules end in a SystemError where an allocation in them has failed
    unclear = any(isinstance(one, (OSError, ImportError, SystemError)) for one in seen)
    return unclear and not _room_for_a_library()


def _room_for_a_library() -> bool:
    try:
        mmap.mmap(-1, _LIBRARY).close()
    except OSError:
        return False
    return True


BUG_SAID = """
This is a bug in planner, not in your program. Please report it with the lines above, the NC program and the machine file."""
FAILED = 1  # planned, but the verdict failed
BAD_INPUT = 2
NOT_SOLVED = 3  # or out of memory
# By the outcome of a plan; of several plans the first one here that there is.
CODES = {"passed": 0, "failed": FAILED, "not solved": NOT_SOLVED, "refused": BAD_INPUT}
BUG = 70  # EX_SOFTWARE of sysexits.h
INTERRUPTED = 130  # 128 + SIGINT, what shells report
BROKEN_PIPE = 141  # 128 + SIGPIPE: the reader of the output has gone
