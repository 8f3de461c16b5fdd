"""What programs of the languages mean that is planned otherwise, and may change geometry or time: sentences that are said first, by the
names under which statements carry them (`assumed_row`)."""

from __future__ import annotations

from planner.nc.language.tree import ZERO, MadeRows, SourcePlace, made

ASSUMED = {
    "acceleration": "BRISK and DRIVE are not followed: acceleration and jerk are those of the machine file",
    "corner feed": "G621, slower feeds at corners, is not followed",
    "machine code": "an M code that the machine's builder defines is assumed not to move anything",
    "orientation": "the angles of rotary axes change evenly on a block (ORIAXES), not as the tool's direction turns",
    "rapid axes": "rapid moves are straight lines, as with RTLION",
    "spindle position": "positioning the spindle (SPOS) takes no time in this plan",
    "tool offset": "offsets of tools (D) are not added: z is that of the tool's tip",
    "tool centre feed": "F holds for the tool's centre (CFTCP); CFC and CFIN, the control's default, have it on the contour of arcs",
}


def assumed_row(place: SourcePlace, name: str) -> MadeRows:
    """The statement that says a sentence of ASSUMED, and is refused by strict reading."""
    assert name in ASSUMED
    return made(place, "assume", **{name: ZERO})
