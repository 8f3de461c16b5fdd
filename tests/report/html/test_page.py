"""The report: its columns against the plan, distances against another formula, and the page in a real browser."""

from __future__ import annotations

import hashlib
import json
import re
from base64 import b64encode
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import planner
from planner.base.errors import InputError
from planner.geometry.build import toolpath_from_program
from planner.geometry.distance import distance_near
from planner.machine import load_machine
from planner.nc.reader import parse_program
from planner.planning.job.plan import Plan
from planner.report.export import write_plan
from planner.report.html.data import lines_of, programmed_path, samples_of
from planner.report.html.page import report_page
from planner.report.html.saved import saved_plan
from tests.commands.command_line import run
from tests.report.html.columns import column
from tests.report.html.in_browser import opened, wait_for

JOB = "G21 F3000 (</script><script>document.title='ran'</script>)\nG1 X40 Y3\nG3 X40 Y33 J15\nG1 X0 Z-2\nG0 X0 Y0 Z0\n"
MILL = load_machine("mill")


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("report") / "job <b>.ngc"
    file.write_text(JOB)
    return file


@pytest.fixture(scope="module")
def plan(job: Path) -> Plan:
    return planner.plan(job, MILL, effort="quick")


@pytest.fixture(scope="module")
def page(plan: Plan) -> str:
    return report_page(plan)


@pytest.mark.usual_sizes
def test_columns_are_those_of_the_plan(page: str, plan: Plan) -> None:
    trajectory = plan.trajectory
    assert trajectory is not None
    assert np.array_equal(column(page, "t", "<f8"), trajectory.t)
    assert np.array_equal(column(page, "feed", "<f4"), trajectory.feed.astype(np.float32))
    assert np.array_equal(column(page, "jy", "<f4"), trajectory.jerk[:, 1].astype(np.float32))
    assert column(page, "program", "<u1").tobytes() == JOB.encode()
    about = json.loads(re.search(r'id="about">(.*?)</script>', page, re.DOTALL).group(1))  # type: ignore[union-attr]
    assert about["summary"]["cycle_time_s"] == trajectory.cycle_time
    assert about["limits"][-1] == "none"


@pytest.mark.usual_sizes
def test_places_of_an_expanded_program_name_their_calls(tmp_path: Path) -> None:
    file = tmp_path / "calls.ngc"
    file.write_text(
        "G21 F3000\no1 sub\nG1 X#1\no1 endsub\no2 sub\no1 call [9]\no2 endsub\nG1 Y5\no1 call [5]\no2 call\nM2\n"
    )
    plan = planner.plan(file, MILL, method="stop")
    page = report_page(plan)
    about = json.loads(re.search(r'id="about">(.*?)</script>', page, re.DOTALL).group(1))  # type: ignore[union-attr]
    frame = column(page, "frame", "<i4")
    assert plan.trajectory is not None
    places = [f"line {line}{about['calls'][k]}" for line, k in zip(plan.trajectory.line, frame, strict=True)]
    assert list(dict.fromkeys(places)) == [
        "line 8", "line 3 (1), called from line 9", "line 3 (1), called from line 6 (2), called from line 10",
    ]  # fmt: skip


def test_deviation_is_that_of_the_verdict(plan: Plan) -> None:
    assert plan.verdict is not None
    worst = float(samples_of(plan).deviation.max())
    assert plan.verdict.contour_error_mm is not None
    assert 0.5 * plan.verdict.contour_error_mm < worst <= plan.verdict.contour_error_mm + 1e-9


def test_times_of_lines_add_up(plan: Plan) -> None:
    assert plan.trajectory is not None
    lines = lines_of(plan, samples_of(plan))
    assert lines["line"].tolist() == [2, 3, 4, 5]
    assert lines["planned"].sum() == pytest.approx(plan.trajectory.cycle_time)
    assert np.isnan(lines["programmed"][-1])
    assert lines["programmed"][1] == pytest.approx(15.0 * np.pi / 50.0)
    assert (lines["planned"][:3] > lines["programmed"][:3] * (1.0 - 1e-2)).all()
    assert (lines["highest"][:3] <= 50.0 * (1 + 1e-9)).all()


