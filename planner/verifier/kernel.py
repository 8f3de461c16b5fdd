"""How the verifier's kernels are compiled."""

from collections.abc import Callable
from typing import Any

from planner.base.kernels import njit


def kernel(inline: bool = False) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """The settings for all kernels of the verifier, which work on their caller's arrays, allocating nothing.

    Counting references to those arrays at every call was four fifths of the running time, hence `_nrt=False`;
    so was passing them on the stack, hence `inline` for the innermost functions, which the interpreter then
    cannot call. Division by zero gives inf, as in numpy. They let go of Python's lock, so that samples and
    what lies between them are read side by side.
    """
    settings: dict[str, Any] = {
        "forceinline": inline,
        "no_cpython_wrapper": inline,
        "no_cfunc_wrapper": True,
        "_nrt": False,
        "nogil": not inline,
    }
    return njit(cache=True, error_model="numpy", **settings)
