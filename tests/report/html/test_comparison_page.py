"""The page of a comparison: its columns are those of the motions, and a browser shows and hides them. Pages on paper."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import planner
from planner.report.html.page import report_page
from tests.commands.command_line import run
from tests.report.html.columns import column
from tests.report.html.in_browser import opened, wait_for

JOB = "G21 F3000\nG1 X40 Y3\nX45 Y30\nX0\n"


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("compared")
    (folder / "job <b>.ngc").write_text(JOB)
    page = folder / "page.html"
    done = run(
        "compare", folder / "job <b>.ngc", "--method", "kinematic,stop,fir-plain", "--report", page, "-q"
    )
    assert done.exit_code == 0, done.output
    assert str(page) in done.output.replace("\n", "")
    return page


@pytest.mark.shows("report", "sampled: columns against the plan, distances by another formula")
@pytest.mark.usual_sizes
def test_columns_are_the_motions_of_the_methods(file: Path) -> None:
    page = file.read_text(encoding="utf-8")
    for k, method in enumerate(("kinematic", "stop")):
        motion = planner.plan(planner.read_program(text=JOB), "mill", method=method).trajectory
        assert motion is not None
        assert np.array_equal(column(page, f"m{k}_feed", "<f4"), motion.feed.astype(np.float32))
        assert np.array_equal(column(page, f"m{k}_y", "<f4"), motion.position[:, 1].astype(np.float32))
    about = json.loads(re.search(r'id="about">(.*?)</script>', page, re.DOTALL).group(1))  # type: ignore[union-attr]
    assert [row["method"] for row in about["rows"]] == ["kinematic", "stop", "fir-plain"]
    assert about["best"] == "kinematic"
    assert "job &lt;b&gt;.ngc" in page


def test_a_file_that_is_no_page_is_kept(tmp_path: Path, file: Path) -> None:
    (tmp_path / "mine.html").write_text("mine")
    job = file.with_name("job <b>.ngc")
    assert run("compare", job, "--method", "stop", "--report", tmp_path / "mine.html", "-q").exit_code == 2
    assert (tmp_path / "mine.html").read_text() == "mine"
    assert run("compare", job, "--method", "stop", "--report", job, "-q", "--force").exit_code == 2
    assert job.read_text() == JOB
    page = tmp_path / "page.html"
    for more in ([], ["--force"]):  # beside a page --force is of use
        assert run("compare", job, "--method", "stop", "--report", page, "-q", *more).exit_code == 0


@pytest.fixture
def browser(chromium: Any, file: Path) -> Iterator[Any]:
    with opened(chromium, file) as shown:
        yield shown


@pytest.mark.slow
def test_a_browser_shows_and_hides_the_methods(browser: Any) -> None:
    from selenium.webdriver.common.by import By

    assert browser.execute_script("return document.querySelectorAll('#title b').length") == 0
    assert browser.execute_script("return comparison.state().shown") == 3
    browser.find_elements(By.CSS_SELECTOR, "tr.choice")[1].click()
    assert browser.execute_script("return comparison.state().hidden") == [1]
    on_paper = "return document.querySelectorAll('#first polyline').length"  # WebGL leaves it empty
    assert browser.execute_script(on_paper) == 2
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    assert browser.execute_script("return document.getElementById('first').clientHeight") > 100
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "screen"})
    browser.find_element(By.CSS_SELECTOR, "[data-against=line]").click()
    assert (
        browser.execute_script("return document.getElementById('profile').layout.xaxis.title.text")
        == "NC line"
    )
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []


# --- the page of a report, on paper: here for the browser that the page above has started -----------------------------------------


@pytest.fixture
def report(tmp_path: Path, chromium: Any) -> Iterator[Any]:
    plan = planner.plan(planner.path([[0, 0], [20, 0], [20, 20]], feed=50.0), "mill", method="stop")
    (tmp_path / "report.html").write_text(report_page(plan), encoding="utf-8")
    with opened(chromium, tmp_path / "report.html") as shown:
        yield shown


@pytest.mark.slow
def test_on_paper_the_path_of_a_report_is_the_first_picture(report: Any) -> None:
    """A picture in WebGL leaves paper empty; the others are as wide as the paper, in the colours of a light ground."""
    assert (
        report.execute_script("return getComputedStyle(document.getElementById('first')).display") == "none"
    )
    report.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    report.execute_script("dispatchEvent(new Event('beforeprint'))")
    names = "['path', 'first', 'scale', 'lines-box']"
    shown = f"return {names}.map((id) => getComputedStyle(document.getElementById(id)).display)"
    assert report.execute_script(shown) == ["none", "flex", "flex", "none"]
    wide = "return [...document.querySelectorAll('#profile .main-svg')].map((svg) => svg.getBoundingClientRect().width)"
    assert max(report.execute_script(wide)) <= report.execute_script("return document.body.clientWidth")
    assert report.execute_script(
        "return document.querySelector('#profile .main-svg').getAttribute('viewBox')"
    )
    inks = "return [...document.querySelectorAll('#profile svg text')].map((one) => one.style.fill)"
    dark = {"name": "prefers-color-scheme", "value": "dark"}
    report.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "screen", "features": [dark]})
    report.refresh()
    wait_for(report, "return document.body.dataset.ready")
    on_screen = report.execute_script(inks)
    assert "rgb(230, 233, 239)" in on_screen
    report.execute_script("dispatchEvent(new Event('beforeprint'))")
    assert set(report.execute_script(inks)) <= {"rgb(29, 36, 48)", "rgb(102, 112, 133)"}
    report.execute_script("dispatchEvent(new Event('afterprint'))")
    assert report.execute_script(inks) == on_screen
