"""The summary of the campaign, from its rows alone: tables of sources, ways and laws, and every job that is not as it should be."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.record import markdown, write_results

Row = dict[str, Any]
OUTCOMES = ("passed", "failed", "fails as documented", "not solved", "refused", "crash", "too long")
KEPT_OF_A_ROW = (
    "seed",
    "source",
    "way",
    "outcome",
    "said",
    "second",
    "law",
    "law_broken",
    "law_said",
    "law_second",
    "cpu",
)


def write_summary(rows: list[Row]) -> None:
    """Write results/campaign.json and .md."""
    if not rows:
        return
    tables = {
        "source": _counts(rows, lambda row: row.get("source", "?")),
        "way": _counts(rows, lambda row: row.get("way", "?")),
    }
    wrong = [row for row in rows if wrongs(row)]
    cpu = np.array([row.get("cpu", 0.0) for row in rows])
    about = (
        f"{len(rows)} jobs, seeds {rows[0]['seed']} to {rows[-1]['seed']}, made at {_commits(rows)}; {cpu.sum():.0f} CPU s, "
        f"{cpu.mean():.2f} s in the mean, {np.percentile(cpu, 99):.1f} s at the 99th percentile, {cpu.max():.1f} s at most.\n\n"
    )
    text = about
    for name, counts in tables.items():
        text += (
            markdown([name, "jobs", *OUTCOMES, "passed, and the second judge finds a fault"], counts) + "\n"
        )
    laws = _laws(rows)
    if laws:
        text += markdown(["law", "jobs", "broken", "worst", "changed job fails"], laws) + "\n"
    text += "Why jobs are refused or not solved (numbers left out):\n\n" + markdown(
        ["jobs", "sentence"], _reasons(rows)
    )
    text += f"\n{len(wrong)} jobs are not as they should be; they are listed in campaign.json.\n"
    data = {
        "jobs": len(rows),
        "outcomes": dict(Counter(row["outcome"] for row in rows)),
        "wrong": [{key: row[key] for key in KEPT_OF_A_ROW if row.get(key)} for row in wrong],
    }
    write_results("campaign", data, text)


def wrongs(row: Row) -> list[str]:
    """What is wrong with a row, in words for counting."""
    found = [row["outcome"]] if row["outcome"] in ("failed", "crash", "too long") else []
    found += ["unexplained"] if row["outcome"] in ("refused", "not solved") and not row.get("said") else []
    if row["outcome"] == "fails as documented":
        return []
    return found + [name for name in ("second", "law_second", "law_broken", "law_said") if row.get(name)]


def _counts(rows: list[Row], of: Callable[[Row], str]) -> list[list[str]]:
    table = []
    for name in [*sorted({of(row) for row in rows}), "all"]:
        some = [row for row in rows if name in (of(row), "all")]
        outcomes = Counter(row["outcome"] for row in some)
        second = sum(bool(row.get("second")) and row["outcome"] == "passed" for row in some)
        table.append([name, str(len(some)), *(str(outcomes[kind]) for kind in OUTCOMES), str(second)])
    return table


def _laws(rows: list[Row]) -> list[list[str]]:
    table = []
    for law in sorted({row["law"] for row in rows if row.get("law")}):
        some = [row for row in rows if row.get("law") == law]
        off = [row.get("law_broken", 0.0) for row in some]
        failed = sum(bool(row.get("law_said") or row.get("law_second")) for row in some)
        table.append(
            [law, str(len(some)), str(sum(value > 0 for value in off)), f"{max(off):.2e}", str(failed)]
        )
    return table


def _reasons(rows: list[Row]) -> list[list[str]]:
    said = Counter(
        re.sub(r"-?\d+(\.\d+)?(e[-+]?\d+)?", "N", row.get("said", "").replace("|", "/"))[:150]
        for row in rows
        if row["outcome"] in ("refused", "not solved")
    )
    return [[str(count), reason] for reason, count in said.most_common(40)]


def _commits(rows: list[Row]) -> str:
    return ", ".join(dict.fromkeys(row.get("commit", "?") for row in rows))
