"""Cycles of Fanuc's and Haas' lathes with a profile, G70 to G73, and G76, as statements (docs/language.md,
"Lathes").

A profile is a procedure of its own, which a cycle runs to read it (lathe_cycles.py) and G70 runs to cut it.
"""

import re

import numpy as np

from planner.nc.integers import LENGTHS
from planner.nc.language import tree
from planner.nc.language.fanuc import lathe_cycles
from planner.nc.language.fanuc.calls import LANGUAGE, fanuc_files
from planner.nc.language.fanuc.lathe_words import LatheVariables, LatheWords, absolute, of_shared, shared
from planner.nc.language.run import Dialect
from planner.nc.language.source import Source, SourceLine

_CALL = re.compile(r"G7[0-3](?![\d.]).*?P(\d+).*?Q(\d+)|G7[0-3](?![\d.]).*?Q(\d+).*?P(\d+)")
_NUMBER = re.compile(r"/?\d?N(\d+)", re.IGNORECASE)
_AFTER = 1_000_000_000  # label behind the last block of a profile: its number and this
# Words of cycles that are in least increments where they have no point; of others D is.
_INCREMENTS = {"G74": "PQ", "G75": "PQ", "G76": "PQRDIK", "G83": "Q"}
# Words of profile cycles by their letters in the first of two blocks, and what is said without the depth of a pass.
_OF_FIRST_BLOCK = {
    "G71": {"D": "U", "R": "R"},
    "G72": {"D": "W", "R": "R"},
    "G73": {"I": "U", "K": "W", "D": "R"},
}
_NO_DEPTH = "the depth of a pass is not given: D, or {0} in a block before this one ({0}2. R0.5)"
_NO_PASSES = "G73 needs the number of its passes: D, or R in a block before this one"
# The least increment in the program's unit, 0.001 mm or 0.0001 inch: #4006 is 20 under G20 and 21 under G21.
_INCREMENT = tree.number(1e-4) + (tree.numbered(4006) - 20) * (1e-3 - 1e-4)


