"""Columns of records over a guide: one value per run between full stops, per leg or per joint.

A field that is declared so is checked and made read-only, picked for some runs and put back, for every record in the same way.
"""

from __future__ import annotations

from dataclasses import field, fields
from typing import Any

import numpy as np

from planner.base.arrays import Array, freeze


def per_run(width: int | None = None) -> Any:
    """A field (S,), or (S, width), of float64."""
    return _column("run", np.float64, width)


def per_leg(dtype: type = np.float64, *, finite: bool = True, axes: bool = False) -> Any:
    """A field (R,), or (R, A) with `axes`; with `finite=False` infinity is allowed."""
    return _column("leg", dtype, -1 if axes else None, finite)


def per_joint(dtype: type = np.float64, *, finite: bool = True, axes: bool = False) -> Any:
    """A field (R+1,), or (R+1, A) with `axes`."""
    return _column("joint", dtype, -1 if axes else None, finite)


def _column(rows: str, dtype: type, width: int | None, finite: bool = True) -> Any:
    """A field with its rows, type and width in the metadata; width -1 for one column per axis."""
    return field(metadata={"rows": rows, "dtype": dtype, "width": width, "finite": finite})


def freeze_columns(record: Any, sizes: dict[str, int], axes: int) -> None:
    """Check the columns of a record and make them read-only.

    sizes : number of rows per "run", "leg" and "joint"
    axes  : A, the width of columns with `axes`

    Raises ValueError for a column of another shape, or one that is not finite and should be.
    """
    for one in fields(record):
        if "rows" in one.metadata:
            width = one.metadata["width"]
            shape = (sizes[one.metadata["rows"]], *(() if width is None else (axes if width < 0 else width,)))
            freeze(record, one.name, one.metadata["dtype"], shape, finite=one.metadata["finite"])


def chosen_rows(first: Array, chosen: Array) -> dict[str, Array]:
    """Indices of the rows that the chosen runs have, for "run", "leg" and "joint".

    first  : (S+1,) first joint of each run, as of `Guide`
    chosen : (S,) True for the runs that are meant, one at least
    """
    run = np.flatnonzero(chosen)
    legs = np.flatnonzero(np.repeat(chosen, np.diff(first)))
    return {"run": run, "leg": legs, "joint": np.append(legs, first[run[-1] + 1])}


def picked(record: Any, rows: dict[str, Array]) -> dict[str, Any]:
    """The given rows (n,) of "run", "leg" and "joint" (`chosen_rows`) of all columns, by name."""
    return {
        one.name: getattr(record, one.name)[rows[one.metadata["rows"]]]
        for one in fields(record)
        if "rows" in one.metadata
    }


def put_back(record: Any, rows: dict[str, Array], chosen: Any) -> dict[str, Any]:
    """All columns of a record, by name, with some rows taken from another; the joint at the end of a run belongs to the next one.

    rows   : (n,) of "run", "leg" and "joint" (`chosen_rows`)
    chosen : a record of these rows alone
    """
    columns: dict[str, Any] = {}
    for one in fields(record):
        if "rows" in one.metadata:
            of, last = one.metadata["rows"], -1 if one.metadata["rows"] == "joint" else None
            columns[one.name] = getattr(record, one.name).copy()
            columns[one.name][rows[of][:last]] = getattr(chosen, one.name)[:last]
    return columns
