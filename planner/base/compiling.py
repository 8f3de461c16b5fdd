"""numba compiles the planner's kernels in about half the time: the same code for the processor, without work that nobody needs.

A kernel that Python calls (a root) contains all the kernels that it calls, optimised once as a whole. As it comes, numba also
optimises each of these by itself, turns each into machine code, and makes an entry for Python and one for C, none of which is used. So

  processor   code is made for a level of the architecture (processor.py): `_Generator`
  libraries   what is compiled inside a root stays a library of instructions that the root links: `_Inner`; only the root is optimised
              as a whole and turned into machine code, with everything in it
  entries     kernels inside a root have no entry for Python: `ENTRIES`; nor have functions of numba's own: `_of_roots`
  values      they are not compiled once more for every number that an argument is in some call: `_without_values`
  typing      numba asks all of its definitions of an operator again at every place; here each question is asked once: `_call_type`
  settings    of which numba compares and hashes 20 values, many times for each expression: `_same_settings`, `_hash_of_settings`
  garbage     is not collected meanwhile

Numbers are in docs/speed.md. The replacements work while a root is compiled, and numba is as it was afterwards. They reach into
numba, and are used with the versions only that they are tested with (kernels.py).
"""

from __future__ import annotations

import functools
import gc
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numba
from numba.core import codegen, compiler, registry, targetconfig, types
from numba.core.types import functions

from planner.base.kept import Kept
from planner.base.processor import processor

ENTRIES = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
WRAPPERS = ("create_cpython_wrapper", "create_cfunc_wrapper")

_environments: dict[str, Any] = {}  # of what is compiled inside roots, until a root has their place
_by_function: weakref.WeakKeyDictionary[Any, dict[Any, Any]] = weakref.WeakKeyDictionary()


def root(function: Callable[..., Any], settings: dict[str, Any]) -> Any:
    """The kernel of a function, with these settings of `numba.njit`."""
    made = numba.njit(pipeline_class=_RootCompiler, **{"no_cfunc_wrapper": True, **settings})(function)
    made._compiler = _Compiler(made._compiler)
    made.inside_others = inside = numba.njit(**{**settings, **ENTRIES})(function)
    inside.get_call_template = functools.partial(_without_values, inside.get_call_template)
    return made


def _without_values(numba_s: Callable[..., Any], args: Any, kws: Any) -> Any:
    """How a kernel is called with arguments of these types: f(x, 0) as f(x, n)."""
    return numba_s(
        [types.unliteral(of) for of in args], {name: types.unliteral(of) for name, of in kws.items()}
    )


def type_inside(kernel: Any) -> Any:
    """numba's type of a kernel that another one calls."""
    return types.Dispatcher(kernel.dispatcher.inside_others)


def compiled(dispatcher: Any, args: tuple[Any, ...]) -> Any:
    """numba's result of compiling for arguments of the types of these. Raises numba's errors."""
    signature = tuple(dispatcher.typeof_pyval(value) for value in args)
    dispatcher.compile(signature)
    return dispatcher.overloads[signature]


def to_keep(made: Any) -> Kept:
    """What of numba's result is kept."""
    environments = [made.environment, *made._find_referenced_environments()]
    return Kept(
        made.fndesc.llvm_cpython_wrapper_name,
        [(of.env_name, of.globals.get("__name__", ""), list(of.consts)) for of in environments],
        made.library._get_compiled_object(),
    )


class _Inner(codegen.JITCodeLibrary):
    """What is compiled inside a root: instructions to be linked. Each function by itself is simplified, as numba does it, and that is
    all: without that, roots are no faster to compile and up to twice as slow to run."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        self._ensure_finalized()
        return 0

    @property
    def codegen(self) -> Any:
        return _LaterEnvironment(self._codegen)


class _LaterEnvironment:
    """numba's code generator for a library without machine code: the place of the Python objects that it uses, such as the text of an
    exception, is in the root's."""

    def __init__(self, numba_s: Any):
        self._numba_s = numba_s

    def set_env(self, name: str, env: Any) -> None:
        _environments[name] = env

    def __getattr__(self, name: str) -> Any:
        return getattr(self._numba_s, name)


class _Generator(codegen.JITCPUCodegen):
    """numba's code generator, for the processor of processor.py."""

    _library_class = _Inner

    def _get_host_cpu_name(self) -> str:
        return processor().name

    def _get_host_cpu_features(self) -> str:
        return processor().features


@functools.cache
def _generator() -> _Generator:
    """The one of this process."""
    return _Generator("planner")


class _RootCompiler(compiler.Compiler):
    """Gives a root a library with machine code, as numba does it."""

    def define_pipelines(self) -> Any:
        state = self.state
        state.library = codegen.JITCodeLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return super().define_pipelines()


class _Compiler:
    """numba's compiler of one kernel, at work with the replacements. numba holds its lock meanwhile."""

    def __init__(self, numba_s: Any):
        self._numba_s = numba_s

    def compile(self, args: Any, return_type: Any) -> Any:
        with _replaced():
            made = self._numba_s.compile(args, return_type)
        generator = _generator()
        for name in [name for name in _environments if generator._engine.is_symbol_defined(name)]:
            generator.set_env(name, _environments.pop(name))
        return made

    def __getattr__(self, name: str) -> Any:
        return getattr(self._numba_s, name)


@contextmanager
def _replaced() -> Iterator[None]:
    settings, context = targetconfig.TargetConfig, registry.cpu_target.target_context
    replacements: list[tuple[Any, str, Any]] = [
        (context, "_internal_codegen", _generator()),
        *((type(context), name, _of_roots(getattr(type(context), name))) for name in WRAPPERS),
        (functions.BaseFunction, "get_call_type", _call_type),
        (settings, "__eq__", _same_settings),
        (settings, "__hash__", _hash_of_settings),
    ]
    before = [(owner, name, getattr(owner, name)) for owner, name, _ in replacements]
    collecting = gc.isenabled()
    gc.disable()
    try:
        for owner, name, value in replacements:
            setattr(owner, name, value)
        yield
    finally:
        for owner, name, value in before:
            setattr(owner, name, value)
        if collecting:
            gc.enable()


def _of_roots(numba_s: Callable[..., None]) -> Callable[..., None]:
    """numba's function that adds an entry to a library, for libraries of roots only."""

    def add(context: Any, library: Any, *args: Any, **kws: Any) -> None:
        if not isinstance(library, _Inner):
            numba_s(context, library, *args, **kws)

    return add


_numba_s_call_type = functions.BaseFunction.get_call_type


@functools.wraps(_numba_s_call_type)
def _call_type(self: Any, context: Any, args: Any, kws: Any) -> Any:
    """The signature of a function of numba's own for arguments of these types. It also depends on the compiler's settings."""
    known = _by_function.setdefault(self, {})
    asked = context, tuple(args), tuple(kws.items()), targetconfig.ConfigStack.top_or_none()
    found = known.get(asked)
    if found is None:
        found = _numba_s_call_type(self, context, args, kws)
        if all(of_argument.is_precise() for of_argument in args):
            known[asked] = found
    return found


_numba_s_same_settings = targetconfig.TargetConfig.__eq__


def _same_settings(self: Any, other: Any) -> Any:
    if type(self) is not type(other):
        return _numba_s_same_settings(self, other)
    a, b = self._values, other._values  # those that are set
    return self is other or all(
        a.get(name, option.default) == b.get(name, option.default)
        for name, option in self.options.items()
        if name in a or name in b
    )


def _hash_of_settings(self: Any) -> int:
    return hash(type(self))
