"""What a plan shows of itself: a line, a card, figures, a table, files."""

from __future__ import annotations

import dataclasses
import html
import itertools
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import planner
from planner.nc.program import Kind
from planner.planning.job.plan import Plan

TEXT = "G21 F3000 (<script>)\nG1 X40 Y3\nG3 X40 Y33 J15\nG1 X0 Z-2\nG0 X0 Y0 Z0\n"


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("shown") / "job <b>.ngc"
    path.write_text(TEXT)
    return path


@pytest.fixture(scope="module")
def plan(file: Path) -> Plan:
    return planner.plan(file, "mill", effort="quick")


@pytest.fixture(scope="module")
def unsolved(plan: Plan) -> Plan:
    return dataclasses.replace(plan, trajectory=None, verdict=None, grid=None, sentence="no <way>")


def test_the_line_says_what_was_planned(plan: Plan, unsolved: Plan) -> None:
    assert repr(plan) == f"<Plan of job <b>.ngc on mill by optimal: {plan.cycle_time:.4f} s, passed>"
    assert repr(unsolved) == "<Plan of job <b>.ngc on mill by optimal: not solved>"
    assert plan.trajectory is not None
    assert plan.cycle_time == plan.trajectory.cycle_time


def test_records_are_lines_too(plan: Plan) -> None:
    assert plan.trajectory is not None
    assert repr(plan.verdict) == "<Verdict: passed>"
    count = f"{len(plan.trajectory):,}"
    assert repr(plan.trajectory) == (
        f"<Trajectory: {count} setpoints, axes x y z, dt 0.001 s, {plan.cycle_time:.4f} s>"
    )
    assert repr(plan.program).startswith("<Program ")
    assert repr(plan.prices).startswith("<PriceList: more would save feed ")
    (row,) = planner.compare(planner.path([[0, 0], [5, 0]], 20.0), "mill", ["stop"])
    assert repr(row) == f"<Row of stop: {row.cycle_time:.4f} s, passed>"
    far = planner.verify([0.0, 0.1], [[0, 9], [0, 9]], planner.path([[0, 0], [5, 0]], 20.0), "mill")
    assert repr(far).startswith("<Verdict: failed, ")
    assert repr(far).endswith(" more>")
    assert len(repr(far)) < 300


def test_without_a_motion_nothing_is_made_up(unsolved: Plan, tmp_path: Path) -> None:
    for ask in (
        lambda: unsolved.cycle_time,
        lambda: unsolved.plot,
        unsolved.to_pandas,
        unsolved.report,
        lambda: unsolved.save(tmp_path / "out"),
    ):
        with pytest.raises(planner.NotSolvedError, match="no <way>"):
            ask()
    assert not (tmp_path / "out").exists()
    assert "no &lt;way&gt;" in unsolved._repr_html_()


def test_the_card_is_well_formed_and_runs_nothing(plan: Plan) -> None:
    card = plan._repr_html_()
    tree = ElementTree.fromstring(card.replace("&nbsp;", " "))
    assert {one.tag.rpartition("}")[2] for one in tree.iter()} <= {
        *("div", "b", "table", "tr", "td", "span", "small", "ul", "li", "svg", "polyline", "code"),
    }
    assert "job &lt;b&gt;.ngc" in card
    assert f"{plan.cycle_time:.4f} s" in card
    assert len(card) < 100_000


def test_the_picture_is_the_motion(plan: Plan) -> None:
    tree = ElementTree.fromstring(plan._repr_html_().replace("&nbsp;", " "))
    lines = [one.attrib["points"] for one in tree.iter() if one.tag.endswith("polyline")]
    points = np.array([[float(x) for x in point.split(",")] for line in lines for point in line.split()])
    assert plan.trajectory is not None
    seen, true = np.ptp(points, axis=0), np.ptp(plan.trajectory.position[:, :2], axis=0)
    assert seen[0] / seen[1] == pytest.approx(true[0] / true[1], rel=1e-2)
    for one, next_one in itertools.pairwise(lines):
        assert one.split()[-1] == next_one.split()[0], "the lines of one colour join"


