"""The times at which joints are passed, as the checks of threads and of the extruder ask for them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from planner.verifier.findings import joint_times


@pytest.mark.parametrize(
    ("near_time", "times"),
    [
        ([0.0, 1.0, 0.5, 2.0], [0.0, 1.0, 2.0]),  # the vertex within a block is none of the joints
        ([0.0, 1.5, 2.5, 2.0], [0.0, 1.5, 2.0]),
        ([0.0, 3.0, 3.5, 2.0], [0.0, 3.0, 3.0]),  # come by once more after the joint behind was passed
        ([0.0, 1.0, 0.0, 0.0], [0.0, 1.0, 1.0]),  # never reached
    ],
)
def test_joints_are_passed_in_order(near_time: list[float], times: list[float]) -> None:
    reading: Any = SimpleNamespace(match=SimpleNamespace(passed={"near_time": np.array(near_time)}))
    pieces: Any = SimpleNamespace(joint={"real": np.array([True, True, False, True])})
    assert joint_times(reading, pieces).tolist() == times
