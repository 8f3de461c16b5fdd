"""The command line. Every command imports what it needs itself, so that `planner --help` answers at once.

Exit codes: 0 done and verified; 1 the verdict failed; 2 bad input; 3 not solved; 70 a bug of ours; 130
interrupted.
"""

from __future__ import annotations

import functools
import json
import os
import sys
import time
from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from planner.cli_pulses import pulses
from planner.errors import InputError, NotSolvedError

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

FAILED, BAD_INPUT, NOT_SOLVED, BUG, INTERRUPTED, BROKEN_PIPE = 1, 2, 3, 70, 130, 141
DEFAULT_MACHINE = "mill"
PROGRESS_AFTER = 1.0  # [s]: a shorter job needs no bar
PIPE_WIDTH = 120  # columns where the output is no terminal


class Method(StrEnum):
    """Names of the methods."""

    toppra = "toppra"
    optimal = "optimal"
    bezier = "bezier"
    kinematic = "kinematic"
    stop = "stop"


class Corner(StrEnum):
    """Names of the corner shapes."""

    bezier = "bezier"
    fir = "fir"
    kinematic = "kinematic"


class Solver(StrEnum):
    """Names of the solvers of the second-order problem."""

    reachability = "reachability"
    toppra = "toppra"


class Format(StrEnum):
    """Formats of trajectory files."""

    parquet = "parquet"
    csv = "csv"
    npz = "npz"


