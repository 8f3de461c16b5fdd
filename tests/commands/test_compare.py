"""`planner compare`: which is best, what a row says, refusals and failures as rows, files that are whole or not there."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hand_made import SQUARE, make_plan
from typer.testing import CliRunner, Result

from planner.base.errors import InputError, NotSolvedError
from planner.base.names import METHODS
from planner.cli import app
from planner.commands.compare import parse_methods
from planner.report import comparison
from planner.report.compare import Row, best_of
from planner.report.comparison import comparison_csv, comparison_dict


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["compare", *(str(argument) for argument in arguments)])


@pytest.fixture
def answers(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[str]]:
    """Let `plan` answer by method: with an exception, or with the settings of a plan made by hand."""

    def answer(**by_method: Any) -> list[str]:
        asked: list[str] = []

        def plan(*_: object, method: str, **__: object) -> Any:
            asked.append(method)
            how = by_method.get(method.replace("-", "_"), {})
            if isinstance(how, Exception):
                raise how
            return make_plan(**how)

        monkeypatch.setattr("planner.planning.methods.registry.plan", plan)
        return asked

    return answer


def row(method: str, time: float, *, outcome: str = "passed", free: tuple[str, ...] = ()) -> Row:
    worst = {"jerk": (0.5, "jerk.y")}
    return Row(method=method, outcome=outcome, sentence="s", cycle_time=time, worst=worst, free=free)


# ------------------------------------------------------------------------------------------ the methods


def test_all_means_every_method_of_the_registry() -> None:
    assert parse_methods("all") == list(METHODS)


def test_methods_are_kept_in_the_order_given() -> None:
    assert parse_methods("stop, fir") == ["stop", "fir"]
    assert parse_methods("stop,toppra") == ["stop", "second-order"]  # an earlier name


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("magic", "'magic'; there are optimal, second-order"),
        ("stop,", "no method ''"),
        ("", "no method ''"),
        ("stop,Stop", "'Stop'"),
        ("stop,all", "'all'"),
        ("stop,fir,stop", "'stop' is named twice"),
    ],
)
def test_wrong_methods_are_named_before_any_work(
    answers: Callable[..., list[str]], job: Path, text: str, said: str
) -> None:
    asked = answers()
    result = run(job, "--method", text)
    assert result.exit_code == 2
    assert said in result.stderr
    assert asked == []


# ------------------------------------------------------------------------------------------ what is best


def test_the_best_passed_and_limits_everything() -> None:
    rows = [
        row("second-order", 1.0, free=("jerk",)),
        row("optimal", 2.0),
        row("fir-plain", 1.5, outcome="failed"),
        row("stop", 4.0),
    ]
    best = best_of(rows)
    assert best is not None
    assert best.method == "optimal"
    ratios = [made["ratio_to_best"] for made in comparison_dict(rows, {})["methods"]]
    assert ratios == [0.5, 1.0, 0.75, 2.0]


def test_without_such_a_one_any_that_passed_and_without_any_none() -> None:
    rows = [row("fir-plain", 1.0, outcome="failed"), row("second-order", 3.0, free=("jerk",))]
    assert getattr(best_of(rows), "method", None) == "second-order"
    assert best_of(rows[:1]) is None
    assert comparison_dict(rows[:1], {})["methods"][0]["ratio_to_best"] is None


# ------------------------------------------------------------------------------------------ rows of the command


@pytest.mark.shows("compare", "sampled: rows say what the verdicts say")
def test_a_row_says_what_the_verdict_says(answers: Callable[..., list[str]], job: Path) -> None:
    """The hand-made verdict: velocity.y 1.0000014 is worse than velocity.x 0.5; jerk is not limited."""
    answers()
    result = run(job, "--method", "second-order", "--json")
    assert result.exit_code == 0
    said = json.loads(result.stdout)
    made = said["methods"][0]
    assert made["worst"]["velocity"] == {"ratio": 1.0000014, "limit": "velocity.y"}
    assert made["worst"]["jerk"] == {"ratio": 3.5, "limit": "jerk.x"}
    assert made["not_limited"] == ["jerk"]
    assert made["cycle_time_s"] == pytest.approx(0.8)
    assert made["contour_error_mm"] == 0.0123
    assert made["vertex_error_mm"] == 0.02
    assert made["planning_time_s"] == pytest.approx(0.02)  # "solve", without "read"
    assert said["program"] == str(job)
    table = run(job, "--method", "second-order").stdout
    assert "(3.5 x)" in table
    assert "12.3 " in table  # [um]
    assert "second-order does not limit jerk" in table


def test_a_line_of_progress_per_method(answers: Callable[..., list[str]], job: Path) -> None:
    answers(fir=InputError("no"))
    result = run(job, "--method", "stop,fir,bezier")
    assert result.stderr == "stop: 0.8000 s, passed\nfir: refused\nbezier: 0.8000 s, passed\n"
    assert run(job, "--method", "stop,fir,bezier", "--quiet").stderr == ""


def test_what_a_method_cannot_do_is_a_row_with_its_sentence(
    answers: Callable[..., list[str]], job: Path
) -> None:
    answers(
        fir=InputError("three filters", source="m.toml"),
        optimal={"solved": False},
        bezier={"passed": False},
        kinematic=NotSolvedError("too short"),
    )
    result = run(job, "--method", "fir,optimal,bezier,kinematic,stop", "--json")
    assert result.exit_code == 0
    said = json.loads(result.stdout)
    made = {entry["method"]: (entry["outcome"], entry["sentence"]) for entry in said["methods"]}
    assert made["fir"] == ("refused", "m.toml: three filters")
    assert made["optimal"] == ("not solved", "no feed satisfies all limits; loosen the tolerance")
    assert made["bezier"][0] == "failed"
    assert made["bezier"][1].startswith("velocity.y: 101 mm/s")
    assert made["kinematic"] == ("refused", "too short")
    assert said["best"] == "stop"
    table = run(job, "--method", "fir,optimal,stop").stdout
    assert "fir: m.toml: three filters" in table
    assert "optimal: no feed satisfies" in table


@pytest.mark.shows("command-line", "sampled: wrong options and files exit with their code and a sentence")
@pytest.mark.parametrize(
    ("fir", "stop", "code"),
    [
        ({}, InputError("no"), 0),
        ({"passed": False}, {"solved": False}, 1),
        ({"solved": False}, InputError("no"), 3),
        (InputError("no"), InputError("no"), 2),
    ],
)
def test_exit_codes(answers: Callable[..., list[str]], job: Path, fir: Any, stop: Any, code: int) -> None:
    answers(fir=fir, stop=stop)
    result = run(job, "--method", "fir,stop")
    assert result.exit_code == code
    assert "fir" in result.stdout  # the table is there in any case


def test_a_bug_is_not_a_row(answers: Callable[..., list[str]], job: Path) -> None:
    answers(fir=ZeroDivisionError("oops"))
    result = run(job, "--method", "fir,stop")
    assert result.exit_code == 70
    assert "oops" in result.stderr


@pytest.mark.parametrize("content", [None, "G38.2 Z-1 F10\nG1 X5 F100\n", ""])
def test_a_bad_program_is_said_once_and_not_per_method(
    answers: Callable[..., list[str]], tmp_path: Path, content: str | None
) -> None:
    asked = answers()
    path = tmp_path / "bad.ngc"
    if content is not None:
        path.write_text(content)
    result = run(path)
    assert result.exit_code == 2
    assert result.stderr.startswith(str(path))
    assert result.stderr.count("\n") <= 2
    assert asked == []


def test_a_bad_machine(answers: Callable[..., list[str]], job: Path) -> None:
    answers()
    result = run(job, "-m", "lathe")
    assert result.exit_code == 2
    assert "lathe" in result.stderr


# ------------------------------------------------------------------------------------------ files


def test_the_files_hold_the_table(answers: Callable[..., list[str]], job: Path, tmp_path: Path) -> None:
    answers(fir=InputError('no, "never"'))
    for name in ("c.json", "c.csv"):
        out = tmp_path / "new" / name
        result = run(job, "--method", "second-order,fir", "--out", out)
        assert result.exit_code == 0, result.output
        assert str(out) in result.stdout
    assert sorted(file.name for file in out.parent.iterdir()) == ["c.csv", "c.json"]
    assert json.loads((out.parent / "c.json").read_text())["best"] == "second-order"
    first, second = csv.DictReader(io.StringIO((out.parent / "c.csv").read_text()))
    assert first["method"] == "second-order"
    assert float(first["velocity_ratio"]) == 1.0000014
    assert first["velocity_limit"] == "velocity.y"
    assert first["not_limited"] == "jerk"
    assert first["feed_ratio"] == ""
    assert second["outcome"] == "refused"
    assert second["cycle_time_s"] == ""
    assert second["sentence"] == 'no, "never"'


@pytest.mark.parametrize("name", ["c.parquet", "c", "folder.json", "file/c.json"])
def test_a_place_that_cannot_be_written_is_refused_before_any_work(
    answers: Callable[..., list[str]], job: Path, tmp_path: Path, name: str
) -> None:
    asked = answers()
    (tmp_path / "folder.json").mkdir()
    (tmp_path / "file").write_text("")
    result = run(job, "--out", tmp_path / name)
    assert result.exit_code == 2
    assert result.stderr.startswith(str(tmp_path / name))
    assert asked == []


def test_a_method_that_uses_up_the_memory_is_a_row(answers: Callable[..., list[str]], job: Path) -> None:
    answers(fir=MemoryError("Unable to allocate 428. MiB"))
    result = run(job, "--method", "stop,fir")
    assert result.exit_code == 0
    assert "fir: the memory is used up (Unable to allocate 428. MiB); split" in result.stdout


@pytest.mark.parametrize("name", ["c.json", "c.csv"])
def test_only_comparisons_are_overwritten(
    answers: Callable[..., list[str]], job: Path, tmp_path: Path, name: str
) -> None:
    asked = answers()
    out = tmp_path / name
    for content in ("mine", "[1]", '{"best": 1}'):
        out.write_text(content)
        result = run(job, "--method", "stop", "-o", out)
        assert result.exit_code == 2
        assert "was not written by planner" in result.stderr
        assert out.read_text() == content
    assert asked == []
    assert run(job, "--method", "stop", "-o", out, "--force").exit_code == 0
    assert run(job, "--method", "second-order", "-o", out).exit_code == 0
    assert "second-order" in out.read_text()
    program = tmp_path / ("job" + out.suffix)
    program.write_text(SQUARE)
    refused = run(program, "--method", "stop", "-o", program, "--force")
    assert refused.exit_code == 2
    assert "read as input" in refused.stderr
    assert program.read_text() == SQUARE


def test_a_failed_write_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "c.csv"
    path.write_text("old")

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(InputError, match="No space left"):
        comparison.write_comparison(path, [row("stop", 1.0)], {})
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_numbers_in_csv_read_back_exactly() -> None:
    made = list(csv.DictReader(io.StringIO(comparison_csv([row("stop", 0.1 + 0.2)]))))
    assert float(made[0]["cycle_time_s"]) == 0.1 + 0.2


# ------------------------------------------------------------------------------------------ the real thing


@pytest.mark.slow
def test_real_methods_on_a_real_job(job: Path) -> None:
    """Same job for all: whatever passes ends within the tolerance, nothing is slower than stopping."""
    result = run(job, "--method", "optimal,kinematic,fir,stop", "--tolerance", "0.05", "--json")
    assert result.exit_code == 0, result.output
    said = json.loads(result.stdout)
    made = {entry["method"]: entry for entry in said["methods"]}
    assert said["tolerance_mm"] == 0.05
    assert made["stop"]["ratio_to_best"] == max(entry["ratio_to_best"] for entry in made.values()) > 1
    for entry in made.values():
        assert entry["outcome"] == "passed"
        assert max(entry["contour_error_mm"], entry["vertex_error_mm"]) <= 0.05
        assert entry["summary"]["tolerance_mm"] == 0.05
