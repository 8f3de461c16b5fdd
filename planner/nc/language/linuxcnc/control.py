"""Control statements of LinuxCNC's language: subprograms, branches and loops between an O word and its end."""

from __future__ import annotations

from planner.nc.language import tree
from planner.nc.language.source import SourceLine

_NESTED_MAX = 100  # loops and branches in each other
_ENDS = {"endsub": "sub", "endif": "if", "endwhile": "while", "endrepeat": "repeat"}
KEYWORDS = frozenset(
    ("sub", "call", "return", "if", "elseif", "else", "while", "do", "repeat", "break", "continue", *_ENDS)
)


class LinuxcncControl:
    """The statements so far, and those that are open.

    procedures : subprograms by their labels
    main       : statements of the main program
    base, body : statements outside of all that is open, and where the next one goes
    open       : control statements whose end has not come, the outermost first
    """

    def __init__(self) -> None:
        self.procedures: dict[str, tree.Procedure] = {}
        self.main: list[tree.Statement] = []
        self.open: list[tree.OpenStatement] = []
        self.base = self.body = self.main

    def _add(self, label: str, place: tree.SourcePlace, body: list[tree.Statement]) -> None:
        if label in self.procedures:
            first = self.procedures[label].place.line
            raise tree.ProgramFault(place, f"a second subprogram o{label}; the first is on line {first}")
        self.procedures[label] = tree.Procedure(label, place, body)

    def _control(self, keyword: str, label: str, condition: tree.Expression | None, line: SourceLine) -> None:
        top = self.open[-1] if self.open else None
        if keyword == "while" and top is not None and top.kind == "do" and top.label == label:
            self._close(top)
            self.body.append(tree.Loop(top.place, "do", label, _needed(condition, keyword, line), top.body))
        elif keyword in ("sub", "if", "while", "do", "repeat"):
            self._begin(keyword, label, condition, line)
        elif keyword in ("elseif", "else"):
            self._another_branch(keyword, label, condition, line)
        elif keyword in _ENDS:
            self._end(keyword, label, condition, line)
        elif keyword == "return":
            if not any(o.kind == "sub" for o in self.open):
                raise line.fault("return stands in a subprogram only")
            self.body.append(tree.Return(line.place, condition))
        else:
            if not any(o.kind in ("while", "do", "repeat") and o.label == label for o in self.open):
                raise line.fault(f"there is no loop o{label} around this {keyword}")
            self.body.append((tree.Break if keyword == "break" else tree.Continue)(line.place, label))

    def _begin(self, keyword: str, label: str, condition: tree.Expression | None, line: SourceLine) -> None:
        if keyword == "sub" and self.open:
            raise line.fault(f"a subprogram begins inside {self.open[-1].kind}; write its end before it")
        if len(self.open) >= _NESTED_MAX:
            raise line.fault(f"more than {_NESTED_MAX} loops and branches in each other")
        if keyword not in ("sub", "do"):
            _needed(condition, keyword, line)
        opened = tree.OpenStatement(keyword, line.place, condition, label)
        self.open.append(opened)
        if keyword == "sub":
            self._add(label, line.place, opened.body)
        self.body = opened.body

    def _another_branch(
        self, keyword: str, label: str, condition: tree.Expression | None, line: SourceLine
    ) -> None:
        top = self._innermost("if", keyword, label, line)
        if top.condition is None:
            raise line.fault(f"{keyword} after else; else comes last")
        top.another_branch(_needed(condition, keyword, line) if keyword == "elseif" else None)
        self.body = top.body

    def _end(self, keyword: str, label: str, condition: tree.Expression | None, line: SourceLine) -> None:
        kind = _ENDS[keyword]
        top = self._innermost(kind, keyword, label, line)
        self._close(top)
        if kind == "sub":
            if condition is not None:
                top.body.append(tree.Return(line.place, condition))
        elif kind == "if":
            self.body.append(top.branched())
        else:
            assert top.condition is not None
            self.body.append(tree.Loop(top.place, kind, label, top.condition, top.body))

    def _innermost(self, kind: str, keyword: str, label: str, line: SourceLine) -> tree.OpenStatement:
        if not self.open or self.open[-1].kind != kind or self.open[-1].label != label:
            last = (
                f"o{self.open[-1].label} {self.open[-1].kind} on line {self.open[-1].place.line} is open"
                if self.open
                else "nothing is open"
            )
            raise line.fault(f"o{label} {keyword} has no o{label} {kind} before it: {last}")
        return self.open[-1]

    def _close(self, top: tree.OpenStatement) -> None:
        self.open.pop()
        self.body = self.open[-1].body if self.open else self.base


def _needed(condition: tree.Expression | None, keyword: str, line: SourceLine) -> tree.Expression:
    if condition is None:
        raise line.fault(f"{keyword} needs an [expression] after it")
    return condition


def end_of(kind: str) -> str:
    """The keyword that ends a control statement."""
    return "while [condition]" if kind == "do" else f"end{kind}"
