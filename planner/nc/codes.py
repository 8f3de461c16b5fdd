"""What G and M codes and letters are: which modal group they belong to, or why they are refused and what to
do instead.

Codes are integers in tenths, as RS274NGC has them: G61.1 is 611. Two codes of one group on a line contradict
each other.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Refusal:
    """A construct that is not read: what it is, and what to do.

    takes_axes : the axis words beside it are its own and must not be read as a move
    """

    what: str
    remedy: str
    takes_axes: bool = False

    def __str__(self) -> str:
        return f"{self.what} not supported; {self.remedy}"


G_GROUP: dict[int, str] = {
    **dict.fromkeys((0, 10, 20, 30, 50, 51, 52, 53, 62), "motion"),
    **dict.fromkeys((40, 280, 300, 530, 920, 921, 922, 923), "one-shot"),
    **dict.fromkeys((170, 180, 190), "plane"),
    **dict.fromkeys((200, 210), "units"),
    **dict.fromkeys((900, 910), "distance mode"),
    **dict.fromkeys((901, 911), "arc centre mode"),
    **dict.fromkeys((540, 550, 560, 570, 580, 590, 591, 592, 593), "work offset"),
    **dict.fromkeys((610, 611, 640), "path control"),
    **dict.fromkeys((430, 490), "tool length"),
    400: "cutter compensation",
    940: "feed mode",
    970: "spindle mode",
    **dict.fromkeys((980, 990), "retract mode"),
    80: "lathe diameter mode",
    800: "cycle end",  # a motion code on its line beats it
}

# Codes that change nothing here and are kept as events: spindle speed in rpm, retract modes of canned cycles,
# lathe radius mode.
G_EVENTS = frozenset((970, 980, 990, 80))

M_GROUP: dict[int, str] = {
    **dict.fromkeys((0, 10, 20, 300, 600), "stopping"),
    **dict.fromkeys((30, 40, 50), "spindle"),
    60: "tool change",
    **dict.fromkeys((70, 80, 90), "coolant"),
    **dict.fromkeys((480, 490), "override"),
}
M_EVENTS = frozenset((30, 40, 50, 70, 80, 90, 480, 490))

_STRAIGHT = "write the moves out as G0, G1, G2 and G3 (in the CAM system, or with a converter)"
_POST = "choose a three-axis post-processor that writes G94 feeds in mm or inch per minute"
_CYCLE = Refusal("a canned cycle is", _STRAIGHT, True)
_PROBE = Refusal(
    "a probing move, whose end only the machine knows, is", "plan the parts before and after it", True
)
_THREAD = Refusal("motion synchronised with the spindle is", "plan the parts before and after it", True)
_CUTTER = Refusal("cutter radius compensation is", "let the CAM system compensate and write G40")
_LATHE = Refusal("diameter programming is", "write radii and G8")
_STORED = Refusal("storing a position in the control is", "give it as [positions] in the machine file", True)
_OFFSETS = Refusal(
    "setting offsets from the program is", "give them as [work_offsets] and [tools] in the machine file", True
)

G_REFUSED: dict[int, Refusal] = {
    **dict.fromkeys((60, 61), Refusal("a spline or transformation is", _STRAIGHT, True)),
    70: _LATHE,
    100: _OFFSETS,
    **dict.fromkeys((281, 301), _STORED),
    **dict.fromkeys((330, 331), _THREAD),
    **dict.fromkeys((380, 382, 383, 384, 385), _PROBE),
    **dict.fromkeys((410, 411, 420, 421), _CUTTER),
    **dict.fromkeys(
        (431, 432), Refusal("a tool offset given in the program is", "use G43 H and [tools]", True)
    ),
    **dict.fromkeys((500, 510), Refusal("scaling is", "write the scaled coordinates out")),
    520: Refusal("a local coordinate system is", "use G92 or one of G54 to G59.3", True),
    **dict.fromkeys(
        (680, 690), Refusal("rotating the coordinate system is", "write the rotated coordinates out", True)
    ),
    **dict.fromkeys((700, 710, 711, 712, 720, 721, 722), Refusal("a lathe cycle is", _STRAIGHT, True)),
    **dict.fromkeys((730, 740, 760, 810, 820, 830, 840, 850, 860, 870, 880, 890), _CYCLE),
    930: Refusal("inverse-time feed is", "write feeds in length per minute (G94)"),
    950: Refusal("feed per revolution is", "write feeds in length per minute (G94)"),
    960: Refusal("constant surface speed is", "write a spindle speed (G97)"),
}

M_REFUSED: dict[int, Refusal] = {
    **dict.fromkeys(
        (500, 510, 520, 530),
        Refusal("switching overrides is", "remove it: a plan is made for the programmed feed"),
    ),
    190: Refusal("orienting the spindle is", "plan the parts before and after it"),
    610: Refusal("setting the tool number is", "write T and M6"),
    **dict.fromkeys(
        range(620, 690, 10),
        Refusal("reading or writing the control's signals is", "plan the parts before and after it"),
    ),
    **dict.fromkeys((700, 710, 720, 730), Refusal("saving and restoring modes is", "write the modes out")),
    **dict.fromkeys((980, 990), Refusal("a subprogram is", "write its blocks out")),
}


def unknown(letter: str, code: int) -> Refusal:
    """The refusal of a code that no table names."""
    if letter == "M":
        if 1000 <= code <= 1990:
            return Refusal("a command that each machine defines for itself is", "remove it if nothing moves")
        return Refusal("an M code that RS274NGC does not know is", "remove it if nothing moves")
    return Refusal("a G code that RS274NGC does not know is", "write it with the codes of RS274NGC", True)


# Letters that no supported code uses.
LETTERS_REFUSED: dict[str, Refusal] = {
    **dict.fromkeys("ABC", Refusal("a rotary axis is", _POST)),
    **dict.fromkeys("UVW", Refusal("a second linear axis is", _POST)),
    "E": Refusal(
        "an extruder axis (or a number with an exponent) is", "remove E words, write numbers out in digits"
    ),
    "D": Refusal("a cutter radius number is", "let the CAM system compensate and remove it"),
    "L": Refusal("a repetition or parameter word is", "remove it, or write the repetitions out"),
    "O": Refusal("a subprogram or O word is", "write its blocks out, or remove a mere program number"),
}

# Letters that only some words use: "I word without G2 or G3".
LETTER_NEEDS = {
    "I": "G2, G3, G5 or G5.1",
    "J": "G2, G3, G5 or G5.1",
    "K": "G2, G3 or G6.2",
    "R": "G2, G3 or G6.2",
    "P": "G4, G64, G2, G3, G5, G5.2 or G6.2",
    "Q": "G64 or G5",
    "L": "G5.2",
    "H": "G43",
}

# Characters that start no word, and what they mean in the dialects that use them.
CHARACTERS: dict[str, str] = {
    "#": "parameters are not supported; run the program through its control's interpreter and plan the resulting moves",
    "[": "expressions are not supported; write the number out",
    "<": "named parameters are not supported; write the number out",
    "$": "commands to the control ($H, $J ...) are not supported; remove the line if nothing moves, else write G0 or G1",
    "=": "assignments are not part of RS274NGC (is this a Siemens program?); choose an RS274NGC post-processor",
    '"': "texts are not part of RS274NGC (is this a Siemens program?); choose an RS274NGC post-processor",
    "@": "polar coordinates are not supported; write x and y",
    "^": "polar coordinates are not supported; write x and y",
    "/": "block delete is allowed at the start of a line only",
    ")": "a comment is closed that was not opened",
    "!": "a comment starts with ( or ;",
}


def number(code: int) -> str:
    """A code as it is written: 611 -> "61.1", 10 -> "1"."""
    return f"{code // 10}.{code % 10}" if code % 10 else str(code // 10)
