"""`planner.methods`: names, what each method is, and `planner.methods["kinematic"]` to plan with."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from importlib import import_module
from typing import TYPE_CHECKING

from planner.base.names import METHODS

if TYPE_CHECKING:
    from planner.planning.page import Method


class MethodNames:
    """The names of the methods, in the order of the documentation; a sentence on each, and the method."""

    def __iter__(self) -> Iterator[str]:
        return iter(METHODS)

    def __len__(self) -> int:
        return len(METHODS)

    def __contains__(self, name: object) -> bool:
        return name in METHODS

    def __getitem__(self, name: str) -> Method:
        """The method of a name, with its usual settings. Raises InputError for an unknown name."""
        made: Method = import_module("planner.planning.methods.registry").make_method(name)
        return made

    def about(self) -> dict[str, str]:
        """A sentence on each method, by its name."""
        return {
            name: _sentence(entry.home, plain="plain" in entry.settings) for name, entry in METHODS.items()
        }

    def __repr__(self) -> str:
        width = max(map(len, METHODS))
        return "\n".join(f"{name:{width}}  {said}" for name, said in self.about().items())

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td><b>{name}</b></td><td>{said}</td></tr>" for name, said in self.about().items()
        )
        return f"<table>{rows}</table>"


def _sentence(home: str, plain: bool) -> str:
    """The first sentence of the docstring of the class at `home`."""
    module, _, name = home.partition(":")
    said = (inspect.getdoc(getattr(import_module(module), name)) or "").partition("\n\n")[0]
    first = " ".join(said.split()).rstrip(".")
    return f"{first}: the paper's rules as they are" if plain else first


methods = MethodNames()
