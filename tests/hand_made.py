"""A plan made by hand: each line from rest to rest on a quintic, so that the files can be tested without a planner."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from planner.geometry.build import toolpath_from_program
from planner.machine import load_machine
from planner.motion.trajectory import Trajectory
from planner.nc.reader import parse_program
from planner.sensitivity.records import DearCorners, GridHistory, PriceList
from planner.verifier import Claims, CornerCheck, Fault, Kind, Known

SQUARE = "G21 G90 G17\nF3000\nG1 X10\nY10\nX0\nY0\nM2\n"

TOO_FAST = Fault(
    kind=Kind.LIMIT,
    name="velocity.y",
    found="101 mm/s, 1.01 of the limit 100 mm/s at t = 0.1 s, X10 Y0, line 3",
)
DEAR = DearCorners(
    line=np.array([7, 4]),
    position=np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]),
    theta=np.array([np.pi / 2, np.pi / 3]),
    price=np.array([-0.5, -0.25]),
    saved=np.array([0.0044, 0.00216]),
)
PRICES = PriceList(
    limits={"velocity.x": 0.0, "acceleration.y": -2e-5, "jerk.y": -3e-7},
    feed=-0.4,
    tolerance=-1.5,
    saved={"velocity.x": 0.0, "acceleration.y": 0.0381, "jerk.y": 1e-5, "feed": 0.05, "tolerance": 0.0131},
    corners=DEAR,
    ranges={"acceleration.y": (0.0381, 0.0381), "feed": (0.049, 0.051), "tolerance": (0.01, 0.0162)},
)


def trajectory_along(toolpath: Any, *, dt: float = 1e-3, time: float = 0.2) -> Trajectory:
    """Quintic motions of `time` seconds along each (straight) segment."""
    per = round(time / dt)
    u = np.arange(1, per + 1) / per
    shape = np.stack(
        [
            u**3 * (10 - 15 * u + 6 * u**2),
            30 * u**2 * (1 - u) ** 2 / time,
            60 * u * (1 - u) * (1 - 2 * u) / time**2,
            (60 - 360 * u + 360 * u**2) / time**3,
        ]
    )
    step = toolpath.end - toolpath.start
    levels = [np.einsum("t,ma->mta", row, step).reshape(-1, step.shape[1]) for row in shape]
    levels[0] += np.repeat(toolpath.start, per, axis=0)
    first = [toolpath.start[:1], *(np.zeros_like(toolpath.start[:1]) for _ in range(3))]
    position, velocity, acceleration, jerk = (np.vstack(pair) for pair in zip(first, levels, strict=True))
    return Trajectory(
        axes=toolpath.axes,
        dt=dt,
        t=np.arange(len(position)) * dt,
        position=position,
        velocity=velocity,
        acceleration=acceleration,
        jerk=jerk,
        s=np.append(0.0, np.cumsum(np.linalg.norm(np.diff(position, axis=0), axis=1))),
        feed=np.linalg.norm(velocity, axis=1),
        block=np.append(toolpath.block[0], np.repeat(toolpath.block, per)),
        line=np.append(toolpath.line[0], np.repeat(toolpath.line, per)),
    )


def make_verdict(*, passed: bool = True, turns: bool = True) -> Any:
    def check(ratio: float, limited: bool = True) -> Any:
        return SimpleNamespace(ratio=ratio, value=1.0, limit=1.0, limited=limited, line=3)

    return SimpleNamespace(
        passed=passed,
        limits={
            "velocity.x": check(0.5),
            "velocity.y": check(1.0000014),
            "acceleration.x": check(0.75),
            "jerk.x": check(3.5, limited=False),
        },
        claims=Claims(
            known={"velocity.x": Known.EXACT, "velocity.y": Known.EXACT, "contour error": Known.CERTIFIED},
            open_mm=1e-4,
        ),
        contour_error_mm=0.0123,
        linear_error_mm=None,
        vertex_error_mm=0.02,
        end_error_mm=0.0,
        corners=make_corners(turns=turns),
        after_filters=None,
        ringing=(),
        lost_after=None,
        notes=(),
        not_limited=("jerk",),
        faults=() if passed else (TOO_FAST,),
        sentences=[] if passed else [str(TOO_FAST)],
        summary=lambda: {
            "passed": passed,
            "limits": {"velocity.x": 0.5, "velocity.y": 1.0000014, "acceleration.x": 0.75, "jerk.x": 3.5},
            "contour_error_mm": 0.0123,
            "vertex_error_mm": 0.02,
            "end_error_mm": 0.0,
            "not_limited": ["jerk"],
            "faults": [] if passed else [str(TOO_FAST)],
        },
    )


def make_corners(*, turns: bool = True) -> CornerCheck:
    """Three corners of 90 degrees, at eq. 19, below it, and at a stop; or none."""
    feed, own = np.array([14.0, 13.0, 0.0]), np.array([14.0, 20.0, np.inf])
    columns = {
        "line": np.array([3, 4, 5]),
        "position": np.array([[10.0, 0.0, 0.0], [10.0, 10.0, 0.0], [0.0, 10.0, 0.0]]),
        "theta": np.full(3, np.pi / 2),
        "budget": np.full(3, 0.02),
        "time": np.array([0.2, 0.4, 0.6]),
        "feed_planned": feed,
        "feed_closed_form": own,
        "feed_paper": np.full(3, 10.0),
        "feed_programmed": np.full(3, 50.0),
        "speed_ratio": feed / own,
        "miss": np.array([0.015, 0.01, 0.0]),
        "chord_error": np.array([0.001, 0.001, 0.0]),
        "budget_ratio": np.array([0.8, 0.55, 0.0]),
        "delivered_speed": feed / own,
        "delivered_budget": np.array([0.75, 0.5, 0.0]),
    }
    return CornerCheck(**(columns if turns else {name: column[:0] for name, column in columns.items()}))


def make_plan(
    text: str = SQUARE,
    *,
    machine: str = "mill",
    passed: bool = True,
    solved: bool = True,
    turns: bool = True,
    prices: PriceList | None = None,
) -> Any:
    limits = load_machine(machine)
    program = parse_program(text, limits, source="square.ngc")
    toolpath = toolpath_from_program(program, limits)
    trajectory = trajectory_along(toolpath) if solved else None
    t = np.linspace(0.0, trajectory.cycle_time, 40) if trajectory is not None else np.zeros(2)
    return SimpleNamespace(
        method="second-order",
        geometry="corners",
        corner="bezier",
        solver="Reachability()",
        program=program,
        machine=limits,
        toolpath=toolpath,
        corners=make_corners(turns=turns) if solved else None,
        status=SimpleNamespace(name="OPTIMAL" if solved else "INFEASIBLE"),
        sentence="solved" if solved else "no feed satisfies all limits; loosen the tolerance",
        joints=None,
        trajectory=trajectory,
        verdict=make_verdict(passed=passed, turns=turns) if solved else None,
        stop_time=1.25,
        least_time=None,
        grid_points=40,
        grid=GridHistory(
            t=t,
            s=t,
            feed=t,
            active=np.arange(40) % 3,
            reached=np.eye(5, dtype=bool)[np.arange(40) % 3],
            active_names=("feed", "velocity.x", "acceleration.y", "none", "rest"),
            share=np.array([0.25, 0.002, 0.7, 0.03, 0.018]),
        )
        if solved
        else None,
        prices=prices,
        notes=program.notes,
        timings={"read": 0.01, "solve": 0.02},
        solved=solved,
        beside=(),
    )
