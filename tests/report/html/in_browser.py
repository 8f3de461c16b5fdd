"""Pages in a real browser (conftest.py)."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any


@contextmanager
def opened(chromium: Any, file: Path) -> Iterator[Any]:
    """The browser with a page in a tab of its own, once the page is ready; the tab is closed at the end."""
    before = chromium.current_window_handle
    chromium.switch_to.new_window("tab")
    chromium.get(f"file://{file}")
    wait_for(chromium, "return document.body.dataset.ready")
    yield chromium
    chromium.close()
    chromium.switch_to.window(before)


def wait_for(browser: Any, question: str, seconds: float = 90.0) -> Any:
    """The answer of the page once it is one."""
    until = time.monotonic() + seconds
    while not (answer := browser.execute_script(question)):
        assert time.monotonic() < until, f"no answer: {question}"
        time.sleep(0.1)
    return answer
