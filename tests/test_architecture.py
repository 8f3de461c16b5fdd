"""Imports go from later stages to earlier ones only, and heavy packages load only where they are used."""

from __future__ import annotations

import ast
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

import planner
from tests.syntax import statements

PACKAGE = Path(__file__).resolve().parent.parent / "planner"

# The rooms, earlier stages first: a room imports from those before it, and no file takes part in a circle.
ROOMS = (
    *("base", "machine", "nc", "geometry", "corners", "smoothing", "feedrate", "motion", "joint"),
    *("baselines", "verifier", "delivery", "sensitivity", "planning", "controls", "report", "commands"),
    *("cli", "__main__"),
)
# The judge sees the path, the machine and the samples, and no code of those it judges.
VERIFY_MAY_IMPORT = {
    "base.units",
    "base.errors",
    "base.arrays",
    "base.kernels",
    "base.series",
    "base.sizes",
    "base.threads",
    "machine",
    "geometry.toolpath",
    "motion.trajectory",
    "verifier",
}
# The planner reads verdicts. It asks for one only where a motion is delivered, and measures nothing by the judge's means.
VERDICT_RECORDS = {
    "DERIVATIVES",
    "NOT_LIMITED_NAMES",
    "OF_CHORDS",
    "WHOLE",
    "AfterFilters",
    "CornerCheck",
    "Fault",
    "Given",
    "Kind",
    "LimitCheck",
    "Ringing",
    "SamePath",
    "ThreadCheck",
    "Verdict",
}
JUDGING = {"verify", "verify_joints", "fit_axes", "same_path"}
MAY_JUDGE = ("planning.job.job", "planning.job.at_tip", "commands", "report")
HEAVY = {"casadi", "matplotlib", "toppra", "numba", "scipy", "pyarrow", "ruckig"}


def modules() -> dict[str, Path]:
    found = {}
    for file in sorted(PACKAGE.rglob("*.py")):
        parts = ("planner", *file.relative_to(PACKAGE).with_suffix("").parts)
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    return found


MODULES = modules()


@cache
def import_statements(module: str) -> tuple[ast.Import | ast.ImportFrom, ...]:
    """Those of a module, also inside functions and for annotations."""
    tree = ast.parse(MODULES[module].read_text(encoding="utf-8"))
    return tuple(node for node in statements(tree) if isinstance(node, ast.Import | ast.ImportFrom))


@cache
def imports(module: str) -> frozenset[str]:
    """Names of the package's modules that a module imports; a package's own modules may be named by it."""
    names = set()
    for node in import_statements(module):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif node.module:
            assert not node.level, f"{module}: relative import; write the full name"
            named = {f"{node.module}.{alias.name}" for alias in node.names}
            names |= {name if name in MODULES else node.module for name in named}
    return frozenset(names & MODULES.keys() - {"planner", module})


def room(module: str) -> int:
    return ROOMS.index(module.split(".")[1])


def test_no_room_imports_a_later_one() -> None:
    """Imports inside functions count, and those for annotations."""
    later = {
        (module, name)
        for module in MODULES
        for name in imports(module)
        if "." in module and room(name) > room(module)
    }
    assert not later


def test_no_file_is_in_a_circle() -> None:
    left = {module: imports(module) for module in MODULES if module != "planner"}
    while done := {module for module, names in left.items() if not names & left.keys()}:
        left = {module: names for module, names in left.items() if module not in done}
    assert not left, "each of these imports another of them"


def test_the_verifier_is_independent() -> None:
    for module in MODULES:
        if module.startswith("planner.verifier"):
            for name in imports(module):
                short = name.removeprefix("planner.")
                assert short in VERIFY_MAY_IMPORT or short.startswith("verifier."), f"{module} imports {name}"


