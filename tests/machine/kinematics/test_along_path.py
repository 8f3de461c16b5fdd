"""Derivatives of the joints along a path, and kinematics of one's own: against casadi's automatic differentiation."""

from __future__ import annotations

import casadi
import numpy as np
import pytest

from planner.base.errors import InputError
from planner.machine.kinematics.chain import Chain, along
from planner.machine.kinematics.expression import expression
from planner.machine.parts import KinematicsData

casadi.GlobalOptions.setNumpyMode(-1)  # numpy's functions of its symbols stay symbols

CHAINS = (
    {"type": "xyzac-trt", "x_rot_point": 12.0, "y_offset": -20.0, "z_offset": 35.0},
    {"type": "xyzbc-trt", "y_rot_point": -7.0, "x_offset": 14.0},
    {"type": "head-table", "x_rot_point": 5.0, "pivot_length": 150.0},
    {"type": "head-head", "tilt": "a", "pivot_length": 120.0, "reversed": ["a"]},
)


def motion(axes: int, count: int = 30) -> np.ndarray:
    """Places and derivatives at random, with angles of a few rad."""
    rng = np.random.default_rng(3)
    size = np.array([50.0] * 3 + [2.0] * (axes - 3))
    return rng.normal(size=(4, count, axes)) * size


@pytest.mark.shows("tool-point", "exact: derivatives by casadi, circles by the table alone")
@pytest.mark.parametrize("data", CHAINS, ids=lambda data: data["type"])
def test_derivatives_are_those_of_casadi(data: dict) -> None:
    """Casadi differentiates q(p(t)) three times by t; both come from the same closed form, by different rules."""
    chain = Chain(data=KinematicsData(**data), length=40.0)
    given = motion(5)
    t, jet = casadi.SX.sym("t"), casadi.SX.sym("jet", 4, 5)
    place = {
        letter: jet[0, k] + jet[1, k] * t + jet[2, k] * t**2 / 2 + jet[3, k] * t**3 / 6
        for k, letter in enumerate(chain.axes)
    }
    joints = chain.joints(place)
    rows = []
    for letter in "xyz":
        value = joints[letter]
        for _ in range(4):
            rows.append(casadi.substitute(value, t, 0))
            value = casadi.jacobian(value, t)
    oracle = casadi.Function("oracle", [jet], rows)
    ours = along(chain.joints, chain.axes, given)
    for n in range(given.shape[1]):
        expected = np.array([float(v) for v in oracle(given[:, n])]).reshape(3, 4).T
        np.testing.assert_allclose(ours[:, n, :3], expected, rtol=1e-11, atol=1e-8)
    np.testing.assert_array_equal(ours[:, :, 3:], given[:, :, 3:])


def test_an_expression_is_the_closed_form_that_it_writes_down() -> None:
    """A head that tilts by b over a still table, pivot 80: head-head with c at 0."""
    mine = expression(
        "xyzb", lambda x, y, z, b: (x + 80.0 * casadi.sin(b), y, z - 80.0 + 80.0 * casadi.cos(b))
    )
    given = motion(4)
    turning = np.concatenate([given, np.zeros((4, 30, 1))], axis=2)
    chain = Chain(data=KinematicsData(type="head-head", pivot_length=80.0), length=0.0)
    np.testing.assert_allclose(
        along(mine.joints, mine.axes, given),
        along(chain.joints, chain.axes, turning)[:, :, :4],
        rtol=1e-11,
        atol=1e-8,
    )
    place = {letter: given[0, :, k] for k, letter in enumerate("xyzb")}
    np.testing.assert_allclose(mine.joints(place)["x"], given[0, :, 0] + 80 * np.sin(given[0, :, 3]))


@pytest.mark.parametrize(
    ("axes", "joints", "said"),
    [
        ("xyc", lambda x, y, c: (x, y, c), "x, y and z come first"),
        ("xyzq", lambda *p: p[:3], "x, y and z come first"),
        ("xyza", lambda *p: p[:2], "returns 2 joints"),
        ("xyza", lambda x, y, z, a: (x + casadi.SX.sym("other"), y, z), "symbols of the axes only"),
    ],
)
def test_what_is_no_expression_of_kinematics_is_refused(axes: str, joints, said: str) -> None:
    with pytest.raises(InputError, match=said):
        expression(axes, joints)


def test_places_without_derivatives_are_refused() -> None:
    rooted = expression("xyza", lambda x, y, z, a: (casadi.sqrt(x), y, z))
    with pytest.raises(InputError, match="no derivatives at place 0"):
        along(rooted.joints, rooted.axes, np.zeros((4, 1, 4)))
