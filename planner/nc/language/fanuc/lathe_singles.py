"""Cycles of Fanuc's and Haas' lathes without a profile, as statements (their moves: nc/lathe_cuts.py).

G90 G92 G94     turning, thread, facing in one cut: X Z (U W) and a taper R (Haas: I; K of G94). They hold until another motion:
                each further line with X, Z, U or W is a cut, with the words that it does not give as they were
G74 G75         pecking along z and x: G74 R(retract) and G74 X Z P(shift) Q(peck) R(relief) F, and in one block
                G74 X Z I(shift) K(peck) D(relief) F; in G75 the P or I is the peck and the Q or K the shift. P and Q are in least
                increments (0.001 mm, 0.0001 inch) where they have no point
"""

from __future__ import annotations

from planner.nc.language.fanuc.calls import code_of
from planner.nc.language.fanuc.lathe_cycles import name_of
from planner.nc.language.fanuc.lathe_words import X_HERE, Z_HERE, LatheWords
from planner.nc.language.source import Source, SourceLine
from planner.nc.language.tree import Expression, Line, Message, Named, Turning, Word, assign

CUTS = {"G90": "turning", "G92": "threading", "G94": "facing"}
PECKS = ("G74", "G75")
# Codes behind which a cut is not repeated: other motions and cycles.
_MOTIONS = {
    *(f"G{n}" for n in (0, 1, 2, 3, 32, 33, 34, *range(70, 77), *range(80, 90))),
    *(f"G0{n}" for n in range(4)),
}
# Codes whose coordinates are their own.
_OWN_COORDINATES = {"G4", "G04", "G10", "G28", "G30", "G50", "G53"}
_PLACE = "XZUW"


class LatheSingles(LatheWords):
    """G74, G75, G90, G92 and G94."""

    def __init__(self, source: Source):
        super().__init__(source)
        self.cut = ""  # G90, G92 or G94 while it is in force
        self.cut_given: set[str] = set()  # its words so far
        self.retract: dict[str, Expression] = {}  # R of the first blocks of G74 and G75

    def _single(self, words: tuple[Word, ...], codes: set[str], line: SourceLine) -> bool:
        """Read a line with such a cycle, or one that repeats the cut in force. False if it is none. Raises ProgramFault."""
        letters = {chr(word.letter) for word in words}
        pecks = next((code for code in PECKS if code in codes), "")
        if pecks:
            self.cut = ""
            self._pecking(pecks, words, line)
            return True
        named = next((code for code in CUTS if code in codes and letters & set(_PLACE)), "")
        if named and codes & _MOTIONS:
            other = sorted(codes & _MOTIONS)[0]
            raise line.fault(
                f"{named} beside {other}: in G code system A it is the {CUTS[named]} cycle; systems B and C are not read"
            )
        if codes & _MOTIONS:
            self.cut = ""
            return False
        if named == "G92" and "F" not in letters:  # in G code system B it sets a position
            self.cut = ""
            raise line.fault("G92 with X and Z needs the lead of its thread as an F word on its line")
        if named:
            self.cut, self.cut_given = named, set()
        elif not self.cut or not letters & set(_PLACE) or codes & _OWN_COORDINATES:
            return False
        self._cutting(words, line)
        return True

    def _cutting(self, words: tuple[Word, ...], line: SourceLine) -> None:
        given = {chr(word.letter): word.value for word in words if chr(word.letter) in _PLACE + "RIK"}
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
            self.body.append(Message(line.place, (text,)))
        self.body.append(shared(values, line))
        self.body.append(Turning(line.place, self.cut, "".join(sorted(self.cut_given))))
        self.threading = False

    def _pecking(self, cycle: str, words: tuple[Word, ...], line: SourceLine) -> None:
        own = {chr(word.letter): word for word in words if chr(word.letter) in _PLACE + "PQRIKD"}
        if set(own) == {"R"}:
            self.retract[cycle] = own["R"].value
            self._rest(words, {"R"}, line)
            return
        self._rest(words, set(own), line)
        values = absolute({letter: word.value for letter, word in own.items() if letter in _PLACE})
        along, across = "ZX" if cycle == "G74" else "XZ"
        if along not in values:
            raise line.fault(f"{cycle} needs the bottom as {along} or {'W' if along == 'Z' else 'U'}")
        for letters, peck in (("QK", cycle == "G74"), ("PI", cycle == "G75")):
            for letter in letters:
                if letter in own:
                    values["K" if peck else "I"] = self._length(own[letter], cycle, line)
        if across in values and "I" not in values:
            shift = "P or I" if cycle == "G74" else "Q or K"
            raise line.fault(f"{cycle} with {across} needs {shift}, from one cut to the next")
        for letter in "RD":
            if letter in own:
                values["D"] = own[letter].value
        if cycle in self.retract:
            values["R"] = self.retract[cycle]
        self.body.append(shared(values, line))
        self.body.append(Turning(line.place, cycle, "".join(values)))
        self.threading = False

    def _rest(self, words: tuple[Word, ...], own: set[str], line: SourceLine) -> None:
        """The line's other words, F S T M, which are executed before the cycle."""
        rest = tuple(
            word for word in words if chr(word.letter) not in own and code_of(word) not in (*CUTS, *PECKS)
        )
        if rest:
            self._words(rest, (), line)

    def _length(self, word: Word, cycle: str, line: SourceLine) -> Expression:
        """A word of a cycle in the program's unit."""
        raise NotImplementedError


def absolute(given: dict[str, Expression]) -> dict[str, Expression]:
    """Words with X and Z for U and W, which count from where the tool is."""
    values = dict(given)
    for letter, axis, here in (("U", "X", X_HERE), ("W", "Z", Z_HERE)):
        if letter in values:
            values[axis] = here + values.pop(letter)
    return values


def shared(values: dict[str, Expression], line: SourceLine) -> Line:
    """The words in shared names, where `lathe_cycles.LatheCycles.act` finds them."""
    return assign(line.place, *((Named(name_of(letter), True), value) for letter, value in values.items()))