def test_thinned_samples_keep_the_peaks(plan: Plan) -> None:
    every, few = samples_of(plan), samples_of(plan, most=200)
    assert few.step > 1
    assert len(few.shown) <= 300
    assert few.shown.feed.max() == every.shown.feed.max()
    assert few.shown.t[[0, -1]].tolist() == every.shown.t[[0, -1]].tolist()
    assert (np.diff(few.shown.t) > 0).all()


@pytest.mark.slow
def test_distances_from_lines_arcs_and_helices() -> None:
    text = "G21 F99\nG1 X10\nG3 X10 Y20 Z6 J10 P3\nG2 X30 Y20 I10\nG1 X40"
    toolpath = toolpath_from_program(parse_program(text, MILL), MILL, None)
    rng = np.random.default_rng(1)
    segment = rng.integers(0, len(toolpath), 200)
    point = toolpath.start[segment] + rng.normal(0.0, 3.0, (200, 3))
    fine = []
    for k in range(len(toolpath)):
        u = np.linspace(0.0, 1.0, 40_001)[:, None]
        if toolpath.arc[k] < 0:
            fine.append(toolpath.start[k] + u * (toolpath.end[k] - toolpath.start[k]))
            continue
        row, x = toolpath.arc[k], u * toolpath.length[k]
        angle = toolpath.arcs.rate[row] * x
        ring = np.cos(angle) * toolpath.arcs.e1[row] + np.sin(angle) * toolpath.arcs.e2[row]
        fine.append(
            toolpath.arcs.center[row] + toolpath.arcs.radius[row] * ring + toolpath.arcs.drift[row] * x
        )
    cloud = np.vstack(fine)
    expected = np.array([np.linalg.norm(cloud - one, axis=1).min() for one in point])
    found = distance_near(toolpath, point, segment)
    flat = toolpath.arcs.drift[:, 2] == 0.0
    assert flat.tolist() == [False, True]
    # On a helix the point at the same angle is not quite the nearest: its rise per mm bounds by how much.
    assert (found >= expected - 1e-5).all()  # expected: the nearest of many points
    assert (found <= expected * np.sqrt(1.0 + (toolpath.arcs.drift[0, 2]) ** 2) + 1e-3).all()


def test_distances_from_curves() -> None:
    toolpath = toolpath_from_program(
        parse_program("G21 F99\nG1 X10\nG5 I5 J5 P-5 Q8 X40 Y10", MILL), MILL, None
    )
    segment = np.flatnonzero(toolpath.curve >= 0)
    assert len(segment)
    rng = np.random.default_rng(2)
    shares = rng.random(len(segment))
    on = toolpath.curves.at(
        toolpath.curve[segment], toolpath.length[segment], shares * toolpath.length[segment]
    )[:, 0]
    assert distance_near(toolpath, on, segment).max() < 1e-6
    off = on + np.array([0.0, 0.0, 0.3])
    np.testing.assert_allclose(distance_near(toolpath, off, segment), 0.3, atol=1e-9)


def test_programmed_path_goes_through_the_vertices(plan: Plan) -> None:
    points = programmed_path(plan.toolpath)
    for vertex in plan.toolpath.end:
        assert np.linalg.norm(points - vertex, axis=1).min() < 1e-9


def test_a_plan_without_a_solution_profile_has_a_report(job: Path) -> None:
    stop = planner.plan(job, MILL, method="stop")
    assert stop.grid is None
    samples = samples_of(stop)
    assert set(samples.limits) - {"none"} <= {
        f"{q}.{a}" for q in ("velocity", "acceleration", "jerk") for a in "xyz"
    } | {"feed"}
    assert "column-t" in report_page(stop)


@pytest.mark.usual_sizes
def test_report_of_files_shows_the_same(tmp_path: Path, plan: Plan, page: str) -> None:
    write_plan(plan, tmp_path / "out", report=True)
    written = (tmp_path / "out" / "report.html").read_text("utf-8")
    again = run("report", tmp_path / "out", "-o", tmp_path / "again.html")
    assert again.exit_code == 0, again.output
    other = (tmp_path / "again.html").read_text("utf-8")
    for name in ("t", "feed", "deviation", "line_planned"):
        for shown in (written, other):
            assert np.array_equal(column(shown, name, "<u1"), column(page, name, "<u1"))
    assert (
        run("report", tmp_path / "out", "-o", tmp_path / "again.html").exit_code == 0
    )  # a report is replaced
    (tmp_path / "mine.html").write_text("mine")
    assert run("report", tmp_path / "out", "-o", tmp_path / "mine.html").exit_code == 2
    assert run("report", tmp_path).exit_code == 2
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    (tmp_path / "out" / "summary.json").write_text(json.dumps({**summary, "run_id": "other"}))
    with pytest.raises(InputError, match="of two runs"):
        saved_plan(tmp_path / "out")


