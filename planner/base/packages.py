"""Packages that only some solvers and outputs need: imported when they are needed, and asked for by name where they are missing."""

from __future__ import annotations

import importlib
from typing import Any

from planner.base.errors import InputError


def import_needed(package: str, user: str) -> Any:
    """The package, imported; `user` is what needs it. Raises InputError with the command that installs it."""
    try:
        return importlib.import_module(package)
    except ModuleNotFoundError as fault:
        if fault.name != package.partition(".")[0]:
            raise  # it is there, and something that it needs is not
        raise InputError(
            f"{user} needs the package {fault.name}, which is not installed: pip install {fault.name}"
        ) from None
