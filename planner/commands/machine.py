"""`planner machine`: built-in machines, and files from a template, a control's settings or measured times."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from planner.base.errors import InputError
from planner.commands.options import (
    DEFAULT_MACHINE,
    ForceOption,
    MachineOption,
    control_option,
    length_option,
    output_option,
    time_option,
)
from planner.commands.terminal import guarded, say, show

if TYPE_CHECKING:
    from planner.controls.timing.traces import Trace
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
            help="LinuxCNC's INI file, what $$ of grbl or M503 of Marlin printed, Klipper's printer.cfg, or RepRapFirmware's config.g",
        ),
    ],
    output: Annotated[Path, output_option("FILE", "machine file to write (.toml)")],
    control: Annotated[str | None, control_option(", where it is not recognised")] = None,
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
    force: ForceOption = False,
) -> None:
    """Make a machine file from the settings of a control, and say what they leave open."""
    from planner.controls.machine_import.convert import RAMP_TIME, import_machine
    from planner.report.replace import refuse_inputs, write_new

    refuse_inputs([output], [settings])
    imported = import_machine(
        settings,
        control=control,
        ramp_time=RAMP_TIME if ramp_time is None else ramp_time,
        tolerance=tolerance,
        given=_limits_given(set_ or []),
    )
    write_new(output, imported.text.encode(), force=force)
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


@guarded
def fit_command(
    measured: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="PROGRAM=SECONDS|TRACE",
            help="a program and how long the control took for it [s], or its trace; or a trace alone (CSV, halscope, Klipper)",
        ),
    ] = None,
    machine: MachineOption = None,
    control: Annotated[str | None, control_option()] = None,
    write: Annotated[
        Path | None,
        typer.Option("--write", metavar="DIR", help="write the test programs into a new directory"),
    ] = None,
    output: Annotated[Path | None, output_option("FILE", "machine file to write (.toml)")] = None,
    force: ForceOption = False,
) -> None:
    """Find limits of axes from recorded traces; accelerations, the speed at corners and a factor from the times of five
    test programs, which --write makes."""
    from planner.controls.timing.fit import fitted, machine_text, programs_to_time
    from planner.controls.timing.times import control_named, control_times
    from planner.controls.timing.traces import limits_of
    from planner.nc.reader import read_program
    from planner.report.replace import refuse_inputs, write_new

    if (write is None) == (not measured):
        raise InputError(
            "give --write DIR to get the test programs, or PROGRAM=SECONDS of each of them, or TRACE"
        )
    limits = machine_named(machine)
    if write is not None:
        name = control_named(control, limits)
        try:
            write.mkdir(parents=True)
        except OSError as fault:
            raise InputError(f"cannot be made: {fault.strerror}", source=str(write)) from fault
        for file, text in programs_to_time(limits, name).items():
            write_new(write / file, text.encode())
            took = control_times(read_program(text=text), limits, name).seconds
            say(f"{write / file}: about {took:.0f} s, from X0 Y0 Z0; measure how long it takes")
        return
    given = [_measured(text) for text in measured or []]
    traces, times = [one[2] for one in given if one[2]], {file: took for file, took, _ in given if file}
    settings: tuple[tuple[str, float, float], ...] = ()
    said: list[str] = []
    if traces:
        limits, settings, said = limits_of(traces, limits)
    if times:
        name = control_named(control, limits)
        of_times = fitted(
            {file: (read_program(file, limits), took) for file, took in times.items()}, limits, name
        )
        limits, settings = of_times.machine, (*settings, *of_times.settings)
        said += of_times.residual_texts()
    for what, before, value in settings:
        say(f"{what}: {value:.6g}, before {before:.6g}")
    for text in said:
        say(text)
    if output is not None:
        refuse_inputs([output], [Path(file) for text in measured or [] for file in text.split("=")])
        write_new(output, machine_text(limits, settings, said).encode(), force=force)
        say(f"{output} written")


def _measured(text: str) -> "tuple[str, float, Trace | None]":
    """The program, "" for none, its seconds, and the trace that they are from."""
    from planner.controls.timing.traces import read_trace

    file, _, took = text.rpartition("=")
    try:
        seconds = float(took)
    except ValueError:
        if not os.path.isfile(took):
            raise InputError(
                f"'{text}': write a program and its seconds or its trace, as in x.nc=61.2 or x.nc=x.csv, or a trace"
            ) from None
        try:
            trace = read_trace(took)
        except InputError as fault:
            needed = "a trace, or of a program its seconds: x.nc=61.2"
            raise InputError(f"{fault.message}; give {needed}", source=took, line=fault.line) from None
        return file, trace.seconds, trace
    if not file or not 0.0 < seconds < float("inf"):
        raise InputError(f"'{text}': write a program and its seconds above 0, as in x.nc=61.2")
    return file, seconds, None
