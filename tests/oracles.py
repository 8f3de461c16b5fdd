"""Packages that motions are compared with. There are no wheels of them for some machines: tests that need them are skipped there."""

from __future__ import annotations

import importlib.util
import platform

import pytest


def _needs(package: str) -> pytest.MarkDecorator:
    missing = importlib.util.find_spec(package) is None
    return pytest.mark.skipif(
        missing, reason=f"{package} is not installed (there may be no wheel for {platform.machine()})"
    )


needs_ruckig, needs_toppra = _needs("ruckig"), _needs("toppra")
