"""A few inputs of each kind of benchmarks/fuzz.py; and a page in which a text has become more than a text is seen there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.fuzz import KINDS
from benchmarks.fuzz_plans import MARKER, Page, check_page
from benchmarks.fuzz_run import command

INPUTS = 5


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_inputs_end_in_a_result_or_a_sentence(kind: str, tmp_path: Path) -> None:
    for seed in range(INPUTS):
        assert KINDS[kind](np.random.default_rng([seed, 77]), tmp_path, command)


@pytest.mark.parametrize(
    "wrong",
    [
        f"<img src=x onerror={MARKER}()>",
        f"<script>{MARKER}()</script>",
        "<b>new</b>",
        f'<p title="{MARKER}">x</p>',
    ],
)
def test_what_became_more_than_a_text_is_seen(wrong: str, tmp_path: Path) -> None:
    harmless, page = tmp_path / "harmless.html", tmp_path / "page.html"
    harmless.write_text("<p title='x'>text</p><script>run()</script>")
    page.write_text(f"<p title='x'>&lt;{MARKER}&gt;</p>")
    check_page(page, harmless)
    page.write_text(f"<p title='x'>text</p>{wrong}")
    with pytest.raises(AssertionError, match="in the page"):
        check_page(page, harmless)


def test_data_in_a_page_are_no_script() -> None:
    page = Page(f'<script type="application/json" id="about">{{"a": "{MARKER}"}}</script>')
    assert page.data
    assert not page.wrong
