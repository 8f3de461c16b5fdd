"""Laws of the campaign: what a changed job is, and what is promised of it."""

from __future__ import annotations

import numpy as np
import pytest
from campaign_program import MACHINE, TEXT

from benchmarks.campaign.course import course
from benchmarks.campaign.judge import matched
from benchmarks.campaign.laws import (
    ALLOWED,
    broken,
    changed,
    holds,
    looser,
    mirrored,
    reversed_program,
    scaled,
    scaled_machine,
    split,
)
from benchmarks.campaign.rows import blocks_of
from planner.geometry.build import toolpath_from_program
from planner.nc.reader import parse_program
from planner.planning.methods.registry import plan


@pytest.mark.parametrize("change", ["mirrored", "reversed", "scaled"])
def test_laws_keep_the_time_of_full_stops(change: str) -> None:
    """The time of the method `stop` is a sum over blocks, so that a wrongly changed program shows."""
    text = TEXT.replace("G61\n", "").replace("G64\n", "")
    program, machine = parse_program(text, MACHINE), MACHINE
    before = plan(program, machine, method="stop").cycle_time
    if change == "mirrored":
        program = mirrored(program)
    elif change == "reversed":
        program = reversed_program(program)
    else:
        program, machine = scaled(program, 3.0), scaled_machine(machine, 3.0)
    after = plan(program, machine, method="stop")
    assert after.verdict is not None
    assert after.verdict.passed
    assert after.cycle_time == pytest.approx(before, abs=10 * machine.dt)


def test_on_the_way_back_every_joint_keeps_its_tolerance() -> None:
    """Found by the campaign itself: a dwell took the tolerance of what came before it, and the first joint that of the last block."""
    text = "G21 F600\nG64 P0.002\nG1 X1\nG64 P0.01\nG4 P0.1\nG1 X2 Y1\nG64 P0.03\nG1 X4\nG1 X5 Y2\nM2\n"
    program = parse_program(text, MACHINE)
    there, back = (
        toolpath_from_program(one, MACHINE).tolerance for one in (program, reversed_program(program))
    )
    np.testing.assert_array_equal(there, [0.002, 0.002, 0.01, 0.03, 0.03])
    np.testing.assert_array_equal(back, there[::-1])
    other = parse_program(text.replace("G1 X5", "G64 P0.05\nG1 X5"), MACHINE)
    laws = {
        made.law
        for seed in range(40)
        if (made := changed(other, MACHINE, None, np.random.default_rng(seed))) is not None
    }
    assert "reverse" not in laws  # the last block has a tolerance of its own
    assert {"mirror", "scale", "split"} <= laws


@pytest.mark.parametrize("law", ["looser feed", "looser velocity", "looser acceleration", "looser jerk"])
@pytest.mark.parametrize("method", ["fir-plain", "fir-spline-plain", "fir", "fir-spline"])
def test_only_filters_as_in_the_papers_get_longer_with_a_limit(method: str, law: str) -> None:
    """Short blocks that reach no limit but that of the filters: what a larger V or A does to V/A and A/J is all that it does."""
    feed = 60000 if law == "looser velocity" else 3000
    text = f"G1 X0.3 Y0.1 F{feed}\nG1 X0.6 Y0\nG1 X0.9 Y0.1\nM2\n"
    program, machine = parse_program(text, MACHINE), MACHINE
    before = plan(program, machine, method=method).cycle_time
    other = looser(program, machine, None, law.removeprefix("looser "), 2.0)
    after = plan(other.program, other.machine, method=method).cycle_time
    assert holds(law, method) == (broken(other, before, after, machine.dt) == 0)


@pytest.mark.parametrize("seed", range(3))
def test_a_line_as_two_is_the_same_path(seed: int) -> None:
    program = parse_program(TEXT, MACHINE)
    other = split(program, np.random.default_rng(seed))
    assert other is not None
    assert len(other) == len(program) + 1
    before, after = (course(blocks_of(one, MACHINE, ("x", "y", "z"), None)) for one in (program, other))
    off = matched(before.points, after, np.full(len(after.block), 1e-9))
    assert off[1] == ""
    found = plan(other, MACHINE, method="second-order")
    assert found.cycle_time <= plan(program, MACHINE, method="second-order").cycle_time * (1 + ALLOWED)
