"""How a command speaks: its exit code, its messages, tables on standard output, a bar on standard error."""

from __future__ import annotations

import functools
import os
import sys
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import typer

from planner.errors import InputError, NotSolvedError

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

FAILED, BAD_INPUT, NOT_SOLVED, BUG, INTERRUPTED, BROKEN_PIPE = 1, 2, 3, 70, 130, 141
PROGRESS_AFTER = 1.0  # [s]: a shorter job needs no bar
PIPE_WIDTH = 120  # columns where the output is no terminal


def guarded(command: Callable[..., None]) -> Callable[..., None]:
    """Turn what a command raises into a message and an exit code."""

    @functools.wraps(command)
    def run(*args: Any, **kwargs: Any) -> None:
        try:
            command(*args, **kwargs)
            sys.stdout.flush()
        except InputError as fault:
            typer.echo(str(fault), err=True)
            raise typer.Exit(BAD_INPUT) from None
        except NotSolvedError as fault:
            typer.echo(f"not solved: {fault}", err=True)
            raise typer.Exit(NOT_SOLVED) from None
        except KeyboardInterrupt:
            typer.echo("interrupted", err=True)
            raise typer.Exit(INTERRUPTED) from None
        except BrokenPipeError:
            # without this the flush at exit would fail once more
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            raise typer.Exit(BROKEN_PIPE) from None
        except typer.Exit:
            raise
        except Exception:
            import traceback

            traceback.print_exc()
            typer.echo(
                "\nThis is a bug in planner, not in your program. Please report it with the lines above, "
                "the NC program and the machine file.",
                err=True,
            )
            raise typer.Exit(BUG) from None

    return run


class ProgressBar:
    """A bar on standard error that appears when a job takes longer than a moment, on a terminal only."""

    def __enter__(self) -> ProgressBar:
        self._start = time.monotonic()
        self._bar: Any = None
        self._task: Any = None
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def __call__(self, stage: str, fraction: float) -> None:
        """Show that `stage` is done to `fraction` (0 to 1)."""
        if self._bar is None:
            if not sys.stderr.isatty() or time.monotonic() - self._start < PROGRESS_AFTER:
                return
            self._open()
        self._bar.update(self._task, description=stage, completed=fraction)

    def _open(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TimeElapsedColumn(),
            console=Console(stderr=True),
            transient=True,
        )
        self._task = self._bar.add_task("", total=1.0)
        self._bar.start()


def show(*tables: RenderableType) -> None:
    from rich.console import Console

    console: Console = Console() if sys.stdout.isatty() else Console(width=PIPE_WIDTH)
    with (
        console.capture() as captured
    ):  # rich's own writing ends the process on a broken pipe, with exit code 1
        for table in tables:
            console.print(table)
    sys.stdout.write(captured.get())
    sys.stdout.flush()
