"""The summary of the campaign, from its tally alone: tables of sources, ways and laws, and the jobs that are not as they should be;
and the paragraph of docs/benchmarks.md."""

from __future__ import annotations

import textwrap
from collections import Counter
from typing import Any

import numpy as np

from benchmarks.campaign.tally import (
    CRASH,
    DOCUMENTED,
    FAILED,
    OUTCOMES,
    PASSED,
    REFUSED,
    TOO_LONG,
    UNSOLVED,
    Tally,
)
from benchmarks.record import ROOT, markdown, write_results

SHARES = (0.0, 0.1, 0.5, 0.9, 1.0)  # of motions, in the table of bounds
REASONS = 40  # sentences at most
WIDTH = 136  # characters of a line of the page
WORDS = 200  # characters of what is said of a job
PAGE = ROOT / "docs" / "benchmarks.md"
BEGIN, END = "<!-- campaign: written by `python -m benchmarks campaign` -->", "<!-- end of campaign -->"


def write_summary(tally: Tally) -> None:
    """Write results/campaign.json and .md."""
    if not len(tally):
        return
    cpu = tally.seconds_of_all()
    text = (
        f"{len(tally)} jobs, all at commit {tally.commit} of the planner; {cpu:.0f} CPU s, "
        f"{cpu / len(tally):.2f} s in the mean; half of the "
        f"jobs within {tally.seconds(0.5):.2f} s, 99 % within {tally.seconds(0.99):.1f} s.\n\n"
    )
    for number, name in enumerate(("source", "way")):
        columns = [name, "jobs", *OUTCOMES, "passed, and the second judge finds a fault"]
        text += markdown(columns, _counts(tally, number)) + "\n"
    laws = _laws(tally)
    if laws:
        text += markdown(["law", "jobs", "broken", "worst", "changed job fails"], laws) + "\n"
    above = _above(tally)
    if above:
        columns = [
            "way",
            "motions with a bound",
            "below it",
            *(f"above, {share:.0%} of them" for share in SHARES),
        ]
        text += markdown(columns, above) + "\n"
    reasons = [[str(count), reason] for reason, count in tally.said.most_common(REASONS)]
    text += "Why jobs are refused or not solved (numbers left out):\n\n" + markdown(
        ["jobs", "sentence"], reasons
    )
    text += f"\n{len(tally.wrong)} jobs are not as they should be. Those that did not take too long:\n\n"
    text += markdown(["seed", "source", "way", "outcome", "what"], list(map(_wrong, _besides_long(tally))))
    text += _again(tally)
    write_results("campaign", tally.data(), text)
    PAGE.write_text(with_paragraph(PAGE.read_text(encoding="utf-8"), paragraph(tally)), encoding="utf-8")


def with_paragraph(page: str, text: str) -> str:
    """The page with this text between its marks. Raises ValueError where it has none."""
    begin, end = page.index(BEGIN) + len(BEGIN), page.index(END)
    return f"{page[:begin]}\n\n{text}\n\n{page[end:]}"


def paragraph(tally: Tally) -> str:
    """What the jobs came to, in words."""
    of = tally.outcomes()
    changed = sum(tally.laws.values()) + sum(bool(row.get("law")) for row in tally.wrong.values())
    broken = sorted(row["law_broken"] for row in tally.wrong.values() if row.get("law_broken"))
    worst = f", by {broken[0]:.1e} to {broken[-1]:.1e}" if broken else ""
    second = sum(bool(row.get("second")) for row in tally.wrong.values() if row["outcome"] == PASSED)
    second += sum(bool(row.get("law_second")) for row in tally.wrong.values())
    text = (
        f"{len(tally):,} jobs, all at commit {tally.commit}, each counted as it came out the first time: "
        f"{of[PASSED]:,} plans pass the verifier, {of[REFUSED]:,} programs are refused and {of[UNSOLVED]:,} not "
        f"solved, with a reason, {of[DOCUMENTED]:,} plans fail as [methods](methods.md) says of their method (the papers' methods as "
        f"they are, chords under G61), {of[TOO_LONG]:,} take more than their processor seconds, {of[FAILED]:,} fail, "
        f"{of[CRASH]:,} crash. The second judge finds a fault in {second:,} of the plans that pass. Of {changed:,} changed jobs "
        f"{len(broken):,} break their law{worst}."
    )
    return textwrap.fill(text, WIDTH, break_on_hyphens=False)


def _again(tally: Tally) -> str:
    """What came of jobs that were planned again; they count above as they came out the first time."""
    if not tally.again:
        return "\nNo job was planned again.\n"
    counts = Counter(
        (tally.wrong[seed]["outcome"] if seed in tally.wrong else "as it should be", outcome)
        for seed, outcome in tally.again.items()
    )
    rows = [[*key, str(count)] for key, count in sorted(counts.items())]
    return "\nPlanned again, and not counted above:\n\n" + markdown(["first", "then", "jobs"], rows)


def _besides_long(tally: Tally) -> list[dict[str, Any]]:
    return [row for _, row in sorted(tally.wrong.items()) if row["outcome"] != TOO_LONG]


def _wrong(row: dict[str, Any]) -> list[str]:
    """A row of the table of what is not as it should be."""
    said = [str(row.get(key)) for key in ("said", "second", "law_said", "law_second") if row.get(key)]
    said += [f"{row['law']}: {row['law_broken']:.2e}"] if row.get("law_broken") else []
    told = "; ".join(said).replace("|", "/")[:WORDS]
    return [str(row["seed"]), row.get("source", "?"), row.get("way", "?"), row["outcome"], told]


def _counts(tally: Tally, number: int) -> list[list[str]]:
    """Rows of the table by source (0) or way (1)."""
    outcomes: dict[str, Counter[str]] = {}
    second: Counter[str] = Counter()
    for key, count in tally.right.items():
        for name in (key[number], "all"):
            outcomes.setdefault(name, Counter())[key[2]] += count
    for row in tally.wrong.values():
        for name in (row.get(("source", "way")[number], "?"), "all"):
            outcomes.setdefault(name, Counter())[row["outcome"]] += 1
            second[name] += bool(row.get("second")) and row["outcome"] == PASSED
    return [
        [name, str(counts.total()), *(str(counts[kind]) for kind in OUTCOMES), str(second[name])]
        for name, counts in sorted(outcomes.items(), key=lambda item: (item[0] == "all", item[0]))
    ]


def _above(tally: Tally) -> list[list[str]]:
    """Rows of the table of bounds: how far the motions of a way are above what was proved."""
    below = Counter(row.get("way", "?") for row in tally.wrong.values() if row.get("below"))
    return [
        [
            way,
            str(len(some)),
            str(below[way]),
            *(f"{100 * value:.2g} %" for value in np.quantile(some, SHARES)),
        ]
        for way, some in sorted(tally.above.items())
    ]


def _laws(tally: Tally) -> list[list[str]]:
    table = []
    wrong = [row for row in tally.wrong.values() if row.get("law")]
    for law in sorted({*tally.laws, *(row["law"] for row in wrong)}):
        some = [row for row in wrong if row["law"] == law]
        off = [row.get("law_broken", 0.0) for row in some]
        failed = sum(bool(row.get("law_said") or row.get("law_second")) for row in some)
        table.append([
            law, str(tally.laws[law] + len(some)), str(sum(value > 0 for value in off)), f"{max(off, default=0.0):.2e}", str(failed),
        ])  # fmt: skip
    return table
