"""Figures are made from any plan; peaks survive the thinning."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hand_made import make_plan
from matplotlib.figure import Figure
from quick import slow_but

from planner.report import plots, profiles_figure
from planner.report.units import UNITS

PROGRAMS = {
    "flat": "G21 G90 G17\nF3000\nG1 X10\nY10\nX0\nY0\nM2\n",
    "solid": "G21 G90 G17\nF3000\nG1 X10\nY10 Z5\nX0\nY0 Z9\nM2\n",
    "rapids": "G21 G90 G17\nF3000\nG0 X5\nG1 X10\nY10\nG0 X0\nY0\nM2\n",
    "one line along x": "G21 G90 G17\nF3000\nG1 X10\nM2\n",
    "upright": "G21 G90 G17\nF3000\nG1 Z-4\nX1\nM2\n",
}


@pytest.mark.slow
@pytest.mark.parametrize("name", slow_but("flat", PROGRAMS))
def test_figures(tmp_path: Path, name: str) -> None:
    plots.write_figures(make_plan(PROGRAMS[name]), tmp_path)
    for file in ("toolpath.png", "profiles.png"):
        assert (tmp_path / file).read_bytes().startswith(b"\x89PNG")


def test_profiles_show_limits_and_what_limits() -> None:
    plan = make_plan()
    figure = profiles_figure.profiles_figure(plan, UNITS["mm"])
    labels = [axes.get_ylabel().split("\n")[0] for axes in figure.axes]
    assert len(labels) == 2 + 2 * 2  # feed, band, and two moving axes
    said = [label.get_text() for label in figure.legends[0].get_texts()]
    assert said == ["acceleration.y 70 %", "feed 25 %", "nothing 3 %", "dwells 2 %"], "as in the terminal"
    limit = plan.machine.axes["x"].acceleration * 1e-3
    heights = {float(line.get_ydata()[0]) for line in figure.axes[2].lines}  # type: ignore[index, arg-type]
    assert {limit, -limit} <= heights


def test_a_plan_without_a_grid_has_no_band() -> None:
    plan = make_plan()
    plan.grid = None
    assert len(profiles_figure.profiles_figure(plan, UNITS["mm"]).axes) == 1 + 2 * 2


@pytest.mark.shows("pictures", "sampled: no peak is lost, colours are told apart")
def test_the_envelope_keeps_every_peak() -> None:
    values = np.zeros(1_000_000)
    values[[123_456, 654_321]] = 7.0, -5.0
    axes = Figure().add_subplot()
    profiles_figure.draw_profile(axes, np.linspace(0.0, 1.0, len(values)), values, "black")
    drawn = axes.collections[0].get_paths()[0].vertices
    assert drawn[:, 1].max() == 7.0
    assert drawn[:, 1].min() == -5.0
    assert len(drawn) < 3 * profiles_figure.COLUMNS


@pytest.mark.usual_sizes
def test_thinning_keeps_the_ends_and_stays_within_a_pixel() -> None:
    angle = np.linspace(0.0, 2 * np.pi, 500_000)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    keep = plots.one_per_pixel(circle, 2.0)
    assert keep[0] == 0
    assert keep[-1] == len(circle) - 1
    assert len(keep) < 8 * plots.PIXELS
    assert np.linalg.norm(np.diff(circle[keep], axis=0), axis=1).max() < 2.0 * 1.5 / plots.PIXELS


def test_the_constraint_that_fills_a_column_wins() -> None:
    t = np.array([0.0, 0.5, 0.5 + 1e-9, 1.0])
    kinds = profiles_figure.majority(t, np.array([0, 1, 2]), 3, 1.0)
    half = profiles_figure.COLUMNS // 2
    assert (kinds[:half] == 0).all()
    assert (kinds[half:] == 2).all()
