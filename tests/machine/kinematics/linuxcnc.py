"""LinuxCNC's own kinematics, its compiled components as they are installed, called outside its real-time system."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from pathlib import Path

import numpy as np

from planner.base.arrays import FloatArray

MODULES = Path("/usr/lib/linuxcnc/modules")
# What the component wants from its host: pins are variables here, set by their names.
HOST = r"""
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
static char names[64][64]; static double *pins[64]; static int count;
int hal_init(const char *n) { return 1; }
int hal_exit(int i) { return 0; }
int hal_ready(int i) { return 0; }
void *hal_malloc(long size) { return calloc(1, size); }
int hal_pin_bit_new(const char *n, int d, void **p, int c) { *p = calloc(1, 8); return 0; }
int hal_pin_s32_new(const char *n, int d, void **p, int c) { *p = calloc(1, 8); return 0; }
int hal_pin_float_newf(int d, double **p, int c, const char *f, ...) {
    va_list a; va_start(a, f); vsnprintf(names[count], 64, f, a); va_end(a);
    *p = pins[count++] = calloc(1, 8); return 0; }
void rtapi_print(const char *f, ...) {}
void rtapi_print_msg(int l, const char *f, ...) {}
int set_pin(const char *ending, double value) {
    for (int i = 0; i < count; i++)
        if (strlen(names[i]) >= strlen(ending) && !strcmp(names[i] + strlen(names[i]) - strlen(ending), ending)) {
            *pins[i] = value; return 0; }
    return -1; }
"""


def missing(name: str) -> str:
    """Why the component cannot be called here; empty if it can."""
    if not (MODULES / f"{name}.so").exists():
        return f"LinuxCNC's {name}.so is not installed (package linuxcnc-uspace)"
    return "" if shutil.which("gcc") else "no C compiler for the host of LinuxCNC's component"


class Component:
    """One component, loaded once in a process of this host; its tables are static, so that each needs a copy of its own."""

    def __init__(self, name: str, folder: Path, pins: dict[str, float]):
        source, host = folder / "host.c", folder / "host.so"
        source.write_text(HOST)
        subprocess.run(["gcc", "-w", "-shared", "-fPIC", str(source), "-o", str(host)], check=True)
        copy = folder / f"{name}.so"
        shutil.copy(MODULES / f"{name}.so", copy)
        self._host = ctypes.CDLL(str(host), mode=ctypes.RTLD_GLOBAL)
        self._library = ctypes.CDLL(str(copy))
        assert self._library.rtapi_app_main() >= 0
        for key, value in pins.items():
            assert self._host.set_pin(key.encode(), ctypes.c_double(value)) == 0, key

    def joints(self, pose: FloatArray) -> FloatArray:
        """(5,) joints of a pose x y z a b c (6,) in mm and degrees, in the order of the component."""
        world, found = (ctypes.c_double * 9)(*pose), (ctypes.c_double * 16)()
        flags = (ctypes.c_ulong(), ctypes.c_ulong())
        assert self._library.kinematicsInverse(world, found, *(ctypes.byref(f) for f in flags)) == 0
        return np.array(found[:5])
