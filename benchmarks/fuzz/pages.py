"""Fuzzing of pages: of texts that come into one, and of the folders that a plan wrote."""

from __future__ import annotations

import json
import shutil
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.fuzz.mutate import text_of, value_of
from benchmarks.fuzz.run import Place
from benchmarks.fuzz.settings import ROOT, planned
from benchmarks.fuzz.trajectories import plan_once

MARKER = "xss7"  # stands in every text that must stay a text
FILES = ("summary.json", "trajectory.meta.json", "trajectory.csv")
KEPT_TEXTS = ("run_id", "program", "status")  # of which another text would only be refused
NAME_MAX = 100  # characters of a file's name
PAYLOADS = [
    text.replace("xss", MARKER)
    for text in (
        "<img src=x onerror=xss()>",
        "</script><script>xss()</script>",
        "<!--<script>xss()",
        '"onmouseover=xss() x="',
        "' onload='xss()",
        "</title><svg onload=xss()>",
        "]]><xss>",
        "${xss()}",
        "{{xss}}",
        "@@PLOTLY@@xss@@SCRIPT@@",
        "javascript:xss()",
        "&lt;xss&gt;&#60;xss",
        "\u2028xss\u2029",
        "<xss onclick=xss()>",
        "--><iframe src=//xss>",
        "\\u003cxss\\",
        "\x1b[31mxss",
        "</style><style>xss",
    )
]


class Page(HTMLParser):
    """What elements a page has, with the names of their attributes; where the marker stands; and the scripts that run."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.kinds: set[tuple[str, tuple[str, ...]]] = set()
        self.wrong: list[str] = []
        self.data: list[str] = []
        self._script: str | None = None
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """One element."""
        self.kinds.add((tag, tuple(sorted(name for name, _ in attrs))))
        self.wrong += [f"<{tag} {name}={value}>" for name, value in attrs if MARKER in f"{tag}{name}{value}"]
        self._script = (dict(attrs).get("type") or "run") if tag == "script" else None

    def handle_data(self, data: str) -> None:
        """A text, or what is in a script."""
        if self._script == "application/json":
            self.data.append(data)
        elif self._script == "run" and MARKER in data:
            self.wrong.append(f"in a script: {data[:200]}")

    def handle_endtag(self, tag: str) -> None:
        """The end of an element."""
        if tag == "script":
            self._script = None


@cache
def kinds_of(file: Path) -> frozenset[tuple[str, tuple[str, ...]]]:
    """The elements of a page of harmless texts."""
    return frozenset(Page(file.read_text("utf-8")).kinds)


def check_page(file: Path, harmless: Path) -> None:
    """Raise AssertionError if a text of the input became more than a text."""
    page = Page(file.read_text("utf-8"))
    new = page.kinds - kinds_of(harmless)
    if page.wrong or new:
        raise AssertionError(f"in the page: {page.wrong[:3]} {sorted(new)[:3]}")
    for data in page.data:
        json.loads(data)


def payload(rng: np.random.Generator) -> str:
    """One or two texts that a page must not take for more than texts."""
    return "".join(PAYLOADS[int(k)] for k in rng.integers(0, len(PAYLOADS), int(rng.integers(1, 3))))


def make_page(rng: np.random.Generator, start: bytes | None, place: Place) -> bytes:
    """Dangerous texts for comments and names, or changed files of a plan's folder, as JSON: {"names": ...} or {"files": ...}."""
    if start is None and rng.random() < 0.5:
        texts = {"file": payload(rng) if rng.random() < 0.6 else "job"}
        return json.dumps({"names": texts | {"comment": payload(rng), "machine": payload(rng)}}).encode()
    given = {"files": {}} if start is None else json.loads(start)
    if "names" in given:
        key = str(rng.choice(["file", "comment", "machine"]))
        given["names"][key] = (given["names"][key] if rng.random() < 0.5 else "") + payload(rng)
        return json.dumps(given).encode()
    name = str(rng.choice(FILES, p=[0.42, 0.42, 0.16]))
    text = given["files"].get(name)
    text = (plan_once(place) / name).read_text("utf-8") if text is None else text
    given["files"][name] = _other_file(rng, text)
    return json.dumps(given).encode()


def _other_file(rng: np.random.Generator, text: str) -> str:
    """The text of a file with one to three JSON values changed, or with lines and bytes changed."""
    try:
        said: Any = json.loads(text)
    except ValueError:
        said = None
    if not isinstance(said, dict) or rng.random() < 0.15:
        return text_of(rng, [text.encode("utf-8", "surrogatepass")]).decode("utf-8", "replace")
    for _ in range(int(rng.integers(1, 4))):
        said = value_of(rng, said)
        if isinstance(said, dict) and rng.random() < 0.5:
            texts = [key for key, value in said.items() if isinstance(value, str) and key not in KEPT_TEXTS]
            if texts:
                said[str(rng.choice(texts))] = payload(rng)
    return json.dumps(said)


def try_page(data: bytes, rng: np.random.Generator, place: Place) -> str:
    """A page of a plan with dangerous texts in comments and names, or of a folder with changed files."""
    harmless = place.folder / "harmless.html"
    base = plan_once(place)
    if not harmless.exists():
        place.command("report", base, "-o", harmless)
    given = json.loads(data)
    if "names" in given:
        return _names(given["names"], rng.random() < 0.3, place, harmless)
    return _changed(given["files"], place, base, harmless)


def _names(texts: dict[str, str], compared: bool, place: Place, harmless: Path) -> str:
    work = place.folder / "names"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir()
    name = "".join(c for c in texts["file"] if c not in "/\x00")[:NAME_MAX] or "job"
    job, machine, out = work / f"{name}.ngc", work / "machine.toml", work / "out"
    comment = texts["comment"]
    closed = comment.replace(")", "]").replace("(", "[")
    job.write_text(
        f"G21 G90 F900 ({closed})\n; {comment}\nG1 X5 Y1\n(MSG,{closed})\nG2 X9 Y5 R4\nG1 X2\nM2\n", "utf-8"
    )
    mill = (ROOT / "planner" / "machines" / "mill.toml").read_text()
    old = next(line for line in mill.splitlines() if line.startswith("name"))
    machine.write_text(mill.replace(old, f"name = {json.dumps(texts['machine'])}"), "utf-8")
    options = ("-m", machine, "--method")
    end = planned(place.command("plan", *options, "stop", "-o", out, "--report", "-q", "--", job))
    if end in ("planned", "verdict failed"):
        check_page(out / "report.html", harmless)
        if compared:
            both = out / "both.html"
            place.command("compare", *options, "stop,kinematic", "--report", both, "-q", "--", job)
            page = Page(both.read_text("utf-8"))
            if page.wrong or any(MARKER in str(kind) for kind in page.kinds):
                raise AssertionError(f"in the comparison: {page.wrong[:3]}")
    return f"names: {end}"


def _changed(files: dict[str, str], place: Place, base: Path, harmless: Path) -> str:
    work, page = place.folder / "changed", place.folder / "changed.html"
    shutil.rmtree(work, ignore_errors=True)
    page.unlink(missing_ok=True)
    shutil.copytree(base, work)
    for name, text in files.items():
        (work / name).write_bytes(text.encode("utf-8", "surrogatepass"))
    if place.command("report", work, "-o", page, "--force"):
        if page.exists():
            raise AssertionError("refused, and a page is written")
        return "folder: refused"
    check_page(page, harmless)
    return "folder: page"
