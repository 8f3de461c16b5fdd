"""Labels, calls, repeats, Q parameters and FN functions of a conversational program."""

from collections.abc import Sequence

from planner.nc.language import makers, tree
from planner.nc.language.heidenhain.text import Block, Formula, Rows, variable
from planner.nc.language.making import assumed_row
from planner.nc.language.system_variables import position
from planner.nc.state import NAMED

_COMPARE = {"EQU": "EQ", "NE": "NE", "GT": "GT", "LT": "LT"}
# FN functions by their numbers: comparisons, and operations on two values and on one.
_FN_IF = {9: "EQU", 10: "NE", 11: "GT", 12: "LT"}
_FN_TWO = {1: "+", 2: "-", 3: "*", 4: "/", 8: "LEN", 13: "ATAN"}
_FN_ONE = {0: "", 5: "SQRT", 6: "SIN", 7: "COS"}
# Functions that move nothing: printing, formatted output, the PLC, waiting for it, tables, texts.
FN_NOTHING, _FN_WAIT, _FN_ERROR, _FN_READ = (15, 16, 19, 20, 26, 27, 29, 37, 38), 20, 14, 18
_PLAIN_IF = "IF is followed by a value, EQU, NE, GT or LT, a value and GOTO LBL: IF +Q1 EQU +2 GOTO LBL 5"
_ALARM = "the program raises its error (FN 14) here; run it with values that do not lead there"
_CONTROLS = "the value is known by the control only; assign what it has there: Q1 = 5"
FN_REFUSED = {
    18: f"{_CONTROLS} (SYSREAD of the position, ID270 NR1 IDX1 to 3, is read)",
    28: f"{_CONTROLS} (TABREAD reads a table at the control)",
    17: "it writes data of the control; leave it out, if these move nothing",
}


class Flow:
    """Statements that decide the order of the blocks."""

    def __init__(self) -> None:
        self.blocks: Sequence[Block] = ()  # of the program
        self.names: dict[str, int] = {}  # numbers of labels that have names
        self.known: dict[int, int] = {}  # label to its block
        self.called: set[int] = set()  # labels that are called as subprograms
        self.repeats = 0  # how many sections are repeated
        self.file = 0  # number of the file

    def _label(self, block: Block) -> int:
        match = block.take(r'\s*(?:(\d+)|"([^"]*)")')
        if match is None:
            raise block.wrong('a label is a number or a name: LBL 5, LBL "holes"')
        return int(match[1]) if match[1] else self.names.setdefault(match[2], NAMED + len(self.names))

    def _label_here(self, block: Block) -> Rows:
        name, label = block.rest.strip(), self._label(block)
        if label == 0:
            return []
        if self.blocks[self.known[label]] is not block:
            raise block.fault(f"label {name} is set twice")
        return [tree.Label(block.place, label)]

    def _call(self, block: Block) -> Rows:
        label = self._label(block)
        if label not in self.known:
            raise block.fault(f"there is no LBL {block.text[8:].split('REP')[0].strip()} to call")
        repeat = block.take(r"\s*REP\s*(\d+)(?:\s*/\s*\d+)?")
        if repeat is None:
            self.called.add(label)
            return [tree.Call(block.place, procedure_name(label, self.file), None, block.text)]
        counter = variable(f"rep{self.file}_{self.repeats}")
        self.repeats += 1
        return [tree.repeated(block.place, counter, tree.Number(float(repeat[1])), label)]

    def _parameter(self, block: Block) -> Rows:
        block.column = 0
        if block.take(r"QS\d+\s*="):
            return []  # a text moves nothing
        match = block.take(r"Q([LR]?)(\d+)\s*=\s*")
        if match is None:
            raise block.fault("a parameter and a formula are expected, such as Q1 = Q2 + 3")
        target = block.known(int(match[2]), match[1].upper())
        return [tree.assign(block.place, (target, Formula(block).read()))]

    def _fn(self, block: Block) -> Rows:
        match = block.take(r"\s*(\d+)\s*:\s*")
        number = int(match[1]) if match else -1
        if number in _FN_IF:
            return self._jump(block, number)
        if number in FN_NOTHING:
            return [assumed_row(block.place, "waits")] if number == _FN_WAIT else []
        if number == _FN_ERROR:
            return [tree.made(block.place, makers.refuse(_ALARM))]
        begin = block.column
        asked = number == _FN_READ and block.take(
            r"SYSREAD\s*(?=Q[LR]?\d+\s*=\s*ID\s*270\s+NR\s*1\s+IDX\s*[1-3]\s*$)"
        )
        target = block.take(r"Q([LR]?)(\d+)\s*=\s*")
        axis = block.take(r".*IDX\s*([1-3])") if asked else None
        if target is None or (number not in {**_FN_ONE, **_FN_TWO} and axis is None):
            why = FN_REFUSED.get(number, "it is not known; read are FN 0 to 16, 19, 20, 26, 27, 29, 37, 38")
            raise block.fault(f"FN {number if match else ''} is not read: {why}", begin)
        q = block.known(int(target[2]), target[1].upper())
        if axis is not None:
            operation: tree.Expression = position("XYZ"[int(axis[1]) - 1])
        elif number in _FN_ONE:
            block.take(r"(?:SQRT|SIN|COS)\s*")
            operation = block.value()
            operation = tree.op(_FN_ONE[number], operation) if _FN_ONE[number] else operation
        else:
            left = block.value()
            if not block.take(r"\s*(?:DIV|LEN|ANG|[-+*])\s*(?=[-+.\dQ])"):
                raise block.wrong("+, -, *, DIV, LEN or ANG and a second value are expected")
            operation = tree.op(_FN_TWO[number], left, block.value())
        block.end()
        return [tree.assign(block.place, (q, operation))]

    def _jump(self, block: Block, number: int = 0) -> Rows:
        """FN 9 to 12; IF without FN compares as it says (`number` 0)."""
        block.take(r"\s*IF\b\s*|\s*IF(?=[-+Q\d.])")
        left = block.value()
        block.take(" *")
        begin = block.column
        compare = block.take(r"\s*(EQU|NE|GT|LT)\b")
        if compare is None or compare[1].upper() != _FN_IF.get(number, compare[1].upper()):
            what = f"FN {number} compares with {_FN_IF[number]}" if number else _PLAIN_IF
            raise block.fault(what, begin)
        right = block.value()
        block.require(block.take(r"\s*GOTO\s+LBL\s*"), "GOTO LBL is expected here", block.column)
        go: Rows = [tree.Goto(block.place, tree.number(self._label(block)))]
        return [tree.If(block.place, ((tree.op(_COMPARE[compare[1].upper()], left, right), go),), [])]


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
