"""Random programs of cycles, offsets, feed modes, lathes and cutter compensation: the reader and LinuxCNC's interpreter read the same.

What one refuses the other refuses, but for two things: the reader refuses every inner corner that takes more of a move than there is,
LinuxCNC only some of them (at others its tool moves backwards, or once round an arc); and LinuxCNC refuses arcs that begin early where
it goes straight on (planner/nc/cutter.py).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from oracle import Canon, asked, asked_of_kinds, needs_oracle, recorded
from random_nc import KINDS as OF_ONE_KIND
from random_splines import random_splines
from random_together import together
from test_agreement import MACHINE, assert_same_motion, offsets_in_inches, random_program

from benchmarks.controls import linuxcnc_answers
from planner.base.errors import InputError
from planner.nc.reader import parse_program

KINDS = {**OF_ONE_KIND, "moves": random_program, "splines": random_splines, "together": together}
COUNT = 25  # of each kind; benchmarks/reading/random_programs.py reads thousands
EARLY = 0.02  # share of programs that only LinuxCNC refuses for an arc that begins early, at most: 1 of 650 was seen
GOUGES = 0.04  # share of programs that only the reader refuses, at most: 23 of 1500 were seen


@dataclass
class Tally:
    """What became of programs: read, refused by both, refused here alone as gouging, refused there alone for an arc that begins early,
    blocks compared, and disagreements."""

    read: int = 0
    refused: int = 0
    gouges: int = 0
    early: int = 0
    blocks: int = 0
    wrong: tuple[str, ...] = ()

    def add(self, kind: str, text: str, canon: Canon) -> None:
        """Compare one program."""
        try:
            program = parse_program(text, MACHINE)
        except InputError as fault:
            if canon.error:
                self.refused += 1
            elif "gouge" in str(fault):
                self.gouges += 1
            else:
                self.wrong += (f"{text}\nonly the reader refuses: {fault}",)
            return
        if "Arc move in concave corner" in canon.error:
            self.early += 1
            return
        try:
            assert not canon.error, f"only LinuxCNC refuses: {canon.error}"
            slow = any(
                "G93 asks for less" in said for said in program.assumptions
            )  # whose feed LinuxCNC raises
            assert_same_motion(
                program, canon, centre=1e-6, feeds=kind not in ("lathe", "together") and not slow
            )
        except AssertionError as fault:
            self.wrong += (f"{text}\n{fault}",)
        self.read += 1
        self.blocks += len(program)


def random_texts(kind: str, count: int, seed: int) -> list[str]:
    """So many programs of a kind."""
    rng = np.random.default_rng(seed)
    return [KINDS[kind](rng) for _ in range(count)]


def tally_of(kind: str, programs: Iterable[tuple[str, Canon]]) -> Tally:
    """What becomes of programs of a kind, with LinuxCNC's answers."""
    tally = Tally()
    for text, canon in programs:
        tally.add(kind, text, canon)
    return tally


def compare(kind: str, count: int, seed: int, folder: Path) -> Tally:
    """Read `count` random programs of a kind on both sides."""
    texts = random_texts(kind, count, seed)
    return tally_of(kind, zip(texts, asked(texts, offsets_in_inches(), folder), strict=True))


@pytest.fixture(scope="module")
def answered(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[tuple[str, Canon]]]:
    """`COUNT` random programs of every kind, and what LinuxCNC makes of them."""
    programs = {kind: (random_texts(kind, COUNT, 2026), offsets_in_inches()) for kind in KINDS}
    answers = asked_of_kinds(programs, tmp_path_factory.mktemp("random"))
    return {kind: list(zip(texts, answers[kind], strict=True)) for kind, (texts, _) in programs.items()}


def assert_agreed(tally: Tally, count: int) -> None:
    assert not tally.wrong, tally.wrong[0]
    assert tally.read > count / 2
    assert tally.gouges <= 1 + GOUGES * count
    assert tally.early <= 1 + EARLY * count


@pytest.mark.shows("read-linuxcnc", "compared: LinuxCNC 2.9's rs274, recorded answers to random programs")
@pytest.mark.parametrize("kind", KINDS)
def test_programs_agree_with_the_recorded_answers(kind: str) -> None:
    assert_agreed(tally_of(kind, recorded()[kind]), len(recorded()[kind]))


@pytest.mark.slow
@needs_oracle
@pytest.mark.parametrize("kind", KINDS)
def test_random_programs_of_a_kind_agree(answered: dict[str, list[tuple[str, Canon]]], kind: str) -> None:
    assert_agreed(tally_of(kind, answered[kind]), COUNT)


@needs_oracle
def test_the_recorded_answers_are_current(tmp_path: Path) -> None:
    """They are LinuxCNC's to these programs (python -m benchmarks.controls.linuxcnc_answers makes them)."""
    programs = linuxcnc_answers.programs()
    assert list(programs) == list(recorded())
    for kind, (texts, _) in programs.items():
        assert texts == [text for text, _ in recorded()[kind]], f"the generator of kind {kind} has changed"
    answers = asked_of_kinds(programs, tmp_path)
    for kind in programs:
        for (text, kept), canon in zip(recorded()[kind], answers[kind], strict=True):
            assert kept.error == canon.error, text
            np.testing.assert_allclose(kept.move, canon.move, rtol=1e-11, atol=1e-11, err_msg=text)
            np.testing.assert_allclose(kept.further, canon.further, rtol=1e-11, atol=1e-11, err_msg=text)
