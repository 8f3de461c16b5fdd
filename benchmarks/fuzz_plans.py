"""Fuzzing of trajectory files, of folders that a plan wrote, and of texts that come into a page."""

from __future__ import annotations

import json
import shutil
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.fuzz_mutate import bytes_of, text_of, value_of
from benchmarks.fuzz_run import Command
from benchmarks.fuzz_settings import JOB, planned

MARKER = "xss7"  # stands in every text that must stay a text
ODD_COLUMN = (0.0, -1.0, 1e300, -1e300, 1e-300, np.nan, np.inf, 1e9)


def plan_once(folder: Path, command: Command) -> Path:
    """A plan of the job in CSV, with its page; the same folder for all inputs."""
    out = folder / "base"
    if not out.exists():
        (folder / "job.ngc").write_text(JOB)
        command(
            "plan", folder / "job.ngc", "-m", "mill", "--method", "stop", "--format", "csv", "-o", out, "-q"
        )
    return out


# ------------------------------------------------------------------------------------------ trajectory files


@cache
def columns_of(file: Path) -> dict[str, np.ndarray[Any, Any]]:
    """The columns of a CSV file."""
    from pyarrow import csv

    table = csv.read_csv(file)
    return {name: table[name].to_numpy() for name in table.column_names}


def other_columns(rng: np.random.Generator, columns: dict[str, Any]) -> dict[str, Any]:
    """Columns with values, types, shapes and names changed."""
    columns = dict(columns)
    if rng.random() < 0.4:  # another program writes times and positions
        columns = {name: columns[name] for name in ("t", "x", "y", "z") if name in columns}
    for _ in range(int(rng.integers(0, 4))):
        if not columns:
            break
        name = str(rng.choice([*columns]))
        column = columns[name]
        change = int(rng.integers(0, 11))
        if change == 0:
            del columns[name]
        elif change == 1:
            columns[
                str(rng.choice(["a", "b", "c", "u", "e", "ve", "T", " x", "xyz", "line", "", "t ", "jx"]))
            ] = column
        elif change == 2:
            columns[name] = column[: int(rng.integers(0, 4))]
        elif change == 3:
            columns = {
                key: each[: int(rng.integers(0, 4))] if change else each for key, each in columns.items()
            }
        elif change == 4:
            some = rng.integers(0, max(len(column), 1), 3)
            columns[name] = np.array(column, dtype=float)
            if len(column):
                columns[name][some] = rng.choice(ODD_COLUMN, 3)
        elif change == 5:
            kinds = ["f2", "f4", "i1", "i4", "u8", "c8", "S3", "U5", "?", "M8[s]", "f8"]
            with np.errstate(all="ignore"):
                try:
                    columns[name] = column.astype(str(rng.choice(kinds)))
                except (ValueError, TypeError):
                    continue
        elif change == 6 and column.dtype.kind in "fiu":
            with np.errstate(all="ignore"):
                columns[name] = column * rng.choice([0.0, -1.0, 1e-300, 1e300, 1e6, 1e-6])
        elif change == 7:
            columns[name] = (
                np.round(np.asarray(column, dtype=float), int(rng.integers(0, 4)))
                if column.dtype.kind == "f"
                else column
            )
        elif change == 8:
            columns[name] = column[::-1]
        elif change == 9 and column.dtype.kind == "f":
            columns[name] = column + rng.normal(size=len(column)) * 10 ** rng.uniform(-9, 3)
        else:
            order = rng.integers(0, max(len(column), 1), len(column))
            columns = {key: each[order] if len(each) == len(order) else each for key, each in columns.items()}
    return columns


def write_columns(file: Path, columns: dict[str, Any], text: str, rng: np.random.Generator) -> bool:
    """Write a trajectory file; False if its format cannot hold these columns."""
    import pyarrow as pa
    from pyarrow import csv, parquet

    try:
        if file.suffix == ".npz":
            if {"x", "y"} <= {*columns} and len(columns["x"]) == len(columns["y"]) and rng.random() < 0.3:
                columns = {name: each for name, each in columns.items() if name not in "xy"} | {
                    "xy": np.column_stack([columns["x"], columns["y"]])
                }
            np.savez(
                file,
                metadata=np.array(text),
                allow_pickle=False,
                **{key or "none": each for key, each in columns.items()},
            )
            return True
        table = pa.table({key: np.asarray(each) for key, each in columns.items()})
    except (pa.ArrowException, ValueError, TypeError):
        return False
    if file.suffix == ".parquet":
        parquet.write_table(
            table.replace_schema_metadata({"planner": text.encode("utf-8", "surrogatepass")}), file
        )
        return True
    try:
        csv.write_csv(table, file)
    except pa.ArrowException:
        return False
    file.with_suffix(".meta.json").write_bytes(text.encode("utf-8", "surrogatepass"))
    return True


