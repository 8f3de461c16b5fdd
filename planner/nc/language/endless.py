"""Loops that cannot end, told from their text: nothing that they do changes their condition, and nothing leaves them.

A loop that may end, as far as this tells, is bounded while it runs (run.py). Where this says that it cannot, it cannot.
"""

from __future__ import annotations

from collections.abc import Iterator

from planner.nc.language import tree

_LEAVES = (tree.Break, tree.Call, tree.Goto, tree.Return)  # a called subprogram may change anything
_ENDS = (2.0, 30.0)  # M codes


def never_ends(loop: tree.Loop, language: tree.Language) -> bool:
    """True if the loop goes on for ever once its condition holds after a turn."""
    if loop.kind == "repeat":
        return False
    read = list(_parameters(loop.condition))
    if any(not _is_kept(parameter, language) for parameter in read):
        return False
    return all(_stays(statement, set(read)) for statement in tree.statements_in(loop.body))


def _parameters(expression: tree.Expression) -> Iterator[tree.Parameter]:
    """Parameters that an expression reads."""
    if isinstance(expression, tree.Operation):
        for operand in expression.operands:
            yield from _parameters(operand)
    elif isinstance(expression, tree.Exists):
        yield expression.parameter
    elif not isinstance(expression, tree.Number):
        yield expression


def _is_kept(parameter: tree.Parameter, language: tree.Language) -> bool:
    """True if only assignments that name the parameter change it."""
    if isinstance(parameter, tree.Named):
        return not (
            parameter.shared
            and (parameter.name in language.system_names or parameter.name.startswith("_value"))
        )
    return isinstance(parameter.index, tree.Number) and parameter.index.value not in language.system_numbers


def _stays(statement: tree.Statement, read: set[tree.Parameter]) -> bool:
    """True if a statement leaves the parameters as they are, and the loop going on."""
    if isinstance(statement, _LEAVES) or (isinstance(statement, tree.PlainRows) and statement.may_end):
        return False
    if not isinstance(statement, tree.Line):
        return True
    for word in statement.words:
        if chr(word.letter) == "M" and not (
            isinstance(word.value, tree.Number) and word.value.value not in _ENDS
        ):
            return False
    targets = [target for target, _ in statement.assignments]
    computed = any(isinstance(t, tree.Numbered) and not isinstance(t.index, tree.Number) for t in targets)
    return not computed and not read & set(targets)
