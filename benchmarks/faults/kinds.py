"""The kinds of faults of benchmarks/faults: what is done to the planner, and what has to hold afterwards."""

from __future__ import annotations

import json
import os
import random
import resource
import signal
import time
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

from benchmarks.faults import bombs, hostile
from benchmarks.faults.bench import (
    ENDS,
    HIDDEN,
    INTERRUPTED,
    JOBS,
    PATIENCE,
    Bench,
    after,
    ended,
    mounted,
    not_whole,
)

MANY = 20_000  # moves of a job that takes some memory


def plan_words(rng: random.Random) -> list[str]:
    """A plan into the folder, by one of the methods, with pictures and pages now and then."""
    words = [
        "plan",
        rng.choice(["a.ngc", "b.ngc"]),
        "-o",
        "out",
        "-q",
        "--method",
        rng.choice(["stop", "kinematic", "optimal"]),
    ]
    words += ["--format", rng.choice(["csv", "npz", "parquet"])] if rng.random() < 0.5 else []
    return words + (["--report"] if rng.random() < 0.3 else [])


# ------------------------------------------------------------------------------------------ ends from outside


def kill(bench: Bench, rng: random.Random) -> dict[str, Any]:
    """kill -9: all files are whole, of one run or, between two renames, of two; the next run removes leftovers."""
    process = bench.start(*plan_words(rng))
    after(process, rng.uniform(0.0, 1.0) * bench.takes)
    process.kill()
    end = ended(process)
    wrong = not_whole(bench.out)
    leftovers = [path for path in bench.out.iterdir() if HIDDEN.fullmatch(path.name)]
    if wrong and leftovers and not not_whole_but(bench.out, leftovers):
        wrong = []
    again = bench.run("plan", "a.ngc", "-o", "out", "-q")
    row = bench.row([again])
    return row | {"exits": [end[0]], "wrong": wrong + row["wrong"], "leftovers": len(leftovers)}


def not_whole_but(out: Path, leftovers: list[Path]) -> list[str]:
    """The same as `not_whole`, without hidden folders of a killed run; files of that run may be in place already."""
    listed = json.loads((out / "summary.json").read_text("utf-8"))["sha256"]
    new: dict[str, str] = {}
    for folder in leftovers:
        if (folder / "summary.json").exists():
            new |= json.loads((folder / "summary.json").read_text("utf-8"))["sha256"]
    files = [path for path in out.iterdir() if path.is_file() and path.name != "summary.json"]
    digests = {path.name: sha256(path.read_bytes()).hexdigest() for path in files}
    return [name for name, digest in digests.items() if digest not in (listed.get(name), new.get(name))]


def interrupt(bench: Bench, rng: random.Random) -> dict[str, Any]:
    """Ctrl-C at any moment of a plan, of two plans side by side, of a page, of a comparison."""
    words = rng.choice(
        [
            plan_words(rng),
            ["plan", "a.ngc", "b.ngc", "-o", "many", "-q", "--method", "stop"],
            ["report", "out", "-o", "page.html"],
            ["compare", "a.ngc", "--method", "stop,kinematic", "-o", "compared.json", "--force", "-q"],
        ]
    )
    process = bench.start(*words)
    after(process, rng.uniform(0.0, 1.0) * bench.takes)
    process.send_signal(signal.SIGINT)
    end = ended(process)
    return bench.row([end], (*ENDS, *INTERRUPTED), command=words[0])


# ------------------------------------------------------------------------------------------ places


WRITES = (
    ["plan", "a.ngc", "--method", "stop", "-q", "-o", "{}/out"],
    ["plan", "a.ngc", "--method", "stop", "-q", "--plot", "--report", "-o", "{}/out"],
    ["plan", "a.ngc", "--method", "stop", "-q", "--trace", "{}/trace.json"],
    ["plan", "a.ngc", "b.ngc", "--method", "stop", "-q", "-o", "{}/many"],
    ["compare", "a.ngc", "--method", "stop,kinematic", "-q", "-o", "{}/table.csv"],
    ["compare", "a.ngc", "--method", "stop,kinematic", "-q", "--report", "{}/both.html"],
    ["report", "out", "-o", "{}/page.html"],
    ["expand", "a.ngc", "-o", "{}/plain.ngc"],
    ["pulses", "out", "-o", "{}/pulses.csv"],
    ["export", "out", "--for", "pvt", "-o", "{}/pvt"],
    ["machine", "init", "{}/machine.toml"],
    ["sweep", "a.ngc", "--vary", "x.jerk=1e4,1e5", "--method", "stop", "-q", "-o", "{}/sweep"],
)


