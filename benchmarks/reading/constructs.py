"""What is read, said first or refused of programs of each dialect, from the tables of the reader.

    python -m benchmarks.reading.constructs

Writes results/constructs.json and .md; tests/nc/language/test_constructs.py says where it is out of date.
"""

from __future__ import annotations

from collections.abc import Iterable

from benchmarks.record import RESULTS, write_results
from planner.nc import codes, settings
from planner.nc.language.fanuc import frames, lathe_words
from planner.nc.language.heidenhain import definitions, moves
from planner.nc.language.heidenhain import flow as conversational_flow
from planner.nc.language.heidenhain import tables as conversational
from planner.nc.language.making import ASSUMED
from planner.nc.language.siemens import block_words, cycles, parser, tables

PAGE = RESULTS / "constructs.md"
READ, SAID, NOTHING, REFUSED = "read", "said first", "moves nothing", "refused"
Row = tuple[str, str, str]  # a construct, what is done with it, and why


def rows() -> dict[str, list[Row]]:
    """The constructs of each dialect."""
    commands = block_words.COMMANDS.keys() - tables.IDLE - tables.SAID.keys()
    siemens: list[Row] = [(f"G{code}", READ, "") for code in sorted({*tables.CODES, 74, 75, 331, 332, 63})]
    siemens += [
        (name, READ, "")
        for name in sorted({*commands, *cycles.ARGUMENTS, *parser.PATTERNS, *tables.TOOL_POINT})
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
    return {
        "Sinumerik": siemens,
        "Heidenhain": heidenhain,
        "Fanuc and Haas": fanuc(),
        "Lathes of Fanuc and Haas": lathes(),
        "Printers": printers(),
    }


def fanuc() -> list[Row]:
    """The G codes of mills, and the M codes that are read or refused."""
    read = [f"G{codes.number(code)}" for code in sorted(codes.G_GROUP)]
    calls = ("G65", "G66", "G67", "M97", "M98", "M99")
    read += sorted({*frames.WORDS, *calls} - set(read))
    found: list[Row] = [(name, READ, "") for name in read]
    found += [(f"M{codes.number(code)}", READ, "") for code in sorted(codes.M_GROUP)]
    found += [
        (f"G{codes.number(code)}", SAID, settings.G_SETTING.meaning)
        for code in sorted(settings.G_SETTINGS)
        if f"G{codes.number(code)}" not in read
    ]
    for letter, refused in (("G", codes.G_REFUSED), ("M", codes.M_REFUSED)):
        names = {f"{letter}{codes.number(code)}": str(why) for code, why in sorted(refused.items())}
        found += [(name, REFUSED, why) for name, why in names.items() if name not in read]
    return found


def lathes() -> list[Row]:
    """The cycles of lathes, and what lathes have and mills have not."""
    read = {*lathe_words.CYCLES, *lathe_words.PECKS, *lathe_words.CUTS, *lathe_words.DRILLS, "G32"}
    found: list[Row] = [(name, READ, "") for name in sorted(read)]
    found += [(name, REFUSED, f"{why} is not read") for name, why in lathe_words.REFUSED.items()]
    return found


def printers() -> list[Row]:
    """The M codes that settings.py knows; G codes are those of any program."""
    found: list[Row] = []
    for number in range(1000):
        what = settings.setting("M", 10 * number, "", "")
        if (
            number in settings.SETS_LIMITS
            or f"M{number}" in settings.RETRACTIONS
            or number in (82, 83, 200, 221)
        ):
            found.append((f"M{number}", READ, ""))
        elif what is not None and what.what not in (None, settings.UNKNOWN_M, settings.TOOL_POINT_M):
            assert what.what is not None
            found.append((f"M{number}", SAID if what.what.changes else NOTHING, what.what.meaning))
    return found


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
