"""Python source of a language: expressions by its templates, and basic blocks, lines that run one after the
other."""

import math
import re
from collections.abc import Callable

from planner.nc.language import tree

_SIGNS = {"EQ": "==", "NE": "!=", "GT": ">", "GE": ">=", "LT": "<", "LE": "<="}
COMPARISONS = frozenset(_SIGNS)
# Of finite numbers these may make one that is not: a computed value of none would count as a word without value.
GROWING = frozenset(("+", "-", "*", "/", "POT", "LEN"))
_TWELVE_DIGITS = 1e-12  # relative
LOGICAL = frozenset(("AND", "OR", "XOR", "NOT"))
# By name and number of operands. A dialect that means another thing by a name puts its own text in the place
# of this one.
ARITHMETIC: dict[tuple[str, int], str] = {
    ("-", 1): "(-{0})",
    **{(sign, 2): f"({{0}}{sign}{{1}})" for sign in "+-*/"},
    **{(name, 2): f"({{0}}{sign}{{1}})" for name, sign in _SIGNS.items()},
    ("**", 2): "power({0},{1})",
    ("MOD", 2): "modulo({0},{1})",
    ("DIV", 2): "float(trunc({0}/{1}))",
    ("AND", 2): "({0}!=0 and {1}!=0)",
    ("OR", 2): "({0}!=0 or {1}!=0)",
    ("XOR", 2): "(({0}!=0)!=({1}!=0))",
    ("NOT", 1): "({0}==0)",
    ("ATAN", 2): "atan2({0},{1})",
    ("LEN", 2): "hypot({0},{1})",
    ("MIN", 2): "min({0},{1})",
    ("MAX", 2): "max({0},{1})",
    ("ABS", 1): "abs({0})",
    ("EXP", 1): "exp({0})",
    ("LN", 1): "log({0})",
    ("LOG", 1): "log10({0})",
    **dict.fromkeys((("SQRT", 1), ("SQR", 1)), "sqrt({0})"),
    ("POT", 1): "({0})**2",
    **dict.fromkeys((("INT", 1), ("TRUNC", 1)), "float(trunc({0}))"),
    ("FRAC", 1): "({0}-trunc({0}))",
    ("FIX", 1): "float(floor({0}))",
    ("FUP", 1): "float(ceil({0}))",
    ("ROUND", 1): "rounded({0})",
    ("ADP", 1): "({0})",
    ("BIN", 1): "binary({0})",
    ("BCD", 1): "decimal({0})",
    **{(name.upper(), 1): f"{name}({{0}})" for name in ("sin", "cos", "tan", "asin", "acos", "atan")},
}


def finite(x: float) -> float:
    """The same. Raises OverflowError if it is not finite."""
    if x - x != 0.0:
        raise OverflowError
    return x


def modulo(a: float, b: float) -> float:
    """a MOD b, never negative. Raises ZeroDivisionError."""
    if b == 0.0:
        raise ZeroDivisionError
    rest = math.fmod(a, b)
    return rest + abs(b) if rest < 0.0 else rest


def rounded(x: float) -> float:
    """ROUND: halves go away from zero."""
    return float(math.trunc(x + (0.5 if x >= 0 else -0.5)))


def equal(a: float, b: float) -> bool:
    """Whether numbers are the same to twelve digits."""
    return abs(a - b) <= _TWELVE_DIGITS * max(abs(a), abs(b))


def array_index(index: float, size: float) -> float:
    """The index of an array's value. Raises ValueError for none of its values."""
    if not 0 <= round(index) < size:
        raise ValueError(f"index {index:g} of an array of {size:g} values, 0 to {size - 1:g}")
    return float(round(index))


FUNCTIONS: dict[str, Callable[..., object]] = {
    "array_index": array_index,
    "equal": equal,
    "remainder": math.remainder,
    **{f.__name__: f for f in (math.exp, math.log, math.log10, math.sqrt, math.hypot, math.trunc, math.fmod)},
    **{f.__name__: f for f in (math.ceil, math.floor, math.copysign, finite, modulo, rounded)},
    "power": math.pow,
    "sin": lambda x: math.sin(math.radians(x)),
    "cos": lambda x: math.cos(math.radians(x)),
    "tan": lambda x: math.tan(math.radians(x)),
    "asin": lambda x: math.degrees(math.asin(x)),
    "acos": lambda x: math.degrees(math.acos(x)),
    "atan": lambda x: math.degrees(math.atan(x)),
    "atan2": lambda y, x: math.degrees(math.atan2(y, x)),
    "binary": lambda x: float(int(f"{int(x):x}")),  # 0x25 read as the decimal digits 25
    "decimal": lambda x: float(int(str(int(x)), 16)),  # 25 as 0x25
}