def test_nobody_who_plans_uses_the_verifier() -> None:
    """All imports count, those for annotations and inside functions too."""
    for module in MODULES:
        short = module.removeprefix("planner.")
        if short.split(".")[0] == "verifier":
            continue
        names = VERDICT_RECORDS | (
            JUDGING if any(f"{short}.".startswith(f"{may}.") for may in MAY_JUDGE) else set()
        )
        for node in import_statements(module):
            if isinstance(node, ast.Import):
                assert not any(alias.name.startswith("planner.verifier") for alias in node.names), module
            elif (node.module or "").startswith("planner.verifier"):
                assert node.module == "planner.verifier", (
                    f"{module} imports {node.module}: only what the room says"
                )
                imported = {alias.name for alias in node.names}
                assert imported <= names, f"{module} imports {', '.join(sorted(imported - names))}"


def test_a_plan_knows_nothing_of_what_shows_it() -> None:
    """Neither by an import for annotations nor by a module's name."""
    for module in ("planner.planning.job.plan", "planner.planning.job.shown"):
        text = MODULES[module].read_text(encoding="utf-8")
        assert "planner.report" not in text, module


def test_kernels_are_made_where_the_cache_may_fail() -> None:
    for module, file in MODULES.items():
        if module in (
            "planner.base.compiling",
            "planner.base.lanes",
            "planner.base.views",
        ):  # what kernels are made by, and of
            continue
        made = any(
            line.startswith(("from numba", "import numba")) for line in file.read_text("utf-8").splitlines()
        )
        assert not made, f"{module}: from planner.base.kernels import njit"


@pytest.mark.parametrize(
    "code",
    [
        "import planner",
        "from planner.cli import app; app(['--help'], standalone_mode=False)",
        "from planner.cli import app; app(['plan', '--help'], standalone_mode=False)",
        "from planner.cli import app; app(['machine', 'init', '--help'], standalone_mode=False)",
    ],
)
def test_help_and_import_load_nothing_heavy(code: str) -> None:
    loaded = _loaded(code)
    assert "planner" in loaded
    assert not loaded & HEAVY


# What a plan does not use: oracles, pictures, trajectory files, what only compiling needs, and what other programs or options need.
NOT_OF_A_PLAN = {
    "casadi",
    "matplotlib",
    "toppra",
    "pyarrow",
    "pandas",
    "scipy.linalg",
    "scipy.interpolate",
    "scipy.optimize",
    "numba.np.arraymath",
    "planner.report",
    "planner.report.interactive",
    "planner.controls.export",
    "planner.nc.hpgl.plotter",
}


def test_a_plan_loads_only_what_it_uses(tmp_path: Path) -> None:
    """Each package costs all plans its import; SciPy's linear algebra 0.3 s, which numba loads in order to compile."""
    job = tmp_path / "corner.ngc"
    job.write_text("G21 G90 G64 P0.05 F3000\nG1 X10\nX20 Y5\nM2\n")
    planner.plan(job, "mill")  # its kernels are on the disk now
    in_python = f"import planner; planner.plan({str(job)!r}, 'mill')"
    loaded = _loaded(in_python)
    assert {"planner.planning.page", "numba"} <= loaded
    assert loaded & NOT_OF_A_PLAN == set()
    options = ["plan", str(job), "--quiet", "-o", str(tmp_path / "out")]
    loaded = _loaded(f"from planner.cli import app; app({options}, standalone_mode=False)")
    assert {"planner.planning.page", "numba"} | OF_THE_FILES <= loaded
    assert loaded & NOT_OF_A_PLAN == OF_THE_FILES


OF_THE_FILES = {"pyarrow", "planner.report"}


def _loaded(code: str) -> set[str]:
    code += "\nimport sys\nprint('loaded:', *sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.rpartition("loaded:")[2].split())


def test_readme_names_files_that_exist() -> None:
    readme = (PACKAGE.parent / "README.md").read_text(encoding="utf-8")
    for name in ("planner/examples/bracket.ngc",):
        assert name in readme
        assert (PACKAGE.parent / name).is_file()
