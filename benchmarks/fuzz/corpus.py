"""Inputs that reached something new, kept in a folder to be changed further, in this run and in later ones.

    FOLDER/KIND/inputs/SEED-OPTIONS     an input, and the seed of the settings that it is read with
    FOLDER/KIND/findings/SEED-OPTIONS   inputs that ended in a finding
    FOLDER/KIND/reached.json            the ways known so far, and of which sources

Where the readers' sources have changed since, all inputs are tried again before a run, and those that reach nothing that the others
do not are left out.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.fuzz.coverage import ROOT, Tracer, digest

INPUT_MAX = 60_000  # bytes: larger inputs are not kept
JOINED_MAX = 20  # lines of another input that are put into one
NEWEST = 50  # inputs that half of the choices are among


class Input(NamedTuple):
    """An input, and the seed of the settings that it is read with."""

    data: bytes
    options: int


class Corpus:
    """The kept inputs of a kind, and the ways that they reach."""

    def __init__(self, folder: Path, tracer: Tracer):
        self.folder, self.tracer = folder, tracer
        self.inputs: list[Input] = []
        self._sources = digest(map(Path, tracer.ways))

    def load(self, again: Callable[[Input], object]) -> None:
        """What earlier runs kept; `again` tries an input where the sources have changed since."""
        files = sorted((self.folder / "inputs").glob("*-*"))
        if self._known():
            self.inputs = [read_input(file) for file in files]
            return
        for file in files:
            one = read_input(file)
            with self.tracer.watching():
                again(one)
            if self.tracer.new:
                self.inputs.append(one)
            else:
                file.unlink()
        self.save()

    def _known(self) -> bool:
        file = self.folder / "reached.json"
        if not file.exists():
            return False
        saved = json.loads(file.read_text("utf-8"))
        if saved["sources"] != self._sources:
            return False
        for name, ways in saved["ways"].items():
            self.tracer.ways[str(ROOT / name)] = set(ways)
        return True

    def save(self) -> None:
        """Write the ways reached so far; inputs are written when they are kept."""
        ways = {
            str(Path(name).relative_to(ROOT)): sorted(found)
            for name, found in self.tracer.ways.items()
            if found
        }
        self.folder.mkdir(parents=True, exist_ok=True)
        new = self.folder / "reached.new"
        new.write_text(json.dumps({"sources": self._sources, "ways": ways}), "utf-8")
        new.replace(self.folder / "reached.json")

    def keep(self, one: Input, seed: int) -> None:
        """One more input to be changed further, unless it is large."""
        if len(one.data) <= INPUT_MAX:
            self.inputs.append(one)
            write_input(self.folder / "inputs", one, seed)

    def choose(self, rng: np.random.Generator, joined: bool) -> Input | None:
        """An input to be changed further, every other time one of the newest; None if there is none.

        joined : with lines of another one put in now and then
        """
        if not self.inputs:
            return None
        one = self._any(rng)
        if not joined or rng.random() < 0.5:
            return one
        lines, other = one.data.split(b"\n"), self._any(rng).data.split(b"\n")
        at, first = int(rng.integers(len(lines) + 1)), int(rng.integers(len(other)))
        some = other[first : first + int(rng.integers(1, JOINED_MAX))]
        return one._replace(data=b"\n".join([*lines[:at], *some, *lines[at:]]))

    def _any(self, rng: np.random.Generator) -> Input:
        among = self.inputs[-NEWEST:] if rng.random() < 0.5 else self.inputs
        return among[int(rng.integers(len(among)))]


def write_input(folder: Path, one: Input, seed: int) -> Path:
    """An input as a file; `read_input` reads it."""
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f"{seed:09d}-{one.options}"
    file.write_bytes(one.data)
    return file


def read_input(file: Path) -> Input:
    """An input of a file."""
    return Input(file.read_bytes(), int(file.name.partition("-")[2]))
