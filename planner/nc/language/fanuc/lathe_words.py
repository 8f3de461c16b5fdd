"""Words of Fanuc's and Haas' lathes (G code system A) as those of LinuxCNC's lathes, and cycles without a
profile (docs/language.md, "Lathes"; their moves: nc/lathe_cuts.py).

U W become X and Z from where the tool is, G98 G99 feeds per minute and per turn (G94, G95), G32 a thread G33
K, G50 S the D of G96, G4 X U a dwell, T0203 rows of its own (T2 M6, G43 H3; T0200 G49). Drilling cycles and
G50 with coordinates are refused.
"""

from collections.abc import Callable, Iterable

from planner.nc.language import makers, tree
from planner.nc.language.fanuc.lathe_cycles import MAKERS
from planner.nc.language.fanuc.parser import FanucParser
from planner.nc.language.making import assumed_row
from planner.nc.language.source import Source, SourceLine
from planner.nc.language.system_variables import FanucVariables

CYCLES = ("G70", "G71", "G72", "G73", "G76")
# Parameters that hold the end of the last block.
X_HERE, Z_HERE = tree.numbered(5001), tree.numbered(5002)
_ABSOLUTE = {"U": ("X", X_HERE), "W": ("Z", Z_HERE)}  # axes of increments
_TOOL_DIGITS = 100  # T0203: tool 2, offset 3
# Drilling cycles along z, and which they are on mills.
DRILLS = {f"G{n}": float(n) for n in (81, 82, 83, 84, 85, 86, 89)} | {"G184": 74.0}
_TURNING = {"G84": 3.0, "G184": 4.0}  # the spindle, which these cycles start themselves
# Codes that are not read, and what they are.
_LIVE = "turns or drills with a driven tool, for which the spindle is an axis,"
REFUSED = {
    **dict.fromkeys(("G12.1", "G112", "G7.1", "G107"),
                    "milling in x and the spindle's angle, which is no axis here (a mill has [dialect] lathe = false),"),
    **dict.fromkeys(("G87", "G88"), "a cycle that drills from the side (Fanuc), or ends in a retract by hand (Haas),"),
    **dict.fromkeys(("G95", "G186", "G195", "G196", *(f"G{n}" for n in range(241, 250))), f"a cycle that {_LIVE}"),
    **dict.fromkeys(("G68", "G51.2", "G14", "G68.1"), "a second turret or spindle, or a part turned as a polygon,"),
    "G105": "the push of a bar feeder, which moves the part,",
    "G34": "a thread whose lead grows",
}  # fmt: skip
CUTS = {"G90": "turning", "G92": "threading", "G94": "facing"}
PECKS = ("G74", "G75")
# Codes behind which a cut is not repeated: other motions and cycles.
_MOTIONS = {f"G{n}" for n in (0, 1, 2, 3, 32, 33, 34, *range(70, 77), *range(80, 90), 184)}
_LINES_AND_ARCS = {"G0", "G1", "G2", "G3"}
# Codes whose words are their own.
_OWN_WORDS = {"G4", "G10", "G12", "G13", "G28", "G30", "G50", "G53", "G65", "G66"}
_PLACE = "XZUW"


class LatheVariables(FanucVariables):
    """Fanuc's numbers on a lathe: the second axis is z, and x is a diameter."""

    def here(self, axis: int) -> float:
        """The position in the program's coordinates and unit."""
        found = super().here((0, 2, 1)[axis] if axis < 3 else axis)
        return 2.0 * found if axis == 0 and self.interpreter.state.diameters else found


