"""Parts that pages share: columns of numbers, plotly's script, templates, and filling these."""

import base64
import gzip
import hashlib
import html
import json
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from planner.base.arrays import Array
from planner.base.errors import import_needed
from planner.base.files import readable

LEVEL = 6  # of compression: a higher one takes three times as long for 2 % less


def page_of(
    name: str, kind: str, source: str, about: dict[str, Any], columns: Mapping[str, Array], **places: str
) -> str:
    """A page for a browser: the body NAME.html in the frame of all pages, with shared.js, view.js and
    NAME.js.

    kind    : what the page is, behind the file's name in its title
    source  : the program's file
    about   : what the script is told
    columns : numbers by name, each (n,)
    places  : what is filled in at @@NAME@@ of the body

    Raises InputError if plotly is not installed.
    """
    kinds = {column_name: column.dtype.str.lstrip("<|") for column_name, column in columns.items()}
    # plotly's script, to be run by the page that it stands in
    plotly = str(import_needed("plotly.offline", "a report").get_plotlyjs()).replace("</script", "<\\/script")
    script = template("shared.js") + template("view.js") + template(f"{name}.js")
    parts = {
        "POLICY": policy(plotly, script),
        "TITLE": html.escape(Path(source).name),
        "KIND": kind,
        "STYLE": template("report.css"),
        "BODY": filled(template(f"{name}.html"), {**places, "PLOTLY": plotly}),
        # JSON may stand in a script element without "<"
        "ABOUT": json.dumps({**about, "columns": kinds}, allow_nan=False).replace("<", "\\u003c"),
        "COLUMNS": "\n".join(
            f'<script type="text/plain" id="column-{column_name}">{packed(column)}</script>'
            for column_name, column in columns.items()
        ),
        "SCRIPT": script,
    }
    return readable(filled(template("frame.html"), parts))


def policy(*scripts: str) -> str:
    """The policy of a page for browsers: run these scripts, known by their SHA-256, and nothing else; show
    pictures that it has in it or draws itself; load nothing. Styles are free: plotly writes them into the
    page, and they run nothing."""
    digests = (hashlib.sha256(script.encode()).digest() for script in scripts)
    known = " ".join(f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)
    return (
        f"default-src 'none'; script-src {known}; style-src 'unsafe-inline'; img-src data: blob:; "
        "base-uri 'none'; form-action 'none'"
    )


def filled(page: str, parts: Mapping[str, str]) -> str:
    """A page with its places @@NAME@@ filled."""
    return "".join(parts.get(piece, piece) for piece in page.split("@@"))


def packed(column: Array) -> str:
    """Bytes of a `column` (n,), compressed, as base64."""
    data = np.ascontiguousarray(column)
    little = data.astype(data.dtype.newbyteorder("<"), copy=False)
    return base64.b64encode(gzip.compress(little.tobytes(), LEVEL, mtime=0)).decode("ascii")


def template(name: str) -> str:
    """A part of a page, from the package."""
    return (resources.files("planner") / "report" / "html" / name).read_text(encoding="utf-8")
