"""How often each retry fires: from the trace, and by counters around functions that tell nobody (`watch`); loops of compiled functions
run as Python for that."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

from planner.feedrate.jerk import chain, part, window
from planner.optimal import reshape
from planner.smoothing import initial, relax, spline_path

counts: Counter[str] = Counter()


def count_steps(steps: list[dict[str, Any]]) -> None:
    """Count what a trace tells."""
    stops = corners = filters = 0
    candidates: list[str] = []
    winner = ""
    for step in steps:
        name = step["name"]
        filters = filters + 1 if name == "filters" else 0
        if name == "filters":
            counts[f"filters, round {filters}"] += 1
        elif name == "shaped":
            again = candidates.count(f"{step['limits']:g}") > 0
            candidates.append(f"{step['limits']:g}")
            if step["kept"]:
                winner = f"shaped: {candidates[-1]} times the limits" + ", no stops added" * again
        stops = stops + 1 if name == "splines" and step["stops_added"] else 0 if name == "splines" else stops
        corners = corners + 1 if name == "corners" else 0 if name == "bound on corners" else corners
        if name == "splines" and step["stops_added"]:
            counts[f"stops for splines, round {stops}"] += 1
        elif name in ("slower for verdict", "less for the period"):
            counts[f"{name}, round {step['round']}"] += 1
        elif name == "corners":
            counts[f"corners, solve {corners}"] += 1
    if winner:
        counts[winner] += 1


def watch() -> None:
    """Count what the trace does not tell."""
    for module, names in ((relax, ("_relax", "_finish", "_relax_run")), (initial, ("_lay", "_lay_run"))):
        for name in names:
            setattr(module, name, getattr(module, name).py_func)
    _around(spline_path, "relax", _labelled("first shape"))
    _around(reshape, "relax", _labelled("reshaped"))
    _around(relax, "certify", _certified)
    _around(relax, "_relax_run", _run_relaxed)
    _around(initial, "_denser", _counted("laid denser"))
    _around(initial, "_lay_run", _counted("runs laid"))
    _around(spline_path, "cusps", _cusps)
    _around(reshape, "cusps", _cusps)
    _around(window.ScaledWindow, "_from", _tried)
    _around(window.ScaledWindow, "_tracked", _tracked)
    _around(chain.Chain, "_unfelt", _unfelt)
    _around(part.Part, "_join", _joined)


def _around(owner: Any, name: str, wrapper: Callable[..., Any]) -> None:
    inner = getattr(owner, name)
    setattr(owner, name, lambda *args, **more: wrapper(inner, *args, **more))


def _counted(name: str) -> Callable[..., Any]:
    def wrapper(inner: Callable[..., Any], *args: Any) -> Any:
        counts[name] += 1
        return inner(*args)

    return wrapper


_label = [""]
_attempts = [0]


def _labelled(label: str) -> Callable[..., Any]:
    def wrapper(inner: Callable[..., Any], *args: Any, **more: Any) -> Any:
        _label[0] = label
        return inner(*args, **more)

    return wrapper


def _certified(inner: Callable[..., Any], *args: Any) -> Any:
    _attempts[0] += 1
    return inner(*args)


def _run_relaxed(inner: Callable[..., Any], *args: Any) -> Any:
    _attempts[0] = 0
    found = inner(*args)
    counts[f"{_label[0]}: runs relaxed"] += 1
    counts[f"{_label[0]}: runs tightened"] += _attempts[0] > 1
    counts[f"{_label[0]}: runs tightened more than twice"] += _attempts[0] > 3
    counts[f"{_label[0]}: runs without a certificate"] += not found[0]
    return found


def _cusps(inner: Callable[..., Any], laid: Any) -> Any:
    found = inner(laid)
    counts[f"{_label[0]}: runs with a cusp"] += int(found.sum())
    return found


def _tried(inner: Callable[..., Any], *args: Any) -> Any:
    found, most, starts = inner(*args)
    counts["windows"] += 1
    if found is None:
        counts["windows: no start converged"] += 1
    elif starts > 1:
        counts[f"windows: start {starts} converged"] += 1
    return found, most, starts


def _tracked(inner: Callable[..., Any], *args: Any) -> Any:
    found = inner(*args)
    counts["starts tracked" if found is not None else "starts not tracked"] += 1
    return found


def _unfelt(inner: Callable[..., Any], self: Any, begin: int, end: int, found: Any) -> int:
    keep: int = inner(self, begin, end, found)
    counts["windows: made larger"] += keep == begin
    return keep


def _joined(inner: Callable[..., Any], *args: Any) -> bool:
    met: bool = inner(*args)
    counts["pieces joined in the middle" if met else "pieces not joined in the middle"] += 1
    return met
