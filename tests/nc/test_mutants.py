"""Mutated programs of every dialect end in a program or in a message (benchmarks/fuzz reads many more of them)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.fuzz.programs import a_machine, a_reading, load_programs, mutant, outcome

COUNT = 400


def end_of(seed: int, programs: list[list[bytes]]) -> str:
    rng = np.random.default_rng([seed, 1])
    return outcome(mutant(np.random.default_rng(seed), programs), a_reading(rng), a_machine(rng))


@pytest.fixture(scope="module")
def programs(shared_dir: Path) -> list[list[bytes]]:
    return load_programs(shared_dir / "nc")


@pytest.mark.shows("read-refused", "sampled: mutated programs end in a program or a sentence")
@pytest.mark.parametrize("first", range(0, COUNT, 100))
def test_mutants_end_in_a_program_or_in_a_message(first: int) -> None:
    found = {end_of(seed, []) for seed in range(first, first + 100)}
    assert found <= {"read", "refused", "not a program"}
    assert "refused" in found


@pytest.mark.shows("read-refused", "sampled: mutated programs end in a program or a sentence")
def test_some_mutants_are_read() -> None:
    """3 to 8 % of them are programs still."""
    assert "read" in {end_of(seed, []) for seed in range(200)}


@pytest.mark.shows("read-refused", "sampled: mutated programs end in a program or a sentence")
def test_mutants_of_real_programs(programs: list[list[bytes]]) -> None:
    for seed in range(COUNT, COUNT + 100):
        end_of(seed, programs)


@pytest.mark.shows("read-refused", "sampled: mutated programs end in a program or a sentence")
def test_the_same_seed_makes_the_same_mutant() -> None:
    made = [mutant(np.random.default_rng(seed), []) for seed in range(50)]
    assert made[7] == mutant(np.random.default_rng(7), [])
    assert len(set(made)) > 45