def try_trajectory(rng: np.random.Generator, folder: Path, command: Command) -> str:
    """Judge a file that is damaged, or that other programs might have written."""
    base = plan_once(folder, command)
    file = folder / f"motion.{rng.choice(['csv', 'npz', 'parquet'])}"
    for old in folder.glob("motion.*"):
        old.unlink()
    about: Any = json.loads((base / "trajectory.meta.json").read_text())
    if rng.random() < 0.4:
        about = value_of(rng, about)
    columns = columns_of(base / "trajectory.csv")
    damaged = rng.random() < 0.35
    written = write_columns(file, columns if damaged else other_columns(rng, columns), json.dumps(about), rng)
    if not written:
        return "cannot be written"
    if damaged:
        data = file.read_bytes()
        file.write_bytes(text_of(rng, [data]) if file.suffix == ".csv" else bytes_of(rng, data))
    options = ["-m", "mill"] if rng.random() < 0.5 else []
    words = [] if not options and rng.random() < 0.3 else [folder / "job.ngc"]
    code = command("verify", file, *words, *options, "-q", *(["--json"] if rng.random() < 0.3 else []))
    return {0: "passed", 1: "verdict failed", 2: "refused", 3: "not solved"}[code]


# ------------------------------------------------------------------------------------------ pages

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


def try_report(rng: np.random.Generator, folder: Path, command: Command) -> str:
    """A page of a plan with dangerous texts in comments and names, or of a folder with changed files."""
    harmless = folder / "harmless.html"
    base = plan_once(folder, command)
    if not harmless.exists():
        command("report", base, "-o", harmless)
    return (
        _names(rng, folder, command, harmless)
        if rng.random() < 0.5
        else _changed(rng, folder, command, base, harmless)
    )


def _names(rng: np.random.Generator, folder: Path, command: Command, harmless: Path) -> str:
    work = folder / "names"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir()
    name = "".join(c for c in payload(rng) if c not in "/\x00")[:100] if rng.random() < 0.6 else "job"
    job = work / f"{name}.ngc"
    comment = payload(rng)
    closed = comment.replace(")", "]").replace("(", "[")
    job.write_text(
        f"G21 G90 F900 ({closed})\n; {comment}\nG1 X5 Y1\n(MSG,{closed})\nG2 X9 Y5 R4\nG1 X2\nM2\n", "utf-8"
    )
    machine = work / "machine.toml"
    text = (Path(__file__).resolve().parent.parent / "planner" / "machines" / "mill.toml").read_text()
    old = next(line for line in text.splitlines() if line.startswith("name"))
    machine.write_text(text.replace(old, f"name = {json.dumps(payload(rng))}"), "utf-8")
    out = work / "out"
    end = planned(command("plan", "-m", machine, "--method", "stop", "-o", out, "--report", "-q", "--", job))
    if end in ("planned", "verdict failed"):
        check_page(out / "report.html", harmless)
        if rng.random() < 0.3:
            command(
                "compare",
                "-m",
                machine,
                "--method",
                "stop,kinematic",
                "--report",
                out / "both.html",
                "-q",
                "--",
                job,
            )
            page = Page((out / "both.html").read_text("utf-8"))
            if page.wrong or any(MARKER in str(kind) for kind in page.kinds):
                raise AssertionError(f"in the comparison: {page.wrong[:3]}")
    return f"names: {end}"


def _changed(rng: np.random.Generator, folder: Path, command: Command, base: Path, harmless: Path) -> str:
    work, page = folder / "changed", folder / "changed.html"
    shutil.rmtree(work, ignore_errors=True)
    page.unlink(missing_ok=True)
    shutil.copytree(base, work)
    change = rng.random()
    if change < 0.75:
        file = work / str(rng.choice(["summary.json", "trajectory.meta.json"]))
        said: Any = json.loads(file.read_text())
        for _ in range(int(rng.integers(1, 4))):
            said = value_of(rng, said)
            if isinstance(said, dict) and rng.random() < 0.5:
                texts = [
                    key
                    for key, value in said.items()
                    if isinstance(value, str) and key not in ("run_id", "program", "status")
                ]
                if texts:
                    said[str(rng.choice(texts))] = payload(rng)
        file.write_bytes(json.dumps(said).encode())
    else:
        file = work / str(rng.choice(["summary.json", "trajectory.meta.json", "trajectory.csv"]))
        file.write_bytes(text_of(rng, [file.read_bytes()]))
    if command("report", work, "-o", page, "--force"):
        if page.exists():
            raise AssertionError("refused, and a page is written")
        return "folder: refused"
    check_page(page, harmless)
    return "folder: page"
