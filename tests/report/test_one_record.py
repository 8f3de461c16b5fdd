"""Terminal, `summary.json`, picture, page, notebook and trajectory file say the same of a plan, on twelve kinds of job."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pytest
from rich.console import Console

import planner
from planner.machine import Machine, load_machine
from planner.planning.job.plan import Plan
from planner.report.export import write_plan
from planner.report.html.data import samples_of
from planner.report.html.saved import saved_plan
from planner.report.interactive.page import plan_card
from planner.report.profiles_figure import profiles_figure
from planner.report.rows import verdict_rows
from planner.report.tables import plan_table
from planner.report.trajectory_reader import read_trajectory
from planner.report.units import UNITS
from tests.quick import slow_but
from tests.report.html.columns import column

WORDS = {"none": "nothing", "rest": "dwells"}
TIMES = {"tool_change": 6.5, "spindle_start": 1.5, "spindle_stop": 0.75, "m_code": 0.25}
TILTING = {"type": "xyzac-trt", "y_offset": -18.0, "z_offset": 30.0, "tool_length": 55.0}
ROTARY = {"velocity": 150.0, "acceleration": 900.0, "jerk": 30000.0}
FILAMENT = {"velocity": 40.0, "acceleration": 3000.0, "jerk": 1e5}


class Kind(NamedTuple):
    """A kind of job: its program, what its machine has beside the mill's limits, axes beside the mill's, and by which method."""

    text: str
    more: Mapping[str, Any] = MappingProxyType({})
    axes: Mapping[str, Any] = MappingProxyType({})
    method: str = "second-order"


KINDS = {
    "mill": Kind("G21 F2400\nG1 X14 Y3\nX20 Y12\nG3 X8 Y20 R15\nG0 Z4\n", method="optimal"),
    "lathe": Kind("G21 G18 G7 F180\nG0 X24 Z1\nG1 X18\nZ-9\nX24 Z-12\nG0 Z1\n"),
    "laser": Kind("G21 M4 S400 F1800\nG1 X12\nS150 X18 Y4\nS0 X22\nM5\n"),
    "plot": Kind("IN;SP1;PU200,0;PD1400,0;PD1400,900;PU;PD0,900;PU;SP0;", {"plotter": {"pen_down": 0.03}}),
    "printer": Kind(
        "G21 M83\nG1 X12 E0.6 F1500\nY9 E0.4\nG1 E-1.2 F2100\nG0 X0\nG1 E1.2 F2100\n",
        axes={"e": FILAMENT},
        method="optimal",
    ),
    "tilting table": Kind(
        "G21 G90\nM428\nG1 X9 A4 C12 F900\nX18 Y4 A9 C35\nY15 A12 C50\nM429\n",
        {"kinematics": TILTING},
        {"a": ROTARY, "c": ROTARY},
    ),
    "rotary axis": Kind("G21 F900\nG1 X8 A30\nX15 A75\nA140\nX22\n", {}, {"a": ROTARY}),
    "nurbs": Kind("G21 G17 F1800\nG5.2 P1 L4\nX9 Y0\nX16 Y14 P2\nX-4 Y14\nX0 Y4\nG5.3\nG1 X-9\n"),
    "inch": Kind("G20 F60\nG1 X0.6 Y0.1\nX0.9 Y0.5\nG2 X0.4 Y0.9 R0.6\n", method="optimal"),
    "dwell": Kind("G21 F1500\nG1 X11\nG4 P0.4\nX20 Y6\nG4 P0.25\nX30\n"),
    "times": Kind("G21 T1 M6\nS900 M3\nF1200\nG1 X10\nM8\nX22 Y3\nM5\n", {"times": TIMES}),
    "drilling": Kind("G21 F240\nG99 G81 X4 Y4 Z-3 R2\nX12\nG83 X20 Z-5 R2 Q2\nG80\n"),
    "thread": Kind("G21 S240 M3\nG0 X9 Z3\nG33 Z-9 K1.25\nG0 X14\nZ3\nM5\n"),
}


def plan_of(kind: Kind, folder: Path) -> Plan:
    limits = load_machine("mill").model_dump(exclude_none=True)
    machine = Machine(**{**limits, **kind.more, "axes": {**limits["axes"], **kind.axes}})
    file = folder / ("job.plt" if kind.text.startswith("IN") else "job.ngc")
    file.write_text(kind.text)
    return planner.plan(planner.read_program(file, machine), machine, method=kind.method)


def terminal(plan: Plan) -> dict[str, str]:
    """Labels and texts as they are printed, at a width at which nothing is folded."""
    console = Console(width=5000, record=True, file=open("/dev/null", "w", encoding="utf-8"))  # noqa: SIM115
    console.print(plan_table(plan))
    lines = console.export_text().splitlines()[1:]
    console.file.close()
    wide = next(line.index(plan.sentence) for line in lines if line.startswith("solution"))
    return {line[:wide].strip(): line[wide:].strip() for line in lines if line[:wide].strip()}


@pytest.mark.shows("said", "sampled: twelve kinds of jobs")
@pytest.mark.parametrize("name", slow_but(("mill", "rotary axis", "times"), KINDS))
def test_everything_says_the_same(name: str, tmp_path: Path) -> None:
    plan = plan_of(KINDS[name], tmp_path)
    assert plan.trajectory is not None
    assert plan.verdict is not None
    assert plan.verdict.passed, plan.verdict.faults
    write_plan(plan, tmp_path / "out", report=True)
    said = json.loads((tmp_path / "out" / "summary.json").read_text())
    page = (tmp_path / "out" / "report.html").read_text()
    about = json.loads(re.search(r'id="about">(.*?)</script>', page, re.DOTALL).group(1))  # type: ignore[union-attr]
    read = read_trajectory(tmp_path / "out" / "trajectory.parquet").trajectory
    printed, told = terminal(plan), dict(said["told"])

    # Words: one list
    assert {label: text for label, text in told.items() if label} == {
        k: v for k, v in printed.items() if k in told
    }
    assert about["summary"]["told"] == said["told"]
    card = plan_card(plan)
    assert told["cycle time"] in card
    assert told["contour error"] in card

    # Times
    assert told["cycle time"].startswith(f"{said['cycle_time_s']:.4f} s")
    assert said["cycle_time_s"] == pytest.approx(read.t[-1], abs=2 * read.dt)
    beside = said["beside_motion"]
    assert beside["total_s"] == pytest.approx(said["cycle_time_s"] + beside["known_s"])
    assert ("total" in told) == any("because" not in one for one in beside["counted"])
    if "total" in told:
        assert told["total"].startswith(f"{beside['total_s']:.4f} s")
        assert told["beside the motion"].startswith(f"{beside['known_s']:g} s")
    if beside["dwell_s"]:
        assert told["of it dwells"] == f"{beside['dwell_s']:g} s"

    # Shares: the same whole per cents
    percents = {
        WORDS.get(limit, limit): math.floor(100 * share + 0.5) for limit, share in said["held_by"].items()
    }
    percents = {limit: percent for limit, percent in percents.items() if percent}
    assert told["held by"] == ", ".join(f"{limit} {percent} %" for limit, percent in percents.items())
    assert about["summary"]["held_by"] == said["held_by"]
    assert max(percents.values()) <= 100
    legend = [label.get_text() for label in profiles_figure(plan, UNITS["mm"]).legends[0].get_texts()]
    assert [label.partition(" (")[0] for label in legend] == [
        f"{one} {percent} %" for one, percent in percents.items()
    ][:7]
    for limit, percent in [*percents.items()][:5]:
        assert f"{limit} {percent} %" in card

    # The feed: what F means, in the file, on the page and in its table
    feed, highest = column(page, "feed", "<f4"), column(page, "line_highest", "<f4")
    assert feed.max() == pytest.approx(read.feed.max(), rel=1e-6)
    assert highest.max() >= feed.max() * (1 - 1e-6)
    programmed = column(page, "programmed", "<f4")
    cut = np.isfinite(programmed)
    assert (feed[cut] <= 1.002 * programmed[cut] + 1e-3).all()
    assert (feed[cut] > 0.9 * programmed[cut]).any() or name in ("printer", "plot", "drilling")

    # The file, judged anew
    again = saved_plan(tmp_path / "out")[0].verdict
    assert again is not None
    rows = dict(verdict_rows(again))
    # of rows in between setpoints, which the plan has pieces for: within what the verdict knows of it
    missed = [float(one["corners missed by"].removesuffix(" µm")) for one in (rows, told)]
    assert missed[0] == pytest.approx(missed[1], abs=5e-3)
    if plan.joints is None:  # from setpoints of the joints alone a corner at the tip cannot be looked at
        assert rows["corners"].partition(";")[0] == told["corners"].partition(";")[0]


def test_the_feed_of_a_tilting_table_is_that_of_the_tip(tmp_path: Path) -> None:
    """F900 is 15 mm/s at the tip, whatever the axes turn; where only an axis turns, F is in degrees per minute."""
    plan = plan_of(KINDS["tilting table"], tmp_path)
    assert plan.trajectory is not None
    table = samples_of(plan)
    tip = np.linalg.norm(plan.trajectory.velocity[:, :3], axis=1)
    assert plan.trajectory.feed.max() > 2 * 15.0, "the length in all axes goes faster"
    np.testing.assert_allclose(table.feed, tip, rtol=1e-9)
    assert np.median(table.feed) == pytest.approx(15.0, rel=0.01)
    turning = plan_of(KINDS["rotary axis"], tmp_path)
    assert turning.trajectory is not None
    table, alone = samples_of(turning), turning.program.line[turning.trajectory.block] == 4
    assert np.unique(table.programmed[alone]) == pytest.approx([15.0]), "deg/s"
    assert table.feed[alone].max() == pytest.approx(15.0, rel=0.01)
    degrees = np.gradient(
        np.rad2deg(turning.trajectory.position[:, 3] / turning.machine.radius), turning.trajectory.t
    )
    np.testing.assert_allclose(table.feed[alone][5:-5], np.abs(degrees[alone])[5:-5], rtol=0.02, atol=0.05)
