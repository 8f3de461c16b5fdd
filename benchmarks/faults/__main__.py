"""What goes wrong around the planner: is anything lost or half written, and is the user told in plain words?

    python -m benchmarks.faults [--count 40] [--kinds kill interrupt ...] [--seed 0]     into results/faults.json and .md

So many trials of each kind, of small jobs, in processes of their own. The folder that a trial writes to holds the whole result of an
earlier run. A trial is wrong if afterwards neither this nor a new result is whole, if anything half written lies about, if the exit
code is none of the planner's, or if the message is a traceback or calls it a bug of the planner.

`full` and `read-only` use small file systems in memory where this process may mount them, else limits of the size of files and /proc.
"""

from __future__ import annotations

import argparse
import json
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.faults.bench import Bench
from benchmarks.faults.kinds import KINDS
from benchmarks.record import RESULTS, markdown, provenance, write_results


def trials(kind: str, count: int, rng: random.Random) -> list[dict[str, Any]]:
    """So many trials of a kind."""
    rows = []
    trial: Callable[[Bench, random.Random], dict[str, Any]] = KINDS[kind]
    with tempfile.TemporaryDirectory(prefix="faults-") as folder:
        bench = Bench(Path(folder))
        for _ in range(count):
            row = trial(bench, rng)
            rows.append(row)
            if row["wrong"]:
                print(f"{kind}: {row}", flush=True)
    return rows


def table(kinds: dict[str, dict[str, Any]]) -> str:
    """The kinds in Markdown."""
    lines = []
    for kind, of in kinds.items():
        ends = Counter(str(end) for row in of["trials"] for end in row["exits"])
        told = ", ".join(f"{end}: {count}" for end, count in sorted(ends.items()))
        wrong = sum(bool(row["wrong"]) for row in of["trials"])
        lines.append([kind, of["commit"], str(len(of["trials"])), told, str(wrong)])
    return markdown(["kind", "at", "trials", "exit codes: processes (negative: the signal)", "wrong"], lines)


def main() -> None:
    """Hold the trials, and write what came of them."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=[*KINDS])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--dry", action="store_true", help="write no results")
    given = parser.parse_args()
    file = RESULTS / "faults.json"
    kinds: dict[str, Any] = json.loads(file.read_text("utf-8"))["kinds"] if file.exists() else {}
    wrong = 0
    for kind in given.kinds:
        began = time.monotonic()
        rows = trials(kind, given.count, random.Random(f"{given.seed} {kind}"))
        kinds[kind] = {"commit": provenance()["commit"], "trials": rows}
        bad = sum(bool(row["wrong"]) for row in rows)
        wrong += bad
        print(f"{kind}: {len(rows)} trials, {bad} wrong, {time.monotonic() - began:.0f} s", flush=True)
        if not given.dry:
            write_results("faults", {"kinds": kinds}, table(kinds))
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
