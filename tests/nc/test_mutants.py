"""Mutated programs of every dialect end in a program or in a message (benchmarks/nc_mutants.py reads 15,000 of them)."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.nc_mutants import a_machine, a_reading, load_programs, mutant, outcome

COUNT = 400


@pytest.fixture(scope="module")
def programs(shared_dir: Path) -> list[list[bytes]]:
    folder = shared_dir / "nc"
    return load_programs(folder)


@pytest.mark.parametrize("first", range(0, COUNT, 100))
def test_mutants_end_in_a_program_or_in_a_message(first: int) -> None:
    found = {
        outcome(mutant(seed, []), a_reading(seed), a_machine(seed)) for seed in range(first, first + 100)
    }
    assert found <= {"read", "refused", "not a program"}
    assert "refused" in found


def test_some_mutants_are_read() -> None:
    """3 to 8 % of them are programs still."""
    assert "read" in {outcome(mutant(seed, []), a_reading(seed), a_machine(seed)) for seed in range(200)}


def test_mutants_of_real_programs(programs: list[list[bytes]]) -> None:
    for seed in range(COUNT, COUNT + 100):
        outcome(mutant(seed, programs), a_reading(seed), a_machine(seed))


def test_the_same_seed_makes_the_same_mutant() -> None:
    assert mutant(7, []) == mutant(7, [])
    assert len({mutant(seed, []) for seed in range(50)}) > 45
