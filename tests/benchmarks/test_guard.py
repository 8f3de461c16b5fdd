"""The guard: the quick suite gives no worse status, verdict or cycle time than benchmarks/results/quick.jsonl, by `compare` (1e-3).

After a change that makes plans faster, `python -m benchmarks run quick` makes the reference anew; read its diff before committing.
"""

from __future__ import annotations

from functools import cache

import pytest
from quick import slow_but

from benchmarks.record import RESULTS
from benchmarks.runner.compared import BETTER, changes, worse
from benchmarks.runner.measure import outcome
from benchmarks.runner.rows import ERROR, Key, Row, read
from benchmarks.runner.suites import SUITES
from benchmarks.runner.ways import way_of

SUITE = SUITES["quick"]
JOBS = {job.name: job for job in SUITE.jobs()}
REFERENCE = read(RESULTS / "quick.jsonl").rows


@cache
def fresh(name: str) -> dict[Key, Row]:
    """The rows of a job, made here and now."""
    rows = []
    for way in map(way_of, SUITE.ways):
        blank = Row(suite="quick", job=name, way=way.name, kind=way.kind, status=ERROR)
        rows.append(outcome(way, JOBS[name], blank))
    return {row.key: row for row in rows}


def of_job(name: str) -> dict[Key, Row]:
    return {key: row for key, row in REFERENCE.items() if key[1] == name}


def test_the_reference_has_every_pair_and_all_of_them_pass() -> None:
    assert REFERENCE.keys() == {("quick", name, way) for name in JOBS for way in SUITE.ways}
    assert {row.verdict for row in REFERENCE.values()} == {"passed"}


CASES = slow_but(("pentagon", "long, short, long"), JOBS)


@pytest.mark.parametrize("name", CASES)
def test_nothing_is_worse(name: str) -> None:
    assert [str(change) for change in worse(changes(of_job(name), fresh(name)))] == []


@pytest.mark.parametrize("name", CASES)
def test_nothing_is_faster_than_the_reference_says(name: str) -> None:
    """A reference that is slower than the plans of today would not see the next loss."""
    better = [str(change) for change in changes(of_job(name), fresh(name)) if change.kind == BETTER]
    assert better == [], "make the reference anew: python -m benchmarks run quick"