class LatheParser(LatheWords):
    """Makes statements of a lathe's file, and a procedure of each profile that a cycle names."""

    def __init__(self, source: Source):
        super().__init__(source)
        self.pairs: set[tuple[int, int]] = set()  # P and Q of the cycles
        self.called: set[tuple[int, int]] = set()  # so far
        self.profiles: dict[tuple[int, int], tuple[list[tree.Statement], int, int]] = {}
        self.cycles: list[tuple[tuple[int, int], tree.SourcePlace]] = []
        self.waiting: dict[str, dict[str, tree.Expression]] = {}  # words of the first blocks of cycles

    def parse(self) -> list[tree.Procedure]:
        """All procedures of the file, and one for the profile of each cycle."""
        words = self.source.words
        rows = np.flatnonzero(words.letter[words.first[:-1]] != ord("%"))
        self.source.lines = rows.tolist()
        texts = [self.source.line(row).text.upper().replace(" ", "") for row in rows.tolist()]
        numbers = {int(match.group(1)) for text in texts if (match := _NUMBER.match(text))}
        found_pairs = (
            (int(p or later), int(q or first)) for text in texts for p, q, first, later in _CALL.findall(text)
        )
        self.pairs = {pair for pair in found_pairs if numbers.issuperset(pair)}
        procedures = super().parse()
        for pair, place in self.cycles:
            body, first, last = self.profiles.get(pair, (procedures[0].body, 0, -1))
            if last < 0:
                self.faults.append(tree.ProgramFault(place, _no_profile(pair)))
            elif all(known.name != _profile_name(pair) for known in procedures):
                procedures.append(tree.Procedure(_profile_name(pair), body[first].place, body[first:last]))
        if not self.source.file:
            body, modes = procedures[0].body, (("G", 7.0), ("G", 18.0), ("G", 95.0))
            percent = bool(body) and isinstance(body[0], tree.PlainRows)  # stands before all else
            body.insert(int(percent), tree.row(procedures[0].place, *modes))
        return procedures

    def take_line(self, line: SourceLine) -> None:
        match = _NUMBER.match(line.text.replace(" ", ""))
        number = int(match.group(1)) if match else -1
        begun = [pair for pair in self.pairs if pair[0] == number]
        # a cycle has made those that are called: what follows is behind it
        called = (tree.number(_AFTER + pair[1]) for pair in begun if pair in self.called)
        self.body += [tree.Goto(line.place, behind) for behind in called]
        for pair in begun:
            self.profiles.setdefault(pair, (self.body, len(self.body), -1))
        super().take_line(line)
        ended = [pair for pair in self.pairs if pair[1] == number]
        for pair in ended:
            body, first, last = self.profiles.get(pair, (None, 0, 0))
            if body is self.body and last < 0:
                self.profiles[pair] = (self.body, first, len(self.body))
        if ended:
            self.body.append(tree.Label(line.place, _AFTER + number))

    def _cycle(self, cycle: str, words: tree.Words, line: SourceLine) -> None:
        letters_of = "PQUWIKDRAXZE" if cycle == "G76" else "PQUWIKDR"
        given = {word.letter: word for word in words if word.letter in letters_of}
        if not given.keys() & set("XZUWK") if cycle == "G76" else not given.keys() >= set("PQ"):
            self.waiting[cycle] = {  # of the first of two blocks
                letter: word.value if letter == "P" else self._length(word, cycle, line)
                for letter, word in given.items()
            }
            return
        if rest := tuple(word for word in words if word.letter not in letters_of and word.code != cycle):
            self._words(rest, (), line)
        if cycle == "G76":
            self._thread(given, line)
            return
        blocks = [given[letter].value for letter in "PQ"]
        first, last = (int(one.value) if isinstance(one, tree.Number) else -1 for one in blocks)
        if (profile := (first, last)) not in self.pairs:
            raise line.fault(_no_profile(profile))
        self.cycles.append((profile, line.place))
        self.called.add(profile)
        call = tree.Call(line.place, _profile_name(profile), None, f"{cycle} P{first} Q{last}")
        if cycle == "G70":
            start, back = (tree.made(line.place, maker) for maker in (lathe_cycles.start, lathe_cycles.back))
            self.body += [start, call, back]
            return
        values = {letter: self._length(given[letter], cycle, line) for letter in "UWIKD" if letter in given}
        before = self.waiting.get(cycle, {})
        for letter, first_letter in _OF_FIRST_BLOCK[cycle].items():
            if letter not in values and first_letter in before:
                values[letter] = before[first_letter]
        text = _NO_PASSES if cycle == "G73" else _NO_DEPTH.format("U" if cycle == "G71" else "W")
        line.require("D" in values, text)
        self.body += [shared(values, line), tree.made(line.place, lathe_cycles.read_profile), call]
        self.body.append(of_shared(line.place, cycle, values))

    def _thread(self, given: dict[str, tree.Word], line: SourceLine) -> None:
        values = {letter: self._length(word, "G76", line) for letter, word in given.items()}
        if self.feed is None:
            raise line.fault("G76 needs the lead of the thread as an F word")
        if "K" not in given:
            first = self.waiting.get("G76")
            if first is None or "P" not in given or "Q" not in given:
                raise line.fault("G76 needs K and D, or P and Q with a block G76 P Q R before it")
            values = {**values, "K": values["P"], "D": values["Q"], **_finishing(first, line)}
            values["I"] = self._length(given["R"], "G76", line) if "R" in given else tree.ZERO
        else:
            line.require("D" in given, "G76 needs D, the depth of the first pass")
            # Q is the angle of the spindle where the thread begins
            values = {letter: value for letter, value in values.items() if letter not in "QR"}
            text = "G76 in one block: the control's settings for chamfer, least pass and finishing allowance are taken as 0"
            self.body.append(tree.Message(line.place, (text,)))
        values = {letter: value for letter, value in absolute(values).items() if letter in "XZKDQRLAIE"}
        values["F"] = self.feed
        self.body.append(tree.made(line.place, lathe_cycles.thread, **values))
        self.threading = False

    def _length(self, word: tree.Word, cycle: str, line: SourceLine) -> tree.Expression:
        """A word of a cycle in the program's unit: a number without a point is in least increments."""
        in_increments = "" if cycle == "G73" else _INCREMENTS.get(cycle, "D")
        if word.letter not in in_increments or not isinstance(word.value, tree.Number):
            return word.value
        text = self.source.words.data[word.at - self.source.begin :]
        match = re.match(rb"[A-Za-z]\s*[-+]?[\d ]*(\.)?", text)
        if (match and match.group(1)) or (line.scale != 1.0 and ord(word.letter) in LENGTHS):
            return word.value
        return word.value * _INCREMENT


def _finishing(first: dict[str, tree.Expression], line: SourceLine) -> dict[str, tree.Expression]:
    """The first block of G76: P mmrraa has the cuts at full depth, ten chamfers in leads, the angle."""
    digits = first.get("P", tree.number(10_000))
    number = digits.value if isinstance(digits, tree.Number) else -1.0
    if number != int(number) or not 0 <= number < 1e6:
        raise line.fault("P of the first block of G76 has six digits: how often, chamfer, angle (P010060)")
    often, rest = divmod(int(number), 10_000)
    chamfer, angle = divmod(rest, 100)
    values = {"L": float(max(often, 1)), "E": chamfer / 10.0, "A": float(angle)}
    found: dict[str, tree.Expression] = {letter: first.get(letter, tree.ZERO) for letter in "QR"}
    return found | {letter: tree.Number(value) for letter, value in values.items()}


def _no_profile(pair: tuple[int, int]) -> str:
    return f"there is no profile from N{pair[0]} to N{pair[1]} in this program; P and Q are the numbers of its first and last block"


def _profile_name(pair: tuple[int, int]) -> str:
    return f"profile N{pair[0]} to N{pair[1]}"


DIALECT = Dialect(LANGUAGE, LatheVariables, LatheParser, fanuc_files)
