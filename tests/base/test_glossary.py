"""The page in docs/ is the glossary of the package."""

from __future__ import annotations

from pathlib import Path

from planner.base.glossary import BESIDE, PARTS, TERMS, markdown

ROOT = Path(__file__).resolve().parents[2]


def test_the_page_is_up_to_date() -> None:
    assert (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8") == markdown()


def test_every_word_stands_once() -> None:
    words = [*PARTS, *BESIDE, *TERMS]
    assert len(set(words)) == len(words)
    assert len(PARTS) == 6
