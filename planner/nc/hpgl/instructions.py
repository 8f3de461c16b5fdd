"""The instructions of HP-GL and HP-GL/2: which are read, which change nothing in the path, and which are refused with what to do.

A plotter leaves out instructions that it does not know. Here they are left out too, and counted in a note; of those that HP's plotters
know, none that could change the path is left out: it is read, or ignored with a note, or a fault.
"""

from __future__ import annotations

import re
from dataclasses import dataclass


@dataclass(frozen=True)
class Form:
    """How an instruction that is read is written: `name` with numbers, of which there may be `counts` (None: any even number)."""

    name: str
    numbers: str
    counts: tuple[int, ...] | None

    def fits(self, count: int) -> bool:
        """True if the instruction may have so many numbers."""
        return count % 2 == 0 if self.counts is None else count in self.counts

    def __str__(self) -> str:
        return f"{self.name} {self.numbers}".rstrip()


# By their names: the numbers that each takes, and how many of them there may be (None for any number of pairs).
FORMS = {
    form.name: form
    for form in (
        Form("IN", "", (0, 1)),
        Form("DF", "", (0,)),
        Form("PU", "x,y,...", None),
        Form("PD", "x,y,...", None),
        Form("PA", "x,y,...", None),
        Form("PR", "dx,dy,...", None),
        Form("AA", "x,y,sweep", (3, 4)),
        Form("AR", "dx,dy,sweep", (3, 4)),
        Form("AT", "x,y,xend,yend", (4, 5)),
        Form("RT", "dx,dy,dxend,dyend", (4, 5)),
        Form("CI", "radius", (1, 2)),
        Form("EA", "x,y", (2,)),
        Form("ER", "dx,dy", (2,)),
        Form("SP", "pen", (0, 1)),
        Form("VS", "speed in cm/s", (0, 1, 2)),
        Form("IP", "x1,y1,x2,y2", (0, 2, 4)),
        Form("SC", "xmin,xmax,ymin,ymax", (0, 4, 5, 7)),
        Form("PG", "", (0, 1)),
        Form("AF", "", (0,)),
        Form("AH", "", (0,)),
        Form("FR", "", (0,)),
    )
}
PAGE_ENDS = ("PG", "AF", "AH", "FR")


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

# Of these: what would change the path or its time, some with numbers only, without which they are the default.
CHANGING, WITH_NUMBERS = frozenset(("RP", "EC", "NR")), frozenset(("LT", "IW", "AS"))

_OUTLINES = "convert it to lines and arcs in the drawing program ('export as outlines', 'as curves')"
_PLAIN = "export the drawing as plain HPGL with PU and PD"
_REMOVE = "remove it, and export the drawing as it shall lie on the machine"
_TEXT = f"text in a plotter's own letters is not read; {_OUTLINES}"
_FILL = f"fillings are not read; {_OUTLINES}"
_POLYGON = f"the polygon buffer is not read; {_PLAIN}"
_CURVE = f"this curve is not read; {_PLAIN}"

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

# Instructions that are followed by text, and what it looks like up to its end.
_TO_ETX, _TO_TERMINATOR = re.compile(rb"[^\x03]*\x03?"), re.compile(rb"[^;]*;?")
TEXT = {
    **dict.fromkeys(("LB", "WD", "BL", "PB", "MG"), _TO_ETX),
    **dict.fromkeys(("SM", "DT", "PE", "DL", "UC"), _TO_TERMINATOR),
    "CO": re.compile(rb'\s*(?:"[^"]*"|[^;]*);?'),
}

ALLOWED = " ".join(form.name for form in FORMS.values())
