"""Mutated inputs of all other kinds than NC programs: does each end in a result or in a sentence, in time and in memory?

    python -m benchmarks.fuzz [--minutes 10] [--kinds hpgl machine imports trajectory report] [--seed 0]

NC programs are those of benchmarks/nc_mutants.py. Every input goes through the commands as a user has them, in this process. A finding
is an exception, a warning of a library, a refusal without a sentence, a page in which a text of the input became an element or a
script, or an input that takes longer than `SECONDS`. Writes results/fuzz.json and .md; kinds that are not run keep theirs.
Exit code 1 after a finding, with its seed: `--seed N --count 1` runs it again.
"""

from __future__ import annotations

import argparse
import json
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.fuzz_plans import try_report, try_trajectory
from benchmarks.fuzz_run import Command, command
from benchmarks.fuzz_settings import try_hpgl, try_imports, try_machine
from benchmarks.record import RESULTS, markdown, provenance, write_results

SECONDS = 20  # of computing for one input
MEMORY = 6 << 30  # bytes of address space
SHOWN = 25  # findings whose traceback is printed, of each kind

KINDS: dict[str, Callable[[np.random.Generator, Path, Command], str]] = {
    "hpgl": try_hpgl,
    "machine": try_machine,
    "imports": try_imports,
    "trajectory": try_trajectory,
    "report": try_report,
}


class _Hung(BaseException):
    """An input took longer than `SECONDS`."""


def _hung(*_: object) -> None:
    raise _Hung


def run(kind: str, first: int, minutes: float, count: int | None) -> dict[str, Any]:
    """Inputs of a kind for so many minutes, or so many: how many came to what end, and the seeds of findings."""
    found: Counter[str] = Counter()
    findings: list[dict[str, Any]] = []
    began = time.monotonic()
    seed = first
    with tempfile.TemporaryDirectory(prefix="fuzz-") as name:
        while (time.monotonic() - began < 60.0 * minutes) if count is None else seed < first + count:
            signal.setitimer(signal.ITIMER_PROF, SECONDS)
            try:
                found[KINDS[kind](np.random.default_rng([seed, len(kind)]), Path(name), command)] += 1
            except (Exception, _Hung) as fault:
                signal.setitimer(signal.ITIMER_PROF, 0)
                found["finding"] += 1
                findings.append(
                    {"seed": seed, "said": "hung" if isinstance(fault, _Hung) else str(fault)[-300:]}
                )
                if len(findings) <= SHOWN:
                    print(f"---- {kind} {seed}", flush=True)
                    traceback.print_exc(file=sys.stdout)
            signal.setitimer(signal.ITIMER_PROF, 0)
            seed += 1
    minutes_taken = (time.monotonic() - began) / 60.0
    return {
        "inputs": seed - first,
        "minutes": minutes_taken,
        "found": dict(found),
        "findings": findings,
        "first_seed": first,
    }


def table(kinds: dict[str, dict[str, Any]]) -> str:
    """The kinds in Markdown."""
    ends = [*sorted({end for of in kinds.values() for end in of["found"] if end != "finding"}), "finding"]
    rows = [
        [
            kind,
            of["commit"],
            f"{of['inputs']:,}",
            f"{of['minutes']:.0f}",
            *(f"{of['found'].get(end, 0):,}" for end in ends),
        ]
        for kind, of in kinds.items()
    ]
    return markdown(["kind", "at", "inputs", "minutes", *ends], rows)


def main() -> None:
    """Fuzz, and write the summary."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=10.0, help="of each kind")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=[*KINDS])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, help="so many inputs of each kind, and nothing is written")
    given = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    signal.signal(signal.SIGPROF, _hung)
    file = RESULTS / "fuzz.json"
    kinds: dict[str, dict[str, Any]] = json.loads(file.read_text("utf-8"))["kinds"] if file.exists() else {}
    for kind in given.kinds:
        done = run(kind, given.seed, given.minutes, given.count)
        print(kind, done["inputs"], done["found"], [one["seed"] for one in done["findings"]][:50], flush=True)
        kinds[kind] = done | {"commit": provenance()["commit"]}
        if given.count is None:
            write_results("fuzz", {"kinds": kinds}, table(kinds))
    sys.exit(1 if any(kinds[kind]["findings"] for kind in given.kinds) else 0)


if __name__ == "__main__":
    main()
