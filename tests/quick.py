"""Of the many cases of one test the few that are not slow and stand for it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def slow_but(quick: str | Iterable[Any], cases: Iterable[Any]) -> list[Any]:
    """Single arguments for `parametrize`: all but the quick ones are marked slow."""
    among = {quick} if isinstance(quick, str) else set(quick)
    cases = list(cases)
    assert among <= set(cases), among - set(cases)
    return [case if case in among else pytest.param(case, marks=pytest.mark.slow) for case in cases]
