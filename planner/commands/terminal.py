"""How a command reports: messages, tables on standard output, progress on standard error."""

from __future__ import annotations

import codecs
import functools
import io
import os
import sys
import warnings
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import typer

from planner.base.errors import InputError, NotSolvedError, printable
from planner.commands.exit_codes import BAD_INPUT, BROKEN_PIPE, BUG, INTERRUPTED, NOT_SOLVED

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
    """What an encoding lacks: plain letters for units, escapes for the rest, file names that are no UTF-8 among them."""
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
        except InputError as fault:
            say(str(fault), err=True)
            raise typer.Exit(BAD_INPUT) from None
        except NotSolvedError as fault:
            say(f"not solved: {fault}", err=True)
            raise typer.Exit(NOT_SOLVED) from None
        except MemoryError as fault:
            say(f"not solved: {memory_used_up(fault, judging)}", err=True)
            raise typer.Exit(NOT_SOLVED) from None
        except KeyboardInterrupt:
            say("interrupted", err=True)
            raise typer.Exit(INTERRUPTED) from None
        except BrokenPipeError:
            _drop_output()
            raise typer.Exit(BROKEN_PIPE) from None
        except typer.Exit:
            raise
        except Exception as fault:
            from planner.commands.memory import is_of_memory

            if is_of_memory(fault):
                say(f"not solved: {memory_used_up(MemoryError(), judging)}", err=True)
                raise typer.Exit(NOT_SOLVED) from None
            import traceback

            say(traceback.format_exc(), err=True)
            say(
                "This is a bug in planner, not in your program. Please report it with the lines above, "
                "the NC program and the machine file.",
                err=True,
            )
            raise typer.Exit(BUG) from None

    return run


def memory_used_up(fault: MemoryError, judging: bool = False) -> str:
    """The message for a job that needs more memory than there is, and what to do about it; `judging` a file that was planned."""
    said = f"the memory is used up ({fault})" if str(fault) else "the memory is used up"
    if judging:
        return f"{said}; verify a part of the motion at a time"
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
