"""Optimisation-based feedrate planning for CNC machines.

>>> import planner
>>> p = planner.plan("planner/examples/bracket.ngc", "mill", method="kinematic")
>>> p
<Plan of bracket.ngc on mill by kinematic: 15.6184 s, passed>

    plan                     plan, sample and verify a program: one call
    Plan                     what it returns: the motion, the verdict, what limits the motion and what the limits cost; it shows itself
                             in notebooks, plots, saves and reports itself (docs/python.md)
    methods                  the methods: a list of names that says what each is
    compare                  several methods on one program, judged by the same verifier
    verify                   any motion, from arrays, judged against a program and a machine
    stretched                a plan run evenly slower, to take a given time
    read_program, path       a program from a file, a text, or points
    Program                  its blocks
    Machine, load_machine    limits, interpolation period and tolerance of a machine, from a TOML file
    PathLimit, JointLimit    limits of your own; with corner shapes (PolynomialCorner) and methods (Method): docs/extending.md
    Reading                  how a program is read: what is refused, left out and assumed
    Toolpath                 the programmed path with its joints and tolerances
    Trajectory               the setpoints, one row per interpolation period
    Verdict                  the verifier's findings
    Trace                    what planning tried, step by step
    InputError               bad input; the message names file, line and column
    NotSolvedError           no motion was found; raised by `Plan.require`
    __version__

Units and symbols are in `planner.base.units`, words in docs/glossary.md, names of methods in
`planner.base.names`. Everything is imported on first use, so that `import planner` costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from planner.planning.job.shown import VIEWS

if TYPE_CHECKING:
    from planner.base.errors import InputError as InputError
    from planner.base.errors import NotSolvedError as NotSolvedError
    from planner.corners.own import PolynomialCorner as PolynomialCorner
    from planner.geometry.toolpath import Toolpath as Toolpath
    from planner.machine import Machine as Machine
    from planner.machine import load_machine as load_machine
    from planner.machine.user_limit import JointLimit as JointLimit
    from planner.machine.user_limit import PathLimit as PathLimit
    from planner.motion.trajectory import Trajectory as Trajectory
    from planner.nc.program import Program as Program
    from planner.nc.reader import read_program as read_program
    from planner.nc.reading import Reading as Reading
    from planner.planning.job.plan import Plan as Plan
    from planner.planning.job.trace import Trace as Trace
    from planner.planning.methods.listing import MethodNames as MethodNames
    from planner.planning.methods.registry import plan as plan
    from planner.planning.page import Method as Method
    from planner.report.compare import compare as compare
    from planner.report.interactive.points import path as path
    from planner.report.interactive.points import stretched as stretched
    from planner.report.interactive.points import verify as verify
    from planner.verifier import Verdict as Verdict

    __version__: str
    methods: MethodNames

# Where each public name is; the imports above say the same to type checkers.
_HOME = {
    "plan": "planner.planning.methods.registry",
    "Plan": "planner.planning.job.plan",
    "Trace": "planner.planning.job.trace",
    "JointLimit": "planner.machine.user_limit",
    "PathLimit": "planner.machine.user_limit",
    "PolynomialCorner": "planner.corners.own",
    "Method": "planner.planning.page",
    "methods": "planner.planning.methods.listing",
    "path": "planner.report.interactive.points",
    "stretched": "planner.report.interactive.points",
    "verify": "planner.report.interactive.points",
    "compare": "planner.report.compare",
    "Machine": "planner.machine",
    "load_machine": "planner.machine",
    "Program": "planner.nc.program",
    "read_program": "planner.nc.reader",
    "Reading": "planner.nc.reading",
    "Toolpath": "planner.geometry.toolpath",
    "Trajectory": "planner.motion.trajectory",
    "Verdict": "planner.verifier",
    "InputError": "planner.base.errors",
    "NotSolvedError": "planner.base.errors",
}

VIEWS.update(
    to_pandas="planner.report.interactive.page:plan_frame",
    plot="planner.report.interactive.page:PlanFigures",
    save="planner.report.interactive.page:save",
    report="planner.report.interactive.page:ReportPage",
    card="planner.report.interactive.page:plan_card",
)

__all__ = ["__version__", *_HOME]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return import_module("importlib.metadata").version("feedrate-planner")
    if name not in _HOME:
        raise AttributeError(f"module 'planner' has no attribute '{name}'")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