app = typer.Typer(
    help="The fastest motion of an NC program within the limits of a machine, planned and verified.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
machine_app = typer.Typer(help="Machine files.", no_args_is_help=True)
app.add_typer(machine_app, name="machine")

Job = Annotated[Path, typer.Argument(metavar="JOB", help="NC program")]
MachineOption = Annotated[
    str | None,
    typer.Option(
        "-m",
        "--machine",
        metavar="FILE",
        help=f"machine file or built-in machine [default: {DEFAULT_MACHINE}]",
    ),
]
ToleranceOption = Annotated[
    float | None,
    typer.Option(
        metavar="MM", help="contour error budget; beats G64 P in the program and the machine's tolerance"
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="print JSON instead of a table")]


def _guarded(command: Callable[..., None]) -> Callable[..., None]:
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


# ---------------------------------------------------------------------------------------------- commands


@app.command()
@_guarded
def plan(
    job: Job,
    machine: MachineOption = None,
    method: Annotated[Method, typer.Option(help="how to plan")] = Method.toppra,
    corner: Annotated[
        Corner, typer.Option(help="shape of the rounded corners, for toppra and optimal")
    ] = Corner.bezier,
    solver: Annotated[
        Solver, typer.Option(help="of method toppra: our kernel, or the package toppra for comparison")
    ] = Solver.reachability,
    tolerance: ToleranceOption = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="write trajectory and summary into DIR"),
    ] = None,
    file_format: Annotated[
        Format, typer.Option("--format", help="format of the trajectory")
    ] = Format.parquet,
    plot: Annotated[bool, typer.Option("--plot", help="write pictures into DIR (PNG)")] = False,
    corners: Annotated[
        bool, typer.Option("--corners", help="print the corners next to their closed-form speed")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Plan, sample and verify the motion of a program."""
    if plot and output is None:
        raise InputError("--plot writes its pictures into the output directory: give one with -o DIR")
    from planner import plan as plan_program
    from planner.report.export import summary, write_plan

    with _Progress() as progress:
        result = plan_program(
            job,
            machine or DEFAULT_MACHINE,
            method=method.value,
            corner=corner.value,
            solver=solver.value,
            tolerance=tolerance,
            progress=progress,
        )
        written: list[str] = []
        if output is not None and result.trajectory is not None:
            progress("write", 0.0)
            written = write_plan(result, output, file_format=file_format.value, plots=plot)

    if as_json:
        typer.echo(json.dumps(summary(result), indent=2, allow_nan=False))
    else:
        from planner.report.tables import corner_table, plan_table

        _show(plan_table(result))
        table = corner_table(result) if corners else None
        if table is not None:
            _show("", table)
        for name in written:
            typer.echo(str(output / name) if output else name)
    if result.trajectory is None:
        kept = f"; {output} was not touched" if output is not None else ""
        raise NotSolvedError(f"{result.sentence}{kept}")
    if result.verdict is None or not result.verdict.passed:
        raise typer.Exit(FAILED)


@app.command()
@_guarded
def verify(
    trajectory: Annotated[
        Path, typer.Argument(metavar="TRAJECTORY", help="trajectory file (.parquet, .csv, .npz)")
    ],
    job: Job,
    machine: Annotated[
        str | None,
        typer.Option(
            "-m",
            "--machine",
            metavar="FILE",
            help=f"machine file or built-in machine [default: TRAJECTORY's own, or {DEFAULT_MACHINE}]",
        ),
    ] = None,
    tolerance: ToleranceOption = None,
    not_limited: Annotated[
        list[str] | None,
        typer.Option(
            metavar="QUANTITY", help="report without judging: jerk for a plan that does not limit it"
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Judge a trajectory against its program and a machine; it may come from anywhere."""
    from planner.geometry.build import toolpath_from_program
    from planner.machine import load_machine, machine_from_dict
    from planner.nc.reader import read_program
    from planner.report.export import verdict_summary
    from planner.report.tables import verdict_table
    from planner.report.trajectory_file import read_trajectory
    from planner.verify import verify as judge
    from planner.verify.judge import NOT_LIMITED_NAMES

    read = read_trajectory(trajectory)
    recorded = read.metadata.get("machine")
    if machine is None and recorded is not None:
        limits = machine_from_dict(recorded, source=f"{trajectory} (recorded machine)")
    else:
        limits = load_machine(machine or DEFAULT_MACHINE)
    recorded_tolerance = read.metadata.get("tolerance_mm")
    if tolerance is None and isinstance(recorded_tolerance, float):
        tolerance = recorded_tolerance
    unjudged = tuple(read.metadata.get("not_limited", ()) if not_limited is None else not_limited)
    for name in unjudged:
        if name not in NOT_LIMITED_NAMES:
            raise InputError(
                f"--not-limited {name}: there is no such limit; {', '.join(NOT_LIMITED_NAMES)} are"
            )
    toolpath = toolpath_from_program(read_program(job, limits), limits, tolerance)
    with _Progress() as progress:
        verdict = judge(
            read.trajectory,
            toolpath,
            limits,
            not_limited=unjudged,
            progress=lambda fraction: progress("verify", fraction),
        )
    if as_json:
        typer.echo(
            json.dumps({**verdict_summary(verdict), "machine": limits.name, "notes": read.notes}, indent=2)
        )
    else:
        for note in read.notes:
            typer.echo(f"note: {note}", err=True)
        _show(verdict_table(verdict, f"{trajectory} on {job}, machine {limits.name}"))
    if not verdict.passed:
        raise typer.Exit(FAILED)


@app.command()
@_guarded
def info(job: Job, machine: MachineOption = None, as_json: JsonOption = False) -> None:
    """What a program holds; every construct that is not supported, with its line."""
    from planner.machine import load_machine
    from planner.nc.info import inspect_program
    from planner.report.export import info_summary
    from planner.report.tables import info_table

    found = inspect_program(job, load_machine(machine or DEFAULT_MACHINE))
    if as_json:
        typer.echo(json.dumps(info_summary(found), indent=2, allow_nan=False))
    else:
        _show(info_table(found))
    if found.unsupported:
        raise typer.Exit(BAD_INPUT)


app.command()(_guarded(pulses))


@machine_app.command("list")
@_guarded
def machine_list() -> None:
    """List the built-in machines."""
    from planner.machine import builtin_machines, load_machine
    from planner.report.tables import machines_table

    _show(machines_table([load_machine(name) for name in builtin_machines()]))


@machine_app.command("show")
@_guarded
def machine_show(name: Annotated[str, typer.Argument(metavar="NAME", help="built-in machine")]) -> None:
    """Print the file of a built-in machine."""
    from planner.machine import builtin_text

    typer.echo(builtin_text(name), nl=False)


@machine_app.command("init")
@_guarded
def machine_init(file: Annotated[Path, typer.Argument(metavar="FILE", help="file to write (.toml)")]) -> None:
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
    typer.echo(f"{file} written; plan with: planner plan JOB -m {file}")


# ---------------------------------------------------------------------------------------------- terminal


class _Progress:
    """A bar on standard error that appears when a job takes longer than a moment, on a terminal only."""

    def __enter__(self) -> _Progress:
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


def _show(*tables: RenderableType) -> None:
    from rich.console import Console

    console: Console = Console() if sys.stdout.isatty() else Console(width=PIPE_WIDTH)
    with (
        console.capture() as captured
    ):  # rich's own writing ends the process on a broken pipe, with exit code 1
        for table in tables:
            console.print(table)
    sys.stdout.write(captured.get())
    sys.stdout.flush()


def main() -> None:
    """Entry point of the command `planner`."""
    app(prog_name="planner")
