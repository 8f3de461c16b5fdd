"""The registry of every name that a user may type: methods, geometries, corners, solvers, aliases.

The command line makes its choices from these tables, `planner.planning.methods.registry` makes the methods,
and the messages name them. Nothing heavy is imported here: a method is named by its module and class, which
`planner.planning.methods.registry` imports when it is asked for.

To add a method: its module in `planner/planning/methods/` and a row of `METHODS`.
"""

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from planner.base.errors import InputError

OPTIMAL, SECOND_ORDER = "optimal", "second-order"
# How the programmed path becomes a smooth one.
AUTO, SPLINE, SINGLE_CORNERS = "auto", "spline", "corners"
GEOMETRIES = (AUTO, SPLINE, SINGLE_CORNERS)
# The shapes of single corners.
BEZIER, FIR, KINEMATIC = "bezier", "fir", "kinematic"
CORNER_SHAPES = (BEZIER, FIR, KINEMATIC)
# Every way to smooth a path, as `corner` of a method takes it: splines, or a shape of single corners.
SMOOTHINGS = (AUTO, SPLINE, *CORNER_SHAPES)
# How much work a plan is worth (planning/optimal/effort.py).
QUICK, NORMAL, BEST = "quick", "normal", "best"
EFFORTS = (QUICK, NORMAL, BEST)


@dataclass(frozen=True, kw_only=True)
class MethodName:
    """A method as the registry knows it.

    home     : "module:class" of the method
    settings : arguments of the class that the name stands for
    solvers  : names of the solvers that it can use, the default first; empty where it has no choice
    shapes   : whether it takes a geometry, a corner shape, an effort, and `shaped`
    joints   : whether it keeps limits of joints, and others that are functions of the place
    """

    home: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    solvers: tuple[str, ...] = ()
    shapes: bool = False
    joints: bool = False


_FIR_SPLINE = "planner.planning.methods.fir_spline:FirSplineMethod"
_OF_SEARCH = ("own", "ipopt", "fatrop")
METHODS: dict[str, MethodName] = {
    OPTIMAL: MethodName(
        home="planner.planning.methods.optimal:OptimalMethod",
        shapes=True,
        joints=True,
        solvers=_OF_SEARCH,
    ),
    SECOND_ORDER: MethodName(
        home="planner.planning.methods.second_order:SecondOrderMethod",
        shapes=True,
        joints=True,
        solvers=("reachability", "toppra"),
    ),
    "bezier": MethodName(home="planner.planning.methods.bezier:BezierMethod", joints=True),
    "kinematic": MethodName(home="planner.planning.methods.kinematic:KinematicMethod"),
    "fir": MethodName(home="planner.planning.methods.fir:FirMethod"),
    "fir-plain": MethodName(home="planner.planning.methods.fir:FirMethod", settings={"plain": True}),
    "fir-spline": MethodName(home=_FIR_SPLINE),
    "fir-spline-plain": MethodName(home=_FIR_SPLINE, settings={"plain": True}),
    "tube": MethodName(home="planner.planning.methods.tube:TubeMethod", joints=True, solvers=_OF_SEARCH),
    "stop": MethodName(home="planner.planning.methods.stop:StopMethod"),
}
# Names of earlier versions, which keep working.
METHOD_ALIASES = {"toppra": SECOND_ORDER}
SOLVERS = tuple(dict.fromkeys(solver for method in METHODS.values() for solver in method.solvers))
# Settings of `planner.plan` that only methods of `shapes` use.
OF_SHAPES = ("geometry", "corner", "effort", "shaped")
OF_SEARCH = {"smooth": (OPTIMAL,)}  # and those of the joint search, with the methods that have them


def method_name(name: str) -> str:
    """The method's present name. Raises InputError for a name that is neither a method nor an alias."""
    return known_name("method", METHOD_ALIASES.get(name, name), METHODS, METHOD_ALIASES)


def corner_name(name: str) -> str:
    """The name of a corner shape, or `auto` or `spline`, which are geometries and were corners in earlier
    versions. Raises InputError for another name."""
    return name if name in (AUTO, SPLINE) else known_name("corner shape", name, CORNER_SHAPES)


def users_of(setting: str) -> tuple[str, ...]:
    """Names of the methods that use a setting of `planner.plan`."""
    if setting == "solver":
        return tuple(name for name, method in METHODS.items() if method.solvers)
    if setting in OF_SEARCH:
        return OF_SEARCH[setting]
    assert setting in OF_SHAPES
    return tuple(name for name, method in METHODS.items() if method.shapes)


def smoothing(geometry: str | None, corner: str | None) -> tuple[str, str | None]:
    """The geometry, and the shape of single corners where it is `corners`; None: nothing was asked for.

    A corner shape alone means single corners of that shape, `corners` alone Bezier corners; `auto` and
    `spline` are taken as corners too. Raises InputError for unknown names, and for a corner shape beside
    splines.
    """
    geometry = None if geometry is None else known_name("geometry", geometry, GEOMETRIES)
    corner = None if corner is None else corner_name(corner)
    if corner in (AUTO, SPLINE):
        if geometry not in (None, corner):
            raise InputError(f"corner = {corner} is a geometry, and geometry = {geometry} is another")
        return corner, None
    if corner is None:
        return geometry or AUTO, BEZIER if geometry == SINGLE_CORNERS else None
    if geometry in (AUTO, SPLINE):
        said = f"corner = {corner} is a shape of single corners, and geometry {geometry} smooths the path by splines"
        raise InputError(f"{said}; use geometry {SINGLE_CORNERS}")
    return SINGLE_CORNERS, corner


def known_name(kind: str, name: str, names: Iterable[str], aliases: Iterable[str] = ()) -> str:
    """The name, if it is one of `names`; else raises InputError, with a near one of these or `aliases`."""
    if name in (known := tuple(names)):
        return name
    near = difflib.get_close_matches(str(name), (*known, *aliases), n=1)
    hint = f" (did you mean '{near[0]}'?)" if near else ""
    raise InputError(f"no {kind} '{name}'; there are {', '.join(known)}{hint}")
