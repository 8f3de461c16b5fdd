"""`planner time`: how long a control takes for a program as it is, and beside it the plan and what export would bring."""

from __future__ import annotations

import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from planner.base.errors import InputError
from planner.base.names import known_name
from planner.commands import options
from planner.commands.machine import machine_named
from planner.commands.progress import ProgressBar
from planner.commands.terminal import guarded, say, say_json, show
from planner.nc.reading import Reading

if TYPE_CHECKING:
    from planner.controls.timing.times import ControlTimes
    from planner.machine import Machine
    from planner.nc.program import Program

ROWS = 20  # of a table at most, the longest ones; --json has all


@guarded
@options.takes_reading
def time_command(
    job: options.Job,
    machine: options.MachineOption = None,
    control: options.ControlOption = None,
    tolerance: options.ToleranceOption = None,
    plan: Annotated[
        bool, typer.Option("--plan", help="plan the motion too, and predict what export would bring")
    ] = False,
    as_json: options.JsonOption = False,
    quiet: options.QuietOption = False,
    *,
    reading: Reading,
) -> None:
    """Predict how long a control takes for a program as it is: per tool, operation and layer."""
    from planner.controls.timing.times import TIMED, control_named, control_times
    from planner.nc.extents import travel_faults
    from planner.nc.faults import require_none
    from planner.nc.reader import read_program
    from planner.planning.job.beside import beside_motion

    limits = machine_named(machine)
    name = control_named(known_name("control", control, TIMED) if control else None, limits)
    program = read_program(job, limits, reading)
    faults, notes = travel_faults(program, limits, program.text or b"")
    if not reading.ignore_travel:
        require_none(faults, program.source)
    found = control_times(program, limits, name, tolerance)
    beside = beside_motion(program, limits)
    said: dict[str, Any] = {"program": str(job), "machine": limits.name} | asdict(found)
    said["beside_s"] = sum(one.seconds for one in beside)
    if plan:
        said["plan"] = _planned(program, limits, name, tolerance, quiet=quiet)
    if as_json:
        say_json(said | {"assumptions": list(program.assumptions)})
        return
    for text in notes:
        say(f"note: {text}", err=True)
    for text in (*program.assumptions, *found.assumed):
        say(f"assumed: {text}", err=True)
    _show(found, said)


def _planned(
    program: Program, machine: Machine, control: str, tolerance: float | None, *, quiet: bool
) -> dict[str, Any]:
    """The plan's time with nine tenths of the tolerance, and the predictions for what export would write with all of it."""
    import numpy as np

    from planner import plan
    from planner.controls.export.program import LESS, write_program
    from planner.geometry.build import toolpath_from_program

    allowed = float(toolpath_from_program(program, machine, tolerance).tolerance.min())
    with ProgressBar(quiet=quiet) as progress:
        made = plan(program, machine, tolerance=float(np.round(LESS * allowed, 9)), progress=progress)
    predicted: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder:
        try:
            predicted = write_program(Path(folder), made, control, allowed).predicted
        except InputError as fault:  # what it has no words for
            say(f"note: nothing to export: {fault}", err=True)
    assert made.trajectory is not None
    time = made.trajectory.cycle_time
    return {"tolerance_mm": LESS * allowed, "cycle_time_s": time, "exported_s": predicted}


def _show(found: ControlTimes, said: dict[str, Any]) -> None:
    """Print the table."""
    from planner.report.rows import hours_text
    from planner.report.tables import pairs_table

    def clock(seconds: float) -> str:
        return f"{seconds:.4f} s{hours_text(seconds)}"

    table = pairs_table()
    takes = f"{found.seconds:.4g} s" if found.seconds < 1 else clock(found.seconds)
    table.add_row(f"{found.control} takes", takes)
    if found.dwells:
        table.add_row("of that standing still", f"{found.dwells:.4f} s")
    if said["beside_s"]:
        table.add_row("beside the motion", f"{said['beside_s']:.4f} s")
    for title in ("tools", "operations", "layers"):
        parts = getattr(found, title)
        longest = {*sorted(parts, key=parts.__getitem__, reverse=True)[:ROWS]}
        for name, seconds in parts.items():
            if name in longest:
                table.add_row(f"  {name or 'before'}", clock(seconds))
        if len(parts) > ROWS:
            table.add_row(f"  {len(parts) - ROWS} more {title}", "see --json")
    if made := said.get("plan"):
        played = f"{made['cycle_time_s']:.4f} s, on drives that play setpoints"
        table.add_row(f"planned within {made['tolerance_mm']:.4g} mm", played)
        for name, seconds in made["exported_s"].items():
            table.add_row(f"exported, {name}", f"{seconds:.4f} s")
    show(table)
