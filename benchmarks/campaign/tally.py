"""What the campaign has come to so far: rows that are as they should be are counted, the others kept.

The tally is what is committed of a campaign (results/campaign.json). It is of one commit of the planner: a run at that commit goes on
behind it, another one begins anew. A job counts as it came out the first time; what came of jobs that were planned again stands beside.
"""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

Row = dict[str, Any]
PASSED, FAILED, DOCUMENTED, UNSOLVED, REFUSED, CRASH, TOO_LONG = OUTCOMES = (
    "passed",
    "failed",
    "fails as documented",
    "not solved",
    "refused",
    "crash",
    "too long",
)
KEPT_OF_A_ROW = (
    "seed", "source", "way", "outcome", "said", "second", "law", "law_broken", "law_said", "law_second", "below", "cpu",
)  # fmt: skip
BINS = 20  # of processor seconds, in a decade
LEAST = 1e-3  # processor seconds below this are counted as this
SENTENCE = 150  # characters of a sentence by which it is counted


def wrongs(row: Row) -> list[str]:
    """What is not as it should be, in words for counting: all but passed by both judges, refused or not solved with a sentence, failed
    as documented, with its law kept."""
    if row["outcome"] == DOCUMENTED:
        return []
    found = [row["outcome"]] if row["outcome"] in (FAILED, CRASH, TOO_LONG) else []
    found += ["unexplained"] if row["outcome"] in (REFUSED, UNSOLVED) and not row.get("said") else []
    return found + [
        name for name in ("second", "law_second", "law_broken", "law_said", "below") if row.get(name)
    ]


