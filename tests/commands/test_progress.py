"""Progress on standard error: shares and times of stages, lines where there is no terminal."""

from __future__ import annotations

import sys
from typing import Any

import pytest
import rich.progress

from planner.base import kernel_files
from planner.commands import progress
from planner.commands.progress import ProgressBar, duration_text


@pytest.fixture
def bars(monkeypatch: pytest.MonkeyPatch) -> list[rich.progress.Progress]:
    """The bars that are drawn from now on, on a terminal and from the first moment on, by a clock that adds a second at each look."""
    monkeypatch.setattr(progress, "PROGRESS_AFTER", 0.0)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    drawn: list[rich.progress.Progress] = []
    seconds = [0.0]

    def tick() -> float:
        seconds[0] += 1.0
        return seconds[0]

    class Recorded(rich.progress.Progress):
        def __init__(self, *columns: Any, **how: Any) -> None:
            super().__init__(*columns, get_time=tick, auto_refresh=False, **how)
            drawn.append(self)

    monkeypatch.setattr(rich.progress, "Progress", Recorded)
    return drawn


def test_time_is_left_of_a_stage_that_tells_its_share(bars: list[rich.progress.Progress]) -> None:
    with ProgressBar() as bar:
        bar("search", 0.0)
        (task,) = bars[0].tasks
        assert task.total is None
        assert task.time_remaining is None
        for share in (0.2, 0.4, 0.6):
            bar("search", share)
        (task,) = bars[0].tasks
        assert task.percentage == pytest.approx(60.0)
        assert task.time_remaining is not None
        assert task.time_remaining > 0.0
        bar("verify", 0.0)  # another stage, of which nothing is known
        (task,) = bars[0].tasks
        assert (task.description, task.total, task.time_remaining) == ("verify", None, None)


def test_plans_that_are_there_are_a_share_of_all(bars: list[rich.progress.Progress]) -> None:
    with ProgressBar() as bar:
        for there in range(4):
            bar.count(there, 8)
        (task,) = bars[0].tasks
        assert task.description == "3 of 8 plans"
        assert task.percentage == pytest.approx(37.5)
        assert task.time_remaining is not None


def test_compiling_is_told_once(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture) -> None:
    monkeypatch.setattr(progress, "PROGRESS_AFTER", 0.0)
    with ProgressBar():
        compiler = kernel_files.compilation()
        for _ in range(2):
            compiler.begins(True)
            compiler.ends()
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert "compiling, once: kernel 1, kept for the next run" in lines[0]


def test_lines_become_fewer_where_there_is_no_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    clock = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: clock[0])
    with ProgressBar() as bar:
        for second in range(3600):
            clock[0] = float(second)
            bar("solve", 0.5)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "10 s: solve, 50%"
    assert 20 < len(lines) < 45


@pytest.mark.parametrize(
    ("seconds", "said"),
    [(0.4, "0 s"), (99.0, "99 s"), (100.0, "2 min"), (5999.0, "100 min"), (7200.0, "2.0 h")],
)
def test_durations(seconds: float, said: str) -> None:
    assert duration_text(seconds) == said