class LatheWords(FanucParser):
    """Statements of a lathe's program without cycles."""

    # of `lathe.LatheParser`: a cycle with a profile, and a word of a cycle in the program's unit
    _cycle: Callable[[str, tree.Words, SourceLine], None]
    _length: Callable[[tree.Word, str, SourceLine], tree.Expression]

    def __init__(self, source: Source):
        super().__init__(source)
        self.feed: tree.Expression | None = None
        self.threading = False  # G32 is in force
        self.surface: tree.Expression | None = None  # S of G96
        self.speed_max: tree.Expression | None = None
        self.tool = -1
        self.cut = ""  # G90, G92 or G94 while it is in force
        self.cut_given: set[str] = set()  # its words so far
        self.drill = ""  # the drilling cycle in force
        self.feeding = False  # G1 is in force
        rapids = source.words.rows_with(source.words.find("G", 0.0, 28.0))
        # C is an axis, not a chamfer
        self.turns_c = any(ord("C") in source.words.of_rows(row)[0] for row in rapids)
        self.retract: dict[str, tree.Expression] = {}  # R of the first blocks of G74 and G75

    def _words(self, words: tree.Words, assignments: tree.Assignments, line: SourceLine) -> None:
        codes = {word.code for word in words}
        for code in sorted(codes & set(REFUSED)):
            raise line.fault(f"{code}, {REFUSED[code]} is not read; write moves in X and Z, or leave it out")
        given = {word.letter: word.value for word in words if word.letter not in "GM"}
        if "G33" in codes and "K" not in given:  # of systems B and C, with its lead as F
            codes = {code.replace("G33", "G32") for code in codes}
            words = tuple(w._replace(value=tree.Number(32.0)) if w.code == "G33" else w for w in words)
        self.feed = given.get("F", self.feed)
        if self._single(words, codes, line) or self._drilling(words, codes, line):
            return
        if codes & (_LINES_AND_ARCS | {"G32"}):
            self.feeding = "G1" in codes
        if self.feeding and not codes & _OWN_WORDS:
            words = self._corner_words(words)
        cycle = next((code for code in CYCLES if code in codes), "")
        if cycle:
            self._cycle(cycle, words, line)
            return
        if "T" in given:
            words = self._tool(words, given["T"], line)
        words = self._speeds(words, given, codes, line)
        if "G4" in codes and "P" not in given:
            words = tuple(word._replace(letter="P") if word.letter in "XU" else word for word in words)
            self.body.append(tree.Line(line.place, tuple(word for word in words if word.letter != "H")))
            return
        words = tuple(changed for word in words if (changed := self._changed(word, line)) is not None)
        words, thread = self._threads(words, codes, line)
        super()._words(words, assignments, line)
        self.body += thread

    def _corner_words(self, words: tree.Words) -> tree.Words:
        """C, R, A and a lone I or K of a G1 as ,C ,R and ,A: a chamfer, a rounding and an angle."""
        meant = {"R": ",R", "A": ",A", "I": ",C", "K": ",C"} | ({} if self.turns_c else {"C": ",C"})
        changed = tuple(word._replace(letter=meant.get(word.letter, word.letter)) for word in words)
        return tuple(
            word._replace(value=tree.op("ABS", word.value)) if old.letter in "IK" else word
            for word, old in zip(changed, words, strict=True)
        )

    across, axes, of_diameter = ("Z", "X"), "XZY", 2.0

    def _drilling(self, words: tree.Words, codes: set[str], line: SourceLine) -> bool:
        """Read a line with a drilling cycle, or one more hole of it; False if it is none. They lie along z, as
        in G17, and end where they began (G98)."""
        named = next((code for code in DRILLS if code in codes), "")
        others = sorted(codes & (_MOTIONS - DRILLS.keys() - {"G80"}))
        if named and others:
            text = f"{others[0]} and {named} on one line are both motions; write one of them, or two lines"
            raise line.fault(text)
        if codes & (_MOTIONS - DRILLS.keys()):
            self.drill = ""
        drill, places = named or self.drill, {word.letter for word in words} & set(_PLACE)
        if not named and (not drill or codes & _OWN_WORDS or not places):
            return False
        own = {word.letter: word for word in words if word.letter in _PLACE + "RQPKL"}
        self._rest(tuple(word for word in words if word.code != named), set(own), line)
        self.drill = drill
        given = {letter: self._length(word, "G83", line) for letter, word in own.items()}
        level = given.get("R", Z_HERE)
        if "W" in given:
            given["Z"] = level + given.pop("W")
        values = absolute(given) | ({"R": level} if named or "R" in given else {})
        turning = [("M", _TURNING[drill])] if drill in _TURNING and named else []
        at = {letter: word.at for letter, word in own.items()}
        start = (("G", 17.0), ("G", 98.0), *turning, ("G", DRILLS[drill]), *values.items())
        hole = (tree.word("L" if c == "K" else c, at.get(c, line.place.at), value) for c, value in start)
        if "R" in own:
            self.body.append(assumed_row(line.place, "drilling level"))
        self.body += [tree.Line(line.place, tuple(hole)), tree.row(line.place, ("G", 18.0))]
        return True

    def _changed(self, word: tree.Word, line: SourceLine) -> tree.Word | None:
        """The word as LinuxCNC's lathes have it; None for one that says nothing."""
        letter, code = word.letter, word.code
        if letter in "UW":
            axis, here = _ABSOLUTE[letter]
            return word._replace(letter=axis, value=here + word.value)
        if letter == "H":
            if word.value != tree.ZERO:
                raise line.fault("H turns the spindle as the axis C, which is not planned; X, Z are", word.at)
            return None
        if code in ("G98", "G99"):
            return word._replace(value=tree.Number(94.0 if code == "G98" else 95.0))
        return word

    def _threads(
        self, words: tree.Words, codes: set[str], line: SourceLine
    ) -> tuple[tree.Words, list[tree.Statement]]:
        """The words of a line but those of G32, and what G32 cuts."""
        if "G32" in codes:
            self.threading = True
        elif codes & _LINES_AND_ARCS:
            self.threading = False
        if not self.threading or not any(word.letter in "XZ" for word in words):
            return words, []
        if self.feed is None:
            raise line.fault("G32 needs the lead of its thread as an F word")
        given = {word.letter: word.value for word in words if word.letter in "XZ"} | {"K": self.feed}
        others = tuple(w for w in words if w.letter not in "XZF" and w.code != "G32")
        return others, [tree.made(line.place, makers.threaded, **given)]

    def _tool(self, words: tree.Words, number: tree.Expression, line: SourceLine) -> tree.Words:
        """T0203 as rows of its own; the other words are left."""
        if not isinstance(number, tree.Number) or number.value < 0 or number.value != int(number.value):
            raise line.fault("T takes a number, such as T0203 (tool 2, offset 3)")
        tool = offset = int(number.value)
        if tool >= _TOOL_DIGITS:
            tool, offset = divmod(tool, _TOOL_DIGITS)
        if tool != self.tool:
            self.body.append(tree.row(line.place, ("T", float(tool)), ("M", 6.0)))
        self.tool = tool
        length = (("G", 43.0), ("H", float(offset))) if offset else (("G", 49.0),)
        self.body.append(tree.row(line.place, *length))
        return tuple(word for word in words if word.letter != "T" and word.code != "M6")

    def _speeds(
        self, words: tree.Words, given: dict[str, tree.Expression], codes: set[str], line: SourceLine
    ) -> tree.Words:
        """G50 S is kept and becomes D of G96."""
        if "G50" in codes or "G92" in codes:
            if "S" not in given or given.keys() & set("XZUW"):
                raise line.fault("G50 that sets a position is not read; write a work system (G54)")
            self.speed_max = given["S"]
            words = tuple(word for word in words if word.letter != "S" and word.code not in ("G50", "G92"))
            return words if self.surface is None else (*words, *self._surface(line))
        if "G97" in codes:
            self.surface = None
        if "G96" in codes or (self.surface is not None and "S" in given):
            self.surface = given.get("S", self.surface)
            words = tuple(word for word in words if word.letter != "S" and word.code != "G96")
            return (*words, *self._surface(line))
        return words

    def _surface(self, line: SourceLine) -> list[tree.Word]:
        at, speeds = line.place.at, (("S", self.surface), ("D", self.speed_max))
        given = (tree.word(c, at, speed) for c, speed in speeds if speed is not None)
        return [tree.word("G", at, 96.0), *given]

    def _single(self, words: tree.Words, codes: set[str], line: SourceLine) -> bool:
        """Read a line with such a cycle, or a repeated cut; False if it is none. Raises ProgramFault."""
        letters = {word.letter for word in words}
        if pecks := next((code for code in PECKS if code in codes), ""):
            self.cut = ""
            self._pecking(pecks, words, line)
            return True
        named = next((code for code in CUTS if code in codes and letters & set(_PLACE)), "")
        if named and codes & _MOTIONS:
            beside = (
                f"{named} beside {min(codes & _MOTIONS)}: in G code system A it is the {CUTS[named]} cycle"
            )
            raise line.fault(f"{beside}; systems B and C are not read")
        if codes & _MOTIONS:
            self.cut = ""
            return False
        if named == "G92" and "F" not in letters:  # in G code system B it sets a position
            self.cut = ""
            raise line.fault("G92 with X and Z needs the lead of its thread as an F word on its line")
        if named:
            self.cut, self.cut_given = named, set()
        elif not self.cut or not letters & set(_PLACE) or codes & _OWN_WORDS:
            return False
        self._cutting(words, line)
        return True

    def _cutting(self, words: tree.Words, line: SourceLine) -> None:
        given = {word.letter: word.value for word in words if word.letter in _PLACE + "RIK"}
        self._rest(words, set(given), line)
        taper = "K" if self.cut == "G94" else "I"
        if taper in given:
            given["R"] = given.pop(taper)
        extra = given.keys() & set("IK")
        if extra:
            raise line.fault(f"{self.cut} does not use {sorted(extra)[0]}; its taper is R or {taper}")
        values = absolute(given)
        self.cut_given |= values.keys()
        if not self.cut_given >= set("XZ"):
            raise line.fault(f"the {CUTS[self.cut]} cycle {self.cut} needs X or U, and Z or W")
        if self.cut == "G92":
            assert self.feed is not None
            values["F"] = self.feed
            self.cut_given.add("F")
            text = "G92: the control's setting for the chamfer of a thread is taken as 0"
            self.body.append(tree.Message(line.place, (text,)))
        self.body.append(shared(values, line))
        self.body.append(of_shared(line.place, self.cut, sorted(self.cut_given)))
        self.threading = False

    def _pecking(self, cycle: str, words: tree.Words, line: SourceLine) -> None:
        of_cycle = {word.letter: word for word in words if word.letter in _PLACE + "PQRIKD"}
        if set(of_cycle) == {"R"}:
            self.retract[cycle] = of_cycle["R"].value
            self._rest(words, {"R"}, line)
            return
        self._rest(words, set(of_cycle), line)
        values = absolute({letter: word.value for letter, word in of_cycle.items() if letter in _PLACE})
        along, across = "ZX" if cycle == "G74" else "XZ"
        if along not in values:
            raise line.fault(f"{cycle} needs the bottom as {along} or {'W' if along == 'Z' else 'U'}")
        for letter in "QKPI":
            if letter in of_cycle:
                peck = (letter in "QK") == (cycle == "G74")
                values["K" if peck else "I"] = self._length(of_cycle[letter], cycle, line)
        shift = "P or I" if cycle == "G74" else "Q or K"
        text = f"{cycle} with {across} needs {shift}, from one cut to the next"
        line.require(across not in values or "I" in values, text)
        if relief := of_cycle.get("D", of_cycle.get("R")):
            values["D"] = relief.value
        if cycle in self.retract:
            values["R"] = self.retract[cycle]
        self.body.append(tree.made(line.place, MAKERS[cycle], **values))
        self.threading = False

    def _rest(self, words: tree.Words, of_cycle: set[str], line: SourceLine) -> None:
        """The line's other words, F S T M, which are executed before the cycle."""
        codes = (*CUTS, *PECKS)
        if rest := tuple(word for word in words if word.letter not in of_cycle and word.code not in codes):
            self._words(rest, (), line)


def absolute(given: dict[str, tree.Expression]) -> dict[str, tree.Expression]:
    """Words with X and Z for U and W, which count from where the tool is."""
    values = dict(given)
    for letter, (axis, here) in _ABSOLUTE.items():
        if letter in values:
            values[axis] = here + values.pop(letter)
    return values


def shared(values: dict[str, tree.Expression], line: SourceLine) -> tree.Line:
    """The words in shared names, for a cycle that is made later."""
    return tree.assign(line.place, *((_shared(letter), value) for letter, value in values.items()))


def of_shared(place: tree.SourcePlace, cycle: str, letters: Iterable[str]) -> tree.MadeRows:
    """A cycle of the words in shared names."""
    return tree.made(place, MAKERS[cycle], **{letter: _shared(letter) for letter in letters})


def _shared(letter: str) -> tree.Named:
    return tree.Named(f"cycle {letter.lower()}", True)
