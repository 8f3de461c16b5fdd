"""What docs/trust.md says: network, pickles, code from data, licences, types of the public names."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from fnmatch import fnmatch
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement

import planner

ROOT = Path(__file__).resolve().parent.parent
PAGE = (ROOT / "docs" / "trust.md").read_text(encoding="utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))

# ------------------------------------------------------------------------------------------ network and code from data

NETWORK = {
    "asyncio",
    "ftplib",
    "http",
    "requests",
    "smtplib",
    "socket",
    "ssl",
    "telnetlib",
    "urllib",
    "xmlrpc",
}
# Modules and calls that run what data says, and where they are; docs/trust.md has the reason of each.
FROM_DATA = {"pickle", "marshal", "shelve", "dill", "cloudpickle", "yaml"}
CALLS = {"eval", "exec", "compile", "__import__"}
EXPLAINED = {
    ("planner/base/compiling.py", "pickle"),
    ("planner/nc/language/compiled.py", "compile"),
    ("planner/nc/language/compiled.py", "exec"),
    ("planner/commands/study/sweep.py", "joblib"),
    ("planner/commands/study/sweep.py", "distributed"),
}

# Most files have none of these letters, and parsing them all would take seconds.
WORTH_A_LOOK = re.compile(
    "|".join([*NETWORK, *FROM_DATA, *CALLS, "joblib|distributed|import_needed|shell|system|popen"])
)


def of_interest(tree: ast.AST) -> Iterator[str]:
    """The names of modules and calls in question that a syntax tree has."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [node.module or ""]
        elif isinstance(node, ast.Call):
            function = node.func
            if isinstance(function, ast.Name) and function.id in CALLS:
                yield function.id
            if isinstance(function, ast.Name) and function.id == "import_needed":
                yield str(ast.literal_eval(node.args[0]))
            for keyword in node.keywords:
                if (
                    keyword.arg in ("shell", "allow_pickle")
                    and getattr(keyword.value, "value", None) is not False
                ):
                    yield keyword.arg
            if isinstance(function, ast.Attribute) and ast.unparse(function) in ("os.system", "os.popen"):
                yield ast.unparse(function)
            continue
        else:
            continue
        for name in names:
            if name.split(".")[0] in NETWORK | FROM_DATA | {"joblib", "distributed"}:
                yield name.split(".")[0]


@pytest.mark.shows(
    "trust", "sampled: sockets are errors, imports are read, damaged kernels are compiled anew"
)
def test_no_module_has_pickles_sockets_or_code_from_data_but_those_explained() -> None:
    found = {
        (file.relative_to(ROOT).as_posix(), name)
        for file in (ROOT / "planner").rglob("*.py")
        if WORTH_A_LOOK.search(text := file.read_text(encoding="utf-8"))
        for name in of_interest(ast.parse(text))
        # those of import_needed
        if name.partition(".")[0] not in ("toppra", "casadi", "pandas", "fatrop", "plotly")
    }
    assert found == EXPLAINED
    for file, _ in EXPLAINED:
        assert f"`{file}`" in PAGE


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("import socket", "socket"),
        ("from urllib.request import urlopen", "urllib"),
        ("import pickle as p", "pickle"),
        ("eval('1')", "eval"),
        ("np.load(f, allow_pickle=True)", "allow_pickle"),
        ("run(c, shell=True)", "shell"),
        ("os.system('ls')", "os.system"),
    ],
)
def test_what_is_looked_for_is_found(text: str, name: str) -> None:
    assert name in set(of_interest(ast.parse(text)))


OFFLINE = """
import sys
def refuse(event, arguments):
    if event.startswith("socket."):
        raise RuntimeError(f"{event} {arguments}")
sys.addaudithook(refuse)
import socket
class Refused:
    def __init__(self, *a, **k): raise RuntimeError("a socket")
socket.socket = Refused
try:
    socket.create_connection(("127.0.0.1", 9))
except RuntimeError:
    print("refused")
from planner.cli import app
"""


@pytest.mark.shows(
    "trust", "sampled: sockets are errors, imports are read, damaged kernels are compiled anew"
)
@pytest.mark.slow
def test_plans_reports_and_verdicts_open_no_socket(tmp_path: Path) -> None:
    (tmp_path / "job.ngc").write_text("G21 G90 F3000 G64 P0.05\nG1 X10\nY5\nM2\n")
    options = ["job.ngc", "-m", "mill", "--method", "kinematic", "-o", "out", "--report"]
    code = f"{OFFLINE}\napp(['plan', *{options}], standalone_mode=False)"
    code += "\napp(['verify', 'out', 'job.ngc'], standalone_mode=False)"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("refused")
    assert (tmp_path / "out" / "report.html").exists()


# ------------------------------------------------------------------------------------------ licences

KINDS = {
    "MIT": r"\bMIT\b|HPND|Historical Permission",
    "BSD": r"BSD",
    "Apache": r"Apache",
    "LGPL": r"LGPL|Lesser General Public",
    "PSF": r"PSF|Python Software Foundation",
    "ISC": r"\bISC\b",
}


def kinds(text: str) -> set[str]:
    return {kind for kind, words in KINDS.items() if re.search(words, text)}


def needed() -> dict[str, str]:
    """What the package needs, and what that needs, as it is installed here: what its metadata say of the licence, by name."""
    found: dict[str, str] = {}
    todo = list(PROJECT["project"]["dependencies"])
    while todo:
        requirement = Requirement(todo.pop())
        name = requirement.name.lower().replace("_", "-")
        if name in found or (requirement.marker and not requirement.marker.evaluate({"extra": ""})):
            continue
        about = metadata.distribution(name)
        told = [about.metadata.get("License-Expression") or ""]
        told += [one for one in about.metadata.get_all("Classifier", []) if one.startswith("License ::")]
        if not kinds(" ".join(told)):
            told.append((about.metadata.get("License") or "")[:200])
        found[name] = " ".join(told)
        todo += about.requires or []
    return found


def test_licences_are_listed_as_the_packages_say() -> None:
    rows = re.findall(r"^\| ([^|]+) \| ([a-z, -]+) \|$", PAGE.partition("## Licences")[2], re.MULTILINE)
    listed = {name: licence for licence, names in rows for name in names.split(", ")}
    installed = needed()
    assert set(installed) <= set(listed)
    for name, told in installed.items():
        assert kinds(told), f"{name}: {told}"
        assert kinds(told) & kinds(listed[name]), f"{name}: the page says {listed[name]}, its metadata {told}"
        assert "General Public" not in told or name == "casadi", f"{name}: {told}"


# ------------------------------------------------------------------------------------------ types


def test_public_names_come_from_modules_that_are_checked_strictly() -> None:
    (strict,) = (
        one["module"] for one in PROJECT["tool"]["mypy"]["overrides"] if one.get("disallow_untyped_defs")
    )
    for name in planner.__all__:
        value = getattr(planner, name)
        module = getattr(value, "__module__", None) or getattr(value, "__name__", "planner")
        module = "planner" if name == "__version__" else module
        assert any(fnmatch(module, pattern) for pattern in strict), f"{name} of {module}"
