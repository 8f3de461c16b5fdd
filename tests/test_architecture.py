"""Imports go from later stages to earlier ones only, and heavy packages load only where they are used."""

from __future__ import annotations

import ast
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

import planner

PACKAGE = Path(__file__).resolve().parent.parent / "planner"

# Earlier stages first. A module is in the layer with the longest matching name; modules of one layer may import each other.
LAYERS = (
    "planner",
    "planner.base.units",
    "planner.base.errors",
    "planner.base.arrays",
    "planner.base.called",
    "planner.base.files",
    "planner.base.glossary",
    "planner.base.own_folders",
    "planner.base.kernel_files",
    "planner.base.compiling",
    "planner.base.kernel_content",
    "planner.base.kernels",
    "planner.base.names",
    "planner.base.search",
    "planner.base",
    "planner.base.series",
    "planner.constraints.own",
    "planner.fir.filters",
    "planner.machine",
    "planner.kinematics",
    "planner.machine_import",
    "planner.constraints",
    "planner.nc",
    "planner.geometry",
    "planner.corners",
    "planner.smoothing",
    "planner.path.calm",
    "planner.path.rows",
    "planner.path.grid",
    "planner.path.own_rows",
    "planner.path",
    "planner.constraints.on_grid",
    "planner.constraints.own_axes",
    "planner.constraints.assemble",
    "planner.feedrate",
    "planner.motion.trajectory",
    "planner.kinematics.setpoints",
    "planner.motion.on_demand",
    "planner.motion.vertex_times",
    "planner.motion.time_law",
    "planner.motion.sampling",
    "planner.motion.lots",
    "planner.motion.timing",
    "planner.motion",
    "planner.lookahead",
    "planner.fir",
    "planner.tube",
    "planner.verify",
    "planner.job.records",
    "planner.sensitivity",
    "planner.job.trace",
    "planner.job.stages",
    "planner.job.beside",
    "planner.delivery",
    "planner.job",
    "planner.methods.kinematic",  # two motions that the loop compares its own with
    "planner.methods.stop",
    "planner.optimal",
    "planner.methods",
    "planner.report",
    "planner.interactive",
    "planner.control_files",
    "planner.study",
    "planner.commands",
    "planner.cli",
    "planner.__main__",
)
# The judge sees the path, the machine and the samples, and no code of those it judges.
VERIFY_MAY_IMPORT = {
    "base.units",
    "base.errors",
    "base.arrays",
    "base.called",
    "base.kernels",
    "base.series",
    "base.sizes",
    "base.threads",
    "machine",
    "geometry.toolpath",
    "motion.trajectory",
    "verify",
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
    "ThreadCheck",
    "Verdict",
}
JUDGING = {"verify", "verify_joints", "fit_axes"}
MAY_JUDGE = ("job.job", "job.at_tip", "commands", "interactive", "report")
HEAVY = {"casadi", "matplotlib", "toppra", "numba", "scipy", "pyarrow", "ruckig"}


def modules() -> dict[str, Path]:
    found = {}
    for file in sorted(PACKAGE.rglob("*.py")):
        parts = ("planner", *file.relative_to(PACKAGE).with_suffix("").parts)
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    return found


MODULES = modules()


@cache
def imports(file: Path) -> set[str]:
    """Names of the package's modules that a file imports at run time; annotations do not count."""
    names = set()
    for node in ast.walk(_without_type_checking(ast.parse(file.read_text(encoding="utf-8")))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names |= {
                f"{node.module}.{alias.name}" if f"{node.module}.{alias.name}" in MODULES else node.module
                for alias in node.names
            }
        elif isinstance(node, ast.ImportFrom):
            raise AssertionError(f"{file}: relative import; write the full name")
    return {name for name in names if name.split(".")[0] == "planner"}


def _without_type_checking(tree: ast.Module) -> ast.Module:
    tree.body = [
        node
        for node in tree.body
        if not (isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING"))
    ]
    return tree


def layer(module: str) -> int:
    while module not in LAYERS:
        assert "." in module, f"{module} is in no layer: add it to LAYERS"
        module = module.rpartition(".")[0]
    return LAYERS.index(module)


def test_imports_go_to_earlier_layers() -> None:
    without = [module for module in MODULES if module != "planner" and layer(module) == 0]
    assert not without, "in no layer: add them to LAYERS"
    later = {
        (module, name)
        for module, file in MODULES.items()
        for name in imports(file)
        if module != "planner" and layer(name) > layer(module)
    }
    assert not later, "imports of later stages"


def test_the_verifier_is_independent() -> None:
    for module, file in MODULES.items():
        if module.startswith("planner.verify"):
            for name in imports(file):
                short = name.removeprefix("planner.")
                assert short in VERIFY_MAY_IMPORT or short.startswith("verify."), f"{module} imports {name}"


def test_nobody_who_plans_uses_the_verifier() -> None:
    """All imports count, those for annotations and inside functions too."""
    for module, file in MODULES.items():
        short = module.removeprefix("planner.")
        if short.split(".")[0] == "verify":
            continue
        names = VERDICT_RECORDS | (
            JUDGING if any(f"{short}.".startswith(f"{may}.") for may in MAY_JUDGE) else set()
        )
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                assert not any(alias.name.startswith("planner.verify") for alias in node.names), module
            elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("planner.verify"):
                assert node.module == "planner.verify", (
                    f"{module} imports {node.module}: only what the room says"
                )
                imported = {alias.name for alias in node.names}
                assert imported <= names, f"{module} imports {', '.join(sorted(imported - names))}"


def test_a_plan_knows_nothing_of_what_shows_it() -> None:
    """Neither by an import for annotations nor by a module's name."""
    for module in ("planner.job.plan", "planner.job.shown"):
        text = MODULES[module].read_text(encoding="utf-8")
        for later in ("planner.interactive", "planner.report"):
            assert later not in text, module


def test_kernels_are_made_where_the_cache_may_fail() -> None:
    for module, file in MODULES.items():
        if module == "planner.base.compiling":  # where kernels.py has them made
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
    "planner.interactive",
    "planner.control_files",
    "planner.nc.hpgl.plotter",
}


def test_a_plan_loads_only_what_it_uses(tmp_path: Path) -> None:
    """Each package costs all plans its import; SciPy's linear algebra 0.3 s, which numba loads in order to compile."""
    job = tmp_path / "corner.ngc"
    job.write_text("G21 G90 G64 P0.05 F3000\nG1 X10\nX20 Y5\nM2\n")
    planner.plan(job, "mill")  # its kernels are on the disk now
    in_python = f"import planner; planner.plan({str(job)!r}, 'mill')"
    loaded = _loaded(in_python)
    assert {"planner.optimal.loop", "numba"} <= loaded
    assert loaded & NOT_OF_A_PLAN == set()
    options = ["plan", str(job), "--quiet", "-o", str(tmp_path / "out")]
    loaded = _loaded(f"from planner.cli import app; app({options}, standalone_mode=False)")
    assert {"planner.optimal.loop", "numba"} | OF_THE_FILES <= loaded
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
