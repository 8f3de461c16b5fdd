"""Installation compiles the numerical kernels, so that the first plan finds them (planner/commands/ahead.py).

Everything else about the package is in pyproject.toml. A wheel with kernels is one of a platform and a version of Python. Kernels are
known by what they compute, so that one that does not fit what is installed is not used, but compiled anew. PLANNER_COMPILE_AHEAD=0
builds a package without kernels, as is built where they cannot be compiled ahead: elsewhere than on Linux, and without numba.
"""

import compileall
import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

from setuptools import Distribution, setup
from setuptools.command.build_py import build_py

ROOT = Path(__file__).resolve().parent
KERNELS = "planner/kernels"  # in the installation; planner/base/kernel_files.py reads them there
AHEAD = (
    os.environ.get("PLANNER_COMPILE_AHEAD", "1") != "0"
    and sys.platform.startswith("linux")
    and importlib.util.find_spec("numba") is not None
)


class BuildWithKernels(build_py):
    """Python files, and kernels."""

    def run(self) -> None:
        super().run()
        if not AHEAD:
            return
        self.announce("compiling kernels", level=2)
        path = os.pathsep.join([str(ROOT), *sys.path])
        env = {**os.environ, "PYTHONPATH": path}
        command = [sys.executable, "-P", "-m", "planner.commands.ahead"]
        beside = None
        if (os.cpu_count() or 1) > 1:
            quiet = subprocess.DEVNULL
            beside = subprocess.Popen([*command, "corners"], env=env, stdout=quiet, stderr=quiet)
        try:
            done = subprocess.run(command, env=env, stdout=subprocess.PIPE, text=True, check=False)
        finally:
            if beside is not None:
                beside.terminate()
                beside.wait()
        if done.returncode:
            self.warn("kernels are not compiled ahead, see above; the first plan compiles them")
        elif (
            self.editable_mode
        ):  # kernels stay beside the sources, and so does bytecode, which pip makes of what it installs
            compileall.compile_dir(ROOT / "planner", quiet=2)
        else:
            folder = Path(self.build_lib) / KERNELS
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir(parents=True)
            for file in done.stdout.split("\n"):
                if file:
                    shutil.copy2(file, folder)


class PackageWithKernels(Distribution):
    """Of a platform, where it holds kernels."""

    def has_ext_modules(self) -> bool:
        return AHEAD


setup(cmdclass={"build_py": BuildWithKernels}, distclass=PackageWithKernels)
