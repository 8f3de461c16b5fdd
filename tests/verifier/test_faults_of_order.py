"""Blocks left out, repeated or run the wrong way, stops and dwells: each fault is found, and named with its line."""

import numpy as np
import pytest
from judging import SQUARE, M, fault, full_circle, judge, square
from motions import JERK_FREE, Moves, chain, machine, polyline, rounded, stay

from planner.nc.program import PathControl
from planner.verifier import Kind


def test_a_skipped_block_is_named():
    motion = polyline([SQUARE[0], SQUARE[1], SQUARE[2], SQUARE[4]], jerk=2e5)
    verdict = judge(motion, square())
    assert "line 30" in fault(verdict, "vertex")
    assert "lost after line 30" in fault(verdict, "order")
    assert verdict.vertex_error_mm is None


def test_swapped_blocks_are_found():
    """Out and back along x, then along y: run in the other order everything is visited, in the wrong order."""
    toolpath = Moves().line(5).line(0).line(0, 5).line(0, 0).toolpath(M)
    right = [(0, 0, 0), (5, 0, 0), (0, 0, 0), (0, 5, 0), (0, 0, 0)]
    assert judge(polyline(right, jerk=2e5), toolpath).passed
    wrong = [(0, 0, 0), (0, 5, 0), (0, 0, 0), (5, 0, 0), (0, 0, 0)]
    verdict = judge(polyline(wrong, jerk=2e5), toolpath)
    assert Kind.ORDER in verdict.kinds
    assert "line 10" in fault(verdict, "vertex")


def test_a_missing_full_circle_is_found():
    toolpath = Moves().line(10).arc((0, 0), 2 * np.pi).line(20).toolpath(M)
    legs = [polyline([(0, 0, 0), (10, 0, 0)], jerk=2e5), polyline([(10, 0, 0), (20, 0, 0)], jerk=2e5)]
    right = judge(chain(legs[0], full_circle(), legs[1]), toolpath)
    assert right.passed, right.faults
    verdict = judge(chain(*legs), toolpath)
    assert "1 blocks are not run to their end, line 20" in fault(verdict, "order")


def test_a_circle_run_the_wrong_way_is_found():
    toolpath = Moves((10.0, 0, 0)).arc((0, 0), 2 * np.pi).toolpath(M)
    verdict = judge(full_circle(sweep=-2 * np.pi), toolpath)
    assert Kind.ORDER in verdict.kinds
    assert "line 10" in fault(verdict, "vertex")


def test_one_turn_of_two_is_found():
    toolpath = Moves((10.0, 0, 0)).arc((0, 0), 4 * np.pi).toolpath(M)
    assert judge(full_circle(sweep=4 * np.pi), toolpath).passed
    verdict = judge(full_circle(), toolpath)
    assert "1 blocks are not run to their end, line 10" in fault(verdict, "order")


@pytest.mark.slow
def test_a_turn_left_out_of_a_dense_spiral_is_found():
    """The turns are 0.02 mm apart, closer than the budget of 0.05 mm: only the order can tell."""
    angle = np.linspace(0, 8 * np.pi, 801)
    radius = 5 + 0.02 * angle / (2 * np.pi)
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle], 1)
    moves = Moves(tuple(points[0]))
    for p in points[1:]:
        moves.line(*p)
    toolpath = moves.toolpath(M)
    kept = np.vstack([points[:301], points[501:]])
    verdict = judge(polyline(kept), toolpath, not_limited=JERK_FREE)
    assert Kind.ORDER in verdict.kinds
    fault(verdict, "order")


def test_a_repeated_block_is_found():
    again = [SQUARE[0], SQUARE[1], SQUARE[0], *SQUARE[1:]]
    verdict = judge(polyline(again, jerk=2e5), square())
    assert Kind.ORDER in verdict.kinds
    assert "lost after line 10" in fault(verdict, "order")
    assert verdict.lost_after == 10
    assert (
        verdict.contour_error_mm is None
    )  # it is on the path all the time, and up to 10 mm from where it should be


def test_a_missing_end_is_found():
    verdict = judge(polyline(SQUARE[:-1], jerk=2e5), square())
    assert "line 40" in fault(verdict, "end")
    assert "line 40" in fault(verdict, "vertex")
    assert verdict.end_error_mm == pytest.approx(10.0)
    assert Kind.ORDER in verdict.kinds


def test_an_end_short_by_twenty_picometres_is_found_and_by_five_passes():
    for short, passes in ((2e-8, False), (5e-9, True)):
        points = [*SQUARE[:-1], (0, 20 - short, 0)]
        verdict = judge(polyline(points, jerk=2e5), square())
        assert verdict.passed is passes, verdict.faults
        assert verdict.end_error_mm == pytest.approx(short, rel=1e-5)


