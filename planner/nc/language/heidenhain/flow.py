"""Labels, calls, repeats, Q parameters and FN functions of a conversational program."""

from __future__ import annotations

import re
from collections.abc import Sequence

from planner.nc.language import tree
from planner.nc.language.heidenhain.text import (
    PARAMETERS,
    ConversationalBlock,
    Formula,
    own,
    parameter,
    value,
)

_LABEL = re.compile(r'\s*(?:(\d+)|"([^"]*)")')
_REPEAT = re.compile(r"\s*REP\s*(\d+)", re.IGNORECASE)
_IF = re.compile(r"\s*IF\s", re.IGNORECASE)
_THEN = re.compile(r"\s*GOTO\s+LBL\s*", re.IGNORECASE)
_COMPARE = {"EQU": "EQ", "NE": "NE", "GT": "GT", "LT": "LT"}
# FN functions by their numbers: comparisons, and operations on two values and on one.
_FN_IF = {9: "EQU", 10: "NE", 11: "GT", 12: "LT"}
_FN_TWO = {1: "+", 2: "-", 3: "*", 4: "/", 8: "LEN", 13: "ATAN"}
_FN_ONE = {0: "", 5: "SQRT", 6: "SIN", 7: "COS"}
NAMED = 100_000  # number of the first label, and of the first tool, with a name


class Flow:
    """Statements that decide the order of the blocks.

    blocks  : of the program
    names   : numbers of labels that have names
    known   : label to its block
    called  : labels that are called as subprograms
    repeats : how many sections are repeated
    file    : number of the file
    """

    def __init__(self) -> None:
        self.blocks: Sequence[ConversationalBlock] = ()
        self.names: dict[str, int] = {}
        self.known: dict[int, int] = {}
        self.called: set[int] = set()
        self.repeats = 0
        self.file = 0

    def _label(self, block: ConversationalBlock, column: int) -> tuple[int, int]:
        match = _LABEL.match(block.text, column)
        if match is None:
            raise block.fault('a label is a number or a name: LBL 5, LBL "holes"', column)
        if match.group(1):
            return int(match.group(1)), match.end()
        return self.names.setdefault(match.group(2), NAMED + len(self.names)), match.end()

    def _label_here(self, block: ConversationalBlock, column: int) -> list[tree.Statement]:
        label, _ = self._label(block, column)
        if label == 0:
            return []
        if self.blocks[self.known[label]] is not block:
            raise block.fault(f"label {block.text[column:].strip()} is set twice")
        return [tree.Label(block.place, label)]

    def _call(self, block: ConversationalBlock, column: int) -> list[tree.Statement]:
        label, column = self._label(block, column)
        if label not in self.known:
            raise block.fault(f"there is no LBL {block.text[8:].split('REP')[0].strip()} to call")
        repeat = _REPEAT.match(block.text, column)
        if repeat is None:
            self.called.add(label)
            return [tree.Call(block.place, procedure_name(label, self.file), None, block.text)]
        counter = own(f"rep{self.file}_{self.repeats}")
        self.repeats += 1
        again: list[tree.Statement] = [
            tree.assign(block.place, (counter, counter + tree.ONE)),
            tree.Goto(block.place, tree.Number(float(label))),
        ]
        more = tree.op("LT", counter, tree.Number(float(repeat.group(1))))
        return [tree.If(block.place, ((more, again),), [tree.assign(block.place, (counter, tree.ZERO))])]

    def _parameter(self, block: ConversationalBlock, column: int) -> list[tree.Statement]:
        match = re.match(r"Q(\d+)\s*=\s*", block.text, re.IGNORECASE)
        if match is None:
            raise block.fault("a parameter and a formula are expected, such as Q1 = Q2 + 3")
        formula = Formula(block, match.end())
        return [tree.assign(block.place, (self._q(block, int(match.group(1))), formula.read()))]

    def _q(self, block: ConversationalBlock, number: int) -> tree.Parameter:
        if number >= PARAMETERS:
            raise block.fault(f"Q{number}: there are Q0 to Q{PARAMETERS - 1}")
        return parameter(number)

    def _fn(self, block: ConversationalBlock, column: int) -> list[tree.Statement]:
        match = re.match(r"\s*(\d+)\s*:\s*", block.text[column:])
        number = int(match.group(1)) if match else -1
        column += match.end() if match else 0
        if number in _FN_IF:
            return self._jump(block, column, number)
        target_of = re.match(r"Q(\d+)\s*=\s*", block.text[column:], re.IGNORECASE)
        if target_of is None or number not in {**_FN_ONE, **_FN_TWO}:
            raise block.fault(f"FN {number if match else ''} is not read; read are FN 0 to 13", column)
        q, column = self._q(block, int(target_of.group(1))), column + target_of.end()
        if number in _FN_ONE:
            word_of = re.match(r"(?:SQRT|SIN|COS)\s*", block.text[column:], re.IGNORECASE)
            given, column = value(block, column + (word_of.end() if word_of else 0))
            operation: tree.Expression = tree.op(_FN_ONE[number], given) if _FN_ONE[number] else given
        else:
            left, column = value(block, column)
            sign = re.match(r"\s*(?:DIV|LEN|ANG|[-+*])\s*(?=[-+.\dQ])", block.text[column:], re.IGNORECASE)
            if sign is None:
                raise block.fault("+, -, *, DIV, LEN or ANG and a second value are expected", column)
            right, column = value(block, column + sign.end())
            operation = tree.op(_FN_TWO[number], left, right)
        if block.text[column:].strip():
            raise block.fault("nothing may follow here", column)
        return [tree.assign(block.place, (q, operation))]

    def _jump(self, block: ConversationalBlock, column: int, number: int) -> list[tree.Statement]:
        start = _IF.match(block.text, column)
        left, column = value(block, start.end() if start else column)
        compare = re.match(r"\s*(EQU|NE|GT|LT)\b", block.text[column:], re.IGNORECASE)
        if compare is None or compare.group(1).upper() != _FN_IF[number]:
            raise block.fault(f"FN {number} compares with {_FN_IF[number]}", column)
        right, column = value(block, column + compare.end())
        then = _THEN.match(block.text, column)
        if then is None:
            raise block.fault("GOTO LBL is expected here", column)
        label, _ = self._label(block, then.end())
        then_go: list[tree.Statement] = [tree.Goto(block.place, tree.Number(float(label)))]
        return [tree.If(block.place, ((tree.op(_COMPARE[_FN_IF[number]], left, right), then_go),), [])]


def procedure_name(label: int, file: int = 0) -> str:
    """The name of a label's subprogram, in the file of that number."""
    return f"LBL {label} of {file}" if file else f"LBL {label}"


def called_file(text: str) -> str:
    """The name of a called program without its folder and ending, in small letters."""
    name = text.strip().strip('"').replace("\\", "/").split("/")[-1].split(":")[-1].lower()
    return name.removesuffix(".h")


def files(name: str) -> frozenset[str]:
    """Names that the file of a called program may have, in small letters."""
    return frozenset((name, f"{name}.h"))
