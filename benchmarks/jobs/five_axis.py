"""The S-shaped five-axis test piece of suite `five-axis`, in the manner of ISO 10791-7.

The piece is a ruled surface between two S-shaped curves, milled by the flank: the tip runs along the lower one, the tool along the
rulings, which lean to one side, pass the vertical in the middle and lean to the other. It is generated here from the formulas of
`s_piece`; the standard's control points are not copied.
"""

from __future__ import annotations

import numpy as np

from planner.base.arrays import FloatArray
from planner.machine import Machine

LENGTH, WIDTH, LEAN = 160.0, 30.0, 0.25  # of the S, half of its width [mm], largest lean of the rulings [rad]
FEED, TOLERANCE = 150.0, 0.01  # [mm/s], [mm]


def machine() -> Machine:
    """A tilting rotary table with a tool of 80 mm."""

    def limits(velocity: float, acceleration: float, jerk: float) -> dict[str, float]:
        return {"velocity": velocity, "acceleration": acceleration, "jerk": jerk}

    return Machine(
        name="trunnion",
        dt=0.001,
        tolerance=TOLERANCE,
        axes={
            "x": limits(400.0, 4000.0, 80000.0),
            "y": limits(400.0, 4000.0, 80000.0),
            "z": limits(300.0, 3000.0, 60000.0),
            "a": limits(120.0, 1200.0, 24000.0),
            "c": limits(240.0, 2400.0, 48000.0),
        },
        kinematics={"type": "xyzac-trt", "z_rot_point": -60.0, "z_offset": 20.0, "tool_length": 80.0},
    )


def s_piece(points: int) -> tuple[FloatArray, FloatArray]:
    """(n, 3) tips [mm] and (n, 3) directions of the tool for n = `points`."""
    t = np.linspace(-1.0, 1.0, points)
    x, y = 0.5 * LENGTH * t, WIDTH * np.sin(np.pi * t)
    slope = WIDTH * np.pi * np.cos(np.pi * t) / (0.5 * LENGTH)
    across = np.stack([-slope, np.ones(points)], axis=1) / np.hypot(1.0, slope)[:, None]
    lean = LEAN * np.sin(0.5 * np.pi * t)
    direction = np.stack([np.sin(lean) * across[:, 0], np.sin(lean) * across[:, 1], np.cos(lean)], axis=1)
    return np.stack([x, y, 5.0 * t**2], axis=1), direction
