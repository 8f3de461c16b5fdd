"""`planner machine`: the built-in machines, and a machine file to start from."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from planner.base.errors import InputError
from planner.commands.options import DEFAULT_MACHINE, length_option, time_option
from planner.commands.terminal import guarded, say, show

if TYPE_CHECKING:
    from planner.machine import Machine


def machine_named(name: str | None) -> "Machine":
    """The machine of `-m`: a machine file, a built-in one, or the settings of a control as they are, with notes on what
    these leave open; None is the default."""
    from planner.machine import load_machine

    path = Path(name or DEFAULT_MACHINE)
    if (
        name is not None and os.path.isfile(path) and path.suffix != ".toml"
    ):  # False, too, for names that are too long
        from planner.controls.machine_import.convert import import_machine, is_settings

        if is_settings(path):
            imported = import_machine(path)
            for sentence in imported.assumed:
                say(f"note: {sentence}", err=True)
            return imported.machine
    return load_machine(name or DEFAULT_MACHINE)


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

    from planner.report.replace import write_new

    write_new(file, (resources.files("planner") / "templates" / "machine.toml").read_bytes())
    say(f"{file} written; plan with: planner plan JOB -m {file}")


@guarded
def import_file(
    settings: Annotated[
        Path,
        typer.Argument(
            metavar="SETTINGS",
            help="LinuxCNC's INI file, what $$ of grbl or M503 of Marlin printed, or Klipper's printer.cfg",
        ),
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE", help="machine file to write (.toml)")
    ],
    control: Annotated[
        str | None,
        typer.Option(
            "--control", metavar="NAME", help="linuxcnc, grbl, klipper or marlin, where it is not recognised"
        ),
    ] = None,
    ramp_time: Annotated[
        float | None,
        time_option(
            "--ramp-time",
            "time in which an axis builds up its acceleration [s], for jerks that the control does not know (default 0.04)",
        ),
    ] = None,
    tolerance: Annotated[float | None, length_option("--tolerance", "contour tolerance [mm]")] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="AXIS.LIMIT=VALUE",
            help="a limit in mm and s, such as z.jerk=1e4; repeat it for more",
        ),
    ] = None,
) -> None:
    """Make a machine file from the settings of a control, and say what they leave open."""
    from planner.controls.machine_import.convert import RAMP_TIME, import_machine
    from planner.report.replace import write_new

    imported = import_machine(
        settings,
        control=control,
        ramp_time=RAMP_TIME if ramp_time is None else ramp_time,
        tolerance=tolerance,
        given=_limits_given(set_ or []),
    )
    write_new(output, imported.text.encode())
    for sentence in imported.assumed:
        say(f"note: {sentence}")
    say(f"{output} written; plan with: planner plan JOB -m {output}")


def _limits_given(texts: list[str]) -> dict[str, float]:
    """Limits by name, as `--set` has them. Raises InputError for what is no name and number."""
    given = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            given[name.strip().removeprefix("axes.")] = float(value)
        except ValueError:
            raise InputError(f"--set {text}: write a limit and its value, such as z.jerk=1e4") from None
    return given
