"""`planner machine`: the built-in machines, and a machine file to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from planner.base.errors import InputError
from planner.commands.terminal import guarded, say, show


@guarded
def list_machines() -> None:
    """List the built-in machines."""
    from planner.machine import builtin_machines, load_machine
    from planner.report.tables import machines_table

    show(machines_table([load_machine(name) for name in builtin_machines()]))


@guarded
def show_machine(name: Annotated[str, typer.Argument(metavar="NAME", help="built-in machine")]) -> None:
    """Print the file of a built-in machine."""
    from planner.machine import builtin_text

    say(builtin_text(name).rstrip("\n"))


@guarded
def init_file(file: Annotated[Path, typer.Argument(metavar="FILE", help="file to write (.toml)")]) -> None:
    """Write a commented machine file to start from; it names every key and its unit."""
    from importlib import resources

    text = (resources.files("planner") / "templates" / "machine.toml").read_text(encoding="utf-8")
    try:
        with file.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise InputError(
            "exists already and is not overwritten; give another name", source=str(file)
        ) from None
    except OSError as fault:
        raise InputError(f"cannot be written: {fault.strerror}", source=str(file)) from fault
    say(f"{file} written; plan with: planner plan JOB -m {file}")
