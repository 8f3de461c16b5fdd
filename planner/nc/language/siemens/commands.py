"""Commands of a Sinumerik program: their tables; cycles, frames, declarations and messages; calls of
subprograms, files of the program's folder (NAME, NAME P3, NAME(1, R2), CALL "NAME", L10).

Variables of DEF and PROC are a call's own; R parameters are shared. Commands of the reader hand values over
in shared names.
"""

import re

from planner.nc.language import tree
from planner.nc.language.makers import ADDED, SIEMENS
from planner.nc.language.siemens import cycles
from planner.nc.language.siemens.text import LineTokens, SiemensControl, handed_over, position, variable
from planner.nc.language.source import Source

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
# Commands that move nothing and change nothing of what is planned: feedforward, compressors (their tolerance
# is the program's), how orientations change where that is as planned, the defaults of approaches, frames and
# collision checks.
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
TYPES = frozenset(("REAL", "INT", "BOOL"))
_CALLED = re.compile(r"[A-Z_]{2}\w*|L\d+")
# Commands and cycles of the control, which are no files.
_OF_THE_CONTROL = re.compile(
    r"CYCLE\d+|POCKET\d|SLOT\d|HOLES\d|LONGHOLE|RND|RNDM|CHF|CHR|POLY|BSPLINE|ASPLINE|CSPLINE|SPLINEPATH|CIP|CT|INVCW|INVCCW|"
    r"TANG\w*|TRA\w*|COUP\w*|G\d+|DISR|DISCL|ANG|AP|RP|OFFN|FB|FA|SETPIECE|EXTCALL|PCALL|MCALL|STOPRE|ORI\w*|A3|B3|C3|LEAD|TILT|STR\w*"
)
_COMPENSATES = re.compile(rb"G4[12]\b")
_TIMES = re.compile(r"P(\d+)")
_NAMES_MAX = 32  # parameters of a subprogram