def nothing_half(place: Path) -> list[str]:
    """Files in a place that was empty, besides whole results."""
    wrong = []
    for path in place.rglob("*"):
        if path.is_dir() or (path.parent / "summary.json").exists() or path.parent.name == "points":
            continue
        if (
            path.stat().st_size == 0
            or HIDDEN.fullmatch(path.name)
            or (path.suffix == ".json" and not _is_json(path))
        ):
            wrong.append(f"half written: {path.name}")
    for summary in place.rglob("summary.json"):
        wrong += not_whole(summary.parent)
    return wrong


def _is_json(path: Path) -> bool:
    try:
        json.loads(path.read_text("utf-8"))
    except ValueError:
        return False
    return True


def full(bench: Bench, rng: random.Random) -> dict[str, Any]:
    """A disk that is full after some kilobytes: what was there stays, and nothing is half written."""
    words = rng.choice(WRITES)
    room = int(2 ** rng.uniform(0, 14))  # kB
    with mounted(bench.folder / "small", f"size={max(room // 4 * 4, 4)}k") as there:
        place = bench.folder / "small"
        limit = None if there else lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (room << 10, room << 10))
        how = {} if limit is None else {"preexec_fn": limit}
        end = bench.run(*[word.format(place) for word in words], **how)
        half = nothing_half(place)
        size = sum(path.stat().st_size for path in place.rglob("*") if path.is_file())
        for path in sorted(place.rglob("*"), reverse=True):
            path.rmdir() if path.is_dir() else path.unlink()
    row = bench.row([end], command=" ".join(words[:2]), room_kB=room, mounted=there, written=size)
    return row | {"wrong": row["wrong"] + half}


def read_only(bench: Bench, rng: random.Random) -> dict[str, Any]:
    """A place that may not be written to: exit code 2 and a sentence."""
    words = rng.choice(WRITES)
    with mounted(bench.folder / "still", "size=64k,ro") as there:
        place = bench.folder / "still" if there else Path("/proc/self")
        end = bench.run(*[word.format(place) for word in words])
    return bench.row([end], (2,), command=" ".join(words[:2]), mounted=there)


def no_home(bench: Bench, rng: random.Random) -> dict[str, Any]:
    """No home, or one that is not there or not to be written to."""
    environment = {
        name: value for name, value in os.environ.items() if not name.startswith(("HOME", "XDG_", "MPL"))
    }
    home = rng.choice([None, "/nowhere", "/proc/self", ""])
    if home is not None:
        environment["HOME"] = home
    if rng.random() < 0.05:  # rarely: all kernels are compiled then
        environment["NUMBA_CACHE_DIR"] = "/proc/self"
        words = ["plan", "a.ngc", "-o", "out", "-q", "--method", "stop"]
    else:
        words = [*plan_words(rng), *(["--plot"] if rng.random() < 0.3 else [])]
    return bench.row([bench.run(*words, env=environment)], (0,), home=home)


def memory(bench: Bench, rng: random.Random) -> dict[str, Any]:
    """Little address space, from not enough for the imports on; now and then for a job of many moves."""
    limit, words = int(rng.uniform(60, 1500)) << 20, plan_words(rng)
    if rng.random() < 0.3:
        many = bench.folder / "many.ngc"
        many.write_text(JOBS["a"] + "".join(f"X{n} Y{n % 2}\n" for n in range(MANY)))
        words = ["plan", many.name, "-o", "out", "-q", "--method", rng.choice(["stop", "kinematic"])]

    def lower() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))

    end = bench.run(*words, preexec_fn=lower)
    return bench.row([end], limit_MB=limit >> 20, job=words[1])


# ------------------------------------------------------------------------------------------ others at the same files


