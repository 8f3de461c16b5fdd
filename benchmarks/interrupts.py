"""Does Ctrl-C end `planner plan` with exit code 130 whenever it comes, and leave the outputs whole?

    python -m benchmarks.interrupts [--tries 100] [--cold 30] [--seed 0]     into results/interrupts.json and .md

Every try starts the command, sends SIGINT at a random time, and counts if it met a running process. `--cold` of them start with an
empty cache, so that kernels compile: there the signal comes within the first `COLD` seconds. The outputs of an earlier run lie in the
folder that it writes to: afterwards they, or those of the run that was interrupted, have to be whole, by the digests in summary.json,
with nothing beside them.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from hashlib import sha256
from pathlib import Path
from typing import Any

from benchmarks.record import markdown, write_results

COMMAND = [sys.executable, "-c", "print('begun', flush=True); from planner.cli import main; main()"]
JOB = "square.ngc"
SQUARE = "G21 G90 G94\nG64 P0.05\nG1 X20 F3000\nY20\nX0\nY0\n"
COLD = 40.0  # [s]
PATIENCE = 120.0  # what does not end for so long after the signal is hung [s]


def whole(out: Path) -> bool:
    """True if a folder holds the outputs of one run as its summary lists them, and nothing else lies in or beside it."""
    listed = json.loads((out / "summary.json").read_text(encoding="utf-8"))["sha256"]
    found = {
        path.name: sha256(path.read_bytes()).hexdigest()
        for path in out.iterdir()
        if path.name != "summary.json"
    }
    return found == listed and {path.name for path in out.parent.iterdir()} == {out.name, JOB}


def one(arguments: list[str], after: float, cache: str | None) -> dict[str, Any]:
    """The command, interrupted so many seconds after it began: how it ended, and how long that took [s]."""
    environment = dict(os.environ) if cache is None else os.environ | {"NUMBA_CACHE_DIR": cache}
    with subprocess.Popen(
        COMMAND + arguments,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
        # a shell's background jobs are born with interrupts ignored
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as process:
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(after)
        sent = time.monotonic()
        process.send_signal(signal.SIGINT)
        try:
            _, err = process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            return {"exit": None, "ended_after_s": PATIENCE, "said": "hung"}
    return {
        "exit": process.returncode,
        "ended_after_s": time.monotonic() - sent,
        "said": err[-200:] if process.returncode else "",
    }


def tries(count: int, cold: int, rng: random.Random) -> list[dict[str, Any]]:
    """So many tries that met a process."""
    rows: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as folder:
        job, out = Path(folder) / JOB, Path(folder) / "out"
        job.write_text(SQUARE)
        arguments = ["plan", str(job), "-o", str(out)]
        began = time.monotonic()
        subprocess.run(COMMAND + arguments, stdout=subprocess.DEVNULL, check=True)
        takes = time.monotonic() - began
        while len(rows) < count:
            compiling = len(rows) < cold
            after = rng.uniform(0.0, COLD if compiling else takes)
            with tempfile.TemporaryDirectory() as cache:
                row = one(arguments, after, cache if compiling else None)
            if row["exit"] == 0:
                continue  # it was done
            row |= {"compiling": compiling, "after_s": after, "whole": whole(out)}
            rows.append(row)
            print(len(rows), row, flush=True)
    return rows


def table(rows: list[dict[str, Any]]) -> str:
    """The tries in Markdown."""
    lines = []
    for compiling in (False, True):
        some = [row for row in rows if row["compiling"] == compiling]
        lines.append(
            [
                "with an empty cache" if compiling else "with kernels in the cache",
                str(len(some)),
                str(sum(row["exit"] == 130 for row in some)),
                str(sum(row["exit"] == -signal.SIGINT for row in some)),
                str(sum(row["exit"] not in (130, -signal.SIGINT) for row in some)),
                str(sum(not row["whole"] for row in some)),
                f"{max((row['ended_after_s'] for row in some), default=0.0):.2f}",
            ]
        )
    columns = [
        "`planner plan`",
        "tries that met it",
        "exit 130",
        "died of SIGINT (130 in a shell)",
        "anything else",
        "outputs not whole",
        "ended within [s]",
    ]
    return markdown(columns, lines)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tries", type=int, default=100)
    parser.add_argument("--cold", type=int, default=30, help="tries of them with an empty cache")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    rows = tries(given.tries, given.cold, random.Random(given.seed))
    write_results("interrupts", {"tries": rows}, table(rows))


if __name__ == "__main__":
    main()
