"""Rows for the tests of benchmarks."""

from __future__ import annotations

from typing import Any

from benchmarks.runner.rows import METHOD, PASSED, SOLVED, Key, Row


def row(job: str = "corner", way: str = "optimal", **more: Any) -> Row:
    given: dict[str, Any] = {
        "kind": METHOD,
        "status": SOLVED,
        "verdict": PASSED,
        "cycle_s": 1.0,
        "cpu_s": 0.5,
    }
    return Row(suite="quick", job=job, way=way, **(given | more))


def keyed(*rows: Row) -> dict[Key, Row]:
    return {one.key: one for one in rows}
