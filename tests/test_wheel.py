"""What `python -m build` makes: a wheel and a source archive that install into an empty environment and plan there."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from planner.base import kernel_files

ROOT = Path(__file__).resolve().parent.parent
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        importlib.util.find_spec("build") is None, reason="the package build is not installed"
    ),
]


@pytest.fixture(scope="module")
def archives(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The wheel, made from the source archive, and the source archive."""
    out = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(out), str(ROOT)]
    plain = {**os.environ, "PLANNER_COMPILE_AHEAD": "0"}  # kernels in a package: commands/test_ahead.py
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=plain)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    (wheel,), (source,) = out.glob("*.whl"), out.glob("*.tar.gz")
    return wheel, source


def test_both_hold_everything_that_a_plan_needs(archives: tuple[Path, Path]) -> None:
    wheel, source = archives
    inside = set(zipfile.ZipFile(wheel).namelist())
    package = {
        file.relative_to(ROOT).as_posix()
        for file in (ROOT / "planner").rglob("*")
        if file.suffix in (".py", ".toml", ".ngc", ".html", ".css", ".js", ".typed")
    }
    assert package <= inside
    assert not [name for name in inside if name.startswith(("tests/", "benchmarks/"))]
    with tarfile.open(source) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    assert package <= names
    assert {"README.md", "LICENSE", "pyproject.toml"} <= names


@pytest.mark.shows("install", "sampled: into an empty environment")
def test_it_plans_where_nothing_else_is(archives: tuple[Path, Path], tmp_path: Path) -> None:
    """In an environment of its own, into which only the packages of this one are let. The wheel is made from the source archive."""
    venv = tmp_path / "venv"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(venv)], check=True)
    python = venv / ("Scripts" if os.name == "nt" else "bin") / "python"
    pip = [sys.executable, "-m", "pip", "--python", str(python), "--disable-pip-version-check", "--quiet"]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    subprocess.run(
        [*pip, "install", "--no-compile", "--no-deps", "--no-index", str(archives[0])],
        check=True,
        env=environment,
    )
    (site,) = (venv / "lib").glob("python*/site-packages")
    here = Path(importlib.util.find_spec("numpy").origin).parents[1]  # type: ignore[union-attr,arg-type]
    (site / "packages.pth").write_text(f"{here}\n")
    (tmp_path / "job.ngc").write_text("G21 G90 F3000\nG1 X10\nY5\nM2\n")
    code = (
        "import planner, pathlib\n"
        "p = planner.plan('job.ngc', 'router', method='stop')\n"
        "assert p.verdict.passed\n"
        "p.save('out', report=True)\n"
        "print(pathlib.Path(planner.__file__).parent)\n"
    )
    kept = (
        tmp_path / "kept"
    )  # with the kernels of this checkout, which are those of the wheel: compiling takes half a minute
    kept.mkdir()
    (kept / "planner").symlink_to(kernel_files.folders()[0])
    environment["NUMBA_CACHE_DIR"] = str(kept)
    done = subprocess.run(
        [str(python), "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout.strip() == str(site / "planner")
    assert (tmp_path / "out" / "report.html").exists()