def test_a_wrong_start_is_found():
    verdict = judge(polyline([(0.01, 0, 0), *SQUARE[1:]], jerk=2e5), square())
    assert "line 10" in fault(verdict, "start")
    assert verdict.end_error_mm == pytest.approx(0.01)


def test_a_motion_elsewhere_is_found_in_reasonable_time():
    far = [(x + 500.0, y, z) for x, y, z in SQUARE]
    verdict = judge(polyline(far, jerk=2e5), square())
    assert verdict.contour_error_mm is None
    assert verdict.vertex_error_mm is None
    assert verdict.lost_after == 10
    assert Kind.ORDER in verdict.kinds
    assert verdict.summary()["contour_error_mm"] is None


# ---- stops and dwells ------------------------------------------------------------------------------------------------


def test_a_dwell_cut_short_is_found():
    toolpath = Moves().line(5).dwell(0.05).line(5, 5).toolpath(M)
    legs = [polyline([(0, 0, 0), (5, 0, 0)], jerk=2e5), polyline([(5, 0, 0), (5, 5, 0)], jerk=2e5)]
    assert judge(chain(legs[0], stay((5, 0, 0), 0.05), legs[1]), toolpath).passed
    verdict = judge(chain(legs[0], stay((5, 0, 0), 0.045), legs[1]), toolpath)
    assert "line 10" in fault(verdict, "dwell")
    assert "0.05 s" in fault(verdict, "dwell")


def test_a_dwell_at_the_wrong_place_is_found():
    toolpath = Moves().line(5).dwell(0.05).line(5, 5).toolpath(M)
    legs = [polyline([(0, 0, 0), (5, 0, 0)], jerk=2e5), polyline([(5, 0, 0), (5, 5, 0)], jerk=2e5)]
    verdict = judge(chain(legs[0], legs[1], stay((5, 5, 0), 0.05)), toolpath)
    assert "line 10" in fault(verdict, "dwell")


def test_a_stop_run_through_is_found():
    toolpath = Moves().line(10, control=PathControl.EXACT_STOP).line(20).toolpath(M)
    verdict = judge(polyline([(0, 0, 0), (20, 0, 0)], jerk=2e5), toolpath)
    assert "line 10" in fault(verdict, "stop")
    assert len(verdict.faults) == 2  # by the samples and between them


def test_a_stop_that_is_rounded_is_found():
    """The corner is within the budget, but exact stop allows none."""
    points = SQUARE[:3]
    toolpath = Moves().line(*points[1], control=PathControl.EXACT_STOP).line(*points[2]).toolpath(M)
    assert judge(polyline(points, jerk=2e5), toolpath).passed
    verdict = judge(rounded(points, 0.03, 5.0), toolpath, not_limited=JERK_FREE)
    assert any("line 10" in text for text in verdict.sentences if text.startswith("stop"))


def test_a_stop_before_the_vertex_is_found():
    """Paper 003's undershoot: at rest, but 0.01 mm before the programmed point."""
    points = [(0, 0, 0), (9.99, 0, 0), (3, 0, 0)]
    toolpath = Moves().line(10, control=PathControl.EXACT_STOP).line(3).toolpath(M)
    verdict = judge(polyline(points, jerk=2e5), toolpath)
    assert "line 10" in fault(verdict, "stop")


@pytest.mark.parametrize(("tolerance", "in_order"), [(0.72, False), (0.8, True)])
def test_vertices_that_are_near_in_the_wrong_order_are_found(tolerance: float, in_order: bool) -> None:
    """Found by the campaign of random jobs: a motion that cut a zigzag came within the tolerance of all of it, but of the second
    vertex before the first. Here it leaves the second one's tolerance at 0.31 of a move and enters the first one's at 0.48 of it."""
    wide = machine(tolerance=tolerance, fir={"time_constants": [1e-3]})  # which change next to nothing of it
    toolpath = Moves().line(10, 10).line(10, 8.5).line(15, 13).toolpath(wide)
    motion = polyline([(0, 0, 0), (9.6, 9.0, 0), (10.2, 9.6, 0), (15, 13, 0)], jerk=2e5)
    verdict = judge(motion, toolpath, wide)
    assert verdict.vertex.ratio < 1
    assert verdict.contour.ratio < 1
    assert (Kind.ORDER not in verdict.kinds) == in_order
    assert any("not in its order" in str(said) for said in verdict.after_filters.faults) != in_order
    if not in_order:
        assert fault(verdict, "order").startswith(
            "order: the motion is near enough to all of the path, but not in its order, at the end of line 20"
        )
