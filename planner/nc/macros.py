"""Macros of a printer ([gcode_macro NAME] of Klipper): their lines in place of the calls of a program.

    {params.BED|default(60)|int}            a value given with the call; sums, comparisons, `a if b else c`
    {% set a = 2 * 3 %}                     a name for what follows
    {% if a > 5 %} ... {% elif ... %} ... {% else %} ... {% endif %}

Klipper renders a macro when it is called, and before any of it is run. One that asks the printer
(printer.toolhead ...) or has other statements is not run: its call stays, and is said as that of an unknown
macro.
"""

import ast
import operator
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from planner.base.arrays import Array
from planner.base.errors import InputError
from planner.nc.printer import command_of
from planner.nc.reading import KLIPPER

CALLS_MAX = 100_000  # of a program: macros that call others by the hundred never end
_TEXT_MAX, _NUMBER_MAX = 1_000, 1e15  # of expressions and values: no coordinate needs more
_PARTS = re.compile(r"(\{%.*?%\}|\{.*?\})", re.DOTALL)
_CHANGES = b"SET_GCODE_VARIABLE"  # of a macro, while the program runs
_WORDS = {"true": True, "false": False, "none": None}
_MISSING = object()  # a value that the call does not give
_BINARY: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod, ast.Eq: operator.eq, ast.NotEq: operator.ne,
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge,
}  # fmt: skip


class Called(NamedTuple):
    """A program with its macros written out."""

    data: bytes  # the text
    line: Array  # (n,) the line of the program that each line of the text comes from, 1-based
    files: tuple[tuple[int, str], ...]  # as `Words.files`: where macros begin, and where the program goes on
    calls: Counter[str]  # how often each was run
    left: dict[str, str]  # by name why a macro is not run
    dialect: str = KLIPPER  # or "apt" of CL files (cl_file.py)


class _Unknown(Exception):
    """A macro needs what only the printer knows."""


def written_out(data: bytes, macros: Mapping[str, str], ignore: Sequence[str] = ()) -> Called | None:
    """A program with the macros that it calls written out; None where it calls none, or changes what they
    hold.

    macros : their lines by their names in capital letters
    ignore : names that are left alone

    Raises InputError for more calls than `CALLS_MAX`.
    """
    names = "|".join(re.escape(name) for name in macros if name not in ignore)
    found = Called(b"", np.zeros(0), (), Counter(), {})
    if not names or _CHANGES in data.upper():
        return None
    rows = np.ones(data.count(b"\n") + 1, dtype=np.int64)
    pieces, files, size, line, done, counted = [], [], 0, 0, 0, 0
    pattern = rf"^[ \t]*(?:N\d+[ \t]*)?(?:{names})(?![\w.])[^\n]*"
    for match in re.finditer(pattern.encode(), data, re.IGNORECASE | re.MULTILINE):
        text = match[0].decode("utf-8", "replace")
        own = "\n".join(_lines(text, macros, (*ignore,), found)).encode()
        if own == match[0]:
            continue
        line += data.count(b"\n", counted, match.start())
        pieces += [data[done : match.start()], own]
        begin = size + len(pieces[-2])
        size = begin + len(own)
        files += [(begin, text.partition(";")[0].strip()), (size, "")]
        rows[line] += own.count(b"\n")
        counted, done = match.start(), match.end()
    if not found.calls and not found.left:
        return None
    written = b"".join([*pieces, data[done:]])
    return found._replace(data=written, line=np.repeat(np.arange(len(rows)) + 1, rows), files=tuple(files))


def _lines(text: str, macros: Mapping[str, str], closed: tuple[str, ...], found: Called) -> list[str]:
    """The lines that stand for a line; `closed` are the macros that it may not call."""
    command = command_of(text)
    if command is None or command.name not in macros or command.name in closed:
        return [text]
    name = command.name
    try:
        body = _rendered(macros[name], {key.upper(): value for key, value in command.values().items()})
    except _Unknown as why:
        found.left.setdefault(name, str(why))
        return [text]
    found.calls[name] += 1
    if found.calls.total() > CALLS_MAX:
        raise InputError(f"{name}: more than {CALLS_MAX:,} calls of macros")
    closed = (*closed, name)
    return [line for own in body.split("\n") for line in _lines(own, macros, closed, found)]


