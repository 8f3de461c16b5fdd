"""Commands of the planner run inside this process, what counts as a finding, and what a kind of inputs is."""

from __future__ import annotations

import contextlib
import io
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np

ENDS = (0, 1, 2, 3)  # done, verdict failed, bad input, not solved: the exit codes of a proper end
SENTENCE_MAX = 2_000_000  # characters of one run's output: more is a flood


class Finding(Exception):
    """An end that is none: a bug, a warning of a library, a traceback, a refusal without a sentence."""


class Command(Protocol):
    """A command line without `planner`; returns its exit code, and raises Finding."""

    def __call__(self, *words: str | Path) -> int:
        """Run it."""
        ...


class Place(NamedTuple):
    """Where inputs are tried: a folder of their own, and how commands are run."""

    folder: Path
    command: Command


class Kind(NamedTuple):
    """Inputs of a kind.

    make    : (rng, start, place) -> an input: `start` changed further, or a new one where it is None
    judge   : (input, rng, place) -> how it ended; the settings it is tried with come from rng. Raises for a finding
    readers : files and folders of what reads it, below the project
    guided  : whether inputs that reach something new are changed further (results/fuzz-guidance.md)
    joined  : whether lines of one input can be put into another
    """

    make: Callable[[np.random.Generator, bytes | None, Place], bytes]
    judge: Callable[[bytes, np.random.Generator, Place], str]
    readers: tuple[str, ...]
    guided: bool
    joined: bool = True


def command(*words: str | Path) -> int:
    """Run a command line of the planner; its exit code. Raises Finding for a bug, a warning, a refusal without a sentence."""
    from planner.cli import app
    from planner.commands.app import UsageError

    out, err = io.StringIO(), io.StringIO()
    with (
        warnings.catch_warnings(record=True) as warned,
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        warnings.simplefilter("always")
        try:
            code = app([str(word) for word in words], prog_name="planner", standalone_mode=False)
        except UsageError as fault:  # of which typer writes the message, outside standalone mode not
            code = 2
            print(fault.format_message(), file=err)
    code = code if isinstance(code, int) else 0
    said = err.getvalue()
    if code not in ENDS or "Traceback" in said or "bug" in said:
        raise Finding(f"exit code {code}: {said[-3000:]}")
    if warned:
        one = warned[0]
        raise Finding(f"warning: {one.message} at {one.filename}:{one.lineno}")
    if code in (2, 3) and not (said + out.getvalue()).strip():
        raise Finding(f"exit code {code} without a sentence")
    if len(said) + len(out.getvalue()) > SENTENCE_MAX:
        raise Finding(f"{len(said) + len(out.getvalue()):,} characters of output")
    return code
