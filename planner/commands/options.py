"""Arguments and options that several commands share; names come from `planner.base.names`."""

import functools
import inspect
import math
from collections.abc import Callable, Container, Iterable
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from planner.base import names
from planner.base.errors import InputError
from planner.base.units import MICROMETRE, MILLISECOND, MM_PER_INCH, number_and_unit
from planner.nc.reading import ARC_CENTRES, DIALECTS, EXTRUDERS, Reading, ignore_list

DEFAULT_MACHINE = "mill"
# Units of a length on the command line [mm].
LENGTHS = {"mm": 1.0, "um": MICROMETRE, "µm": MICROMETRE, "in": MM_PER_INCH, "inch": MM_PER_INCH}
# Units of a time on the command line [s].
TIMES = {"s": 1.0, "ms": MILLISECOND}


class Format(StrEnum):
    """Formats of trajectory files."""

    parquet = "parquet"
    csv = "csv"
    npz = "npz"


def _use_threads(count: int | None) -> int | None:
    """The number of threads, which is used from now on."""
    from planner.base.threads import use_threads

    use_threads(count)
    return count


def _choice(
    name: str, check: Callable[[str], str], known: Iterable[str], help_text: str, *, listed: bool = True
) -> Any:
    """An option that takes a name that `check` knows; it may be an alias. `known` is what a shell offers, and what the
    help has in the place of NAME where it is `listed`."""

    def parsed(text: str) -> str:
        try:
            return check(text)
        except InputError as fault:
            raise typer.BadParameter(str(fault)) from None

    return typer.Option(
        name,
        metavar="|".join(known) if listed else "NAME",
        parser=parsed,
        help=help_text,
        autocompletion=lambda incomplete: [each for each in known if each.startswith(incomplete)],
    )


def _one_of(kind: str, known: tuple[str, ...], help_text: str) -> Any:
    """An option --KIND that takes one of some names."""
    return _choice(f"--{kind}", functools.partial(names.known_name, kind, names=known), known, help_text)


def output_option(metavar: str, help_text: str) -> Any:
    """The option -o of a command that writes: a FILE or a DIR."""
    return typer.Option("-o", "--output", metavar=metavar, help=help_text)


def control_option(more: str = "") -> Any:
    """An option that takes the name of a control; `more` says when it is not needed."""
    text = f"linuxcnc, grbl, klipper or marlin{more}"
    return typer.Option("--control", metavar="NAME", help=text)


def length_option(name: str, help_text: str) -> Any:
    """An option that takes a length above 0: in mm, or with a unit, such as 20um."""
    return _with_unit(name, help_text, "length", LENGTHS)


def time_option(name: str, help_text: str) -> Any:
    """An option that takes a time above 0: in s, or with a unit, such as 20ms."""
    return _with_unit(name, help_text, "time", TIMES)


def _with_unit(name: str, help_text: str, what: str, units: dict[str, float]) -> Any:
    """An option that takes a number above 0, with one of these units or without: then with the first one."""
    first = next(iter(units))

    def parsed(text: str) -> float:
        number, unit = number_and_unit(text) or ("nan", "")
        value = float(number) * units.get(unit or first, math.nan)
        if not 0.0 < value < math.inf:
            comma = "; decimals have a point" if "," in text else ""
            raise typer.BadParameter(
                f"'{text}' is no {what} above 0; write one in {first}, or with a unit: {', '.join(units)}{comma}"
            )
        return value

    return typer.Option(name, metavar=first.upper(), parser=parsed, help=help_text)


def _machines(incomplete: str) -> list[str]:
    """Built-in machines and machine files that a shell offers."""
    from planner.machine import builtin_machines

    folder = Path(incomplete).parent
    files = [str(file) for file in folder.glob("*.toml")] if folder.is_dir() else []
    return [name for name in (*builtin_machines(), *files) if name.startswith(incomplete)]


SHAPING = " and ".join(names.users_of("geometry"))
Jobs = Annotated[list[Path], typer.Argument(metavar="JOB", help="NC program, or several")]
Job = Annotated[Path, typer.Argument(metavar="JOB", help="NC program")]
MachineOption = Annotated[
    str | None,
    typer.Option(
        "-m",
        "--machine",
        metavar="FILE",
        help=f"machine file, settings of a control, or name of a built-in machine (default: {DEFAULT_MACHINE})",
        autocompletion=_machines,
    ),
]
ToleranceOption = Annotated[
    float | None,
    length_option(
        "--tolerance",
        "contour tolerance [mm], or with a unit: 20um; takes precedence over G64 P in the program and over the machine file",
    ),
]
TrajectoryArgument = Annotated[
    Path,
    typer.Argument(
        metavar="TRAJECTORY", help="trajectory file (.parquet, .csv, .npz), or directory that 'plan -o' wrote"
    ),
]
UnitsOption = Annotated[
    str | None,
    _one_of(
        "units",
        ("mm", "inch"),
        "mm or inch, for what is shown (default: as in the program); feeds are per minute",
    ),
]
ControlOption = Annotated[str | None, control_option(" (default: that of the machine)")]
JsonOption = Annotated[bool, typer.Option("--json", help="print JSON instead of a table")]
ThreadsOption = Annotated[
    int | None,
    typer.Option(
        "--threads",
        min=1,
        metavar="N",
        help="solve on so many cores (default: all); the motion is the same on any number",
        callback=_use_threads,
    ),
]
QuietOption = Annotated[bool, typer.Option("-q", "--quiet", help="print no progress")]
ForceOption = Annotated[bool, typer.Option("--force", help="also overwrite files that planner did not write")]


