"""The page of a comparison: its columns are those of the motions, and a browser shows and hides them."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import planner
from tests.commands.command_line import run
from tests.report.html.columns import column
from tests.report.html.in_browser import opened

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


@pytest.mark.slow
def test_a_browser_shows_and_hides_the_methods(file: Path) -> None:
    pages = opened(file)
    browser: Any = next(pages)  # or skipped
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
    next(pages, None)