@pytest.mark.slow
def test_figures_hold_the_numbers_of_the_plan(plan: Plan) -> None:
    assert plan.trajectory is not None
    by_feed, by_limit = plan.plot.path(), plan.plot.path("limit")
    np.testing.assert_array_equal(by_feed.data[1].x, plan.trajectory.position[:, 0])
    shade, cut = by_feed.data[1].line.color, plan.program.kind[plan.trajectory.block] != Kind.RAPID
    np.testing.assert_array_equal(shade[cut], 60.0 * plan.trajectory.feed[cut])
    assert set(shade[~cut]) == {by_feed.data[1].line.cmin}, "grey"
    assert by_feed.data[1].line.cmax == pytest.approx(3000.0, rel=1e-3), "rapids do not stretch the scale"
    assert set(by_limit.data[1].line.colorbar.ticktext) >= {"nothing"}
    assert plan.plot.path(color="deviation").data[1].line.cmin == 0
    np.testing.assert_array_equal(plan.plot.feed("s").data[1].x, plan.trajectory.s)
    limits = [np.abs(trace.y).max() for trace in plan.plot.profiles().data[2:]]
    assert len(limits) == 9
    assert max(limits) <= 100.0 * (1 + 1e-6)
    with pytest.raises(planner.InputError, match=r"no colouring 'fed'; .*did you mean 'feed'"):
        plan.plot.path("fed")
    with pytest.raises(planner.InputError, match="no horizontal axis 'x'"):
        plan.plot.feed("x")  # type: ignore[arg-type]


def test_the_table_is_that_of_the_trajectory_file(plan: Plan, tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    (tmp_path / "out").mkdir()
    files = plan.save(tmp_path / "out", report=True)
    assert sorted(one.name for one in files) == [
        "planned.ngc",
        "program.ngc",
        "report.html",
        "summary.json",
        "trajectory.parquet",
    ]
    table = plan.to_pandas()
    pandas.testing.assert_frame_equal(table, pandas.read_parquet(tmp_path / "out" / "trajectory.parquet"))
    assert table.attrs["units"]["vx"] == "mm/s"


def test_without_pandas_the_table_says_what_to_install(plan: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(planner.InputError, match=r"feedrate-planner\[notebook\]"):
        plan.to_pandas()


def test_files_in_the_way_are_kept(plan: Plan, tmp_path: Path, file: Path) -> None:
    (tmp_path / "summary.json").write_text("mine")
    with pytest.raises(planner.InputError, match=r"summary\.json"):
        plan.save(tmp_path)
    (tmp_path / "report.html").write_text("mine")
    with pytest.raises(planner.InputError, match=r"report\.html"):
        plan.report().save(tmp_path / "report.html")
    assert file.read_text() == TEXT


def test_the_report_is_a_page(plan: Plan, tmp_path: Path) -> None:
    page = plan.report()
    assert page.save(tmp_path / "page.html").read_text(encoding="utf-8") == page.text
    assert html.escape(page.text) in page._repr_html_()


def test_the_methods_are_listed_and_made() -> None:
    assert list(planner.methods) == list(planner.base.names.METHODS)
    assert len(planner.methods) == len(list(planner.methods))
    assert "stop" in planner.methods
    assert all(planner.methods.about().values())
    assert "<td><b>tube</b></td>" in planner.methods._repr_html_()
    assert (
        planner.methods["kinematic"]
        .plan(planner.path([[0, 0], [5, 0]], 20.0), planner.load_machine("mill"))
        .solved
    )
    with pytest.raises(planner.InputError, match="did you mean 'stop'"):
        planner.methods["stopp"]


@pytest.mark.slow
def test_names_that_are_packages_too_stay_what_they_are() -> None:
    """In whatever order modules are imported."""
    code = (
        "import planner.verifier.judge, planner.feedrate.sampling.samples, planner.planning.methods.registry, planner, inspect\n"
        "assert callable(planner.verify) and callable(planner.path) and 'stop' in planner.methods\n"
        "assert planner.verifier.judge.verify is planner.verifier.verify is not planner.verify\n"
        "assert list(inspect.signature(planner.path).parameters) == ['points', 'feed', 'axes', 'tolerance', 'spline', "
        "'start_speed', 'end_speed']\n"
        "assert planner.__version__ and set(planner.__all__) <= set(dir(planner))\n"
        "for name in planner.__all__: getattr(planner, name)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
