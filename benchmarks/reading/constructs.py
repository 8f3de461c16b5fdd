"""What is read, said first or refused of Sinumerik and Heidenhain programs, from the tables of the reader.

    python -m benchmarks.reading.constructs

Writes results/constructs.json and .md; tests/nc/language/test_constructs.py says where it is out of date.
"""

from __future__ import annotations

from collections.abc import Iterable

from benchmarks.record import RESULTS, write_results
from planner.nc.language.heidenhain import definitions, moves
from planner.nc.language.heidenhain import flow as conversational_flow
from planner.nc.language.heidenhain import tables as conversational
from planner.nc.language.making import ASSUMED
from planner.nc.language.siemens import block_words, cycles, patterns, tables

PAGE = RESULTS / "constructs.md"
READ, SAID, NOTHING, REFUSED = "read", "said first", "moves nothing", "refused"
Row = tuple[str, str, str]  # a construct, what is done with it, and why


def rows() -> dict[str, list[Row]]:
    """The constructs of each dialect."""
    commands = block_words.COMMANDS.keys() - tables.IDLE - tables.SAID.keys()
    siemens: list[Row] = [(f"G{code}", READ, "") for code in sorted({*tables.CODES, 74, 75, 331, 332, 63})]
    siemens += [
        (name, READ, "")
        for name in sorted({*commands, *cycles.ARGUMENTS, *patterns.PATTERNS, *tables.TOOL_POINT})
    ]
    siemens += [(name, SAID, ASSUMED[why]) for name, why in sorted(tables.SAID.items())]
    siemens += [(name, NOTHING, "") for name in sorted(tables.IDLE)]
    siemens += [(name, REFUSED, f"{what}; {helps}") for name, (what, helps) in sorted(tables.REFUSED.items())]
    heidenhain: list[Row] = [
        (f"CYCL DEF {n}", READ, "") for n in sorted({*definitions.READ, *moves.TITLES, 9, 12, 19, 32})
    ]
    heidenhain += [(f"CYCL DEF {n}", SAID, ASSUMED[why]) for n, why in conversational.SAID_CYCLES.items()]
    heidenhain += [
        (f"CYCL DEF {n}", REFUSED, why) for n, why in sorted(conversational.REFUSED_CYCLES.items())
    ]
    heidenhain += [(f"FN {n}", READ, "") for n in range(15)]
    heidenhain += [(f"FN {n}", NOTHING, "") for n in conversational_flow.FN_NOTHING]
    heidenhain += [(f"FN {n}", REFUSED, why) for n, why in sorted(conversational_flow.FN_REFUSED.items())]
    heidenhain += [(name, READ, "") for name in sorted({*moves.PLANES, *moves.TRANSFORMED})]
    heidenhain += [(f"M{n}", NOTHING, "") for n in sorted(conversational.NOTHING)]
    heidenhain += [(f"M{n}", REFUSED, why) for n, why in sorted(conversational.REFUSED.items())]
    heidenhain += [(f"M{n}", NOTHING, "without compensation") for n in conversational.OF_COMPENSATION]
    heidenhain += [(f"M{n}", NOTHING, "without rotary axes") for n in conversational.OF_ROTARY]
    return {"Sinumerik": siemens, "Heidenhain": heidenhain}


def page() -> str:
    """The page: a line for each outcome and reason, with its constructs."""
    lines: list[str] = []
    for dialect, found in rows().items():
        lines += [f"## {dialect}", "", "| constructs | outcome | reason |", "|---|---|---|"]
        groups: dict[tuple[str, str], list[str]] = {}
        for name, outcome, why in found:
            groups.setdefault((outcome, why), []).append(name)
        lines += [f"| {_listed(names)} | {outcome} | {why} |" for (outcome, why), names in groups.items()]
        lines.append("")
    return "\n".join(lines)


def _listed(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in dict.fromkeys(names))


if __name__ == "__main__":
    write_results("constructs", {"rows": rows()}, page())
    print(PAGE)
