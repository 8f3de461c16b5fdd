"""Commands of a Sinumerik program: cycles, frames and messages; poles, polar coordinates, reference points and
dwells; calls of subprograms, files of the program's folder (NAME, NAME P3, NAME(1, R2), CALL "NAME", L10).

Variables of DEF and PROC are a call's own; R parameters are shared. Commands of the reader hand values over
in shared names.
"""

import re
from dataclasses import dataclass, field
from functools import partial

from planner.nc.arcs import IN_PLANE
from planner.nc.language import makers, swivel, tree
from planner.nc.language.siemens import cycles, tables
from planner.nc.language.siemens.control import Control, changed
from planner.nc.language.siemens.text import TIMES, LineTokens, handed_over
from planner.nc.language.system_variables import PER_RADIUS, position

AXES = "XYZ"
_CALLED = re.compile(r"[A-Z_]{2}\w*|L\d+")
_NAMES_MAX = 32  # parameters of a subprogram
_SYSTEMS = (1, 2, 3, 4)  # $P_UIFR[n] is G54 to G57, P of G10 L2
_CLOSER = {"AC": "", "IC": "", "DC": "WRAPPED", "ACP": "TURNED", "ACN": "TURNED"}


def _polar(name: str) -> tree.Named:
    """The pole (x, y, z), the radius and the angle of the last polar coordinates."""
    return tree.Named(f"_polar {name}", True)


def _way_of_polar(axis: str, part: str) -> tree.Expression:
    """What the last polar coordinates add to an axis, COS or SIN of the angle times the radius."""
    way = _polar("rp") * tree.op(part, _polar("ap"))
    return way * PER_RADIUS if axis == "X" else way


@dataclass
class Row:
    """The words of a line so far."""

    words: list[tree.Word] = field(default_factory=list)
    assigned: list[tuple[tree.Parameter, tree.Expression]] = field(default_factory=list)
    before: list[tree.Statement] = field(default_factory=list)  # corners and compensation, before the row
    codes: set[float] = field(default_factory=set)  # numbers of its G codes
    arc: str = ""  # CIP or CT
    through: dict[str, tree.Expression] = field(default_factory=dict)  # I1 J1 K1 of CIP
    polar: list[tuple[tree.Parameter, tree.Expression]] = field(default_factory=list)  # AP and RP
    stops: bool = False  # it ends in a full stop
    corner: bool = False  # it ends in a rounding or chamfer

    def has(self, letters: str) -> bool:
        """True if there is a word with one of the letters."""
        return any(word.letter in letters for word in self.words)

    def take(self, letters: str) -> dict[str, tree.Expression]:
        """The values of words by their letters, which are taken out of the row."""
        found = {word.letter: word.value for word in self.words if word.letter in letters}
        self.words = [word for word in self.words if word.letter not in letters]
        return found


