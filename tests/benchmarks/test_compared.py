"""`compare` names what is worse, and nothing else is worse."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from results_rows import keyed, row

from benchmarks.__main__ import main
from benchmarks.runner.compared import changes, worse
from benchmarks.runner.rows import NOT_APPLICABLE, NOT_SOLVED, SKIPPED, append, line_of


@pytest.mark.parametrize(
    "new",
    [
        {"status": NOT_SOLVED, "verdict": "", "cycle_s": None},
        {"status": NOT_APPLICABLE, "verdict": "", "cycle_s": None},
        {"verdict": "failed"},
        {"verdict": "failed", "cycle_s": 0.9},
        {"cycle_s": 1.0011},
    ],
)
def test_what_is_worse_is_named_with_its_job(new: dict[str, Any]) -> None:
    (change,) = worse(changes(keyed(row()), keyed(row(**new))))
    assert "quick / corner / optimal" in str(change)
    assert [one.kind for one in changes(keyed(row(**new)), keyed(row()))] == ["better"]


@pytest.mark.parametrize("new", [{}, {"cycle_s": 1.0009}, {"cycle_s": 0.9991}, {"message": "another"}])
def test_what_is_the_same_is_no_change(new: dict[str, Any]) -> None:
    assert changes(keyed(row()), keyed(row(**new))) == []


def test_a_slower_plan_is_named_and_is_not_worse() -> None:
    (change,) = changes(keyed(row(cpu_s=0.5)), keyed(row(cpu_s=0.8, quiet=1.3)))
    assert (change.kind, worse([change])) == ("slower", [])
    assert "ratio 1.60" in change.says
    assert "busy core" in change.says
    assert changes(keyed(row(cpu_s=0.01)), keyed(row(cpu_s=0.04))) == []  # a clock's own grain


def test_a_missing_row_is_worse_and_a_skipped_one_is_not_compared() -> None:
    assert [change.kind for change in changes(keyed(row()), {})] == ["worse"]
    skipped = row(status=SKIPPED, verdict="", cycle_s=None, message="no package")
    for old, new in ((row(), skipped), (skipped, row())):
        (change,) = changes(keyed(old), keyed(new))
        assert (change.kind, change.says) == ("not compared", "no package")
    assert changes({}, keyed(row())) == []


def test_the_command_ends_with_1_only_where_something_is_worse(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, cycle in (("old", 1.0), ("slow", 1.01), ("same", 1.0)):
        append(tmp_path / name, [line_of(row(cycle_s=cycle))])
    old, slow, same = (str(tmp_path / name) for name in ("old", "slow", "same"))
    assert main(["compare", old, slow]) == 1
    assert "worse: quick / corner / optimal: cycle time 1 s, now 1.01 s (+1.00%)" in capsys.readouterr().out
    assert main(["compare", old, same]) == 0
    assert main(["compare", slow, old]) == 0
    assert main(["compare", old, str(tmp_path / "none")]) == 2
    assert "no such file" in capsys.readouterr().err
