"""Packages that are called like functions: `planner.path(points)`, although `planner.path` is a package with modules of its own.

Python binds a package to its parent's attribute of that name when any of its modules is imported, so a function there would be lost.
A module may have a class of its own instead (Python's data model, "customizing module attribute access"), and a class can be called.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable
from importlib import import_module
from types import ModuleType
from typing import Any


class CalledPackage(ModuleType):
    """A package that stands for a function of a later stage; it is imported at the first call."""

    def __call__(self, *given: Any, **named: Any) -> Any:
        """What the function makes of the arguments."""
        return _function(self)(*given, **named)

    @property
    def __signature__(self) -> inspect.Signature:
        """The function's, for help and completion."""
        return inspect.signature(_function(self))


def call_like(package: str, home: str) -> None:
    """Let a package that is being imported be called like a function.

    home : "module:function"
    """
    module = sys.modules[package]
    module.__class__ = CalledPackage
    module.__dict__["_home"] = home


def _function(module: ModuleType) -> Callable[..., Any]:
    home, _, name = module.__dict__["_home"].partition(":")
    found: Callable[..., Any] = getattr(import_module(home), name)
    return found