class Commands(SiemensControl):
    """Statements of commands: cycles, frames, variables, messages, calls."""

    def __init__(self, source: Source):
        super().__init__(source)
        self.names: set[str] = set()  # of the variables
        self.absolute = True  # G90 is in force
        self.unit = 1.0  # mm per unit of the program
        self.cycle: list[tree.Statement] | None = None  # of MCALL, which follows every row that moves
        self.compensates = bool(_COMPENSATES.search(source.words.data))  # the file has G41 or G42

    def _cycle(self, reader: LineTokens, name: str) -> None:
        place = reader.place
        given = self._arguments(reader)
        if name == "CYCLE800":
            if any(one is not None and one not in (tree.ZERO, tree.Number(-0.0)) for one in given[4:]):
                raise reader.fault("CYCLE800 with angles tilts the part; axes that turn are not planned yet")
        elif name == "CYCLE832":
            if given and given[0] is not None and given[0] != tree.ZERO:
                self.body.append(tree.row(place, ("G", 64.0), ("P", given[0])))
        else:
            self.body += self._drilled(reader, name, given)

    def _drilled(
        self, reader: LineTokens, name: str, given: list[tree.Expression | None]
    ) -> list[tree.Statement]:
        """A cycle, and what it keeps as it was. Raises ProgramFault."""
        place = reader.place
        known = cycles.ARGUMENTS[name]
        for k, more in enumerate(given[len(known) :]):
            if more not in (None, tree.ZERO, tree.Number(-0.0)):
                text = (
                    f"argument {len(known) + k + 1} of {name}, of later controls, is not read; leave it out"
                )
                raise reader.fault(text, 0)
        values = {key: value for key, value in zip(known, given, strict=False) if value is not None}
        try:
            cycles.check(name, values)
        except ValueError as fault:
            raise reader.fault(str(fault), 0) from fault
        return [tree.made(place, name, **values)]

    def _arguments(self, reader: LineTokens) -> list[tree.Expression | None]:
        """The arguments in the brackets behind a cycle; None for what is left out or a text."""
        given: list[tree.Expression | None] = []
        if not reader.take("("):
            return given
        while not reader.take(")"):
            if reader.peek() == ",":
                given.append(None)
            elif reader.kind() == "text":
                reader.pop()
                given.append(None)
            else:
                given.append(reader.expression())
            if not reader.take(",") and reader.peek() != ")":
                raise reader.fault(") is missing")
        return given

    def _pattern(self, reader: LineTokens) -> None:
        name = reader.peek(-1)
        if self.cycle is None:
            raise reader.fault(f"{name} stands behind MCALL with a drilling cycle, which it repeats", 0)
        given = self._arguments(reader)
        try:
            self.body += cycles.pattern_rows(reader.place, name, given, self.cycle)
        except ValueError as fault:
            raise reader.fault(str(fault), 0) from fault

    def _modal_call(self, reader: LineTokens) -> None:
        if reader.ended:
            self.cycle = None
            return
        name = reader.pop().text
        known = [one for one in cycles.ARGUMENTS if one not in cycles.POCKETS]
        if name not in known:
            raise reader.fault(f"MCALL {name} is not read; read are {', '.join(known)}", 0)
        self.cycle = self._drilled(reader, name, self._arguments(reader))

    def _frame(self, reader: LineTokens) -> None:
        """TRANS, ROT, SCALE, MIRROR: a frame; ATRANS and the others: one beside the one before."""
        name, place = reader.peek(-1), reader.place
        kind = SIEMENS.index(name.removeprefix("A")) + (ADDED if name.startswith("A") else 0)
        given: dict[str, tree.Expression] = {}
        while not reader.ended:
            at, token = reader.at(), reader.pop()
            letter = "RPL" if token.text == "RPL" and name.endswith("ROT") else token.text[0]
            single = token.kind == "word" or len(token.text) == len(letter)
            if letter not in ("X", "Y", "Z", "RPL") or not single:
                raise reader.fault(f"{name} takes X, Y and Z; {token.text} comes", token.at)
            is_word = token.kind == "word"
            value = tree.Number(float(token.text[1:])) if is_word else self._given(reader, letter, at)
            if value is None:
                raise reader.fault("a text is no length", token.at)
            given[letter] = value
        self.body.append(tree.made(place, "siemens frame", kind=kind, **given))
        self.body.append(tree.made(place, "frame in force"))

    def _define(self, reader: LineTokens) -> None:
        kind = reader.pop().text
        if kind not in TYPES:
            raise reader.fault(f"DEF {kind} is not read; read are {', '.join(sorted(TYPES))}", 0)
        while True:
            if reader.kind() != "name" or reader.peek(1) == "[":
                raise reader.fault("the name of a variable is expected here; arrays are not read")
            name = reader.pop().text
            self.names.add(name)
            value = reader.expression() if reader.take("=") else tree.ZERO
            self.body.append(tree.assign(reader.place, (variable(name), value)))
            if not reader.take(","):
                return

    def _message(self, reader: LineTokens) -> None:
        match = re.search(r'"([^"]*)"', reader.text)
        reader.leave()
        if match and match.group(1):
            self.body.append(tree.Message(reader.place, (match.group(1),)))

    def _refused(self, reader: LineTokens) -> None:
        raise reader.fault(f"{reader.peek(-1)} is not read; {REMEDY}", reader.tokens[reader.next - 1].at)

    def _tool_point(self, reader: LineTokens) -> None:
        """TRAORI and TRAFOOF, alone or as NAME(1). Raises ProgramFault for others, and without kinematics."""
        name = reader.peek(-1)
        at = reader.tokens[reader.next - 1].at
        if reader.take("(") and not (reader.take("1") and reader.take(")")):
            raise reader.fault(f"{name} is read alone, or as {name}(1)", at)
        if self.source.at_tip:
            self.body.append(tree.row(reader.place, ("M", TOOL_POINT[name])))
        elif name == "TRAORI":
            text = "TRAORI is not read on a machine without a table [kinematics]; add it to the machine file"
            raise reader.fault(text, at)

    def _given(self, reader: LineTokens, letter: str, at: int) -> tree.Expression | None:
        """The value behind an equals sign; None for a text, such as T="DRILL"."""
        reader.expect("=")
        if reader.kind() == "text":
            reader.pop()
            return None
        kind = reader.peek()
        if kind in ("AC", "IC") and reader.peek(1) == "(":
            reader.next += 2
            value = reader.expression()
            reader.expect(")")
            if letter in "IJK":
                return value - position("XYZ"["IJK".index(letter)]) if kind == "AC" else value
            if letter not in "XYZ":
                raise reader.fault("AC and IC stand with X Y Z and I J K", at - reader.start)
            if (kind == "AC") == self.absolute:
                return value
            return value - position(letter) if kind == "AC" else position(letter) + value
        return reader.expression()

    def _is_call(self, reader: LineTokens) -> bool:
        """True if the line is a call by a name."""
        name, known = reader.peek(), self.names | IDLE | IDLE_CALLS | SAID.keys()
        is_name = reader.kind() == "name" and _CALLED.fullmatch(name)
        if not is_name or name in known:
            return False
        behind = reader.peek(1)
        return not _OF_THE_CONTROL.fullmatch(name) and (behind in ("", "(") or bool(_TIMES.fullmatch(behind)))

    def _call(self, reader: LineTokens) -> None:
        name = reader.pop().text
        times: tree.Expression = tree.ONE
        given = self._arguments(reader)
        if match := _TIMES.fullmatch(reader.peek()):
            reader.pop()
            times = tree.Number(float(match.group(1)))
        if not reader.ended:
            raise reader.fault(f"{reader.peek()} is not expected behind the call of {name}")
        self._append_call(reader, name, given, times)

    def _call_text(self, reader: LineTokens) -> None:
        if reader.kind() != "text":
            raise reader.fault('CALL is followed by the name of a subprogram: CALL "HOLES"')
        text = reader.pop().text.strip('"')
        stem = re.sub(r"(?i)\A_N_", "", text.replace("\\", "/").split("/")[-1])
        name = re.sub(r"(?i)(_SPF|\.SPF|_MPF|\.MPF)\Z", "", stem)
        self._append_call(reader, name.upper(), [], tree.ONE)

    def _append_call(
        self, reader: LineTokens, name: str, given: list[tree.Expression | None], times: tree.Expression
    ) -> None:
        if len(given) > _NAMES_MAX:
            raise reader.fault(f"a subprogram takes at most {_NAMES_MAX} values", 0)
        handed: list[tuple[tree.Parameter, tree.Expression]] = [
            (handed_over(k), given[k] if k < len(given) and given[k] is not None else tree.ZERO)  # type: ignore[misc]
            for k in range(_NAMES_MAX if given else 0)
        ]
        if handed:
            self.body.append(tree.assign(reader.place, *handed))
        self.body.append(tree.Call(reader.place, name.lower(), None, name, times))

    def _procedure(self, reader: LineTokens) -> None:
        if reader.kind() != "name":
            raise reader.fault("PROC is followed by the subprogram's name")
        reader.pop()
        taken: list[tuple[tree.Parameter, tree.Expression]] = []
        if reader.take("("):
            while not reader.take(")"):
                kind, name = reader.peek(), reader.peek(1)
                if kind not in TYPES or reader.ended:
                    raise reader.fault(f"a value of PROC is one of {', '.join(sorted(TYPES))} and a name")
                reader.next += 2
                self.names.add(name)
                taken.append((variable(name), handed_over(len(taken))))
                if not reader.take(",") and reader.peek() != ")":
                    raise reader.fault(") is missing")
        reader.leave()  # SAVE, DISPLOF and others
        if taken:
            self.body.append(tree.assign(reader.place, *taken))

    def _return(self, reader: LineTokens) -> None:
        self.body.append(tree.Return(reader.place))


def siemens_files(name: str) -> frozenset[str]:
    """Names, in small letters, that the file of a subprogram may have: NAME.SPF, NAME.MPF, NAME_SPF."""
    return frozenset(name + ending for ending in (".spf", ".mpf", "_spf", "_mpf", ""))
