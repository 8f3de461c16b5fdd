"""The status page: every feature of the tables has a row, every mark names a feature, and the committed table is that of the marks."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.record import RESULTS
from benchmarks.runner.ages import made_of
from benchmarks.status import KINDS, TRIED, features, front, marks, named_words, page, rows

PAGE = RESULTS / "status.md"


def test_everything_that_the_tables_name_has_a_row() -> None:
    """Commands, options, exports, methods, geometries, corner shapes and solvers, each in one row."""
    words = [word for feature in features().values() for word in feature.words]
    assert sorted(words) == sorted(set(words))
    assert set(words) == named_words()


def test_words_of_the_tables_are_found() -> None:
    assert {
        "planner machine fit",
        "export twincat",
        "--cluster",
        "method fir-plain",
        "solver fatrop",
    } <= named_words()
    assert len([word for word in named_words() if word.startswith("planner ")]) >= 16


def test_every_mark_names_a_feature_and_every_result_is_there() -> None:
    found = features()
    assert sorted({one.feature for one in marks()} - found.keys()) == []
    results = {name for feature in found.values() for name in feature.results}
    assert [name for name in sorted(results) if not (RESULTS / name).is_file()] == []


def test_the_committed_table_is_that_of_the_marks() -> None:
    first, _, text = PAGE.read_text(encoding="utf-8").partition("\n\n")
    assert made_of(first) is not None
    assert text == page(marks()), "python -m benchmarks status"


def test_the_sentence_of_the_front_page_has_the_figures_of_the_results() -> None:
    text = front.PAGE.read_text(encoding="utf-8")
    assert front.with_sentence(text) == text, "python -m benchmarks status"


def test_what_no_test_shows_is_only_tried(tmp_path: Path) -> None:
    assert {row[1] for row in rows([])} == {TRIED}
    (tmp_path / "test_one.py").write_text(
        'import pytest\n\n@pytest.mark.shows("stop", "exact: by hand")\n@pytest.mark.slow\ndef test_a():\n    pass\n'
        'def test_b():\n    """@pytest.mark.shows("stop", "sampled: nothing")"""\n'
    )
    (shown,) = marks(tmp_path)
    assert (shown.feature, shown.kind, shown.text, shown.place) == (
        "stop",
        "exact",
        "by hand",
        "test_one.py::test_a",
    )
    known = {row[0]: row[1] for row in rows([shown])}
    assert known[features()["stop"].what] == "exact"
    assert sorted(set(known.values())) == ["exact", TRIED]


@pytest.mark.parametrize(
    "mark", ['"stop"', '"stop", "proved: by hand"', '"stop", "exact"', '"stop", how="exact: a"', '"stop", 1']
)
def test_a_mark_that_says_not_how_is_refused(tmp_path: Path, mark: str) -> None:
    (tmp_path / "test_one.py").write_text(
        f"import pytest\n\n@pytest.mark.shows({mark})\ndef test_a():\n    pass\n"
    )
    with pytest.raises(ValueError, match=r"^test_one\.py::test_a: .*exact|^test_one\.py::test_a: a mark is"):
        marks(tmp_path)


def test_there_are_words_for_every_kind() -> None:
    assert {one.kind for one in marks()} <= set(KINDS)
    assert "measured" not in {one.kind for one in marks()}, "then results/status.md says of which control"
