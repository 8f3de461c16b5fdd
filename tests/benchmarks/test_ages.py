"""Every result that a page quotes is there and says where it comes from; README quotes none that is old."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from benchmarks.record import RESULTS
from benchmarks.runner.ages import (
    README_LIMIT,
    ROOT,
    Age,
    Made,
    ages,
    commits_since,
    has_history,
    made_of,
    pages,
    quoted,
    too_old,
)
from benchmarks.runner.listing import listed, scripts
from benchmarks.runner.suites import SUITES

PAGE = ROOT / "docs" / "benchmarks.md"
NAMED = [(page, name) for page, text in pages().items() for name in quoted(text)]


@pytest.mark.parametrize(("page", "name"), NAMED)
def test_quoted_results_are_there_and_say_what_made_them(page: str, name: str) -> None:
    file = RESULTS / name
    assert file.is_file(), f"{page} quotes {name}"
    assert made_of(file.read_text(encoding="utf-8").split("\n")[0]) is not None, f"{name}, first line"


def test_what_readme_quotes_is_not_old(capsys: pytest.CaptureFixture[str]) -> None:
    if not has_history():
        pytest.skip("no git history here: ages are not known")
    found = ages()
    for age in found:
        print(
            f"{age.name}: {age.commits} commits to planner/ since {age.made.commit}, quoted in {', '.join(age.pages)}"
        )
    assert {age.name for age in found} == {name for _, name in NAMED}
    assert [age.name for age in found if age.commits is None] == []
    assert [age.name for age in too_old(found, "README.md", README_LIMIT)] == []


def test_an_old_figure_in_readme_is_found() -> None:
    made = Made(by="`c`", commit="1234567", date="2026-01-01")
    old = Age(name="old.md", pages=("docs/speed.md", "README.md"), made=made, commits=README_LIMIT + 1)
    elsewhere = Age(name="other.md", pages=("docs/speed.md",), made=made, commits=README_LIMIT + 1)
    young = Age(name="young.md", pages=("README.md",), made=made, commits=README_LIMIT)
    assert too_old([old, elsewhere, young], "README.md", README_LIMIT) == [old]


def test_ages_are_counted_in_commits_to_the_planner() -> None:
    if not has_history():
        pytest.skip("no git history here: ages are not known")
    assert commits_since("HEAD") == 0
    assert commits_since("0" * 40) is None


def test_first_lines_are_read() -> None:
    found = made_of(
        "Made by `python -m benchmarks.solvers.solver_sizes` at fa4f8f9, written on 2026-11-22T10:46:54+00:00 (x86_64)"
    )
    assert found == Made(
        by="`python -m benchmarks.solvers.solver_sizes`", commit="fa4f8f9", date="2026-11-22"
    )
    assert made_of("# A title") is None


def test_a_report_is_as_old_as_its_oldest_rows() -> None:
    found = made_of("Made by `c` at 1234567+ on 2026-01-01 (x86_64). Rows of planner abcdef0+, 1234567.")
    assert found is not None
    assert found.planners == ("abcdef0", "1234567")


def test_names_are_found_with_and_without_their_folder(tmp_path: Path) -> None:
    (tmp_path / "there.md").write_text("")
    text = (
        "[a](../benchmarks/results/one.md), `there.md`, `benchmarks/results/two.md`, [page](speed.md), one.md"
    )
    assert quoted(text, tmp_path) == ["one.md", "there.md", "two.md"]


def test_the_list_has_every_script_with_its_purpose() -> None:
    text, known = listed(), scripts()
    for script in known:
        assert script.says.endswith((".", "?")), script.name
        assert f"{script.name} " in text
        assert script.says in text
    written = {name for script in known for name in script.results}
    assert {"growth.md", "long-jobs.md", "controls.md"} <= written


def test_the_page_names_every_suite_and_every_report() -> None:
    text = PAGE.read_text(encoding="utf-8")
    of_suites = text.partition("## Suites")[2].partition("\n## ")[0]
    assert re.findall(r"^\| `([a-z0-9-]+)` \|", of_suites, re.MULTILINE) == list(SUITES)
    for file in RESULTS.glob("suite-*.md"):
        assert f"results/{file.name}" in text
    assert (ROOT / "benchmarks" / "__main__.py").is_file()
