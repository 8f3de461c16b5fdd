"""Every citation of docs/papers.md finds its label there, and every test that the page names cites the label in turn."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PAGE = (ROOT / "docs" / "papers.md").read_text(encoding="utf-8")
CITING = sorted(
    path
    for folder, pattern in (
        ("planner", "*.py"),
        ("tests", "*.py"),
        ("benchmarks", "*.py"),
        ("notebooks", "*.ipynb"),
    )
    for path in (ROOT / folder).rglob(pattern)
    if path != Path(__file__).resolve()
)
# "docs/papers.md A.14", "docs/papers.md B1, F5", "docs/papers.md A1/A4"; a citation in words ("docs/papers.md, short segments")
# has no label.
LABEL = r"(?:[A-H](?:\.?G3|\.\d+|\d+)?|0)"
CITATION = re.compile(rf"docs/papers\.md ({LABEL}(?:(?:, |/){LABEL})*)(?![\w'])")


def labels_of(text: str) -> set[str]:
    """The labels that a text cites."""
    return {label for group in CITATION.findall(text) for label in re.split(r", |/", group)}


def labels_of_page() -> set[str]:
    """Sections ("# B. ...", "### C.G3 ...", "## 0. ...") and the rows of the index of checks."""
    sections = re.findall(rf"^#+ ({LABEL})[. ]", PAGE, re.MULTILINE)
    return {*sections, *re.findall(r"^\| \*\*(\w+)\*\* \|", PAGE, re.MULTILINE)}


def test_every_cited_label_is_on_the_page():
    known = labels_of_page()
    missing = {
        str(path.relative_to(ROOT)): sorted(unknown)
        for path in CITING
        if (unknown := labels_of(path.read_text(encoding="utf-8")) - known)
    }
    assert not missing


def test_labels_are_found_where_they_are_cited():
    """The search itself: it would pass on nothing if it found nothing."""
    assert labels_of("see docs/papers.md A.14, peaks (docs/papers.md B1, F5) docs/papers.md A1/A4 docs/papers.md C.G3.") == {
        "A.14", "B1", "F5", "A1", "A4", "C.G3",
    }  # fmt: skip
    cited = set().union(*(labels_of(path.read_text(encoding="utf-8")) for path in CITING))
    assert {"D", "A.14", "C.G3", "F1"} <= cited


def rows_with_tests() -> list[tuple[str, str]]:
    rows = re.findall(r"^\| \*\*(\w+)\*\* \|.*\| ([^|]*) \|$", PAGE, re.MULTILINE)
    return [(label, name) for label, names in rows for name in re.findall(r"`([^`]+)`", names)]


@pytest.mark.parametrize(("label", "name"), rows_with_tests())
def test_named_files_repeat_the_check(label: str, name: str):
    assert label in labels_of((ROOT / name).read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    "text",
    [
        "LI Dongdong",
        "10.3969/j.issn.1005-2895.2019.06.011",
        "CHEN Yang",
        "10.3969/j.issn.1005-2895.2017.03.016",
    ],
)
def test_the_papers_are_named(text: str):
    assert text in PAGE
