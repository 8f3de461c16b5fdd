"""Tables of the words and commands of a Sinumerik program in RS274NGC."""

from __future__ import annotations

# Letters of words with the same meaning in RS274NGC.
PLAIN_LETTERS = "NGXYZIJKFSM"
# G codes with the same meaning.
RETURNS = (2, 17, 30)  # M codes that end a subprogram
SAME_CODES = (0, 1, 2, 3, 17, 18, 19, 33, 54, 55, 56, 57, 90, 91, 94)
# G codes of Siemens that are others here; an empty tuple changes nothing.
CODES: dict[int, tuple[float, ...]] = {
    9: (),  # exact stop of one block; a full stop is added behind it
    **dict.fromkeys((53, 153), (53.0,)),
    60: (61.1,),
    64: (64.0,),
    **dict.fromkeys((642, 643, 644, 645), (64.0,)),
    70: (20.0,),
    71: (21.0,),
    500: (59.3,),  # whose origin is set to 0 before it
    700: (20.0,),
    710: (21.0,),
    **dict.fromkeys((450, 451, 601, 602, 603, 621, 95 * 100), ()),
}
# Commands that move nothing and change nothing of what is planned: feedforward, compressors (their tolerance is the program's), how
# orientations change where that is as planned, the defaults of approaches, frames and collision checks.
IDLE = frozenset((
    "FNORM", "FFWON", "FFWOF", "SOFT", "COMPON", "COMPCURV", "COMPCAD", "COMPSURF", "COMPOF", "UPATH", "SPATH",
    "FIFOCTRL", "ORIMKS", "ORIAXES", "ORIMACHAX", "TOFRAMEOF", "PAROTOF",
    "TOWSTD", "CUT2D", "CUT2DF", "CDON", "CDOF", "CDOF2", "NORM", "KONT", "DIAMOF", "CFTCP", "RTLION",
))  # fmt: skip
# The same with arguments or a value behind them.
IDLE_CALLS = frozenset(("SETMS", "WORKPIECE", "MSG", "EXTERN", "LIMS"))
# Commands and words that are not followed and may change geometry or time: what is said of them (making.py).
SAID = {
    **dict.fromkeys(("BRISK", "DRIVE"), "acceleration"),
    **dict.fromkeys(("CFC", "CFIN"), "tool centre feed"),
    **dict.fromkeys(("ORIWKS", "ORIVECT", "ORIVIRT1"), "orientation"),
    "RTLIOF": "rapid axes",
    "SPOS": "spindle position",
}
# Commands that switch the tool centre point on and off, and the M codes of RS274NGC that stand for them.
TOOL_POINT = {"TRAORI": 428.0, "TRAFOOF": 429.0}
# Commands that tilt or bend the coordinates.
REFUSED = (
    "ROTS", "AROTS", "CROTS", "TRANSMIT", "TRACYL", "RNDM", "ENDLABEL", "CASE",
)  # fmt: skip
REMEDY = "let the CAM system write the moves out"
