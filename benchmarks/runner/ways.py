"""Ways to plan a job, by their names.

METHOD[/CORNER][:EFFORT]    a method of the planner: optimal, optimal:quick, optimal/bezier, second-order/spline, kinematic, ...
a name of `PEERS`           another solver (peers.py); its motion is judged as the planner's are. Those along the planner's splines
                            (sequential-convex, copp, copp-lp) take :EFFORT too, for its grid
a name of `grids.WAYS`      method optimal on a grid of its own (grids.py)
a name of `MODELS`          a model of a control's planner: a time, no motion
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import planner
from benchmarks.runner import grids, linuxcnc, peers
from benchmarks.runner.judged import Judged
from benchmarks.runner.rows import METHOD, MODEL, PEER
from planner.base.errors import InputError
from planner.base.names import EFFORTS, METHODS, SMOOTHINGS, known_name, users_of
from planner.machine import Machine
from planner.nc.program import Program
from planner.planning.job.plan import Plan

Made = Plan | Judged | float  # a plan, another one's motion, or a predicted time [s]


@dataclass(frozen=True, kw_only=True)
class Way:
    """A way to plan a job.

    kind : "method", "peer" or "model"
    plan : called with program, machine and tolerance (None for the program's or the machine's)
    """

    name: str
    kind: str
    plan: Callable[[Program, Machine, float | None], Made]


PEERS: dict[str, Callable[[Program, Machine, float | None], Made]] = {
    "toppra": peers.toppra,
    **{name: peers.along_splines(name) for name in peers.ALONG_SPLINES},
    "ruckig": peers.ruckig,
    "linuxcnc": linuxcnc.linuxcnc,
    "ipopt": peers.tube_by("ipopt"),
    "fatrop": peers.tube_by("fatrop"),
}
MODELS = {f"{name} (model)": peers.modelled(name) for name in ("linuxcnc", "grbl", "klipper", "marlin")}


def way_of(name: str) -> Way:
    """The way of a name. Raises InputError for a name that is none, or for a corner or an effort that is none."""
    if name in PEERS:
        return Way(name=name, kind=PEER, plan=PEERS[name])
    if name in MODELS:
        return Way(name=name, kind=MODEL, plan=MODELS[name])
    if name in grids.WAYS:
        return Way(name=name, kind=METHOD, plan=grids.WAYS[name])
    left, _, effort = name.partition(":")
    method, _, corner = left.partition("/")
    known_name("method, peer or model", method, (*METHODS, *PEERS, *MODELS))
    if effort:
        known_name("effort", effort, EFFORTS)
    if effort and left in peers.ALONG_SPLINES:
        return Way(name=name, kind=PEER, plan=peers.along_splines(name))
    if corner:
        known_name("corner", corner, SMOOTHINGS)
    if (corner or effort) and method not in users_of("effort"):
        raise InputError(
            f"{name}: method {method} has no corner and no effort; {', '.join(users_of('effort'))} have"
        )
    return Way(name=name, kind=METHOD, plan=_planned(method, corner, effort))


def _planned(method: str, corner: str, effort: str) -> Callable[[Program, Machine, float | None], Made]:
    def planned(program: Program, machine: Machine, tolerance: float | None) -> Made:
        return planner.plan(
            program, machine, method=method, tolerance=tolerance, corner=corner or None, effort=effort or None
        )

    return planned
