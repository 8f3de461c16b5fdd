"""The entry point of the command `planner`; the commands themselves are in `planner.commands.app`.

Exit codes: 0 done and verified; 1 the verdict failed; 2 bad input; 3 not solved; 70 a bug of ours; 130
interrupted; 141 nobody reads the output any more.

Nothing is imported before Ctrl-C has its handler, so that an interrupt during the imports ends like any other.
"""

from __future__ import annotations

import gc
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from planner.commands.app import app

__all__ = ["app", "main"]

# So many new objects before a collection of garbage; Python's 700 means 155 collections, 0.1 s of a plan of ten lines (now 10, 0.04 s).
OBJECTS = 10_000


def main() -> None:
    """Entry point of the command `planner`."""
    from planner.commands.interrupt import end_at_interrupts, no_more_interrupts

    end_at_interrupts()
    gc.set_threshold(OBJECTS)
    from planner.commands.app import app
    from planner.commands.terminal import prepare_streams

    prepare_streams()
    try:
        app(prog_name="planner")
    finally:
        no_more_interrupts()


def __getattr__(name: str) -> Any:
    if name != "app":
        raise AttributeError(f"module 'planner.cli' has no attribute '{name}'")
    from planner.commands.app import app

    return app
