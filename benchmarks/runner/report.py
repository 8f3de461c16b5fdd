"""Reports: tables and pictures of a suite from its rows alone, into results/suite-SUITE.md and .png; and the ages of all results."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from benchmarks.record import markdown
from benchmarks.runner import figures, grid_report, published_report
from benchmarks.runner.ages import write_stale
from benchmarks.runner.figures_of_merit import (
    ALLOWED,
    REFERENCE,
    beaten,
    best_times,
    by_job,
    growth,
    profile,
    ratios,
    trades,
)
from benchmarks.runner.rows import (
    MODEL,
    NOT_APPLICABLE,
    NOT_SOLVED,
    PASSED,
    SKIPPED,
    SOLVED,
    Results,
    Row,
    read,
)
from benchmarks.runner.suites import SUITES
from planner.base.errors import InputError

FACTORS = (1.0001, 1.001, 1.01, 1.05, 1.1, 1.2, 1.5, 2.0)  # at which profiles are tabled [-]
ROUNDING = 1.0 + 1e-9  # a ratio to itself


def write_reports(folder: Path, suites: tuple[str, ...] = ()) -> list[Path]:
    """Write the reports of suites, or of all that have rows, beside their rows; and the list of stale results in docs/benchmarks.md.

    Raises InputError for a suite without rows.
    """
    there = [name for name in SUITES if (folder / f"{name}.jsonl").is_file()]
    for name in suites:
        if name not in there:
            raise InputError(f"{folder}: no rows of suite '{name}'; there are {', '.join(there) or 'none'}")
    made: list[Path] = []
    for name in suites or there:
        results = read(folder / f"{name}.jsonl")
        pictures = figures.draw(folder, name, by_job(results.rows.values()), scales=SUITES[name].scales)
        file = folder / f"suite-{name}.md"
        file.write_text(report_of(name, results, pictures), encoding="utf-8")
        made += [file, *pictures]
    return made + write_stale(folder)


def report_of(name: str, results: Results, pictures: Iterable[Path] = ()) -> str:
    """The report of a suite as Markdown; its first line says how the newest of its rows were made."""
    rows = list(results.rows.values())
    jobs = by_job(rows)
    ways = list(dict.fromkeys(row.way for row in rows if row.status != SKIPPED))
    parts = [_head(results), f"# Suite {name}: {SUITES[name].says}", _outcomes(rows)]
    parts += grid_report.tables(jobs) + published_report.tables(name, jobs)
    parts += ["## Cycle time [s]", CYCLE_NOTE, _cycle_times(jobs, ways)]
    if shares := ratios(jobs):
        parts += ["## Share of the jobs within a factor of the best motion", PROFILE_NOTE, _profiles(shares)]
    if against := beaten(jobs):
        parts += [f"## Is `{REFERENCE}` ever slower?", BEATEN_NOTE, _beaten(against)]
    if found := trades(jobs):
        table = [
            [
                one.way,
                f"{one.cycle:.4f}",
                f"{one.cpu:.3g}",
                str(one.jobs),
                ", ".join(one.free),
                "yes" if one.front else "",
            ]
            for one in sorted(found, key=lambda one: one.cpu)
        ]
        columns = [
            "way",
            "cycle time over the best",
            "CPU time over `optimal`",
            "jobs",
            "not limited",
            "on the front",
        ]
        parts += ["## Motion against planning time", TRADE_NOTE, markdown(columns, table)]
    if SUITES[name].scales and (grown := growth(jobs)):
        table = [
            [way, f"{sizes[0]:,} to {sizes[-1]:,}", f"{slope:.2f}", f"{sizes[-1] / seconds[-1]:,.0f}"]
            for way, (sizes, seconds, slope) in grown.items()
        ]
        columns = ["way", "blocks", "slope", "blocks per CPU s at the largest"]
        parts += ["## How planning grows", markdown(columns, table)]
    parts += ["## Processor time [s]", CPU_NOTE, _cpu_times(jobs, ways)]
    if reasons := _reasons(rows):
        parts += ["## Without a passing motion", reasons]
    if pictures:  # beside this file, but not in the repository: the same command makes them
        parts.append(
            f"Pictures, by `python -m benchmarks report`: {', '.join(one.name for one in pictures)}."
        )
    return "\n\n".join(part.strip("\n") for part in parts) + "\n"


CYCLE_NOTE = (
    "Bold: the best that passed with every quantity limited. `*`: the verdict failed. Italic: something is not limited, "
    "or a model's prediction without a motion."
)
PROFILE_NOTE = (
    "A job counts as not reached where the way has no motion that passed with every quantity limited."
)
BEATEN_NOTE = (
    "On the jobs on which a way has a motion that passed with every quantity limited. Only differences above "
    f"{ALLOWED:g} of the time count as slower, and having no such motion."
)
TRADE_NOTE = (
    "Geometric means over the jobs that the way and `optimal` solve. On the front are ways that limit all and solve all of these jobs, "
    "and than which no other such way is better in both."
)
CPU_NOTE = "Of one call, verification included, the least of the repeats. `~`: the core was busy, so the time says little."


def _head(results: Results) -> str:
    newest = max(results.abouts, key=lambda about: str(about.get("date", "")), default={})
    commits = sorted({row.commit for row in results.rows.values()})
    versions = ", ".join(f"{key} {value}" for key, value in dict(newest.get("versions", {})).items() if value)
    return (
        f"Made by `{newest.get('command')}` at {newest.get('commit')} on {newest.get('date')} ({newest.get('machine')}; {versions}). "
        f"Rows of planner {', '.join(commits)}."
    )


def _outcomes(rows: list[Row]) -> str:
    """A line for each way: how many jobs of which outcome."""
    table = []
    for way in dict.fromkeys(row.way for row in rows):
        of = [row for row in rows if row.way == way]
        passed, failed = (sum(row.verdict == one for row in of) for one in (PASSED, "failed"))
        predicted = sum(row.kind == MODEL and row.status == SOLVED for row in of)
        counts = [sum(row.status == one for row in of) for one in (NOT_SOLVED, NOT_APPLICABLE, SKIPPED)]
        rest = len(of) - passed - failed - predicted - sum(counts)
        table.append(
            [way, of[0].kind, *(str(n or "") for n in (len(of), passed, failed, predicted, *counts, rest))]
        )
    columns = [
        "way",
        "kind",
        "jobs",
        "passed",
        "failed",
        "predicted",
        "not solved",
        "not applicable",
        "skipped",
        "error or limit",
    ]
    return markdown(columns, table)


def _cycle_times(jobs: dict[str, dict[str, Row]], ways: list[str]) -> str:
    best = best_times(jobs)
    return markdown(
        ["job", *ways],
        [[job, *(_time(of.get(way), best.get(job, math.nan)) for way in ways)] for job, of in jobs.items()],
    )


def _time(row: Row | None, best: float) -> str:
    if row is None or row.cycle_s is None:
        return "" if row is None else "-"
    said = f"{row.cycle_s:.5g}"
    if row.verdict == "failed":
        return f"{said}*"
    if not row.comparable:
        return f"_{said}_"
    return f"**{said}**" if row.cycle_s <= best * ROUNDING else said


def _profiles(shares: dict[str, object]) -> str:
    table = [
        [way, *(f"{100.0 * profile(of_way, tau):.0f} %" for tau in FACTORS)] for way, of_way in shares.items()
    ]
    return markdown(["way", *(f"{tau:g}" for tau in FACTORS)], table)


def _beaten(against: dict[str, dict[str, float]]) -> str:
    table = []
    for way, of_way in against.items():
        by = np.array(list(of_way.values()))
        slower = sorted((job for job in of_way if of_way[job] > ALLOWED), key=lambda job: -of_way[job])
        told = ", ".join(
            f"{job} ({f'{of_way[job]:.1e}' if of_way[job] < math.inf else 'has none'})"
            for job in slower[:SHOWN]
        )
        table.append([way, str(len(by)), str(len(slower)), f"{np.median(-by):.1%}", told])
    return markdown(["way", "jobs", "optimal is slower on", "shorter by, median", "by"], table)


def _cpu_times(jobs: dict[str, dict[str, Row]], ways: list[str]) -> str:
    def cell(row: Row | None) -> str:
        if row is None or row.cpu_s is None or row.cycle_s is None:
            return ""
        return f"{row.cpu_s:.3g}" + ("~" if row.noisy else "")

    return markdown(["job", *ways], [[job, *(cell(of.get(way)) for way in ways)] for job, of in jobs.items()])


def _reasons(rows: list[Row]) -> str:
    """What kept ways from a passing motion: a line for each message, with the jobs."""
    found: dict[tuple[str, str], list[str]] = {}
    for row in rows:
        if (row.kind != MODEL and row.verdict != PASSED) or row.status != SOLVED:
            what = "verdict failed" if row.verdict else row.status
            found.setdefault((row.way, f"{what}: {row.message}"), []).append(row.job)
    lines = []
    for (way, said), of in found.items():
        names = ", ".join(of[:SHOWN]) + (f" and {len(of) - SHOWN} more" if len(of) > SHOWN else "")
        lines.append(f"* {way}, {names}: {said}")
    return "\n".join(lines)


SHOWN = 4  # jobs that are named with a reason
