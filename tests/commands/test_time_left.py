"""How much time is left: laws of the estimate, on plans that are told by hand."""

from __future__ import annotations

import time

import pytest

from planner.base import kernels
from planner.commands import progress, search_left
from planner.commands.progress import ProgressBar, duration_text
from planner.commands.time_left import LATE, MORE_ROUNDS, PRICES, TimeLeft
from planner.job.trace import Step


def step(name: str, found: float, before: float | None = None, **facts: float) -> Step:
    return Step(at=0.0, name=name, found=found, before=before, kept=before is not None, facts=facts)


def solved(left: TimeLeft, splines: int = 1) -> float:
    """A plan up to its first solve, which took 1 s after 1 s for the grid; returns the time."""
    left.step(0.0, step("programmed feed", 1e-6, dt=1e-3))
    left.step(0.0, step("splines", 0.0, runs=splines))
    left.stage(1.0, "geometry", 0.0)
    left.stage(2.0, "geometry", 1.0)
    left.stage(2.0, "solve", 0.0)
    left.stage(3.0, "solve", 1.0)
    left.step(3.0, step("solve", 1e-6, points=1000, iterations=10, resolution=0.03))
    return 3.0


def test_nothing_is_said_before_anything_is_known() -> None:
    left = TimeLeft()
    left.stage(0.0, "read", 0.0)
    assert left.left(1.0) is None
    left.stage(1.0, "solve", 0.0)
    assert left.left(5.0) is None
    left.stage(6.0, "solve", 0.5)
    assert left.left(6.0) is not None


def test_a_stage_that_tells_its_share_is_believed() -> None:
    """Method stop is all but its verdict: half done after 10 s means 10 s more, however wrong the expectation."""
    for expected in (1e-9, 1e9):
        left = TimeLeft(solves=False)
        left.step(0.0, step("programmed feed", expected, dt=1.0))
        left.stage(0.0, "sample", 0.0)
        left.stage(0.0, "verify", 0.0)
        left.stage(10.0, "verify", 0.5)
        assert left.left(10.0) == pytest.approx(10.0)
        left.stage(15.0, "verify", 0.75)
        assert left.left(15.0) == pytest.approx(5.0)
        left.stage(20.0, "verify", 1.0)
        assert left.left(20.0) == 0.0


def test_fewer_rounds_are_expected_as_gains_fall() -> None:
    said = []
    for falling in (0.6, 0.3, 0.05):
        left = TimeLeft()
        now, best = solved(left), 100.0
        gain = 1e-2
        for n in range(1, 4):
            now += 2.0
            left.step(now, step(f"reshape {n}", best * (1.0 - gain), best))
            best, gain = best * (1.0 - gain), gain * falling
        said.append(left.left(now))
    assert said[0] > said[1] > said[2] > 0.0  # type: ignore[operator]
    asked = TimeLeft(rounds=3)
    now = solved(asked)
    before = asked.left(now)
    for n in range(1, 4):
        now += 2.0
        asked.step(now, step(f"reshape {n}", 90.0, 100.0))
    after = asked.left(now)
    assert before is not None
    assert after is not None
    assert after < before - 2.0 * MORE_ROUNDS  # no round is left
    assert after > PRICES * 2.0 * 0.99  # two seconds for grid and solve


def test_time_left_falls_as_time_passes_and_is_never_negative() -> None:
    left = TimeLeft(writes=True)
    now = solved(left)
    now += 3.0
    left.step(now, step("reshape 1", 99.0, 100.0))
    first = left.left(now)
    later = [left.left(now + t) for t in (0.1, 0.2, 0.4)]
    assert first is not None
    assert all(b < a for a, b in zip([first, *later], later, strict=False))  # type: ignore[operator]
    for name in ("sample", "verify", "report", "write"):
        left.stage(now + 1.0, name, 0.0)
        for t in (0.0, 1.0, 1e3):
            told = left.left(now + 1.0 + t)
            assert told is not None
            assert told >= 0.0
        left.stage(now + 1.0, name, 1.0)