@dataclass
class Tally:
    """Jobs that were planned.

    right    : how many of each source, way and outcome
    laws     : how many of each law were kept
    above    : by way how far the motions that have one are above their proved bound [-]
    said     : sentences of refused and unsolved jobs, numbers left out
    cpu      : how many took so many processor seconds, by the number of their bin
    cpu_sum  : of all of `right` [s]
    commit   : of the planner, at which all were planned
    seeds    : of `right`, by outcome
    wrong    : rows that are not as they should be, by seed
    again    : outcomes of jobs that were planned once more, by seed, with more processor seconds for example; they are counted nowhere
    draws    : names what is drawn from seeds (`campaign_jobs.fingerprint`)
    """

    right: Counter[tuple[str, str, str]] = field(default_factory=Counter)
    laws: Counter[str] = field(default_factory=Counter)
    above: dict[str, list[float]] = field(default_factory=dict)
    said: Counter[str] = field(default_factory=Counter)
    cpu: Counter[int] = field(default_factory=Counter)
    cpu_sum: float = 0.0
    commit: str = ""
    seeds: dict[str, set[int]] = field(default_factory=dict)
    wrong: dict[int, Row] = field(default_factory=dict)
    again: dict[int, str] = field(default_factory=dict)
    draws: str = ""

    def __contains__(self, seed: object) -> bool:
        return seed in self.wrong or any(seed in some for some in self.seeds.values())

    def __len__(self) -> int:
        return sum(map(len, self.seeds.values())) + len(self.wrong)

    def add(self, rows: Iterable[Row]) -> None:
        """Count rows, the first one of each seed. Raises ValueError for a row of another commit."""
        for row in rows:
            seed, job = row["seed"], (row.get("source", "?"), row.get("way", "?"))
            self.commit = self.commit or row["commit"]
            if row["commit"] != self.commit:
                raise ValueError(f"a job of commit {row['commit']} among those of {self.commit}")
            if seed in self:
                self.again[seed] = row["outcome"]
                continue
            if "above" in row:
                self.above.setdefault(job[1], []).append(float(f"{row['above']:.3g}"))
            if wrongs(row):
                self.wrong[seed] = {key: row[key] for key in KEPT_OF_A_ROW if row.get(key) or key == "seed"}
                continue
            self.seeds.setdefault(row["outcome"], set()).add(seed)
            self.right[*job, row["outcome"]] += 1
            self.cpu[_bin(row.get("cpu", 0.0))] += 1
            self.cpu_sum += row.get("cpu", 0.0)
            if row.get("law"):
                self.laws[row["law"]] += 1
            if row["outcome"] in (REFUSED, UNSOLVED):
                self.said[_without_numbers(row["said"])] += 1

    def seconds(self, share: float) -> float:
        """Processor seconds within which this share of all jobs were done, to a bin."""
        bins = self.cpu + Counter(_bin(row.get("cpu", 0.0)) for row in self.wrong.values())
        left = share * bins.total()
        for number in sorted(bins):
            left -= bins[number]
            if left <= 0:
                return float(LEAST * 10.0 ** ((number + 1) / BINS))
        return math.nan

    def seconds_of_all(self) -> float:
        """Processor seconds of all jobs."""
        return self.cpu_sum + sum(row.get("cpu", 0.0) for row in self.wrong.values())

    def data(self) -> dict[str, Any]:
        """As JSON has it."""
        return {
            "draws": self.draws,
            "jobs": len(self),
            "outcomes": dict(self.outcomes()),
            "seeds": {outcome: _ranges(some) for outcome, some in sorted(self.seeds.items()) if some},
            "right": [[*key, count] for key, count in sorted(self.right.items()) if count],
            "laws": dict(self.laws),
            "above": {way: self.above[way] for way in sorted(self.above)},
            "said": dict(self.said.most_common()),
            "cpu": {str(number): self.cpu[number] for number in sorted(self.cpu)},
            "cpu_sum": round(self.cpu_sum, 3),
            "commit": self.commit,
            "again": {str(seed): self.again[seed] for seed in sorted(self.again)},
            "wrong": [self.wrong[seed] for seed in sorted(self.wrong)],
        }

    def outcomes(self) -> Counter[str]:
        """How many jobs ended how."""
        found = Counter(row["outcome"] for row in self.wrong.values())
        for (_, _, outcome), count in self.right.items():
            found[outcome] += count
        return +found

    @classmethod
    def read(cls, file: Path) -> Tally:
        """That of a file; an empty one where there is none."""
        if not file.exists():
            return cls()
        data = json.loads(file.read_text(encoding="utf-8"))
        return cls(
            right=Counter({(source, way, outcome): count for source, way, outcome, count in data["right"]}),
            laws=Counter(data["laws"]),
            above=data.get("above", {}),
            said=Counter(data["said"]),
            cpu=Counter({int(number): count for number, count in data["cpu"].items()}),
            cpu_sum=data["cpu_sum"],
            commit=data["commit"],
            seeds={outcome: _numbers(runs) for outcome, runs in data["seeds"].items()},
            wrong={row["seed"]: row for row in data["wrong"]},
            again={int(seed): outcome for seed, outcome in data["again"].items()},
            draws=data["draws"],
        )


def _bin(seconds: float) -> int:
    return math.floor(BINS * math.log10(max(seconds, LEAST) / LEAST))


def _without_numbers(said: str) -> str:
    return re.sub(r"-?\d+(\.\d+)?(e[-+]?\d+)?", "N", said.replace("|", "/"))[:SENTENCE]


def _ranges(seeds: set[int]) -> str:
    """Numbers as runs: "0-17 19 21-40"."""
    ordered = sorted(seeds)
    first = [k for k in range(len(ordered)) if k == 0 or ordered[k] > ordered[k - 1] + 1]
    runs = zip(first, [*(k - 1 for k in first[1:]), len(ordered) - 1], strict=True)
    return " ".join(f"{ordered[a]}-{ordered[b]}" if b > a else f"{ordered[a]}" for a, b in runs)


def _numbers(runs: str) -> set[int]:
    """The numbers of `_ranges`."""
    ends = [run.split("-") for run in runs.split()]
    return {seed for own in ends for seed in range(int(own[0]), int(own[-1]) + 1)}
