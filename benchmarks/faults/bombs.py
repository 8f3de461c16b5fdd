"""Small files that ask for much: programs, machine files, settings of controls, and trajectories (benchmarks/faults)."""

from __future__ import annotations

import json
import random
import resource
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.faults.bench import Bench

ADDRESSES = 6 << 30  # of memory [bytes]
SECONDS = 40  # of processor time [s]
GIBIBYTE = 1 << 30
LINE = 10_000_000  # characters
DEEP = 100_000  # brackets, tables, digits, arrays
WIDE = 20_000  # columns


# ------------------------------------------------------------------------------------------ trajectories


def _zipped(place: Path) -> Path:
    """A trajectory of 2 GiB of zeros in some megabytes, whose columns differ in length."""
    file = place / "bomb.npz"
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        with archive.open("t.npy", "w", force_zip64=True) as opened:
            _header(opened, GIBIBYTE // 4)
            for _ in range(2 * 64):
                opened.write(bytes(GIBIBYTE // 64))
        with archive.open("x.npy", "w") as opened:
            np.lib.format.write_array(opened, np.zeros(16))  # type: ignore[arg-type]
    return file


def _header(opened: Any, length: int) -> None:
    header = np.lib.format.header_data_from_array_1_0(np.zeros(1)) | {"shape": (length,)}
    np.lib.format.write_array_header_1_0(opened, header)


def _lying(place: Path) -> Path:
    """Columns that have 8 PiB by their headers, and nothing behind these."""
    file = place / "bomb.npz"
    with zipfile.ZipFile(file, "w") as archive:
        for name in ("t", "x"):
            with archive.open(f"{name}.npy", "w") as opened:
                _header(opened, 1 << 50)
    return file


def _many(place: Path) -> Path:
    """So many columns that their names alone take megabytes."""
    file = place / "bomb.npz"
    with zipfile.ZipFile(file, "w") as archive:
        for n in range(DEEP):
            archive.writestr(f"x{n}.npy", b"")
    return file


def _with_metadata(place: Path, metadata: str) -> Path:
    file = place / "bomb.npz"
    np.savez(file, t=np.arange(16.0), x=np.zeros(16), metadata=np.array(metadata))
    return file


def _columns(place: Path) -> Path:
    """A trajectory of 2e8 rows in a few kilobytes."""
    import pyarrow
    import pyarrow.parquet

    file = place / "bomb.parquet"
    rows = 10_000_000
    table = pyarrow.table({name: np.zeros(rows) for name in ("t", "x")})
    with pyarrow.parquet.ParquetWriter(file, table.schema, compression="zstd") as writer:
        for _ in range(20):
            writer.write_table(table, row_group_size=rows)
    return file


def _table(place: Path, names: list[str], metadata: dict[str, str] | None = None) -> Path:
    """A trajectory of 16 rows with these columns."""
    import pyarrow
    import pyarrow.parquet

    file = place / "bomb.parquet"
    table = pyarrow.table({name: np.arange(16.0) for name in names})
    pyarrow.parquet.write_table(table.replace_schema_metadata(metadata), file)
    return file


# ------------------------------------------------------------------------------------------ texts


def _file(place: Path, ending: str, text: str) -> Path:
    file = place / f"bomb.{ending}"
    file.write_text(text)
    return file


def _judged(file: Path) -> list[str]:
    return ["verify", file.name, "a.ngc", "-q"]


def _on_machine(file: Path) -> list[str]:
    return ["plan", "a.ngc", "-m", file.name, "-q"]


def _read(file: Path, *words: str) -> list[str]:
    return ["plan", file.name, "-q", "--method", "stop", *words]


def _imported(file: Path, control: str) -> list[str]:
    return ["machine", "import", file.name, "--control", control, "-o", "bomb.out"]


NESTED = json.dumps({"planner": "metadata"})[:-1] + ', "a": ' + "[" * DEEP + "]" * DEEP + "}"
START = "G21 G90 F600\n"
FANUC = "O1\nG21 G90 F600\nM98 P2 L9999\nM30\nO2\nM98 P3 L9999\nM99\nO3\nG1 X1\nX0\nM99\n"
HEIDENHAIN = "BEGIN PGM A MM\nL X+1 F100\n{}\nEND PGM A MM\n"
REPEATS = "LBL 1\nL X+1\nL X+0\nCALL LBL 1 REP 65534\nLBL 2\nCALL LBL 1 REP 65534\nCALL LBL 2 REP 65534"
BOMBS: dict[str, Callable[[Path], list[str]]] = {
    "npz": lambda place: _judged(_zipped(place)),
    "npz, header": lambda place: _judged(_lying(place)),
    "npz, arrays": lambda place: _judged(_many(place)),
    "npz, metadata": lambda place: _judged(_with_metadata(place, "a" * LINE)),
    "npz, metadata, nested": lambda place: _judged(_with_metadata(place, NESTED)),
    "parquet": lambda place: _judged(_columns(place)),
    "parquet, wide": lambda place: _judged(_table(place, ["t", *(f"x{n}" for n in range(WIDE))])),
    "parquet, metadata": lambda place: _judged(_table(place, ["t", "x"], {"planner": NESTED, "metadata": NESTED})),
    "csv, line": lambda place: _judged(_file(place, "csv", "t,x\n0," + "1" * LINE + "\n")),
    "csv, wide": lambda place: _judged(_file(place, "csv", "t" + ",x" * (LINE // 2) + "\n")),
    "toml, deep": lambda place: _on_machine(_file(place, "toml", "[" + ".".join("a" * DEEP) + "]\n")),
    "toml, wide": lambda place: _on_machine(_file(place, "toml", "".join(f"[t{n}]\n" for n in range(DEEP)))),
    "toml, nested": lambda place: _on_machine(_file(place, "toml", "a = " + "[" * DEEP + "]" * DEEP)),
    "toml, digits": lambda place: _on_machine(_file(place, "toml", "dt = " + "9" * DEEP)),
    "toml, large": lambda place: _on_machine(_file(place, "toml", "# " + "a" * LINE)),
    "klipper, line": lambda place: _imported(_file(place, "cfg", "[printer]\nmax_velocity: " + "1" * LINE), "klipper"),
    "klipper, includes": lambda place: _imported(_file(place, "cfg", "[include bomb.cfg]\n" * DEEP), "klipper"),
    "ini, line": lambda place: _imported(_file(place, "ini", "[TRAJ]\nAXES = " + "1" * LINE), "linuxcnc"),
    "caps, line": lambda place: _read(Path("a.ngc"), "--feed-caps", _file(place, "csv", "line,feed\n1," + "1" * LINE).name),
    "line": lambda place: _read(_file(place, "ngc", START + "G1 X" + "1" * LINE + "\n")),
    "comment": lambda place: _read(_file(place, "ngc", START + "(" + "a" * LINE + ")\nG1 X1\nM2\n")),
    "words": lambda place: _read(_file(place, "ngc", START + "G1" + " X1" * (LINE // 3) + "\nM2\n")),
    "brackets": lambda place: _read(_file(place, "ngc", START + "G1 X" + "[" * DEEP + "1" + "]" * DEEP + "\n")),
    "loop": lambda place: _read(_file(place, "ngc", "F600\no1 while [1]\nG1 X1\nX0\no1 endwhile\nM2\n")),
    "calls": lambda place: _read(_file(place, "ngc", "o1 sub\no1 call\no1 call\no1 endsub\nF600\no1 call\nM2\n")),
    "fanuc, calls": lambda place: _read(_file(place, "nc", FANUC)),
    "heidenhain, line": lambda place: _read(_file(place, "h", HEIDENHAIN.format("L X+" + "1" * LINE))),
    "heidenhain, repeats": lambda place: _read(_file(place, "h", HEIDENHAIN.format(REPEATS))),
    "sinumerik, loop": lambda place: _read(_file(place, "mpf", "G71 G90 F600\nLOOP\nG1 X1\nX0\nENDLOOP\nM30\n")),
    "hpgl, number": lambda place: _read(_file(place, "plt", "IN;SP1;PU0,0;PD" + "1" * LINE + ",0;PU;")),
    "hpgl, circle": lambda place: _read(_file(place, "plt", "IN;SP1;PU0,0;CI400,0.0000001;PU;")),
    "cl, line": lambda place: _read(_file(place, "cls", "UNITS/MM\nFEDRAT/100\nGOTO/" + "1" * LINE + ",0,0\n")),
}  # fmt: skip
SOUND = ("comment", "hpgl, circle")  # which are planned


def bomb(bench: Bench, rng: random.Random) -> dict[str, Any]:
    """A small file that asks for much: a sentence within some seconds and gigabytes. All kinds in turn."""
    bench.turn = (bench.turn + 1) % len(BOMBS)
    kind = list(BOMBS)[bench.turn]
    words = BOMBS[kind](bench.folder)

    def lower() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (ADDRESSES, ADDRESSES))
        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))

    used = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    end = bench.run(*words, preexec_fn=lower)
    used = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - used
    for path in bench.folder.glob("bomb.*"):
        path.unlink()
    allowed = (0,) if kind in SOUND else (2, 3)
    return bench.row([end], allowed, bomb=kind, cpu=round(used, 1), words=len(end[1].split()))
