"""A few inputs of each kind of benchmarks/fuzz; what it counts, keeps and takes up again; and what it sees in a page."""

from __future__ import annotations

import argparse
import importlib
import json
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.fuzz import __main__ as fuzz
from benchmarks.fuzz import tally as fuzz_tally
from benchmarks.fuzz.__main__ import new_input, outcome, run
from benchmarks.fuzz.corpus import Corpus, Input, write_input
from benchmarks.fuzz.coverage import Tracer, count_lines
from benchmarks.fuzz.kinds import KINDS
from benchmarks.fuzz.pages import MARKER, Page, check_page
from benchmarks.fuzz.run import Finding, Kind, Place, command

INPUTS = 5
TRACED = """X = 1


def sign(x):
    if x < 0:
        return -1
    return 1
"""


@pytest.mark.shows("read-refused", "sampled: mutated programs end in a program or a sentence")
@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_inputs_end_in_a_result_or_a_sentence(kind: str, tmp_path: Path) -> None:
    place = Place(tmp_path, command)
    for seed in range(INPUTS):
        one = new_input(KINDS[kind], seed, None, place)
        assert KINDS[kind].judge(one.data, np.random.default_rng(seed), place)
        again = KINDS[kind].make(np.random.default_rng(seed), one.data, place)
        assert KINDS[kind].judge(again, np.random.default_rng(seed), place)


def test_lines_and_ways_of_a_module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "traced_by_test.py"
    file.write_text(TRACED)
    monkeypatch.syspath_prepend(str(tmp_path))
    module = importlib.import_module("traced_by_test")
    tracer = Tracer([file])
    seen = []
    for x in (1, 2, -1):
        with tracer.watching():
            module.sign(x)
        seen.append((tracer.new, tracer.lines))
    assert seen == [(2, 2), (0, 2), (1, 3)]
    assert count_lines([file]) == 3
    sys.modules.pop("traced_by_test")


def a_kind(file: Path) -> Kind:
    """Texts of one letter; "z" is an error, and each other letter of the alphabet a line of its own."""
    lines = "".join(
        f"    if letter == {chr(k)!r}:\n        return 'read'\n" for k in range(ord("a"), ord("k"))
    )
    file.write_text(f"def read(letter):\n{lines}    assert letter != 'z'\n    return 'refused'\n")
    module = importlib.import_module(file.stem)

    def make(rng: np.random.Generator, start: bytes | None, _: Place) -> bytes:
        return b"%c" % int(rng.integers(ord("a"), ord("z") + 1))

    return Kind(make, lambda data, _, __: str(module.read(data.decode())), (str(file),), guided=True)


@pytest.fixture
def letters(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> argparse.Namespace:
    """A run of `a_kind` of 100 inputs."""
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setitem(KINDS, "letters", a_kind(tmp_path / "letters_by_test.py"))
    monkeypatch.setattr(fuzz_tally, "RESULTS", tmp_path)
    monkeypatch.setattr("benchmarks.record.RESULTS", tmp_path)
    monkeypatch.setattr("benchmarks.fuzz.corpus.ROOT", tmp_path)
    yield argparse.Namespace(minutes=10.0, corpus=tmp_path / "corpus")
    sys.modules.pop("letters_by_test")


class After:
    """Says stop after so many questions."""

    def __init__(self, count: int):
        self.left = count

    def __bool__(self) -> bool:
        self.left -= 1
        return self.left < 0


def test_runs_add_up(letters: argparse.Namespace, tmp_path: Path) -> None:
    assert run("letters", letters, After(60)) > 0
    first = json.loads((tmp_path / "fuzz.json").read_text())["kinds"]["letters"][0]
    assert first["inputs"] == sum(first["found"].values()) == first["next_seed"] == 60
    kept = len(list((letters.corpus / "letters" / "inputs").iterdir()))
    assert kept == first["kept"] > 5
    run("letters", letters, After(60))
    rows = json.loads((tmp_path / "fuzz.json").read_text())["kinds"]["letters"]
    assert [(row["inputs"], row["next_seed"]) for row in rows] == [(120, 120)]
    assert rows[0]["kept"] >= kept
    assert rows[0]["minutes"] > first["minutes"]
    assert "letters" in (tmp_path / "fuzz.md").read_text()


def test_a_finding_is_kept_with_its_input(letters: argparse.Namespace, tmp_path: Path) -> None:
    run("letters", letters, After(100))
    row = json.loads((tmp_path / "fuzz.json").read_text())["kinds"]["letters"][0]
    ((said, one),) = row["findings"].items()  # all of them are the same but for numbers
    assert "AssertionError" in said
    assert one["times"] == row["found"]["finding"]
    file = letters.corpus / "letters" / "findings" / one["input"]
    with pytest.raises(Finding, match="AssertionError"):
        outcome(KINDS["letters"], fuzz.read_input(file), Place(tmp_path, command))


def test_an_input_that_ended_the_process_is_a_finding_of_the_next_run(
    letters: argparse.Namespace, tmp_path: Path
) -> None:
    write_input(letters.corpus / "letters" / "current", Input(b"a", 7), 7)
    assert run("letters", letters, After(3)) > 0
    row = json.loads((tmp_path / "fuzz.json").read_text())["kinds"]["letters"][0]
    assert row["findings"]["the process ended while it was tried"]["times"] == 1
    assert row["next_seed"] == 8 + 3
    assert not list((letters.corpus / "letters" / "current").iterdir())


def test_kept_inputs_are_tried_again_where_the_sources_changed(
    letters: argparse.Namespace, tmp_path: Path
) -> None:
    run("letters", letters, After(100))
    file = tmp_path / "letters_by_test.py"
    file.write_text(file.read_text() + "# changed\n")
    tried: list[Input] = []
    corpus = Corpus(letters.corpus / "letters", Tracer([file]))
    corpus.load(tried.append)
    assert len(tried) > 5
    assert not corpus.inputs  # none of them reached anything: nothing was run


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