def searched() -> tuple[TimeLeft, float]:
    """A plan up to the beginning of its search, after 3 s."""
    left, now = TimeLeft(searched=True), 3.0
    left.step(0.0, step("programmed feed", 1e-6, dt=1.0, segments=100))
    left.stage(1.0, "geometry", 0.0)
    left.stage(2.0, "solve", 0.0)
    assert left.left(now) is None
    left.stage(now, "search", 0.0)
    return left, now


def test_a_search_tells_its_share() -> None:
    """Half of a search in 5 s leave 5 s of it, whatever its start took; of less is believed what was expected too."""
    left, now = searched()
    assert left.left(now + 1.0) == pytest.approx(search_left.FIRST * 3.0 * (1.0 + search_left.DELIVERY) - 1.0)
    left.stage(now + 5.0, "search", 0.5)
    delivery = search_left.DELIVERY * 10.0
    assert left.left(now + 5.0) == pytest.approx(5.0 + delivery)
    left.stage(now + 10.0, "search", 1.0)
    left.stage(now + 10.0, "sample", 0.0)
    assert left.left(now + 10.0) == pytest.approx(delivery)
    assert left.left(now + 1e3) > 0.0  # type: ignore[operator]


@pytest.mark.usual_sizes
def test_a_search_that_leaves_something_comes_once_more() -> None:
    """8 s for 80 % of it, and then a plan: 3 s took as much as that needs, and the search 10 s; quick makes no other one."""
    left, now = searched()
    left.stage(now + 8.0, "search", 0.8)
    left.step(now + 8.0, step("search", 1e-6, of_runs=2))
    left.stage(now + 8.0, "geometry", 0.0)
    more = search_left.PLAN * 3.0 + 10.0 * (1.0 + search_left.DELIVERY)
    assert left.left(now + 8.0) == pytest.approx(more)
    assert left.left(now + 9.0) == pytest.approx(more - 1.0)
    left.stage(now + 20.0, "search", 0.0)
    assert left.left(now + 20.0) == pytest.approx(10.0 * (1.0 + search_left.DELIVERY))


@pytest.mark.parametrize("why", ["left", "of"])
def test_a_plan_without_a_search_goes_the_way_of_the_rounds(why: str) -> None:
    """Too many steps for it, said before it begins or then, or nothing to be found: as if nobody had thought of it."""
    left, now = searched()
    left.step(now, step("search", 1e-6, **{why: 60_000}))
    left.stage(now, "search", 1.0)
    large = TimeLeft(searched=True)
    large.step(0.0, step("programmed feed", 1e-6, dt=1.0, segments=1_000_000))
    plain = TimeLeft()
    assert solved(left) == solved(large) == solved(plain)
    assert left.left(3.0) == large.left(3.0) == plain.left(3.0) is not None


def test_work_that_tells_nothing_is_not_said_to_be_done() -> None:
    """However long after its verdict a plan goes on: never no time left."""
    left = TimeLeft(solves=False)
    left.step(0.0, step("programmed feed", 1e-6, dt=1.0))
    left.stage(0.0, "sample", 0.0)
    left.stage(0.0, "verify", 0.0)
    left.stage(10.0, "verify", 1.0)
    assert [left.left(10.0 + silent) for silent in (0.0, 1.0, 10.0)] == pytest.approx(
        [0.0, LATE, 10.0 * LATE]
    )


def test_compiling_is_told_once_and_is_no_time_of_the_job(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    monkeypatch.setattr(progress, "PROGRESS_AFTER", 0.0)
    told: list[tuple[float, str]] = []

    class Left(TimeLeft):
        def stage(self, now: float, name: str, fraction: float) -> None:
            told.append((now, name))

        def left(self, now: float) -> float | None:
            return 100.0

    began: list[object] = []
    with ProgressBar(left=Left(), at_first_kernel=lambda: began.append(1)) as bar:
        compiler = kernels.compilation()
        for _ in range(2):
            compiler.begins(True)
            assert bar.seconds_left() is None
            time.sleep(0.2)
            compiler.ends()
        bar("solve", 0.0)
        assert bar.seconds_left() == 100.0
    ((now, name),) = told
    assert name == "solve"
    assert now < 0.2
    assert began == [1]
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
