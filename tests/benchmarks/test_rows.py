"""Files of rows: what is written is read, an interrupted run loses nothing, and wrong lines are named."""

from __future__ import annotations

from pathlib import Path

import pytest
from results_rows import keyed, row

from benchmarks.record import provenance
from benchmarks.runner.rows import about_line, append, compact, line_of, read
from planner.base.errors import InputError

ROWS = (
    row(cpu_all=(0.5, 0.6), quiet=1.02, blocks=2, points=40, free=("jerk",), commit="abc"),
    row("other", status="error", verdict="", cycle_s=None, message="ValueError: 3 > 2"),
)


def test_rows_are_read_as_they_were_written(tmp_path: Path) -> None:
    file = tmp_path / "folder" / "rows.jsonl"
    append(file, [about_line({"commit": "abc"}), *map(line_of, ROWS)])
    found = read(file)
    assert found.rows == keyed(*ROWS)
    assert found.abouts == ({"commit": "abc"},)


def test_the_last_row_of_a_pair_holds(tmp_path: Path) -> None:
    file = tmp_path / "rows.jsonl"
    append(file, map(line_of, (*ROWS, row(cycle_s=2.0))))
    assert read(file).rows == keyed(row(cycle_s=2.0), ROWS[1])
    compact(file, {"corner", "other"})
    assert len(file.read_text().splitlines()) == 2
    assert read(file).rows == keyed(row(cycle_s=2.0), ROWS[1])


def test_jobs_that_a_suite_has_no_more_are_dropped(tmp_path: Path) -> None:
    file = tmp_path / "rows.jsonl"
    append(file, map(line_of, ROWS))
    compact(file, {"other"})
    assert read(file).rows == keyed(ROWS[1])


def test_what_an_interrupted_run_left_of_a_line_is_passed_over_and_cut_off(tmp_path: Path) -> None:
    file = tmp_path / "rows.jsonl"
    append(file, [line_of(ROWS[0])])
    with file.open("a") as out:
        out.write(line_of(ROWS[1])[:30])
    assert read(file).rows == keyed(ROWS[0])
    append(file, [line_of(ROWS[1])])
    assert read(file).rows == keyed(*ROWS)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("no json\n", "no JSON"),
        ("[1]\n", "each line is an object"),
        ('{"suite": "quick"}\n', "no job, way, kind, status"),
        (line_of(ROWS[0])[:-1] + ', "colour": 1}\n', "unknown colour"),
        (line_of(row(status="fine")) + "\n", "status 'fine'; there are solved"),
    ],
)
def test_wrong_lines_are_named(line: str, said: str, tmp_path: Path) -> None:
    file = tmp_path / "rows.jsonl"
    file.write_text(line_of(ROWS[0]) + "\n" + line)
    with pytest.raises(InputError, match=f"rows.jsonl, line 2: .*{said}"):
        read(file)


def test_without_git_a_result_has_no_commit(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    about = provenance()
    assert about["commit"] == ""
    assert about["date"]
