"""The rule with two nodes for the joints of dense chords (planner/baselines/fir/rules.py), against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from planner.baselines.fir import rules
from planner.baselines.fir.guide import Line

T1, T2, SPEED = 0.02, 0.013, 30.0
ACCELERATION = np.array([500.0, 800.0])


def dense(corner: np.ndarray, at: int) -> tuple[float, float, float]:
    """Error [mm], largest ratio of the axes' accelerations, acceleration [mm/s2] at a corner of a polyline (N+1, 2)."""
    step = np.diff(corner, axis=0)
    length = np.linalg.norm(step, axis=1)
    line = Line(
        s=np.append(0.0, np.cumsum(length)), point=corner, direction=step / length[:, None],
        budget=np.ones(len(corner)), inner=np.ones(len(corner), dtype=bool),
    )  # fmt: skip
    return rules.at_speed_dense.py_func(at, (0, len(corner) - 1), SPEED, line, ACCELERATION, T1, T2)


def uneven(count: int = 61) -> np.ndarray:
    """Numbers from -1 to 1 with unequal steps, 0 in their middle."""
    u = np.linspace(-1.0, 1.0, count)
    return u + 0.004 * np.sin(40.0 * u)


def test_a_straight_line_is_not_missed_wherever_its_nodes_are() -> None:
    found = dense(np.outer(uneven(), [3.0, 4.0]), 30)
    assert found == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


@pytest.mark.parametrize("radius", [20.0, 200.0])
def test_a_circle_is_missed_by_the_error_of_paper_001(radius: float) -> None:
    """E = V^2 kappa (T1^2 + T2^2)/24, with the acceleration V^2 kappa to its centre; chords turn by a little more or less."""
    angle = uneven(2001) * 2.0 / radius
    error, over, acceleration = dense(radius * np.column_stack([np.sin(angle), 1.0 - np.cos(angle)]), 1000)
    assert error == pytest.approx(SPEED**2 / radius * (T1**2 + T2**2) / 24.0, rel=1e-3)
    assert acceleration == pytest.approx(SPEED**2 / radius, rel=1e-3)
    assert over == pytest.approx(acceleration / ACCELERATION[1], rel=1e-3)
