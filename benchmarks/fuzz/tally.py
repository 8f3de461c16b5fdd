"""What came of the inputs: a row for each kind and commit in results/fuzz.json, to which later runs add."""

from __future__ import annotations

import json
import re
from collections import Counter
from pathlib import Path
from typing import Any

from benchmarks.fuzz.corpus import Corpus
from benchmarks.fuzz.coverage import count_lines
from benchmarks.record import RESULTS, markdown, provenance, write_results

SAID_MAX = 300  # characters of what a finding says
FINDINGS_MAX = 50  # different findings of a row that are named


class Tally:
    """The row of a kind at this commit; the next seed is the one after the last of all rows of the kind."""

    def __init__(self, kind: str, *, guided: bool):
        self.kind, file = kind, RESULTS / "fuzz.json"
        self.kinds: dict[str, list[dict[str, Any]]] = {}
        if file.exists():
            self.kinds = json.loads(file.read_text("utf-8"))["kinds"]
        rows = self.kinds.setdefault(kind, [])
        self.next_seed: int = max((row["next_seed"] for row in rows), default=0)
        commit = provenance()["commit"]
        same = [row for row in rows if row["commit"] == commit and row["guided"] == guided]
        if not same:
            same = [{"commit": commit, "guided": guided, "first_seed": self.next_seed, "next_seed": 0}]
            same[0] |= {"inputs": 0, "minutes": 0.0, "found": {}, "findings": {}}
            rows.append(same[0])
        self.row = same[0]

    def ended(self, end: str) -> None:
        """An input came to an end."""
        self.row["found"] = dict(Counter(self.row["found"]) + Counter([end]))

    def found(self, said: str, file: Path) -> None:
        """An input was a finding; the same words, numbers apart, are counted as one."""
        self.ended("finding")
        words = re.sub(r"\d+(\.\d+)?", "0", said.strip())[-SAID_MAX:]
        findings = self.row["findings"]
        if words in findings:
            findings[words]["times"] += 1
        elif len(findings) < FINDINGS_MAX:
            findings[words] = {"times": 1, "input": file.name}

    def took(self, seconds: float) -> None:
        """An input is done, after so many seconds of computing."""
        self.row["minutes"] += seconds / 60.0
        self.row["inputs"] += 1
        self.next_seed += 1
        self.row["next_seed"] = self.next_seed

    def save(self, corpus: Corpus) -> None:
        """Write the row, and what the corpus reaches."""
        files = [Path(name) for name in corpus.tracer.ways]
        self.row |= {
            "kept": len(corpus.inputs),
            "ways": sum(map(len, corpus.tracer.ways.values())),
            "lines": corpus.tracer.lines,
            "lines_of": count_lines(files),
        }
        corpus.save()
        data = {"kinds": self.kinds}
        write_results("fuzz", data, table(self.kinds))


def table(kinds: dict[str, list[dict[str, Any]]]) -> str:
    """All rows in Markdown, and a line of sums for a kind with several."""
    head = ["kind", "at", "guided", "inputs", "minutes", "ends", "findings", "kept inputs", "lines reached"]
    rows = []
    for kind, of in kinds.items():
        rows += [_line(kind, row) for row in of]
        if len(of) > 1:
            found = sum((Counter(row["found"]) for row in of), Counter())
            summed = {"commit": "all", "found": found, "inputs": sum(row["inputs"] for row in of)}
            rows.append(_line(kind, summed | {"minutes": sum(row["minutes"] or 0.0 for row in of)}))
    return markdown(head, rows)


def _line(kind: str, row: dict[str, Any]) -> list[str]:
    ends = sorted((end, times) for end, times in row["found"].items() if end != "finding")
    guided = {True: "yes", False: "no"}.get(row.get("guided"), "")
    return [
        kind,
        row["commit"],
        guided,
        f"{row['inputs']:,}",
        "not counted" if row["minutes"] is None else f"{row['minutes']:.1f}",
        ", ".join(f"{end} {times:,}" for end, times in ends),
        f"{row['found'].get('finding', 0):,}",
        f"{row['kept']:,}" if "kept" in row else "",
        f"{row['lines']:,} of {row['lines_of']:,}" if "lines" in row else "",
    ]


def write_guidance(kind: str, measured: dict[str, float]) -> None:
    """Write results/fuzz-guidance.json and .md; kinds that were not measured keep theirs."""
    file = RESULTS / "fuzz-guidance.json"
    kinds = json.loads(file.read_text("utf-8"))["kinds"] if file.exists() else {}
    kinds[kind] = measured | {"commit": provenance()["commit"]}
    names = ["inputs", "guided inputs", "lines", "guided lines", "ways", "guided ways"]
    rows = [
        [name, of["commit"], f"{of['minutes']:g}", *(f"{of[key]:,}" for key in names)]
        for name, of in kinds.items()
    ]
    write_results("fuzz-guidance", {"kinds": kinds}, markdown(["kind", "at", "minutes", *names], rows))
