"""A page in a real browser: Debian's chromium, without a screen."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest


def opened(file: Path) -> Iterator[Any]:
    """A browser that shows a page, once the page is ready; closed at the end. Skips visibly where there is no browser."""
    chromium, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if not chromium or not driver:
        pytest.skip("chromium and its driver (packages chromium, chromium-driver) are not installed")
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for argument in (
        "--headless=new",
        "--no-sandbox",
        "--disable-dev-shm-usage",
        "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader",
        "--window-size=1400,1800",
    ):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    browser = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    browser.set_script_timeout(60)
    browser.get(f"file://{file}")
    wait_for(browser, "return document.body.dataset.ready")
    yield browser
    browser.quit()


def wait_for(browser: Any, question: str, seconds: float = 90.0) -> Any:
    """The answer of the page once it is one."""
    until = time.monotonic() + seconds
    while not (answer := browser.execute_script(question)):
        assert time.monotonic() < until, f"no answer: {question}"
        time.sleep(0.1)
    return answer
