"""`planner info`: what a program holds."""

import functools
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from planner.base.errors import InputError
from planner.base.files import readable
from planner.commands import options
from planner.commands.machine import machine_named
from planner.commands.terminal import BAD_INPUT, guarded, say, say_json, show
from planner.nc.reading import Reading

if TYPE_CHECKING:
    from planner.machine import Machine


@guarded
@options.takes_reading
def info_command(
    job: options.Job,
    machine: options.MachineOption = None,
    as_json: options.JsonOption = False,
    *,
    reading: Reading,
) -> None:
    """Show what a program contains, and the line of every construct that is not supported."""
    from planner.nc.info import inspect_program
    from planner.report.summary import info_summary
    from planner.report.tables import info_table

    found = inspect_program(job, machine_named(machine), reading)
    if as_json:
        say_json(info_summary(found))
    else:
        show(info_table(found))
    if found.unsupported:
        raise typer.Exit(BAD_INPUT)


@guarded
@functools.partial(options.takes_reading, caps=False)
def expand_command(
    job: options.Job,
    machine: options.MachineOption = None,
    output: Annotated[
        Path | None, options.output_option("FILE", "the file to write (default: print the program)")
    ] = None,
    force: options.ForceOption = False,
    *,
    reading: Reading,
) -> None:
    """Write a program out: parameters, expressions, loops and calls become plain lines; G codes, cycles and offsets
    stay the program's."""
    if force and output is None:
        raise InputError("--force has no effect without a file to write; name one with -o FILE")
    from planner.nc.reader import load, source_name
    from planner.nc.writer import flat_program
    from planner.report.replace import refuse_inputs, write_new

    data = load(job)
    found = flat_program(data, machine_named(machine), reading, source=source_name(job))
    text = data if found is None else readable(found[0]).encode()
    if found is not None and (why := _unread(text, machine_named(machine))):
        say(f"note: LinuxCNC would not read it: {why}", err=True)
    if output is None:
        typer.echo(text, nl=False)
        return
    refuse_inputs([output], [job])
    write_new(output, text, force=force)
    if found is None:
        say(f"{output}: nothing to expand, the program is copied")
    else:
        assert found[1].expansion is not None
        say(f"{output}: {found[1].expansion.rows:,} lines executed, {len(found[1]):,} blocks")


def _unread(text: bytes, machine: "Machine") -> str:
    """Why LinuxCNC does not read an expanded program; "" if it does."""
    from planner.controls.export.controls import CONTROLS
    from planner.nc.lexer import split_words
    from planner.nc.reader import parse_program
    from planner.nc.reading import LINUXCNC

    try:
        parse_program(text, machine, Reading(dialect=LINUXCNC), source="")
    except InputError as fault:
        return f"line {fault.line}: {fault.message}"
    words = split_words(text, block_delete=True)
    for k, (letter, value) in enumerate(zip(words.letter.tolist(), words.value.tolist(), strict=True)):
        if letter == ord("G") and round(value * 10) not in CONTROLS[LINUXCNC].g:
            return f"line {words.line[words.row(k)]}: G{value:g} is none of its codes"
    return ""
