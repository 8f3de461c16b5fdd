"""`planner time`: closed forms, the controls' planners block by block as an oracle, what is told per tool, operation and layer."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import planner
from benchmarks.controls.control_planners import buffered
from planner.controls.timing.linuxcnc import NORMAL
from planner.controls.timing.models import CONTROLS, chords, predicted_times
from planner.controls.timing.times import TIMED, control_named, control_times
from planner.machine import Machine

AXIS = {"velocity": 100.0, "acceleration": 2000.0, "jerk": 200000.0}
AXES = dict.fromkeys("xyz", AXIS)
MACHINE = Machine(name="m", dt=0.001, tolerance=0.05, axes=AXES)
JOB = """%
(MADE BY HAND)
G21 G90 G94
N10 (2D POCKET1)
T3 M6
G0 X0 Y0 Z5
G1 Z-1 F300
X40 F1200
(2D CONTOUR2)
Y30
G4 P0.5
N90 (DRILL)
T7 M6
G1 X0
M2
%
"""


def time_of(text: str, control: str, machine: Machine = MACHINE) -> float:
    return control_times(planner.read_program(text=text), machine, control).seconds


@pytest.mark.parametrize("control", TIMED)
def test_parts_add_up(control: str) -> None:
    """Tools and operations have all of the time, in the order of the program; Z5 to Z-1 at 5 mm/s takes 1.2 s at least."""
    found = control_times(planner.read_program(text=JOB), MACHINE, control)
    assert list(found.tools) == ["T3", "T7"]
    assert list(found.operations) == ["2D POCKET1", "2D CONTOUR2", "DRILL"]
    assert found.layers == {}
    for parts in (found.tools, found.operations):
        assert sum(parts.values()) == pytest.approx(found.seconds)
    assert found.dwells == 0.5
    assert found.operations["2D POCKET1"] > 1.2 + 2.0
    assert found.operations["2D CONTOUR2"] == pytest.approx(0.5 + 1.5, abs=0.05)


@pytest.mark.parametrize("control", TIMED)
def test_slower_machines_take_longer(control: str) -> None:
    slow = Machine(
        name="m", dt=0.001, tolerance=0.05, axes={c: AXIS | {"acceleration": 200.0} for c in "xyz"}
    )
    assert time_of(JOB, control, slow) > time_of(JOB, control)
    by = Machine(name="m", dt=0.001, tolerance=0.05, axes=AXES, control={"name": control, "factor": 1.1})
    motion = time_of(JOB, control) - 0.5
    assert time_of(JOB, control, by) == pytest.approx(1.1 * motion + 0.5), (
        "a factor is of the motion, not of dwells"
    )


def test_layers_and_types_of_a_print() -> None:
    text = "G21 G90 M83\nF1200\n;LAYER:0\n;TYPE:SKIRT\nG1 X10\n;TYPE:FILL\nG1 Y10\n;LAYER:1\nG1 X0\n"
    found = control_times(planner.read_program(text=text), MACHINE, "marlin")
    assert list(found.layers) == ["layer 0", "layer 1"]
    assert list(found.operations) == ["SKIRT", "FILL"]
    assert sum(found.layers.values()) == pytest.approx(found.seconds)
    prusa = text.replace(";LAYER:0", ";LAYER_CHANGE").replace(";LAYER:1", ";LAYER_CHANGE")
    assert list(control_times(planner.read_program(text=prusa), MACHINE, "klipper").layers) == [
        "layer 1",
        "layer 2",
    ]


def test_rapids_of_printers_go_at_the_feed_in_force() -> None:
    """Klipper and Marlin move 60 mm with G0 at F600 in 6 s; grbl and LinuxCNC at 100 mm/s. A word on the line counts for it."""
    text = "G21\nG1 X1 F600\nG0 X61\n"
    assert time_of(text, "klipper") == pytest.approx(6.1, abs=0.02)
    assert time_of(text, "marlin") == pytest.approx(6.1, abs=0.02)
    for control in ("grbl", "linuxcnc"):
        assert time_of(text, control) == pytest.approx(0.1 + 0.6, abs=0.11)
    assert time_of("G20\nG1 X1 F60\nG0 X2 F120\n", "klipper") == pytest.approx(1.5, abs=0.04), (
        "inches a minute"
    )


def test_arcs_are_cut_as_the_controls_cut_them() -> None:
    """grbl: floor(r phi / 2 (t (2 r - t))^(1/2)) with t = 0.002 mm; Klipper: 1 mm; Marlin: 1 mm, and 72 in a turn."""
    sweep, radius = np.array([np.pi]), np.array([10.0])
    length = sweep * radius
    assert chords(CONTROLS["grbl"], length, sweep, radius) == [int(5 * np.pi / np.sqrt(0.002 * 19.998))]
    assert chords(CONTROLS["klipper"], length, sweep, radius) == [31]
    assert chords(CONTROLS["marlin"], length, sweep, radius) == [36]
    assert chords(CONTROLS["klipper"], length / 100, sweep, radius / 100) == [1]


def test_linuxcnc_passes_arcs_at_the_speed_of_their_radius() -> None:
    """A half circle of 2 mm between tangent lines: v^2 = N a r, and half of the acceleration along it."""
    found = control_times(
        planner.read_program(text="G21 F6000\nG1 X30\nG3 X30 Y4 J2\nG1 X0\n"), MACHINE, "linuxcnc", 0.05
    )
    v, leg, a = np.sqrt(NORMAL * 2000 * 2.0), 30.0, 2000.0
    legs = [leg / 100 + 100 / (2 * s) + (100 - v) ** 2 / (2 * 100 * s) for s in (a, 0.5 * a)]
    assert found.seconds == pytest.approx(sum(legs) + 2 * np.pi / v, rel=0.03)
    assert found.moves == 3


def test_linuxcnc_stands_between_rapids_and_feed_moves() -> None:
    text = "G21 G64 P0.05 F6000\nG1 X30\n{} X60\nG1 X90\n"
    a, v = 2000.0, 100.0
    stops = 3 * (30 / v + v / a) + v / a  # the last move with half of the acceleration
    assert time_of(text.format("G0"), "linuxcnc") == pytest.approx(stops)
    assert time_of(text.format("G1"), "linuxcnc") < stops - 0.05


@pytest.mark.shows(
    "time-grbl, time-marlin", "sampled: random paths by block-by-block models of their buffers"
)
@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("way", ["grbl", "marlin", "jerk"])
def test_models_agree_with_the_planners_block_by_block(way: str, seed: int) -> None:
    """Random paths, long and short moves, stops: within 1 % of the buffers of grbl and Marlin."""
    rng = np.random.default_rng(seed)
    steps = np.cumsum(rng.normal(0, 0.3, (300, 3)), axis=0) * rng.choice([0.01, 0.3, 5.0], (300, 1))
    points = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
    feed, stop = rng.choice([10.0, 60.0, np.inf], 300), np.append(rng.random(300) < 0.02, True)
    jump = {"x": 8.0, "y": 6.0, "z": 0.4}
    name = "marlin" if way == "jerk" else way
    more = {"corner_jump": jump} if way == "jerk" else {}
    control = dataclasses.replace(CONTROLS[name], block_time=0.0, **more)
    limits = {"velocity": np.full(3, 100.0), "acceleration": np.full(3, 2000.0), "along": np.inf}
    limits |= {"deviation": control.junction_deviation, "jump": np.array([*jump.values()]) if more else None}
    times = predicted_times(points, feed, stop, MACHINE, ("x", "y", "z"), control)
    assert times.sum() == pytest.approx(buffered(name, points, feed, stop, limits), rel=0.01)


def test_wrong_inputs() -> None:
    with pytest.raises(
        planner.InputError, match="the machine names no control; give one: --control linuxcnc, grbl"
    ):
        control_named(None, MACHINE)
    reprap = Machine(name="m", dt=0.001, tolerance=0.05, axes=AXES, control={"name": "reprapfirmware"})
    with pytest.raises(planner.InputError, match="no model of reprapfirmware"):
        control_named(None, reprap)
    assert control_named("grbl", reprap) == "grbl"
    with pytest.raises(planner.InputError, match="no move"):
        control_times(planner.read_program(text="G21\nM2\n"), MACHINE, "grbl")
