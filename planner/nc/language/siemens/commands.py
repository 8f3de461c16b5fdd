"""Commands of a Sinumerik program: their tables; cycles, frames, declarations and messages; calls of
subprograms, files of the program's folder (NAME, NAME P3, NAME(1, R2), CALL "NAME", L10).

Variables of DEF and PROC are a call's own; R parameters are shared. Commands of the reader hand values over
in shared names.
"""

import re
from functools import partial

from planner.nc.language import makers, swivel, tree
from planner.nc.language.siemens import cycles, patterns, tables
from planner.nc.language.siemens.declarations import Declarations, changed
from planner.nc.language.siemens.text import TIMES, LineTokens, handed_over
from planner.nc.language.system_variables import position

_CALLED = re.compile(r"[A-Z_]{2}\w*|L\d+")
_NAMES_MAX = 32  # parameters of a subprogram
_SYSTEMS = (1, 2, 3, 4)  # $P_UIFR[n] is G54 to G57, P of G10 L2
_CLOSER = {"AC": "", "IC": "", "DC": "WRAPPED", "ACP": "TURNED", "ACN": "TURNED"}


class Commands(Declarations):
    """Statements of commands: cycles, frames, variables, messages, calls."""

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

    def _pattern(self, reader: LineTokens) -> None:
        name = reader.peek(-1)
        if self.cycle is None:
            raise reader.fault(f"{name} stands behind MCALL with a drilling cycle, which it repeats", 0)
        given = self._arguments(reader)
        try:
            self.body += patterns.pattern_rows(reader.place, name, given, self.cycle)
        except ValueError as fault:
            raise reader.fault(str(fault), 0) from fault

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
            return value - position("XYZ"["IJK".index(letter)]) if kind == "AC" else value
        if letter not in "XYZABC" or (kind not in ("AC", "IC") and letter in "XYZ"):
            text = "AC and IC stand with X Y Z A B C and I J K; DC, ACP, ACN with A B C"
            raise reader.fault(text, at - reader.start)
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

    def _is_call(self, reader: LineTokens) -> bool:
        """True if the line is a call by a name."""
        name, behind = reader.peek(), reader.peek(1)
        known = (self.names, tables.IDLE, tables.SAID, tables.REFUSED, cycles.ARGUMENTS)
        called = reader.kind() == "name" and _CALLED.fullmatch(name) and not any(name in one for one in known)
        return bool(called and (behind in ("", "(", "P") or TIMES.fullmatch(behind)))

    def _call(self, reader: LineTokens) -> None:
        name, given = reader.pop().text, self._arguments(reader)
        times = reader.times()
        if not reader.ended:
            raise reader.fault(f"{reader.peek()} is not expected behind the call of {name}")
        self._append_call(reader, name, given, times)

    def _call_text(self, reader: LineTokens) -> None:
        """CALL "NAME", EXTCALL "NAME", EXTCALL ("NAME"), CALL BLOCK label TO label."""
        if reader.take("BLOCK"):
            self._call_block(reader)
            return
        bracket = reader.take("(")
        if reader.kind() != "text":
            raise reader.fault('CALL is followed by the name of a subprogram: CALL "HOLES"')
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
        if len(given) > _NAMES_MAX:
            raise reader.fault(f"a subprogram takes at most {_NAMES_MAX} values", 0)
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


def siemens_files(name: str) -> frozenset[str]:
    """Names, in small letters, that the file of a subprogram may have: NAME.SPF, NAME.MPF, NAME_SPF."""
    return frozenset(name + ending for ending in (".spf", ".mpf", "_spf", "_mpf", ""))
