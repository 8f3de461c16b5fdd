"""docs/extending.md: its examples run, in order, and do what the page says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow  # one of the examples plans a whole program with limits of its own
ROOT = Path(__file__).resolve().parent.parent
PAGE = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> dict:
    """What the page's examples made; of the bracket its first and last blocks."""
    made: dict = {}
    bracket, folder = Path("planner", "examples", "bracket.ngc"), tmp_path_factory.mktemp("checkout")
    (folder / bracket).parent.mkdir(parents=True)
    lines = (ROOT / bracket).read_text(encoding="utf-8").splitlines(keepends=True)
    (folder / bracket).write_text("".join(lines[:22] + lines[-9:]), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for example in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL):
            exec(example, made)
    return made


@pytest.mark.shows("own-limits", "sampled: the examples of the page")
def test_limits_hold_the_motion_and_are_kept(seen):
    assert seen["clamped"].verdict.passed
    assert seen["clamped"].verdict.limits["velocity.clamp side"].ratio > 0.999
    assert seen["armed"].verdict.passed
    arm = [c.ratio for name, c in seen["armed"].verdict.limits.items() if name.endswith(".arm")]
    assert len(arm) == 3
    assert 0.99 < max(arm) <= 1.0 + 1e-6
    prices = seen["armed"].prices
    assert {name for name in prices.limits if name.endswith(".arm")} == {
        f"{quantity}.arm" for quantity in ("velocity", "acceleration", "jerk")
    }
    assert {name.partition(".")[2] for name, _ in prices.ranked()} & {"arm", "clamp side"}


@pytest.mark.shows("own-limits", "sampled: the examples of the page")
def test_the_corner_shape_is_used_and_passes(seen):
    assert seen["rounded"].corner == "wide"
    assert seen["rounded"].verdict.passed
    assert not seen["rounded"].corners.stands.all()


@pytest.mark.shows("own-limits", "sampled: the examples of the page")
def test_the_method_is_judged_like_others(seen):
    assert seen["gentle"].method == "gentle"
    assert seen["gentle"].verdict.passed
    worst = max(
        c.ratio for name, c in seen["gentle"].verdict.limits.items() if name.startswith("acceleration")
    )
    assert worst == pytest.approx(0.5, rel=1e-3)


def test_methods_are_compared(seen):
    rows = {row.method: row for row in seen["rows"]}
    assert set(rows) == {"bezier", "Gentle(0.5)", "Gentle(0.25)"}
    assert {row.outcome for row in seen["rows"]} == {"passed"}, [
        (row.method, row.sentence) for row in seen["rows"]
    ]
    assert rows["Gentle(0.25)"].cycle_time > rows["Gentle(0.5)"].cycle_time


@pytest.mark.parametrize("path", sorted(set(re.findall(r"`((?:planner|tests)/[\w./-]+)`", PAGE))))
def test_files_that_are_named_exist(path):
    assert (ROOT / path).exists()
