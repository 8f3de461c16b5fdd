"""Arguments and options that several commands share, and the names they may take."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

DEFAULT_MACHINE = "mill"


class Method(StrEnum):
    """Names of the methods."""

    toppra = "toppra"
    optimal = "optimal"
    bezier = "bezier"
    kinematic = "kinematic"
    fir = "fir"
    fir_plain = "fir-plain"
    fir_spline = "fir-spline"
    fir_spline_plain = "fir-spline-plain"
    tube = "tube"
    stop = "stop"


class Corner(StrEnum):
    """How the path is smoothed."""

    auto = "auto"
    spline = "spline"
    bezier = "bezier"
    fir = "fir"
    kinematic = "kinematic"


class Solver(StrEnum):
    """Names of the solvers, of the problem with jerk limits and of that without (feedrate/solvers.py)."""

    own = "own"
    ipopt = "ipopt"
    fatrop = "fatrop"
    sequential_convex = "sequential-convex"
    reachability = "reachability"
    toppra = "toppra"


class Format(StrEnum):
    """Formats of trajectory files."""

    parquet = "parquet"
    csv = "csv"
    npz = "npz"


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
QuietOption = Annotated[bool, typer.Option("-q", "--quiet", help="say nothing about progress")]
ForceOption = Annotated[bool, typer.Option("--force", help="overwrite files that planner did not write, too")]
