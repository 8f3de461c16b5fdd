"""The instructions of HP-GL and HP-GL/2: how they are written, which change nothing in the path, and which
are refused.

Instructions that HP's plotters know and that could change the path are read, or ignored with a note, or a
fault; others are left out and counted.

    instruction = letter letter [number (separator number)*] [terminator]       number = [+|-] digits [. digits]
    separator   = comma or white space, or nothing before a sign               terminator = ; or the next instruction

Between instructions may stand device control (ESC . letter), the frame of printers (ESC %, @PJL lines) and,
at the end, characters that are no instruction; they are left out with a note.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

PAGE_ENDS = ("PG", "AF", "AH", "FR")
# Of what is ignored: what would change the path or its time, some with numbers only, without which it is the
# default.
CHANGING, WITH_NUMBERS = frozenset(("RP", "EC", "NR")), frozenset(("LT", "IW", "AS"))
_OUTLINES = "convert it to lines and arcs in the drawing program ('export as outlines', 'as curves')"
_PLAIN = "export the drawing as plain HPGL with PU and PD"
_REMOVE = "remove it, and export the drawing as it shall lie on the machine"
_TEXT = f"text in a plotter's own letters is not read; {_OUTLINES}"
_FILL = f"fillings are not read; {_OUTLINES}"
_POLYGON = f"the polygon buffer is not read; {_PLAIN}"
_CURVE = f"this curve is not read; {_PLAIN}"
# Instructions that are followed by text, and what it looks like up to its end.
_TO_ETX, _TO_TERMINATOR = re.compile(rb"[^\x03]*\x03?"), re.compile(rb"[^;]*;?")
TEXT = {
    **dict.fromkeys(("LB", "WD", "BL", "PB", "MG"), _TO_ETX),
    **dict.fromkeys(("SM", "DT", "PE", "DL", "UC"), _TO_TERMINATOR),
    "CO": re.compile(rb'\s*(?:"[^"]*"|[^;]*);?'),
}
NUMBER_MAX = 1e9  # lengths beyond have lost the micrometre in double precision and are certainly a mistake
_BLANK = re.compile(rb"(?:[\s;]|\xef\xbb\xbf)*")
CONTROL = rb"(?:\x1b(?:\.[@HIMNPQST](?:[\d; ]*:)?|\.[()A-Z]|%-?\d*[A-Z]|[&*(][^A-Z\x1b]*[A-Z]|E)|@PJL[^\n]*)"
_CONTROL = re.compile(CONTROL)
_INSTRUCTION = re.compile(rb"([A-Za-z]{2})([-+.,\d\s]*)")
_NUMBER = re.compile(rb"[-+]?(?:\d+\.?\d*|\.\d+)")
_SEPARATOR = re.compile(rb"\s*,?\s*")
_NO_NUMBER = re.compile(rb"\A\s*,|,\s*,")
# Bytes that no instruction holds.
_NO_INSTRUCTION = bytes(c for c in range(256) if not chr(c).isascii() or not chr(c).isalnum())
Report = Callable[[int, int, str], None]  # from, to, message


@dataclass(frozen=True)
class Form:
    """How an instruction is written: its name, its numbers, their possible `counts` (None: any even one)."""

    name: str
    numbers: str
    counts: tuple[int, ...] | None

    def fits(self, count: int) -> bool:
        """True if the instruction may have so many numbers."""
        return count % 2 == 0 if self.counts is None else count in self.counts

    def __str__(self) -> str:
        return f"{self.name} {self.numbers}".rstrip()


# By their names: the numbers that each takes, and how many of them there may be (None: any number of pairs).
FORMS = {
    name: Form(name, numbers, counts)
    for name, numbers, counts in (
        ("IN", "", (0, 1)),
        ("DF", "", (0,)),
        ("PU", "x,y,...", None),
        ("PD", "x,y,...", None),
        ("PA", "x,y,...", None),
        ("PR", "dx,dy,...", None),
        ("AA", "x,y,sweep", (3, 4)),
        ("AR", "dx,dy,sweep", (3, 4)),
        ("AT", "x,y,xend,yend", (4, 5)),
        ("RT", "dx,dy,dxend,dyend", (4, 5)),
        ("CI", "radius", (1, 2)),
        ("EA", "x,y", (2,)),
        ("ER", "dx,dy", (2,)),
        ("SP", "pen", (0, 1)),
        ("VS", "speed in cm/s", (0, 1, 2)),
        ("IP", "x1,y1,x2,y2", (0, 2, 4)),
        ("SC", "xmin,xmax,ymin,ymax", (0, 4, 5, 7)),
        ("PG", "", (0, 1)),
        *((end, "", (0,)) for end in PAGE_ENDS[1:]),
    )
}


def _each(names: str, text: str) -> dict[str, str]:
    return dict.fromkeys(names.split(), text)


# Without influence on the path. What a reader of the note must know stands in the text.
IGNORED = {
    **_each("LT UL", "lines are drawn solid"),
    **_each("PW WU PT PC NP CR LA AC FT TR MC SV CF", "ink only"),
    **_each("FS AP QL BP PS MT", "how the device works or is fed"),
    "RP": "the drawing is plotted once",
    "EC": "the paper is not cut",
    "NR": "no wait for the next page",
    "AS": "the machine file has the accelerations",
    "IW": "nothing is clipped to a window",
    "CT": "arcs are true arcs, not chords",
    **_each("SI SR SL DI DR CS CA SS SA ES LO CP DT SD AD DV TL", "text only"),
    **_each("OA OC OD OE OF OG OH OI OK OL OO OP OS OT OW IM IV", "questions to a device"),
    **_each("CO WD BL MG", "comments and messages"),
}
REFUSED = {
    **_each("LB PB UC DL", _TEXT),
    **_each("RA RR WG FP", _FILL),
    **_each("PM EP", _POLYGON),
    **_each("BR BZ EW", _CURVE),
    "PE": f"encoded lines are not read; {_PLAIN} ('without compression')",
    **_each("XT YT", f"ticks are not read; {_OUTLINES}"),
    "SM": f"symbols at the points are not read; {_OUTLINES}",
    "RO": f"turning the drawing is not read; {_REMOVE}",
    "IR": f"scaling points in percent of the paper are not read: a program knows no paper; {_REMOVE}",
}
ALLOWED = " ".join(form.name for form in FORMS.values())


@dataclass(slots=True)
class Instruction:
    """One instruction: its name and numbers, where it starts and ends in the source, its text if any."""

    name: str
    numbers: list[float]
    at: int
    end: int
    text: bytes = b""


def instructions(data: bytes, report: Report, note: Callable[[str], None]) -> Iterator[Instruction]:
    """The instructions in their order. What cannot be read goes to `report`, what is left out to `note`."""
    at, last = 0, len(data.rstrip(_NO_INSTRUCTION))
    while True:
        at = _match(_BLANK, data, at).end()
        if at >= last:
            break
        match = _INSTRUCTION.match(data, at)
        if match is None:
            at = _passed_over(data, at, report, note)
            continue
        name, start, end = match.group(1).decode().upper(), at, match.end()
        if name in TEXT:
            at = _match(TEXT[name], data, at + 2).end()
            yield Instruction(name, [], start, start + 2, data[start + 2 : at])
            continue
        at = end
        numbers = _numbers(data, start + 2, end, report)
        if numbers is not None:
            yield Instruction(name, numbers, start, end)
    if rest := data[at:].strip():
        note(f"the file ends with {rest[:8].decode('latin-1')!r}, which is no instruction; left out")


def _passed_over(data: bytes, at: int, report: Report, note: Callable[[str], None]) -> int:
    """Where to go on after what is no instruction: device control is noted, everything else is a fault."""
    if control := _CONTROL.match(data, at):
        note("device control (ESC sequences, @PJL lines) is left out")
        return control.end()
    if number := _NUMBER.match(data, at):
        report(at, number.end(), "a number without an instruction before it")
        return number.end()
    what = "a letter by itself" if data[at : at + 1].isalpha() else "this character"
    form = "an instruction is two letters and numbers, such as PU0,400"
    report(at, at + 1, f"{what} starts no instruction; {form}")
    return at + 1


def _numbers(data: bytes, start: int, end: int, report: Report) -> list[float] | None:
    """The numbers between two places; None, after a report, if they cannot be read."""
    field = data[start:end]
    try:
        numbers = [float(text) for text in field.replace(b",", b" ").split()]
    except ValueError:  # a sign without a separator before it, or no number at all
        return _numbers_one_by_one(data, start, end, report)
    if b"," in field and (gap := _NO_NUMBER.search(field)):
        report(start + gap.end() - 1, start + gap.end(), "a number is missing before this comma")
        return None
    if numbers and max(map(abs, numbers)) > NUMBER_MAX:
        return _numbers_one_by_one(data, start, end, report)
    return numbers


def _numbers_one_by_one(data: bytes, start: int, end: int, report: Report) -> list[float] | None:
    numbers: list[float] = []
    at = _match(_SEPARATOR, data, start).end()
    while at < end:
        match = _NUMBER.match(data, at, end)
        apart = not numbers or data[at - 1 : at] in b", \t\r\n\f\v" or data[at : at + 1] in b"+-"
        if match is None or not apart:
            report(at, at + 1, "this is no number; write digits, such as -12.5, and commas between numbers")
            return None
        value = float(match.group())
        if abs(value) > NUMBER_MAX:
            report(at, match.end(), f"the number is too large; at most {NUMBER_MAX:g} is allowed")
            return None
        numbers.append(value)
        at = _match(_SEPARATOR, data, match.end()).end()
    return numbers


def _match(pattern: re.Pattern[bytes], data: bytes, at: int) -> re.Match[bytes]:
    match = pattern.match(data, at)
    assert match is not None
    return match
