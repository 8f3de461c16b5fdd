"""What all tests share."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

ROOT = Path(__file__).resolve().parent.parent

# No deadline: the first call of a kernel compiles it. On a build machine the same examples every time.
settings.register_profile("local", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("ci" if os.environ.get("CI") else "local")


@pytest.fixture(scope="session")
def shared_dir() -> Path:
    """The optional folder of real NC programs beside the checkout (or where PLANNER_SHARED says)."""
    folder = Path(os.environ.get("PLANNER_SHARED", ROOT.parent / "shared"))
    if not (folder / "nc").is_dir():
        pytest.skip(f"no folder of real programs at {folder}")
    return folder
