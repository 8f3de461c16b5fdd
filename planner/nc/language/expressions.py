"""Expressions to Python source, by the templates of a language."""

from __future__ import annotations

from planner.nc.language.tree import Exists, Expression, Language, Named, Number, Numbered, Parameter


class Expressions:
    """Writes expressions of a language as Python text; P, L, G, R and A are bound by `compiled`."""

    def __init__(self, language: Language):
        self.language = language

    def value(self, expression: Expression) -> str:
        """Python text of a number."""
        text, logical = self._expression(expression, raw=False)
        return f"(1.0 if {text} else 0.0)" if logical else text

    def condition(self, expression: Expression) -> str:
        """Python text of what is true or false."""
        text, logical = self._expression(expression, raw=False)
        return text if logical else f"{text}!=0"

    def assigned(self, expression: Expression) -> str:
        """Python text of a value to be stored: a vacant parameter alone stays vacant."""
        if isinstance(expression, Numbered | Named):
            return self._expression(expression, raw=True)[0]
        return self.value(expression)

    def stored(self, index: float) -> bool:
        """True if a parameter of that number is the program's own, not one that the control is asked for."""
        low = 0 if self.language.vacant is None else 1
        return (
            index == int(index)
            and low <= index <= self.language.largest
            and index not in self.language.system_numbers
        )

    def _expression(self, expression: Expression, *, raw: bool) -> tuple[str, bool]:
        """Python text, and whether it is true or false rather than a number."""
        language = self.language
        if isinstance(expression, Number):
            return (repr(expression.value) if expression.value >= 0 else f"({expression.value!r})"), False
        if isinstance(expression, Named):
            name = expression.name
            if expression.shared and name in language.system_names:
                return f"A({name!r})", False
            return f"{'G' if expression.shared else 'L'}[{name!r}]", False
        if isinstance(expression, Numbered):
            index = expression.index
            if isinstance(index, Number) and self.stored(index.value):
                text = f"P[{int(index.value)}]"
            elif isinstance(index, Number) and index.value in language.system_numbers:
                return f"A({int(index.value)})", False
            else:
                text = f"R({self.value(index)})"
            return (text if raw else language.read.format(text)), False
        if isinstance(expression, Exists):
            return self._exists(expression.parameter), True
        raw = expression.name in language.raw
        operands = []
        for operand in expression.operands:
            text, logical = self._expression(operand, raw=raw and isinstance(operand, Numbered))
            operands.append(f"(1.0 if {text} else 0.0)" if logical else text)
        template = language.operations[expression.name, len(operands)]
        return template.format(*operands), expression.name in language.conditions

    def _exists(self, parameter: Parameter) -> str:
        if isinstance(parameter, Numbered):
            return f"run.exists({self.value(parameter.index)})"
        if not parameter.shared:
            return f"({parameter.name!r} in L)"
        return "True" if parameter.name in self.language.system_names else f"({parameter.name!r} in G)"
