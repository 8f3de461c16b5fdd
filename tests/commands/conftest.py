"""A job of four lines, and `planner.plan` answered by hand."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hand_made import SQUARE, make_plan

import planner


@pytest.fixture
def job(tmp_path: Path) -> Path:
    path = tmp_path / "square.ngc"
    path.write_text(SQUARE)
    return path


@pytest.fixture
def planned(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Let `plan` answer with a plan made by hand, or raise."""

    def answer(**how: Any) -> None:
        def plan(*_: object, **__: object) -> Any:
            if "raises" in how:
                raise how["raises"]
            return make_plan(**how)

        monkeypatch.setitem(vars(planner), "plan", plan)

    return answer