def two_at_once(bench: Bench, rng: random.Random) -> dict[str, Any]:
    """Two plans into one folder: both end well, and it holds the result of one of them."""
    first = bench.start(*plan_words(rng))
    time.sleep(rng.uniform(0.0, 0.5) * bench.takes)
    second = bench.start(*plan_words(rng))
    return bench.row([ended(first), ended(second)], (0,))


def changing_input(bench: Bench, rng: random.Random) -> dict[str, Any]:
    """The program changes while it is planned: the result is that of one text, and planned.ngc is of the same or missing."""
    job = bench.folder / "changing.ngc"
    texts = [JOBS["a"], JOBS["b"]]
    rng.shuffle(texts)
    job.write_text(texts[0])
    process = bench.start("plan", job.name, "-o", "out", "-q", "--method", "stop")
    time.sleep(rng.uniform(0.0, 1.0) * bench.takes)
    how = rng.choice(["replaced", "written over", "removed"])
    if how == "replaced":
        (bench.folder / "new").write_text(texts[1])
        os.replace(bench.folder / "new", job)
    elif how == "written over":
        job.write_text(texts[1])
    else:
        job.unlink()
    end = ended(process)
    row = bench.row([end], how=how)
    summary = json.loads((bench.out / "summary.json").read_text("utf-8"))
    planned = bench.out / "planned.ngc"
    if end[0] == 0 and planned.exists():
        of = "b" if "G2 X0" in planned.read_text() else "a"
        blocks = {"a": 4, "b": 5}[of]
        if summary["blocks"] != blocks:
            row["wrong"].append(f"planned.ngc is of {of}, the plan has {summary['blocks']} blocks")
    job.unlink(missing_ok=True)
    return row


def children(pid: int) -> list[int]:
    """The processes that a process has started, and those that these have; without joblib's resource tracker, which plans nothing:
    where it is killed another one begins, and complains of names that only the first one knew."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
            tracks = b"resource_tracker" in (stat.parent / "cmdline").read_bytes()
        except OSError:
            continue
        if int(fields[1]) == pid and not tracks:
            found += [int(stat.parent.name), *children(int(stat.parent.name))]
    return found


def worker(bench: Bench, rng: random.Random) -> dict[str, Any]:
    """A process of a sweep, or of several programs, is killed: what is done is kept, and the same command goes on."""
    place = bench.folder / "sweep"
    for path in sorted(place.rglob("*"), reverse=True):
        path.rmdir() if path.is_dir() else path.unlink()
    values = ",".join(f"{rng.uniform(1e4, 1e6):.0f}" for _ in range(6))
    many = rng.random() < 0.3
    words = (
        ["plan", "a.ngc", "b.ngc", "-o", "sweep", "--threads", "2", "-q"]
        if many
        else ["sweep", "a.ngc", "--vary", f"x.jerk={values}", "--threads", "2", "-q", "-o", "sweep"]
    )
    process = bench.start(*words)
    until = time.monotonic() + PATIENCE
    while not (young := children(process.pid)) and process.poll() is None and time.monotonic() < until:
        time.sleep(0.02)
    time.sleep(rng.uniform(0.0, 3.0) * bench.takes)
    young = children(process.pid) or young
    if young:
        try:
            os.kill(rng.choice(young), signal.SIGKILL)
        except ProcessLookupError:
            young = []
    end = ended(process)
    again = bench.run(*words)
    row = bench.row([end, again], (0, 3), many=many, killed=bool(young))
    wrong = nothing_half(place) + (
        [] if again[0] == 0 else [f"the same command again: {again[0]} {again[1][-200:]}"]
    )
    return row | {"wrong": row["wrong"] + wrong}


KINDS: dict[str, Callable[[Bench, random.Random], dict[str, Any]]] = {
    "kill": kill,
    "interrupt": interrupt,
    "full": full,
    "read-only": read_only,
    "no-home": no_home,
    "memory": memory,
    "two-at-once": two_at_once,
    "changing-input": changing_input,
    "worker": worker,
    "compiling": hostile.compiling,
    "first-runs": hostile.first_runs,
    "damaged-kernels": hostile.damaged,
    "planted-kernels": hostile.planted,
    "no-room-for-kernels": hostile.no_room,
    "read-only-package": hostile.read_only_package,
    "bomb": bombs.bomb,
}
