"""Mutants of the source: which change of a formula, a constraint, the judge, the reader would no test see?

    python -m benchmarks.mutants [--each N] [--areas NAME ...] [--seed S] [--again] [--seconds T]     into results/mutants.md and .json

N mutants of each area (draw.py) are tried one after the other: the quick tests that run its line (covered.py) run in a copy of the
checkout with the mutant in it (trial.py), up to the first failure of a test that passes without it. What became of a mutant is kept in
mutants.json at once, and it is not tried again; --again tries those that survived once more, and --seconds begins no other after so
many. reasons.toml says of survivors why they are right, or what they change that nobody asks for. Which tests run which lines is found
once for each area, in about the time of its quick tests (coverage.py must be installed), and kept in build/; --cover finds it anew.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
import tomllib
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.mutants.covered import Covered
from benchmarks.mutants.draw import AREAS, Mutant, drawn
from benchmarks.mutants.trial import (
    KILLED,
    NO_END,
    SURVIVED,
    copy_of_checkout,
    covered,
    outcome,
    room_of,
    run,
)
from benchmarks.record import RESULTS, ROOT, markdown, planner_state, write_results

NAME = "mutants"
KEPT = RESULTS / f"{NAME}.json"
COVERED = ROOT / "build"
REASONS = Path(__file__).with_name("reasons.toml")
SAME, ELSEWHERE, OPEN = (
    "same",
    "elsewhere",
    "open",
)  # nothing that is promised changes; another room finds it; neither
Row = dict[str, Any]


def reasons() -> dict[str, dict[str, str]]:
    """Of survivors by key: `kind` (`SAME`, `ELSEWHERE` or `OPEN`) and `why`."""
    found: dict[str, dict[str, str]] = tomllib.loads(REASONS.read_text(encoding="utf-8"))
    return found


def counts(rows: list[Row]) -> list[list[str]]:
    """A row of the table for each area, and one of all."""
    why, table = reasons(), []
    for area in [*AREAS, "all"]:
        own = [row for row in rows if area in (row["area"], "all")]
        became = Counter(row["became"] for row in own)
        kinds = Counter(why.get(row["key"], {}).get("kind", OPEN) for row in own if row["became"] == SURVIVED)
        share = f"{100 * kinds[OPEN] / max(len(own) - kinds[SAME], 1):.1f} %"
        shown = (len(own), became[KILLED], became[NO_END], kinds[ELSEWHERE], kinds[SAME], kinds[OPEN])
        table.append([area, *map(str, shown), share])
    return table


def page(rows: list[Row]) -> str:
    """What stands in results/mutants.md behind its first line."""
    why = reasons()
    columns = [
        "area",
        "mutants",
        "killed by a test",
        "killed: no end",
        "killed in another room, or since",
        "survived: the same",
        "survived",
    ]
    columns += ["share of those that differ"]
    lines = [
        f"| {row['key'].replace('|', '/')} | {why.get(row['key'], {}).get('why', '')} |"
        for row in rows
        if row["became"] == SURVIVED
    ]
    return (
        markdown(columns, counts(rows))
        + "\nKilled by the quick tests of the room alone: what only others find counts as survived until a reason names the test,\n"
        "which may have been written for it.\n\n"
        + "\n".join(["| survived | why |", "|---|---|", *lines])
        + "\n"
    )


def kept() -> dict[str, Row]:
    """The rows of earlier runs by key."""
    if not KEPT.exists():
        return {}
    return {row["key"]: row for row in json.loads(KEPT.read_text(encoding="utf-8"))["rows"]}


def main() -> None:
    """Try what is not there, and write the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.mutants", description=__doc__.split("\n")[0])
    parser.add_argument("--each", type=int, default=25, help="mutants of each area")
    parser.add_argument("--areas", nargs="+", default=list(AREAS), choices=list(AREAS), metavar="NAME")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--again", action="store_true", help="those that survived once more")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="begin no mutant after so many")
    parser.add_argument("--cover", action="store_true", help="find anew which tests run which lines")
    parser.add_argument(
        "--list", action="store_true", help="print the mutants and their tests, and do no more"
    )
    options = parser.parse_args()
    by_area = [drawn(area, options.each, options.seed) for area in options.areas]
    wanted = [area[n] for n in range(options.each) for area in by_area if n < len(area)]  # in turn
    if options.list:
        for mutant in wanted:
            print(mutant.area, mutant.key, *room_of(mutant.file), sep="\n    ")
        return
    rows, known = kept(), dict[str, Covered]()
    with tempfile.TemporaryDirectory() as place, copy_of_checkout(Path(place)) as folder:
        told, end = Told(set(), set()), time.monotonic() + options.seconds
        for mutant in wanted:
            before = rows.get(mutant.key)
            if time.monotonic() > end or (before and not (options.again and before["became"] == SURVIVED)):
                continue
            if mutant.area not in known:
                file = COVERED / f"covered-{mutant.area}.json"
                if options.cover:
                    file.unlink(missing_ok=True)
                known[mutant.area] = covered(folder, [m for m in wanted if m.area == mutant.area], file)
                told.sound |= {name.removeprefix("tests/") for name in known[mutant.area].seconds}
            try:
                rows[mutant.key] = _tried(mutant, folder, known[mutant.area], told)
            except RuntimeError as fault:  # it is tried again by the next run
                print(mutant.key, fault, flush=True)
                continue
            write_results(NAME, {"rows": list(rows.values())}, page(list(rows.values())))
            print(*(rows[mutant.key][name] for name in ("became", "key", "by", "cpu")), flush=True)


@dataclass
class Told:
    """Tests that have failed for a mutant: those that pass without it, and those that do not, which tell nothing."""

    sound: set[str]
    broken: set[str]


def _tried(mutant: Mutant, folder: Path, known: Covered, told: Told) -> Row:
    """The row of a mutant."""
    tests, spent = known.tests_of(folder, mutant.file, mutant.line, room_of(mutant.file)), 0.0
    became, by = SURVIVED, "no test runs it"
    while tests:
        became, by, cpu = outcome(mutant, folder, tests, told.broken, known.seconds)
        spent += cpu
        if became != KILLED or not by or by in told.sound:
            break
        without = run(folder, [f"tests/{by}"], set(), known.seconds)[0]
        (told.sound if without == SURVIVED else told.broken).add(by)
        if without == SURVIVED:
            break
    about = {"area": mutant.area, "key": mutant.key, "planner": planner_state(), "tests": len(tests)}
    return about | {"became": became, "by": by, "cpu": round(spent, 1)}