def test_report_needs_a_directory(job: Path) -> None:
    refused = run("plan", job, "--report")
    assert refused.exit_code == 2
    assert "name one with -o DIR" in refused.output


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory, chromium: Any, page: str) -> Iterator[Any]:
    file = tmp_path_factory.mktemp("page") / "report.html"
    file.write_text(page, encoding="utf-8")
    with opened(chromium, file) as shown:
        yield shown


@pytest.mark.slow
def test_page_renders_in_a_browser(browser: Any, plan: Plan) -> None:
    assert plan.trajectory is not None
    assert browser.title == "job <b>.ngc · planned"  # as text: nothing of the program ran
    assert browser.execute_script("return document.querySelectorAll('#title b').length") == 0
    assert browser.execute_script("return report.state().samples") == len(plan.trajectory)
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
    first = browser.execute_script("return document.querySelector('#program .row').textContent")
    assert first == "1" + JOB.splitlines()[0]
    traces = "return document.getElementById('path').data.map((one) => one.x.length)"
    assert browser.execute_script(traces)[1] > 100


def test_a_page_names_the_scripts_that_it_may_run(page: str) -> None:
    """Each by the SHA-256 of its text, and those that the program brought with it are not among them."""
    (policy,) = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', page[:600])
    assert policy.startswith("default-src 'none'; script-src 'sha256-")
    named = set(re.findall(r"'sha256-([^']*)'", policy))
    texts = re.findall(r'<script(?: type="text/plain" id="plotly")?>(.*?)</script>', page, re.DOTALL)
    sums = {b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in texts}
    assert (len(texts), named) == (2, sums)
    assert not re.search(r"\son\w+=", page.partition("<body>")[2].partition('id="plotly"')[0])


@pytest.mark.slow
def test_a_browser_runs_nothing_else(chromium: Any, page: str, tmp_path: Path) -> None:
    file = tmp_path / "attacked.html"  # as if something of a program were taken for HTML
    attack = "<script>document.title = 'ran'</script><img src=x onerror=\"document.title = 'ran'\">"
    file.write_text(page.replace("<header>", f"{attack}<header>"), encoding="utf-8")
    with opened(chromium, file) as browser:
        assert browser.title == "job <b>.ngc · planned"
        said = [entry["message"] for entry in browser.get_log("browser")]
        assert sum("Content Security Policy" in one for one in said) >= 2, said


@pytest.mark.slow
def test_page_answers_to_clicks(browser: Any, plan: Plan) -> None:
    from selenium.webdriver.common.by import By

    browser.find_element(By.CSS_SELECTOR, "[data-colour=limit]").click()
    assert browser.execute_script("return report.state().colouring") == "limit"
    browser.find_element(By.CSS_SELECTOR, "[data-against=s]").click()
    assert browser.execute_script(
        "return document.getElementById('profile').layout.xaxis.title.text"
    ).startswith("length")
    browser.find_elements(By.CSS_SELECTOR, "#program .row")[3].click()
    assert browser.execute_script("return report.state().line") == 4
    assert plan.trajectory is not None
    line, feed = browser.execute_script("return document.getElementById('path').data[1].customdata[50]")[:2]
    there = plan.trajectory.line[50], 60.0 * plan.trajectory.feed[50]
    assert (line, feed) == pytest.approx(there, rel=1e-6)
    head = browser.find_elements(By.CSS_SELECTOR, "#lines-head button")
    head[2].click()  # planned time, the longest first
    rows = (
        "return [...document.querySelectorAll('#lines .row')].sort((a, b) => a.offsetTop - b.offsetTop)"
        ".map((row) => row.children[2].textContent)"
    )
    times = [float(text) for text in browser.execute_script(rows)]
    assert times == sorted(times, reverse=True)
    browser.execute_script("Plotly.relayout('profile', {'xaxis.range[0]': 1, 'xaxis.range[1]': 5})")
    first, last = wait_for(browser, "const r = report.state().range; return r[0] > 0 ? r : null")
    assert plan.trajectory.s[first] <= 1.0 <= 5.0 <= plan.trajectory.s[last]
    browser.execute_script("report.show(0)")
    browser.find_element(By.ID, "play").click()
    wait_for(browser, "return report.state().now > 0")
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []


