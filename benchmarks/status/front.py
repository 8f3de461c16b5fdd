"""The sentence on the front page: on how many jobs what was checked, each number from a results file."""

from __future__ import annotations

import json
import textwrap
from typing import Any

from benchmarks.campaign.judge import RATIO
from benchmarks.campaign.tally import CRASH, DOCUMENTED, FAILED, PASSED, REFUSED, TOO_LONG, UNSOLVED
from benchmarks.record import RESULTS, ROOT

PAGE = ROOT / "README.md"
BEGIN, END = "<!-- checked: written by `python -m benchmarks status` -->", "<!-- end of checked -->"
WIDTH = 136  # characters of a line of the page
NEAR = 1e-4  # above the known optimum [-]
# What is said of jobs without a plan that passes.
OTHERS = {
    REFUSED: "refused",
    TOO_LONG: "over the time limit",
    DOCUMENTED: "exceeding what their method says it exceeds",
    UNSOLVED: "not solved",
    FAILED: "failing their verdict",
    CRASH: "crashing",
}


def sentence() -> str:
    """What was checked, as lines of the page."""
    campaign, trial = _result("campaign"), _result("verifier-trial")
    optima = [job["above"] for job in _result("known-optima")["jobs"] if "above" in job]
    read = _result("random-programs")["rows"]
    passed = campaign["outcomes"][PASSED]
    others = ", ".join(
        f"{campaign['outcomes'][name]:,} {words}"
        for name, words in OTHERS.items()
        if name in campaign["outcomes"]
    )
    wrong = sum(row["outcome"] == PASSED and bool(row.get("second")) for row in campaign["wrong"])
    refused = sum(fault["found"] for fault in trial["faults"])
    right = sum(motion["answer"] == "passed" for motion in trial["correct"])
    programs, blocks, apart = (
        sum(row[key] for row in read) for key in ("programs", "blocks compared", "disagree")
    )
    near = sum(above <= NEAR for above in optima)
    few = sum(motion["answer"] == "too few digits" for motion in trial["correct"])
    jobs, faults, motions = campaign["jobs"], len(trial["faults"]), len(trial["correct"])
    text = (
        f"Checked: of {jobs:,} [random jobs]({_link('campaign')}) {passed:,} plans pass ({others}), and a second judge that shares no "
        f"code finds {passed - wrong:,} of them within every limit to {RATIO:.0e}; the verifier refuses {refused:,} of {faults:,} "
        f"[faulty motions]({_link('verifier-trial')}) and passes {right:,} of {motions:,} right ones ({few:,} have too few digits); "
        f"{apart:,} of {programs:,} [random programs]({_link('random-programs')}) are read otherwise than by LinuxCNC's interpreter, "
        f"to 1e-9 mm in {blocks:,} blocks; `optimal` is within {NEAR:.0e} of the time of {near:,} of {len(optima):,} jobs whose "
        f"[optimum is known]({_link('known-optima')}). Feature by feature: [status]({_link('status')})."
    )
    return textwrap.fill(text.replace("e-0", "e-"), WIDTH, break_on_hyphens=False, break_long_words=False)


def with_sentence(page: str) -> str:
    """The page with the sentence between its marks. Raises ValueError where it has none."""
    begin, end = page.index(BEGIN) + len(BEGIN), page.index(END)
    return f"{page[:begin]}\n\n{sentence()}\n\n{page[end:]}"


def _result(name: str) -> Any:
    return json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8"))


def _link(name: str) -> str:
    return f"benchmarks/results/{name}.md"