class Commands(Control):
    """Statements of commands: cycles, frames, variables, messages, calls, poles and polar coordinates.

    normal : of the plane that the text has chosen;  turns : the motion code in force in it is G2 or G3
    """

    normal = 2
    turns = False
    threading = False  # G33 is in force

    def _cycle(self, reader: LineTokens) -> None:
        name, place = reader.peek(-1), reader.place
        given = self._arguments(reader)
        if name == "CYCLE800":
            values = {f"p{k}": value for k, value in enumerate(given) if value is not None}
            self.body.append(tree.made(place, swivel.siemens, **values))
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
        for k, more in enumerate(given[len(known) :], start=len(known) + 1):
            if more not in (None, tree.ZERO, tree.Number(-0.0)):
                raise reader.fault(f"argument {k} of {name}, of later controls, is not read; leave it out", 0)
        values = {key: value for key, value in zip(known, given, strict=False) if value is not None}
        try:
            cycles.check(name, values)
        except ValueError as fault:
            raise reader.fault(str(fault), 0) from fault
        return [tree.made(place, partial(cycles.cycle_rows, name=name), **values)]

    def _modal_call(self, reader: LineTokens) -> None:
        if reader.ended:
            self.cycle = None
            return
        name = reader.pop().text
        known = [one for one in cycles.ARGUMENTS if one not in (*cycles.POCKETS, *cycles.RADIAL)]
        if name in cycles.ARGUMENTS and name not in known:
            raise reader.fault(f"MCALL {name} is not read; read are {', '.join(known)}", 0)
        if name in known:
            self.cycle = self._drilled(reader, name, self._arguments(reader))
            return
        self.cycle, body, self.body = [], self.body, []
        given = self._arguments(reader)
        self._append_call(reader, name, given, tree.ONE)
        self.cycle, self.body = self.body, body

    def _frame(self, reader: LineTokens) -> None:
        """TRANS, ROT, SCALE, MIRROR: a frame; ATRANS and the others: one beside the one before."""
        name, place = reader.peek(-1), reader.place
        given: dict[str, tree.Expression] = {}
        while not reader.ended:
            at, token = reader.at(), reader.pop()
            if token.text in makers.FRAMES or token.text[0] == "G":
                reader.next -= 1
                break
            is_word = token.kind == "word"
            letter = "RPL" if token.text == "RPL" and name.endswith("ROT") else token.text[0]
            if letter not in ("X", "Y", "Z", "RPL") or not (is_word or token.text == letter):
                raise reader.fault(f"{name} takes X, Y and Z; {token.text} comes", token.at)
            value = tree.Number(float(token.text[1:])) if is_word else self._given(reader, letter, at)
            if value is None:
                raise reader.fault("a text is no length", token.at)
            given[letter] = value
        self.body.append(tree.made(place, partial(makers.siemens_frame, name=name), **given))

    def _message(self, reader: LineTokens) -> None:
        match = re.search(r'"([^"]*)"', reader.text)
        reader.leave()
        if match and match.group(1):
            self.body.append(tree.Message(reader.place, (match.group(1),)))

    def _refused(self, reader: LineTokens) -> None:
        raise reader.fault(tables.refusal(reader.peek(-1)), reader.tokens[reader.next - 1].at)

    def _offset(self, reader: LineTokens) -> None:
        """$P_UIFR[n, X, TR] = value and $P_UIFR[n] = CTRANS(X, value, ...): a work system's origin."""
        at = reader.tokens[reader.next - 1].at
        reader.expect("[")
        number, words = reader.expression(), []
        system = int(number.value) if isinstance(number, tree.Number) else 0
        if reader.take(","):
            axis = reader.pop().text
            reader.expect(",")
            part = reader.pop().text
            reader.expect("]")
            reader.expect("=")
            words = [(axis, reader.expression())]
        else:
            part = "TR" if reader.take("]") and reader.take("=") and reader.take("CTRANS") else ""
            words = [(axis, tree.ZERO) for axis in "XYZ"] if part and reader.take("(") else []
            while words and not reader.take(")"):
                axis = reader.pop().text
                reader.expect(",")
                words = [(one, old) for one, old in words if one != axis] + [(axis, reader.expression())]
                reader.take(",")
        if system not in _SYSTEMS or part != "TR" or not words or any(axis not in "XYZ" for axis, _ in words):
            text = "settable frames are read as $P_UIFR[1 to 4, X, TR] = value and = CTRANS(X, value, ...); put others into "
            raise reader.fault(text + "[work_offsets] of the machine file", at)
        offset = ("G", 10.0), ("L", 2.0), ("P", float(system))
        self.body.append(tree.row(reader.place, *offset, *sorted(words)))

    def _tool_point(self, reader: LineTokens) -> None:
        """TRAORI and TRAFOOF, alone or as NAME(1). Raises ProgramFault for others, and without kinematics."""
        name = reader.peek(-1)
        at = reader.tokens[reader.next - 1].at
        if reader.take("(") and not (reader.take("1") and reader.take(")")):
            raise reader.fault(f"{name} is read alone, or as {name}(1)", at)
        if self.source.at_tip:
            self.body.append(tree.row(reader.place, ("M", tables.TOOL_POINT[name])))
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
        if kind not in _CLOSER or reader.peek(1) != "(":
            return reader.expression()
        reader.next += 2
        value = reader.expression()
        reader.expect(")")
        if letter in "IJK":
            return self._centre("IJK".index(letter), value) if kind == "AC" else value
        good = letter in ("XYZABC" if kind in ("AC", "IC") else "ABC")
        text = "AC and IC stand with X Y Z A B C and I J K; DC, ACP, ACN with A B C"
        reader.require(good, text, at - reader.start)
        here = position(letter)
        if kind in ("DC", "ACP", "ACN"):  # the shortest way there, or that in a direction
            way = here - value if kind == "ACN" else value - here
            step = tree.op(_CLOSER[kind], way)
            value = here - step if kind == "ACN" else here + step
        elif (kind == "AC") == self.absolute:
            return value
        elif kind == "IC":
            return here + value
        return value if self.absolute else value - here

    @staticmethod
    def _centre(axis: int, place: tree.Expression) -> tree.Expression:
        """A centre's I, J or K, a radius, for an absolute coordinate."""
        way = place - position(AXES[axis])
        return way / PER_RADIUS if axis == 0 else way

    def _is_call(self, reader: LineTokens) -> bool:
        """True if the line is a call by a name."""
        name, behind = reader.peek(), reader.peek(1)
        known = (self.names, tables.IDLE, tables.SAID, tables.REFUSED, cycles.ARGUMENTS)
        called = reader.kind() == "name" and _CALLED.fullmatch(name) and not any(name in one for one in known)
        return bool(called and (behind in ("", "(", "P") or TIMES.fullmatch(behind)))

    def _call(self, reader: LineTokens) -> None:
        name, given = reader.pop().text, self._arguments(reader)
        times = reader.times()
        reader.require(reader.ended, f"{reader.peek()} is not expected behind the call of {name}")
        self._append_call(reader, name, given, times)

    def _call_text(self, reader: LineTokens) -> None:
        """CALL "NAME", EXTCALL "NAME", EXTCALL ("NAME"), CALL BLOCK label TO label."""
        if reader.take("BLOCK"):
            self._call_block(reader)
            return
        bracket = reader.take("(")
        reader.require(reader.kind() == "text", 'CALL is followed by the name of a subprogram: CALL "HOLES"')
        text = reader.pop().text.strip('"')
        if bracket:
            reader.expect(")")
        stem = re.sub(r"(?i)\A_N_", "", text.replace("\\", "/").replace(":", "/").split("/")[-1])
        name = re.sub(r"(?i)(_SPF|\.SPF|_MPF|\.MPF)\Z", "", stem)
        self._append_call(reader, name.upper(), [], tree.ONE)

    def _append_call(
        self, reader: LineTokens, name: str, given: list[tree.Expression | None], times: tree.Expression
    ) -> None:
        if name in self.source.harmless:
            text = f"{name} is assumed not to move anything, as the machine file or --ignore says"
            self.body.append(tree.Message(reader.place, (text,)))
            return
        reader.require(len(given) <= _NAMES_MAX, f"a subprogram takes at most {_NAMES_MAX} values", 0)
        place = reader.place
        values = [tree.ZERO if one is None else one for one in given]
        values += [tree.ZERO] * (_NAMES_MAX - len(given) if given else 0)
        if given:
            pairs = [(handed_over(k), value) for k, value in enumerate(values)]
            pairs += [(changed(k), tree.ZERO) for k in range(len(given))]
            self.body.append(tree.assign(place, *pairs))
        self.body.append(tree.Call(place, name.lower(), None, name, times))
        for k, one in enumerate(given):
            if isinstance(one, tree.Named | tree.Numbered):
                back: list[tree.Statement] = [tree.assign(place, (one, handed_over(k)))]
                self.body.append(tree.If(place, ((tree.op("EQ", changed(k), tree.ONE), back),), []))

    def _polar_word(self, reader: LineTokens, row: Row) -> None:
        name = reader.peek(-1)
        reader.expect("=")
        kind = reader.peek() if reader.peek() in ("AC", "IC") and reader.peek(1) == "(" else ""
        reader.next += bool(kind)
        value, target = reader.expression(), _polar(name.lower())
        if not kind and not self.absolute and name == "AP":
            raise reader.fault("AP under G91 is not read; write AP=IC(angle) or AP=AC(angle)", 0)
        row.polar.append((target, target + value if kind == "IC" else value))

    def _pole(self, reader: LineTokens, row: Row, code: int) -> None:
        """G110, G111, G112 with coordinates in the plane, or AP and RP."""
        plane = [AXES[k] for k in IN_PLANE[self.normal]]
        base = [{110: position(axis), 111: tree.ZERO, 112: _polar(axis)}[code] for axis in plane]
        given = row.take("XYZG")
        if row.polar:
            self.body.append(tree.assign(reader.place, *row.polar))
            way = [_way_of_polar(*one) for one in zip(plane, ("COS", "SIN"), strict=True)]
        else:
            way = [given.get(axis, tree.ZERO) for axis in plane]
        reader.require(not set(given) - {*plane, "G"}, "a pole lies in the plane (G17, G18, G19)", 0)
        pairs = ((_polar(axis), one + step) for axis, one, step in zip(plane, base, way, strict=True))
        self.body.append(tree.assign(reader.place, *pairs))

    def _to_polar(self, reader: LineTokens, row: Row) -> None:
        """The row's end by AP and RP, and an arc's centre, which is the pole."""
        plane = IN_PLANE[self.normal]
        if row.has("".join(AXES[k] for k in plane)):
            raise reader.fault("AP and RP stand instead of coordinates in the plane", 0)
        self.body.append(tree.assign(reader.place, *row.polar))
        for k, part in zip(plane, ("COS", "SIN"), strict=True):
            end = _polar(AXES[k]) + _way_of_polar(AXES[k], part)
            end = end if self.absolute else end - position(AXES[k])
            row.words.append(tree.word(AXES[k], reader.place.at, end))
            if self.turns and not row.has("R"):
                row.words.append(tree.word("IJK"[k], reader.place.at, self._centre(k, _polar(AXES[k]))))

    def _home(self, reader: LineTokens, code: int, at: int) -> list[tree.Word]:
        """G74 X1=0: to the reference point of axes; G75: to their fixed point, G28 and G30 here."""
        axes = []
        while reader.kind() and (match := re.fullmatch(r"([XYZABC])1?0?", reader.peek())):
            axes.append(match[1])
            token = reader.pop()
            if token.kind != "word":
                reader.expect("=")
                reader.expression()
        if reader.take("FP"):
            reader.expect("=")
            text = "G75 FP other than 1 is not read; write its position with SUPA"
            reader.require(reader.expression() == tree.ONE, text, at - reader.start)
        words = [(axis, tree.ZERO) for axis in axes]
        self.body.append(tree.row(reader.place, ("G", 91.0), ("G", 28.0 if code == 74 else 30.0), *words))
        return [tree.word("G", at, 90.0 if self.absolute else 91.0)]

    def _dwell(self, reader: LineTokens, row: Row) -> None:
        """G4 F seconds, or S turns of the spindle."""
        given = row.take("FS")
        row.words = [word for word in row.words if word.code != "G4"]
        if "F" in given:
            row.before.append(tree.row(reader.place, ("G", 4.0), ("P", given["F"])))
        elif "S" in given:
            row.before.append(tree.made(reader.place, makers.dwell_turns, turns=given["S"]))
        else:
            raise reader.fault("G4 is followed by F and seconds, or S and turns of the spindle", 0)

    def _absolutes(self, given: dict[str, tree.Expression]) -> dict[str, tree.Expression]:
        """The values with those of axes as absolute ones."""
        relative = "" if self.absolute else AXES
        return {c: position(c) + value if c in relative else value for c, value in given.items()}


def siemens_files(name: str) -> frozenset[str]:
    """Names, in small letters, that the file of a subprogram may have: NAME.SPF, NAME.MPF, NAME_SPF."""
    return frozenset(name + ending for ending in (".spf", ".mpf", "_spf", "_mpf", ""))