def test_lines_and_places_have_their_prices(page: str, plan: Plan) -> None:
    assert plan.prices is not None
    assert plan.prices.places is not None
    places, lines = plan.prices.places, lines_of(plan, samples_of(plan))
    assert lines["more_feed"].sum() == pytest.approx(places.feed.sum())
    assert lines["more"].sum() == pytest.approx(places.limits.sum())
    assert np.array_equal(column(page, "line_more", "<f4"), lines["more"].astype(np.float32))
    assert places.tolerance is not None
    price = column(page, "price", "<f4")
    assert price.max() == pytest.approx(-places.tolerance.min(), rel=1e-6)
    assert (price == 0).any(), "far from joints there is none"


def test_the_first_picture_needs_no_script(page: str) -> None:
    before = page.partition('id="plotly"')[0]
    assert before.count("<polyline") > 1
    assert (
        page.index("<svg")
        < page.index('<script type="text/plain" id="plotly">')
        < page.index('id="column-t"')
    )


@pytest.mark.slow
def test_the_picture_stands_there_before_plotly(browser: Any) -> None:
    marks = browser.execute_script("return performance.getEntriesByType('mark').map((one) => one.name)")
    assert marks == ["first picture", "plotly", "columns", "path", "ready"]


@pytest.mark.slow
def test_prices_are_a_colour_and_columns(browser: Any, plan: Plan) -> None:
    from selenium.webdriver.common.by import By

    browser.find_element(By.CSS_SELECTOR, "[data-colour=price]").click()
    assert browser.execute_script("return report.state().colouring") == "price"
    heads = browser.find_elements(By.CSS_SELECTOR, "#lines-head button")
    assert [head.text for head in heads[-2:]] == [
        "10 % more F saves [ms]",
        "10 % more of all limits saves [ms]",
    ]


@pytest.mark.slow
def test_zoomed_in_what_is_in_sight_is_drawn_finer(browser: Any, plan: Plan) -> None:
    browser.execute_script("Plotly.relayout('profile', {'xaxis.autorange': true})")
    everywhere = wait_for(browser, "const n = report.drawn(); return n > 2000 ? n : null")
    wheel = """
        const canvas = document.querySelector('#path canvas'), box = canvas.getBoundingClientRect();
        for (let k = 0; k < 16; k++) canvas.dispatchEvent(new WheelEvent('wheel', { deltaY: arguments[0], bubbles: true,
          cancelable: true, clientX: box.left + box.width / 2, clientY: box.top + box.height / 2 }));"""
    browser.execute_script(wheel, -100)
    less = wait_for(browser, f"const n = report.drawn(); return n < {everywhere} ? n : null")
    assert less > everywhere / 3, "what is out of sight is still there, coarser"
    browser.execute_script(wheel, 100)
    assert wait_for(browser, f"return report.drawn() === {everywhere}")


@pytest.mark.slow
def test_the_path_fills_its_box_and_is_not_cut_off(browser: Any) -> None:
    """The corners of the path's own box, as the camera projects them, are within the picture, and not far within."""
    seen = browser.execute_script("""
        const scene = document.getElementById('path')._fullLayout.scene, gl = scene._scene.glplot.cameraParams;
        const times = (m, v) => [0, 1, 2, 3].map((r) => v.reduce((sum, w, k) => sum + m[4 * k + r] * w, 0));
        const found = [];
        for (const k of [0, 1, 2, 3, 4, 5, 6, 7]) {
          const axes = [scene.xaxis, scene.yaxis, scene.zaxis], at = axes.map((axis, a) => {
            const [low, high] = axis.range, middle = (low + high) / 2;
            return middle + ((k >> a) & 1 ? 1 : -1) * (high - low) / 2 / 1.08;
          });
          const scaled = at.map((v, a) => v * scene._scene.dataScale[a]);
          found.push(times(gl.projection, times(gl.view, times(gl.model, [...scaled, 1]))).slice(0, 2));
        }
        return found;""")
    across, up = (max(abs(point[k]) for point in seen) for k in (0, 1))
    assert max(across, up) <= 0.9
    assert max(across, up) >= 0.6