def given_options(context: typer.Context, without: Container[str]) -> list[str]:
    """The options of a command line as they are to be written for another one, all but those of the names in
    `without`."""
    words: list[str] = []
    for option in context.command.params:
        if option.name is None or option.name in without or option.param_type_name != "option":
            continue
        value = context.params.get(option.name)
        if value is None or value is False or value == "":
            continue
        name = max(option.opts, key=len)
        words += [name] if value is True else [name, str(getattr(value, "value", value))]
    return words


# The settings of the reader as options: name and type of the field of `Reading`, and the option.
_READING: dict[str, tuple[Any, Any]] = {
    "strict": (bool, typer.Option("--strict", help="refuse whatever would be assumed in the program")),
    "ignore": (
        str,
        typer.Option(
            "--ignore",
            metavar="CODE,...",
            help="leave out what you know to be harmless: codes, axes, words, lines, such as M428,G187,A,$X,12-20",
        ),
    ),
    **{
        kind.replace("-", "_"): (str, _one_of(kind, known, text))
        for kind, known, text in (
            (
                "arc-centres",
                ARC_CENTRES,
                "what I J K mean in a program without G90.1 and G91.1; auto: by what closes its arcs",
            ),
            ("extruder", EXTRUDERS, "what to do with the E words of a 3-D printer"),
            (
                "dialect",
                DIALECTS,
                "whose language parameters, expressions, subprograms and dwells are; auto: by what the program holds",
            ),
        )
    },
    "feed_caps": (
        str | None,
        typer.Option(
            "--feed-caps",
            metavar="FILE",
            help="CSV of feeds that hold where they are below F: line,feed or file,line,feed or from_mm,to_mm,feed",
        ),
    ),
    "ignore_travel": (
        bool,
        typer.Option("--ignore-travel", help="plan what lies beyond the travel in the machine file"),
    ),
}


def taking(
    command: Callable[..., None],
    argument: str,
    options: dict[str, tuple[Any, Any]],
    usual: dict[str, Any],
    gathered: Callable[[dict[str, Any]], Any],
) -> Callable[..., None]:
    """Give a command some options, which it gets as one argument.

    options  : type and option by name
    usual    : their defaults
    gathered : makes the argument of their values
    """

    @functools.wraps(command)
    def run(*args: Any, **kwargs: Any) -> None:
        given = {name: kwargs.pop(name) for name in options}
        command(*args, **{argument: gathered(given)}, **kwargs)

    signature = inspect.signature(command, eval_str=True)
    parameters = [p for p in signature.parameters.values() if p.name != argument] + [
        inspect.Parameter(
            name,
            inspect.Parameter.KEYWORD_ONLY,
            default=usual[name],
            annotation=Annotated[kind, option],
        )
        for name, (kind, option) in options.items()
    ]
    run.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {p.name: p.annotation for p in parameters}
    return run


def takes_reading(command: Callable[..., None], *, caps: bool = True) -> Callable[..., None]:
    """Give a command the options of the reader; it gets them as one argument, `reading`.

    caps : with feed caps, which mean nothing to a command that writes a program's own words
    """
    options = {name: option for name, option in _READING.items() if caps or name != "feed_caps"}

    def gathered(given: dict[str, Any]) -> Reading:
        return Reading(**given | {"ignore": ignore_list(given["ignore"])})

    usual = {name: "" if name == "ignore" else getattr(Reading(), name) for name in options}
    return taking(command, "reading", options, usual, gathered)


# How a job is planned: what checks the name that an option takes, and the names that there are.
_CHOICES: dict[str, tuple[Callable[[str], str], Iterable[str]]] = {
    "method": (names.method_name, names.METHODS),
    "geometry": (functools.partial(names.known_name, "geometry", names=names.GEOMETRIES), names.GEOMETRIES),
    "corner": (names.corner_name, names.CORNER_SHAPES),
    "solver": (functools.partial(names.known_name, "solver", names=names.SOLVERS), names.SOLVERS),
    "effort": (functools.partial(names.known_name, "effort", names=names.EFFORTS), names.EFFORTS),
}
_HELP = {
    "method": f"how to plan: {', '.join(names.METHODS)}",
    "geometry": f"how {SHAPING} smooth the path: spline (the smoothest curve from stop to stop, then the feed on it), corners (each "
    "corner by itself), or auto (path and feed together, where that runs; the default)",
    "corner": f"shape of single corners; implies --geometry {names.SINGLE_CORNERS} (default: {names.BEZIER})",
    "solver": "solver; the first is the method's default: "
    + "; ".join(f"{name}: {', '.join(m.solvers)}" for name, m in names.METHODS.items() if m.solvers),
    "effort": f"how much work: {', '.join(names.EFFORTS)}, default {names.NORMAL} ({' and '.join(names.users_of('effort'))})",
    "smooth": "weight of the jerk against the time: 0.03 for a smoother motion, 0.3 for a much slower one (default: 0, jerk small "
    f"where it costs no time; {' and '.join(names.users_of('smooth'))})",
}
# The same as options: type of the value, and the option.
_PLANNING: dict[str, tuple[Any, Any]] = {
    name: (str | None, _choice(f"--{name}", check, known, _HELP[name], listed=name in ("geometry", "corner")))
    for name, (check, known) in _CHOICES.items()
} | {"smooth": (float | None, typer.Option("--smooth", min=0.0, metavar="WEIGHT", help=_HELP["smooth"]))}


def takes_planning(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options of planning; it gets those that are given as one argument, `how`, as
    `planner.plan` takes them."""
    usual = dict.fromkeys(_PLANNING, None) | {"method": names.OPTIMAL}
    return taking(
        command,
        "how",
        _PLANNING,
        usual,
        lambda given: {name: value for name, value in given.items() if value is not None},
    )
