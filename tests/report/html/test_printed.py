"""The page of a report on paper, by a real browser."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

import planner
from planner.report.html.page import report_page
from tests.report.html.in_browser import opened, wait_for


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    plan = planner.plan(planner.path([[0, 0], [20, 0], [20, 20]], feed=50.0), "mill", method="stop")
    file = tmp_path_factory.mktemp("page") / "report.html"
    file.write_text(report_page(plan), encoding="utf-8")
    yield from opened(file)


@pytest.mark.slow
def test_on_paper_the_path_is_the_first_picture(browser: Any) -> None:
    """A picture in WebGL leaves paper empty; the others are as wide as the paper, in the colours of a light ground."""
    assert (
        browser.execute_script("return getComputedStyle(document.getElementById('first')).display") == "none"
    )
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    browser.execute_script("dispatchEvent(new Event('beforeprint'))")
    names = "['path', 'first', 'scale', 'lines-box']"
    shown = f"return {names}.map((id) => getComputedStyle(document.getElementById(id)).display)"
    assert browser.execute_script(shown) == ["none", "flex", "flex", "none"]
    wide = "return [...document.querySelectorAll('#profile .main-svg')].map((svg) => svg.getBoundingClientRect().width)"
    assert max(browser.execute_script(wide)) <= browser.execute_script("return document.body.clientWidth")
    assert browser.execute_script(
        "return document.querySelector('#profile .main-svg').getAttribute('viewBox')"
    )
    inks = "return [...document.querySelectorAll('#profile svg text')].map((one) => one.style.fill)"
    dark = {"name": "prefers-color-scheme", "value": "dark"}
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "screen", "features": [dark]})
    browser.refresh()
    wait_for(browser, "return document.body.dataset.ready")
    on_screen = browser.execute_script(inks)
    assert "rgb(230, 233, 239)" in on_screen
    browser.execute_script("dispatchEvent(new Event('beforeprint'))")
    assert set(browser.execute_script(inks)) <= {"rgb(29, 36, 48)", "rgb(102, 112, 133)"}
    browser.execute_script("dispatchEvent(new Event('afterprint'))")
    assert browser.execute_script(inks) == on_screen
