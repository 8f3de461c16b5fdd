"""The summary of the campaign, from its tally alone: tables of sources, ways and laws, and how many jobs are not as they should be."""

from __future__ import annotations

from collections import Counter

from benchmarks.campaign_tally import OUTCOMES, PASSED, Tally
from benchmarks.record import markdown, write_results

REASONS = 40  # sentences at most


def write_summary(tally: Tally) -> None:
    """Write results/campaign.json and .md."""
    if not len(tally):
        return
    cpu = tally.seconds_of_all()
    commits = tally.commits + Counter(row.get("commit", "?") for row in tally.wrong.values())
    text = (
        f"{len(tally)} jobs, made at {', '.join(commits)}; {cpu:.0f} CPU s, {cpu / len(tally):.2f} s in the mean; half of the "
        f"jobs within {tally.seconds(0.5):.2f} s, 99 % within {tally.seconds(0.99):.1f} s.\n\n"
    )
    for number, name in enumerate(("source", "way")):
        columns = [name, "jobs", *OUTCOMES, "passed, and the second judge finds a fault"]
        text += markdown(columns, _counts(tally, number)) + "\n"
    laws = _laws(tally)
    if laws:
        text += markdown(["law", "jobs", "broken", "worst", "changed job fails"], laws) + "\n"
    reasons = [[str(count), reason] for reason, count in tally.said.most_common(REASONS)]
    text += "Why jobs are refused or not solved (numbers left out):\n\n" + markdown(
        ["jobs", "sentence"], reasons
    )
    text += f"\n{len(tally.wrong)} jobs are not as they should be; they are listed in campaign.json.\n"
    write_results("campaign", tally.data(), text)


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
