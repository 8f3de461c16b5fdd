"""What all tests share."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from planner.base.sizes import SIZES, USUAL

ROOT = Path(__file__).resolve().parent.parent

# No deadline: the first call of a kernel compiles it. The suite has the same examples every time, so that it is red for a change and
# not by chance; `--hypothesis-profile search` draws new ones in every run.
settings.register_profile("suite", deadline=None, derandomize=True, print_blob=True)
settings.register_profile("search", deadline=None, print_blob=True)
settings.load_profile("suite")

LONG = frozenset(
    (ROOT / "tests" / "long.txt").read_text(encoding="utf-8").splitlines()
)  # and two lines of remarks
SLOW = 25  # a slow test takes about as long as so many others


def pytest_configure(config: pytest.Config) -> None:
    if hasattr(
        config.option, "loadscopereorder"
    ):  # pytest-xdist would begin with the files that have the most tests
        config.option.loadscopereorder = False


@pytest.hookimpl(tryfirst=True)  # before -m looks
def pytest_itemcollected(item: pytest.Item) -> None:
    """The quick subset: neither marked slow nor named in long.txt."""
    if not item.get_closest_marker("slow") and item.nodeid.partition("[")[0] not in LONG:
        item.add_marker("quick")


@pytest.hookimpl(trylast=True)  # of those that -m has left
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files with the most slow tests first, so that no worker is left alone with one at the end."""
    weight = Counter[Path]()
    for item in items:
        weight[item.path] += SLOW if item.get_closest_marker("slow") else 1
    items.sort(key=lambda item: -weight[item.path])  # stable: the tests of a file stay together and in order


@pytest.fixture(autouse=True)
def _usual_sizes(request: pytest.FixtureRequest) -> None:
    if request.node.get_closest_marker("usual_sizes") and SIZES != USUAL:
        pytest.skip("with small sizes another answer is right")


@pytest.fixture
def threads_as_before() -> Iterator[None]:
    """What a test says of threads ends with it."""
    from planner.base.threads import use_threads

    yield
    use_threads(None)


@pytest.fixture(scope="session")
def shared_dir() -> Path:
    """The optional folder of real NC programs beside the checkout (or where PLANNER_SHARED says)."""
    folder = Path(os.environ.get("PLANNER_SHARED", ROOT.parent / "shared"))
    if not (folder / "nc").is_dir():
        pytest.skip(f"no folder of real programs at {folder}")
    return folder
