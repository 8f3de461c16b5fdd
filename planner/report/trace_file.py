"""The trace of a plan as a JSON file: `program`, `method`, `corner`, `cycle_time_s`, `sentence`, and `steps`, one object each.

Every step has `at` [s], `name`, `found` and `before` [s] or null, `kept` or null, and facts by name (planning/job/trace.py).
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

from planner.planning.job.plan import Plan
from planner.planning.job.trace import Trace
from planner.report.replace import check_file, replacing_file

KEYS = {"program", "method", "steps"}  # by which a file is known as a trace


def check_place(path: Path, inputs: Iterable[Path] = (), *, force: bool = False) -> None:
    """Raise InputError for a place that is no file in a directory, for one of the inputs, and for another file than a trace, unless
    `force` is set."""
    check_file(path, inputs, _is_trace, force=force)


def write_trace(path: Path, trace: Trace, plan: Plan) -> None:
    """Write the trace of a plan, the whole file or none of it. Raises InputError where it cannot be written."""
    value = {
        "program": plan.program.source,
        "method": plan.method,
        "corner": plan.corner,
        "cycle_time_s": plan.trajectory.cycle_time if plan.trajectory is not None else None,
        "sentence": plan.sentence,
        "steps": trace.as_json(),
    }
    with replacing_file(path) as new:
        new.write_text(json.dumps(value, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def _is_trace(path: Path) -> bool:
    try:
        return set(json.loads(path.read_bytes())) >= KEYS
    except (ValueError, RecursionError, TypeError):
        return False
