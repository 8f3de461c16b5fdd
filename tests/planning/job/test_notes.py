"""What a plan says of what it assumed and gave up."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.feedrate.reachability import Reachability
from planner.feedrate.sampling.samples import sample_path
from planner.geometry.build import toolpath_from_program
from planner.geometry.toolpath import Joint
from planner.machine import Machine, load_machine
from planner.nc.reader import parse_program
from planner.planning.job.notes import TOLERANCE_OF_PART, job_notes
from planner.planning.methods.stop import StopMethod
from planner.planning.optimal.notes import noted, path_notes
from planner.planning.optimal.on_path import OnPath
from planner.planning.optimal.order import second_order

MACHINE = load_machine("mill")
SQUARE = "G21 F3000\nG1 X40\nY40\nX0\nY0"


def notes(text: str, machine: Machine = MACHINE, tolerance: float | None = None) -> list[str]:
    program = parse_program(text, machine)
    return job_notes(program, machine, toolpath_from_program(program, machine, tolerance))


def test_an_ordinary_job_needs_no_note() -> None:
    assert notes(SQUARE) == []


@pytest.mark.parametrize("text", [SQUARE, "G21 F3000\nG3 X0 Y0 I-20", "G21 F99\nG0 X900\nG1 X940\nY40"])
def test_a_tolerance_large_beside_the_part_is_noted(text: str) -> None:
    assert notes(text, tolerance=TOLERANCE_OF_PART * 40.0 * 0.999) == []
    (said,) = notes(text, tolerance=1000.0)
    assert "the tolerance of 1000 mm is 25 times the part's largest extent, 40 mm" in said
    assert "line 2: the tolerance of 1 mm" in notes("G21 G64 P1 F99\nG1 X10\nY10")[0]


def test_feeds_above_the_machines_are_noted() -> None:
    slow = MACHINE.model_copy(update={"feed_max": 20.0})
    text = "G21 F600\nG1 X40\nF3000 Y40\nX0\nY0"
    assert notes(text, slow) == [
        "line 3: F above the machine's feed_max is planned at 1200 mm/min (3 blocks, up to F3000)"
    ]


def test_every_method_carries_the_readers_notes() -> None:
    program = parse_program("F3000\nG1 X40\nY40", MACHINE)
    plan = StopMethod().plan(program, MACHINE)
    assert plan.notes == program.notes == ("line 2: no G20 or G21 before the first move: mm",)


def test_what_a_path_gives_up_is_noted() -> None:
    machine = load_machine("router")
    program = parse_program("G21 F3000\nG1 X10\nY10\nX20\nY20\nX30", machine)
    toolpath = toolpath_from_program(program, machine)

    def solved(stops: list[int]) -> OnPath:
        path = round_corners(toolpath.with_joints(stops, Joint.STOP), machine, BezierCorner())
        return second_order(path, sample_path(path, machine), machine, Reachability())

    whole = solved([])
    assert path_notes(toolpath, noted(toolpath, whole)) == []
    assert path_notes(toolpath, noted(toolpath, solved([2]))) == [
        "line 3: a full stop where no smooth curve was found inside the tolerance"
    ]
    assert path_notes(toolpath, noted(toolpath, solved([2, 4])))[0].startswith(
        "line 3: the first of 2 full stops"
    )

    stays = np.arange(len(toolpath) + 1) != 2  # elsewhere another motion is delivered
    assert path_notes(toolpath, noted(toolpath, solved([2])), stays) == []
    assert path_notes(toolpath, noted(toolpath, solved([2, 4])), stays)[0].startswith("line 5: a full stop")

    still = np.flatnonzero(whole.samples.segment == 3)[1]
    feed_sq = whole.solution.feed_sq.copy()
    feed_sq[still] = 0.0
    stuck = dataclasses.replace(whole, solution=dataclasses.replace(whole.solution, feed_sq=feed_sq))
    assert path_notes(toolpath, noted(toolpath, stuck), np.arange(len(toolpath) + 1) < 4) == []
    assert path_notes(toolpath, noted(toolpath, stuck)) == [
        "line 5: a full stop where the solver did not converge"
    ]

    d = whole.path.d.copy()
    d[1] = 0.0
    sharp = dataclasses.replace(whole, path=dataclasses.replace(whole.path, d=d))
    assert path_notes(toolpath, noted(toolpath, sharp)) == [
        "line 2: a corner not rounded: there is no room for it"
    ]
