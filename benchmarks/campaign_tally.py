"""What the campaign has come to so far: rows that are as they should be are counted, the others kept.

The tally is what is committed of a campaign (results/campaign.json): the next one, here or elsewhere, goes on behind it.
"""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator
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
    "seed", "source", "way", "outcome", "said", "second", "law", "law_broken", "law_said", "law_second", "cpu", "commit",
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
    return found + [name for name in ("second", "law_second", "law_broken", "law_said") if row.get(name)]


@dataclass
class Tally:
    """Jobs that were planned.

    right    : how many of each source, way and outcome
    laws     : how many of each law were kept
    said     : sentences of refused and unsolved jobs, numbers left out
    cpu      : how many took so many processor seconds, by the number of their bin
    cpu_sum  : of all of `right` [s]
    commits  : at which they were planned
    seeds    : of `right`
    wrong    : rows that are not as they should be, by seed
    """

    right: Counter[tuple[str, str, str]] = field(default_factory=Counter)
    laws: Counter[str] = field(default_factory=Counter)
    said: Counter[str] = field(default_factory=Counter)
    cpu: Counter[int] = field(default_factory=Counter)
    cpu_sum: float = 0.0
    commits: Counter[str] = field(default_factory=Counter)
    seeds: set[int] = field(default_factory=set)
    wrong: dict[int, Row] = field(default_factory=dict)

    def __contains__(self, seed: object) -> bool:
        return seed in self.seeds or seed in self.wrong

    def __len__(self) -> int:
        return len(self.seeds) + len(self.wrong)

    def add(self, rows: Iterable[Row]) -> None:
        """Count rows; those of seeds that are right already are not looked at, those that were wrong are replaced."""
        for row in rows:
            seed = row["seed"]
            if seed in self.seeds:
                continue
            self.wrong.pop(seed, None)
            if wrongs(row):
                self.wrong[seed] = {key: row[key] for key in KEPT_OF_A_ROW if row.get(key) or key == "seed"}
                continue
            self.seeds.add(seed)
            self.right[row.get("source", "?"), row.get("way", "?"), row["outcome"]] += 1
            self.commits[row.get("commit", "?")] += 1
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
            "jobs": len(self),
            "outcomes": dict(self.outcomes()),
            "seeds": list(_ranges(self.seeds)),
            "right": [[*key, count] for key, count in sorted(self.right.items())],
            "laws": dict(self.laws),
            "said": dict(self.said.most_common()),
            "cpu": {str(number): self.cpu[number] for number in sorted(self.cpu)},
            "cpu_sum": round(self.cpu_sum, 3),
            "commits": dict(self.commits),
            "wrong": [self.wrong[seed] for seed in sorted(self.wrong)],
        }

    def outcomes(self) -> Counter[str]:
        """How many jobs ended how."""
        found = Counter(row["outcome"] for row in self.wrong.values())
        for (_, _, outcome), count in self.right.items():
            found[outcome] += count
        return found

    @classmethod
    def read(cls, file: Path) -> Tally:
        """That of a file; an empty one where there is none."""
        if not file.exists():
            return cls()
        data = json.loads(file.read_text(encoding="utf-8"))
        return cls(
            right=Counter({(source, way, outcome): count for source, way, outcome, count in data["right"]}),
            laws=Counter(data["laws"]),
            said=Counter(data["said"]),
            cpu=Counter({int(number): count for number, count in data["cpu"].items()}),
            cpu_sum=data["cpu_sum"],
            commits=Counter(data["commits"]),
            seeds={seed for first, last in data["seeds"] for seed in range(first, last + 1)},
            wrong={row["seed"]: row for row in data["wrong"]},
        )


def _bin(seconds: float) -> int:
    return math.floor(BINS * math.log10(max(seconds, LEAST) / LEAST))


def _without_numbers(said: str) -> str:
    return re.sub(r"-?\d+(\.\d+)?(e[-+]?\d+)?", "N", said.replace("|", "/"))[:SENTENCE]


def _ranges(seeds: set[int]) -> Iterator[tuple[int, int]]:
    """First and last of each run of numbers."""
    first = last = None
    for seed in sorted(seeds):
        if last is None or seed > last + 1:
            if first is not None and last is not None:
                yield first, last
            first = seed
        last = seed
    if first is not None and last is not None:
        yield first, last