def _rendered(body: str, params: dict[str, str]) -> str:
    """The text of a macro with the values of a call. Raises _Unknown."""
    text: list[str] = []
    scope: dict[str, Any] = {"params": params}
    branches: list[tuple[bool, bool]] = []  # of each open `if`: whether its lines count, and whether some did
    for part in _PARTS.split(body):
        counts = all(on for on, _ in branches)
        if not part.startswith("{%"):
            if counts:
                text.append(str(_value_of(part[1:-1], scope, _checked)) if part[:1] == "{" else part)
            continue
        word, _, rest = part[2:-2].strip("-+ \t\n").partition(" ")
        name, _, value = rest.partition("=")
        if word == "if":
            on = counts and _holds(_value_of(rest, scope))
            branches.append((on, on or not counts))
        elif word in ("elif", "else", "endif") and branches:
            _, had = branches.pop()
            on = not had and word != "endif" and (word == "else" or _holds(_value_of(rest, scope)))
            branches += [(on, had or on)] if word != "endif" else []
        elif word == "set" and counts and name.strip().isidentifier():
            scope[name.strip()] = _value_of(value, scope)
        elif counts:
            raise _Unknown(f"it has {part[:40]}")
    return "".join(text)


def _value_of(text: str, scope: Mapping[str, Any], checked: Callable[[Any], Any] = lambda v: v) -> Any:
    """The value of an expression, in Python's grammar with ** for the | of filters. Raises _Unknown."""
    said = text.strip()[:40]
    try:
        if "**" not in text and len(text) < _TEXT_MAX:
            return checked(_value(ast.parse(text.strip().replace("|", "**"), mode="eval").body, scope))
    except (SyntaxError, TypeError, ValueError, ArithmeticError, RecursionError, MemoryError):
        pass
    except KeyError as name:
        raise _Unknown(f"only the printer knows {name} of {said}") from None
    raise _Unknown(f"{said} cannot be computed")


def _value(node: ast.AST, scope: Mapping[str, Any]) -> Any:
    """Raises KeyError for a name that is not known, and ValueError for what is not read."""
    match node:
        case ast.Constant(value):
            return value
        case ast.Name(name):
            return _WORDS[name] if name in _WORDS else scope[name]
        case ast.Attribute(ast.Name("params"), key) | ast.Subscript(ast.Name("params"), ast.Constant(key)):
            return scope["params"].get(key, _MISSING)
        case ast.Attribute(of) | ast.Subscript(of):
            _value(of, scope)
        case ast.UnaryOp(ast.Not(), of):
            return not _holds(_value(of, scope))
        case ast.UnaryOp(ast.USub(), of):
            return -_checked(_value(of, scope))
        case ast.BoolOp(op, parts):
            held = (_holds(_value(part, scope)) for part in parts)
            return any(held) if isinstance(op, ast.Or) else all(held)
        case ast.IfExp(test, body, orelse):
            return _value(body if _holds(_value(test, scope)) else orelse, scope)
        case ast.Compare(left, [ast.Is() | ast.IsNot() as op], [ast.Name("defined")]):
            return (_value(left, scope) is not _MISSING) == isinstance(op, ast.Is)
        case ast.BinOp(left, ast.Pow(), right):
            return _filtered(_value(left, scope), right, scope)
        case ast.BinOp(left, op, right) | ast.Compare(left, [op], [right]) if type(op) in _BINARY:
            one, other = _checked(_value(left, scope)), _checked(_value(right, scope))
            if isinstance(node, ast.Compare) or not {type(one), type(other)} - {int, float, bool}:
                return _checked(_BINARY[type(op)](one, other))
    raise ValueError(node)


def _filtered(value: Any, filters: ast.AST, scope: Mapping[str, Any]) -> Any:
    """A value through filters, which are default(1)**float in Python's grammar."""
    match filters:
        case ast.BinOp(first, ast.Pow(), others):
            return _filtered(_filtered(value, first, scope), others, scope)
        case ast.Call(ast.Name("default" | "d"), [other, *_]):
            return _value(other, scope) if value is _MISSING else value
        case ast.Call(ast.Name("round"), digits):
            return round(float(_checked(value)), *(_value(one, scope) for one in digits))
        case ast.Name("float"):
            return float(_checked(value))
        case ast.Name("int"):
            return int(float(_checked(value)))
        case ast.Name("upper" | "lower" as kind):
            return str(getattr(str(_checked(value)), kind)())
    raise ValueError(filters)


def _holds(value: Any) -> bool:
    return value is not _MISSING and bool(value)


def _checked(value: Any) -> Any:
    """A value that is given and of an ordinary size. Raises ValueError."""
    small = abs(value) < _NUMBER_MAX if isinstance(value, int | float) else isinstance(value, str)
    if not small or len(str(value)) > _TEXT_MAX:
        raise ValueError(value)
    return value
