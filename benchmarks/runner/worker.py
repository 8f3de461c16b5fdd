"""The process that measures: `python -m benchmarks.runner.worker WAY`, with a request a line on standard input and its row on standard
output.

A request is {"suite", "job", "repeats", "limit", "commit"}. The first line of output says that the way is warm. What is printed
meanwhile goes to standard error. One process serves one way, so that its warm-up counts once; the parent starts another one where it
dies.
"""

from __future__ import annotations

import json
import os
import resource
import sys

from benchmarks.runner.measure import Calibration, Protocol, measured, warm_up
from benchmarks.runner.rows import ERROR, Row, line_of
from benchmarks.runner.suites import SUITES
from benchmarks.runner.ways import way_of
from planner.base.threads import use_threads

READY = "ready"


def main() -> None:
    """Serve until the input ends."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    use_threads(1)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # a process that its limit ends leaves no image
    way = way_of(sys.argv[1])
    warm_up(way)
    calibration = Calibration()
    print(READY, file=answers, flush=True)
    made: dict[str, dict] = {}
    for line in sys.stdin:
        asked = json.loads(line)
        suite = asked["suite"]
        if suite not in made:
            made[suite] = {job.name: job for job in SUITES[suite].jobs()}
        blank = Row(
            suite=suite, job=asked["job"], way=way.name, kind=way.kind, status=ERROR, commit=asked["commit"]
        )
        protocol = Protocol(repeats=asked["repeats"], limit=asked["limit"])
        row = measured(way, made[suite][asked["job"]], blank, protocol, calibration)
        print(line_of(row), file=answers, flush=True)


if __name__ == "__main__":
    main()
