"""Statements of a source, for tests that look at no more of it."""

from __future__ import annotations

import ast
from collections.abc import Iterator

HOLDS = (ast.stmt, ast.excepthandler, ast.match_case)  # statements


def statements(tree: ast.Module) -> Iterator[ast.AST]:
    """All statements of a module, also those inside others: `ast.walk` looks at ten times as many nodes, at every name and number."""
    left: list[ast.AST] = [tree]
    while left:
        inside = [node for node in ast.iter_child_nodes(left.pop()) if isinstance(node, HOLDS)]
        yield from inside
        left += inside
