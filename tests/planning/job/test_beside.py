"""What takes time beside the motion: counted by hand, and by a spindle followed step by step."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from planner.base.errors import InputError
from planner.machine import Times, load_machine, machine_from_dict
from planner.nc.program import Program
from planner.nc.reader import parse_program
from planner.planning.job.beside import beside_motion
from planner.report.rows import beside_rows
from planner.report.summary import beside_summary

MILL = load_machine("mill")


def program(*lines: str) -> Program:
    return parse_program("\n".join(["G21 G90 F600", *lines]), MILL)


def counted(*lines: str, times: Times | None = None) -> dict[str, tuple[int, float | None]]:
    machine = MILL.model_copy(update={"times": times})
    return {it.what: (it.count, it.each) for it in beside_motion(program(*lines), machine)}


@pytest.mark.shows("beside", "exact: counted by hand, and a spindle followed step by step")
def test_counted_by_hand() -> None:
    lines = (
        "T1 M6",
        "S900 M3 M8",
        "G1 X9",
        "M4",
        "X0",
        "M5 M9",
        "M3",
        "T2 M6",
        "M3 M8",
        "X5",
        "M0",
        "M5",
        "M5",
        "M62 P1",
        "M30",
    )
    times = Times(tool_change=8.0, spindle_start=2.0, m_code=0.1, m_codes={"m08": 0.5})
    assert counted(*lines, times=times) == {
        "tool change": (2, 8.0),
        "spindle start": (4, 2.0),  # M3, its reversal M4, M3 after M5, M3 after the tool change
        "spindle stop": (3, None),  # the reversal, M5, M5; the tool change stops it in its own time, and the last M5 finds it standing
        "M0": (1, None),
        "M8": (2, 0.5),
        "M9": (1, 0.1),
    }  # fmt: skip
    assert counted("G1 X1") == {}
    assert counted("M0", times=Times(m_code=1.0)) == {"M0": (1, None)}
    assert counted("M0", "M1", times=Times(m_codes={"M0": 30.0})) == {"M0": (1, 30.0), "M1": (1, None)}


@pytest.mark.shows("beside", "exact: counted by hand, and a spindle followed step by step")
@pytest.mark.parametrize("seed", range(20))
def test_a_spindle_followed_step_by_step(seed: int) -> None:
    codes = np.random.default_rng(seed).choice([3, 4, 5, 6, 8], 40)
    turning, starts, stops = 0, 0, 0
    for code in codes:
        if code in (3, 4):
            wanted = 1 if code == 3 else -1
            starts += wanted != turning
            stops += turning == -wanted
            turning = wanted
        elif code in (5, 6):
            stops += code == 5 and turning != 0
            turning = 0
    found = counted("S900", *(f"M{code}" for code in codes))
    assert found.get("spindle start", (0,))[0] == starts
    assert found.get("spindle stop", (0,))[0] == stops


def test_the_pen_of_a_plotter_is_no_spindle() -> None:
    drawing = parse_program("IN;SP1;PD400,0;PU;SP2;PD0,0;PU;", MILL, source="drawing.plt")
    machine = MILL.model_copy(update={"times": Times(tool_change=3.0)})
    assert [(it.what, it.count, it.each) for it in beside_motion(drawing, machine)] == [
        ("tool change", 2, 3.0)
    ]


def test_rows_and_numbers_add_up() -> None:
    job = program("M6", "M3", "G4 P1.5", "M8", "M0")
    machine = MILL.model_copy(update={"times": Times(tool_change=8.0, spindle_start=2.5)})
    beside = beside_motion(job, machine)
    assert beside_rows(beside, 100.0, 1.5) == [
        ("of it dwells", "1.5 s"),
        ("beside the motion", "10.5 s: 1 tool change of 8 s, 1 spindle start of 2.5 s"),
        ("total", "110.5000 s (1 min 50 s)"),
        ("not in the total", "1 M0 (waits for a person); 1 M8 (no time in the machine file)"),
    ]
    assert beside_rows(beside_motion(job, MILL), 1.0, 0.0)[0][0] == "not in the cycle time"
    plan: Any = SimpleNamespace(program=job, beside=beside, trajectory=SimpleNamespace(cycle_time=100.0))
    said = beside_summary(plan)
    assert (said["known_s"], said["total_s"], said["complete"], said["dwell_s"]) == (10.5, 110.5, False, 1.5)


def test_times_in_a_machine_file() -> None:
    data = MILL.model_dump(mode="json", exclude_none=True)
    assert machine_from_dict(data | {"times": {"m_codes": {"7": 1}}}).times == Times(m_codes={"M7": 1.0})
    for times, said in (
        ({"tool_chang": 3}, "times.tool_chang: unknown key (did you mean 'tool_change'?)"),
        ({"tool_change": -1}, "times.tool_change: "),
        ({"m_codes": {"M6": 1}}, "M6 has a key of its own: tool_change"),
        ({"m_codes": {"G4": 1}}, "'G4' is not an M code"),
    ):
        with pytest.raises(InputError) as fault:
            machine_from_dict(data | {"times": times})
        assert said in str(fault.value)
