"""The campaign's second judge finds what is wrong with a motion and nothing wrong with a good one; some jobs of the campaign."""

from __future__ import annotations

import numpy as np
import pytest

import planner
from benchmarks import campaign, campaign_jobs, campaign_judge

DT, SPEED = 0.001, 50.0
CORNER = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 10.0, 0.0]])


def smooth(share: np.ndarray) -> np.ndarray:
    """From 0 to 1, at rest at both ends with no acceleration."""
    return share**3 * (10.0 - 15.0 * share + 6.0 * share**2)


def motion() -> np.ndarray:
    """Both lines of the corner from rest to rest, 0.5 s each."""
    share = smooth(np.linspace(0.0, 1.0, 501))[:, None]
    first = CORNER[0] + share * (CORNER[1] - CORNER[0])
    return np.vstack([first, CORNER[1] + share[1:] * (CORNER[2] - CORNER[1])])


def judged(position: np.ndarray) -> list[str]:
    bounds = campaign_judge.Bounds(
        velocity=np.full(3, SPEED), acceleration=np.full(3, 300.0), jerk=np.full(3, 1e4)
    )
    way = campaign_judge.Way(
        points=[CORNER[:2], CORNER[1:]], tolerance=np.full(2, 0.01), feed=np.full(2, SPEED)
    )
    return campaign_judge.judged(position, DT, (CORNER[0], CORNER[2]), bounds, way)


def test_a_good_motion_has_no_fault() -> None:
    assert judged(motion()) == []


def bumped(at: int, by: float) -> np.ndarray:
    position = motion()
    position[at - 100 : at + 101, 2] += by * smooth(1.0 - np.abs(np.linspace(-1.0, 1.0, 201)))
    return position


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda: motion()[:-20], "last sample"),
        (lambda: np.delete(motion(), 250, axis=0), "acceleration"),
        (lambda: np.insert(motion(), 250, motion()[250], axis=0), "acceleration"),
        (lambda: bumped(250, 0.02), "from block"),
        (lambda: motion()[::2], "jerk"),
        (lambda: np.vstack([motion()[:501], motion()[:501][::-1]]), "last"),
        (lambda: np.vstack([motion(), motion()[::-1], motion()]), "from block"),
    ],
)
def test_a_wrong_motion_is_found(wrong, said: str) -> None:
    faults = judged(wrong())
    assert any(said in fault for fault in faults), faults


def test_chords_of_an_arc_are_near_it() -> None:
    start, end, center = np.array([5.0, 0.0, 0.0]), np.array([0.0, 5.0, 1.0]), np.zeros(3)
    points = campaign_judge.arc_points(start, end, center, 2, np.pi / 2, 0.01)
    assert np.allclose(np.hypot(points[:, 0], points[:, 1]), 5.0)
    middle = (points[1:] + points[:-1]) / 2
    assert 5.0 - np.hypot(middle[:, 0], middle[:, 1]).min() <= 0.01 * campaign_judge.SAGITTA
    assert np.allclose(points[-1], end)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 4, 9, 26, 31])
def test_a_job_of_the_campaign_passes_both_judges(seed: int) -> None:
    row = campaign.made(seed)
    assert row["status"] == campaign.PASSED, row
    assert row["second"] == []


@pytest.mark.slow
def test_full_stops_beside_a_block_as_short_as_the_tolerance_are_told_apart() -> None:
    """Two of them were taken for the same rest, and the run between them had no motion to begin from."""
    job = campaign_jobs.job(45)
    plan = planner.plan(job.program, job.machine, effort="quick")
    assert plan.verdict.passed


def test_the_same_number_makes_the_same_job() -> None:
    one, other = (campaign_jobs.job(7) for _ in range(2))
    assert one.text == other.text
    assert one.machine == other.machine
