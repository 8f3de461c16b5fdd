"""The closed forms: against LinuxCNC, against the verifier's own, and their laws."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from planner.base.units import RAD_PER_DEG
from planner.machine.kinematics.chain import Chain
from planner.machine.parts import KinematicsData
from planner.verifier.joints import tip_and_direction
from tests.machine.kinematics import linuxcnc

POINT = {"x_rot_point": 12.0, "y_rot_point": -7.0, "z_rot_point": 31.0}
MACHINES = {
    "xyzac-trt": {"type": "xyzac-trt", **POINT, "y_offset": -20.0, "z_offset": 35.0},
    "xyzbc-trt": {"type": "xyzbc-trt", **POINT, "x_offset": 14.0, "z_offset": -25.0},
    "head-table b": {"type": "head-table", **POINT, "pivot_length": 150.0, "x_offset": 3.0},
    "head-table a": {"type": "head-table", "tilt": "a", "pivot_length": 150.0, "y_offset": -8.0},
    "head-head b": {"type": "head-head", "pivot_length": 250.0},
    "head-head a": {
        "type": "head-head",
        "tilt": "a",
        "pivot_length": 120.0,
        "x_offset": 9.0,
        "reversed": ["c"],
    },
}
LENGTH = 63.0


def chain(name: str, length: float = LENGTH) -> Chain:
    return Chain(data=KinematicsData(**MACHINES[name]), length=length)


def places(found: Chain, count: int = 50, seed: int = 0) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    spread = {letter: rng.uniform(-100, 100, count) for letter in "xyz"}
    return spread | {letter: rng.uniform(-3, 3, count) for letter in found.data.rotary}


def table(found: Chain, place: dict[str, np.ndarray]) -> np.ndarray:
    return np.stack([place[letter] for letter in found.axes], axis=1)


@pytest.mark.shows("tool-point", "compared: LinuxCNC's kinematics, where they are installed")
@pytest.mark.parametrize("name", ["xyzac-trt", "xyzbc-trt", "head-head b"])
def test_joints_are_those_of_linuxcnc(name: str, tmp_path: Path) -> None:
    """Its component in a process of its own: 5axiskins is head-head with b reversed, its pivot and tool in one length."""
    component = {"head-head b": "5axiskins"}.get(name, f"{name}-kins")
    if reason := linuxcnc.missing(component):
        pytest.skip(reason)
    settings = dict(MACHINES[name])
    pins = {k.replace("_", "-"): v for k, v in settings.items() if k != "type"}
    if name == "head-head b":
        settings["reversed"], pins = ["b"], {"pivot-length": 250.0 + LENGTH}
    else:
        pins["tool-offset"] = LENGTH
    found = Chain(data=KinematicsData(**settings), length=LENGTH)
    place = places(found)
    poses = np.stack([place.get(letter, np.zeros(50)) for letter in "xyzabc"], axis=1)
    poses[:, 3:] /= RAD_PER_DEG
    np.save(tmp_path / "poses.npy", poses)
    code = (
        "import numpy as np, pathlib; from tests.machine.kinematics.linuxcnc import Component\n"
        f"p = pathlib.Path({str(tmp_path)!r}); c = Component({component!r}, p, {pins!r})\n"
        "np.save(p / 'joints.npy', [c.joints(pose) for pose in np.load(p / 'poses.npy')])"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
    theirs = np.load(tmp_path / "joints.npy")[:, :3]
    ours = np.stack([found.joints(place)[letter] for letter in "xyz"], axis=1)
    np.testing.assert_allclose(ours, theirs, atol=1e-10)


@pytest.mark.parametrize("name", MACHINES)
def test_the_point_of_the_joints_is_the_point(name: str) -> None:
    found = chain(name)
    place = places(found)
    back = found.point(place | found.joints(place))
    for letter in "xyz":
        np.testing.assert_allclose(back[letter], place[letter], atol=1e-11)


@pytest.mark.parametrize("name", MACHINES)
def test_the_verifier_finds_the_same_point_and_direction(name: str) -> None:
    found = chain(name)
    place = places(found)
    tip, direction = tip_and_direction(
        found.data, LENGTH, found.axes, table(found, place | found.joints(place))
    )
    np.testing.assert_allclose(tip, table(found, place)[:, :3], atol=1e-11)
    ours = np.stack(np.broadcast_arrays(*found.direction(place)), axis=1)
    np.testing.assert_allclose(direction, ours, atol=1e-14)


@pytest.mark.parametrize("name", MACHINES)
def test_tips_of_long_and_short_tools_lie_on_the_direction(name: str) -> None:
    """With the joints held, a tool longer by 10 has its tip 10 further against the direction: joints, lengths and direction agree."""
    found, longer = chain(name), chain(name, LENGTH + 10.0)
    place = places(found)
    joints = place | found.joints(place)
    tips = []
    for one, length in ((found, LENGTH), (longer, LENGTH + 10.0)):
        tip = one.point(joints)
        tips.append(np.stack([tip["x"], tip["y"], tip["z"] - length], axis=1))
    up = np.stack(np.broadcast_arrays(*found.direction(place)), axis=1)
    np.testing.assert_allclose(tips[0] - tips[1], 10.0 * up, atol=1e-10)


@pytest.mark.parametrize("name", MACHINES)
def test_joints_are_the_point_where_no_axis_is_turned(name: str) -> None:
    found = chain(name)
    place = places(found) | {letter: np.zeros(50) for letter in found.data.rotary}
    for letter, q in found.joints(place).items():
        np.testing.assert_allclose(q, place[letter], atol=1e-11)


@pytest.mark.parametrize("name", MACHINES)
def test_both_pairs_of_angles_give_the_direction(name: str) -> None:
    found = chain(name)
    unit = np.random.default_rng(1).normal(size=(40, 3))
    unit /= np.linalg.norm(unit, axis=1)[:, None]
    unit[0], unit[1] = (0, 0, 1), (0, 0, -1)
    pairs = found.angles(unit)
    tilt, turn = found.data.rotary
    for k in range(2):
        seen = found.direction({tilt: pairs[:, k, 0], turn: pairs[:, k, 1]})
        np.testing.assert_allclose(np.stack(np.broadcast_arrays(*seen), axis=1), unit, atol=1e-14)
    assert (pairs[2:, 0] != pairs[2:, 1]).all()
    assert (np.abs(pairs[:, :, 1]) <= np.pi + 1e-12).all()


def test_a_point_on_the_axis_of_the_table_needs_no_linear_motion() -> None:
    found = chain("xyzac-trt", 0.0)
    place = {"x": 12.0, "y": -7.0, "z": 5.0, "a": 0.0, "c": np.linspace(0.0, 6.0, 20)}
    q = found.joints(place)
    for letter, value in (("x", 12.0), ("y", -7.0), ("z", 5.0)):
        np.testing.assert_allclose(q[letter], value, atol=1e-13)