class BasicBlocks:
    """The basic blocks of a procedure: lines of Python, the last one with the next block, -1 for none."""

    def __init__(self) -> None:
        self.blocks: list[list[tuple[str, tree.SourcePlace]]] = [[]]
        self.block_of: dict[int, int] = {}  # by label
        self.numbers: list[tuple[int, int]] = []  # labels of the program in their order: number, label
        self.labels = 0

    def put(self, text: str, place: tree.SourcePlace) -> None:
        """Add a line to the block that is being written."""
        self.blocks[-1].append((text, place))

    def label(self) -> int:
        """A new label, whose place is said by `here`."""
        self.labels += 1
        return self.labels

    def here(self, label: int) -> None:
        """The label is the place that is reached now."""
        if self.blocks[-1]:
            self.end(f"{len(self.blocks)}", self.blocks[-1][-1][1])
        self.block_of[label] = len(self.blocks) - 1

    def go(self, place: tree.SourcePlace, label: int, condition: str = "", otherwise: int = 0) -> None:
        """End the block: go on at the label, or at `otherwise` if the condition does not hold."""
        self.end(f"@{label}@ if {condition} else @{otherwise}@" if condition else f"@{label}@", place)

    def end(self, following: str, place: tree.SourcePlace) -> None:
        """End the block, and go on at the one that this text gives."""
        self.put(f"return {following}", place)
        self.blocks.append([])

    def source(self, place: tree.SourcePlace) -> list[tuple[str, tree.SourcePlace]]:
        """Lines of Python with their places, a function for each block; `place` is that of all else."""
        self.end("-1", place)
        lines = []
        for k, block in enumerate(self.blocks[:-1]):
            lines.append((f" def b{k}():", place))
            for text, at in block:
                known = re.sub("@([0-9]+)@", lambda named: str(self.block_of[int(named[1])]), text)
                lines.append((f"  {known}", at))
        names = "".join(f"b{k}," for k in range(len(self.blocks) - 1))
        return [*lines, (f" b=({names});pc=0", place), (" while pc>=0:pc=b[pc]()", place)]


class Expressions:
    """Writes expressions of a language as Python text; P, L, G, R and A are bound by `compiled`."""

    def __init__(self, language: tree.Language):
        self.language = language

    def value(self, expression: tree.Expression) -> str:
        """Python text of a number. Raises OverflowError for a number that is too large."""
        text, logical = self._checked(expression, raw=False)
        return f"(1.0 if {text} else 0.0)" if logical else text

    def condition(self, expression: tree.Expression) -> str:
        """Python text of what is true or false."""
        text, logical = self._checked(expression, raw=False)
        return text if logical else f"{text}!=0"

    def assigned(self, expression: tree.Expression) -> str:
        """Python text of a value to be stored: a vacant parameter alone stays vacant."""
        if isinstance(expression, tree.Numbered | tree.Named):
            return self._expression(expression, raw=True)[0]
        return self.value(expression)

    def stored(self, index: float) -> bool:
        """True if a parameter of that number is the program's own, not one that the control is asked for."""
        low, language = 0 if self.language.vacant is None else 1, self.language
        return low <= index <= language.largest and index % 1 == 0 and index not in language.system_numbers

    def _checked(self, expression: tree.Expression, *, raw: bool) -> tuple[str, bool]:
        """As `_expression`; the text raises OverflowError where the value is not finite."""
        text, logical = self._expression(expression, raw=raw)
        grows = isinstance(expression, tree.Operation) and expression.name in GROWING
        return f"finite({text})" if grows else text, logical

    def _expression(self, expression: tree.Expression, *, raw: bool) -> tuple[str, bool]:
        """Python text, and whether it is true or false rather than a number."""
        language = self.language
        if isinstance(expression, tree.Number):
            if math.isinf(expression.value):  # more digits than there are numbers for
                raise OverflowError
            return (repr(expression.value) if expression.value >= 0 else f"({expression.value!r})"), False
        if isinstance(expression, tree.Named):
            name = expression.name
            if expression.shared and name in language.system_names:
                return f"A({name!r})", False
            return f"{'G' if expression.shared else 'L'}[{name!r}]", False
        if isinstance(expression, tree.Numbered):
            index = expression.index
            if isinstance(index, tree.Number) and self.stored(index.value):
                text = f"P[{int(index.value)}]"
            elif isinstance(index, tree.Number) and index.value in language.system_numbers:
                return f"A({int(index.value)})", False
            else:
                text = f"R({self.value(index)})"
            return (text if raw else language.read.format(text)), False
        if expression.name == "EXISTS":
            (parameter,) = expression.operands
            if isinstance(parameter, tree.Numbered):
                return f"run.exists({self.value(parameter.index)})", True
            assert isinstance(parameter, tree.Named)
            if parameter.shared and parameter.name in language.system_names:
                return "True", True
            return f"({parameter.name!r} in {'G' if parameter.shared else 'L'})", True
        raw = expression.name in language.raw
        operands = []
        for k, operand in enumerate(expression.operands):
            # what is not finite stays so in the next of them, but as a divisor
            passes = expression.name in GROWING and not (expression.name == "/" and k)
            say = self._expression if passes else self._checked
            text, logical = say(operand, raw=raw and isinstance(operand, tree.Numbered))
            operands.append(f"(1.0 if {text} else 0.0)" if logical else text)
        template = language.operations[expression.name, len(operands)]
        return template.format(*operands), expression.name in language.conditions
