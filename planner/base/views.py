"""Arrays for kernels that work on lanes (lanes.py) or, as their reference, on single numbers.

With `wide1` to `wide3` an array (.., WIDTH) of float64 becomes a view (..) of lanes, an array (.., 1) one of numbers. `vector`
and `matrix` are pieces of memory on the stack of the function that asks for them. All sizes that shall be numbers in the
machine code, so that loops are unrolled, are lengths of tuples (`size`).
"""

# mypy: ignore-errors

import operator

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin, models, register_model

from planner.base.lanes import intrinsic_of, lanes

_BYTES = 8  # to which lanes are aligned in memory: numpy promises no more


class View(types.Type):
    """An array in memory that lives long enough, which nobody counts the uses of: where it begins, and the sizes of its
    dimensions behind the first that are no numbers in the machine code.

    inner : of those dimensions the sizes, None where it is not known when it is compiled
    """

    def __init__(self, dtype, inner, outer=None):
        self.dtype, self.inner, self.outer = dtype, inner, outer
        super().__init__(name=f"view({dtype}, {inner}, {outer})")


@register_model(View)
class _ViewModel(models.StructModel):
    def __init__(self, dmm, fe_type):
        unknown = [(f"size{d}", types.intp) for d, n in enumerate(fe_type.inner) if n is None]
        super().__init__(dmm, fe_type, [("data", types.CPointer(fe_type.dtype)), *unknown])


def _is_index(index):
    return isinstance(index, types.Integer) or (
        isinstance(index, types.BaseTuple) and all(isinstance(one, types.Integer) for one in index)
    )


def _indexed(view, index):
    """The type of what is at an index."""
    count = 1 if isinstance(index, types.Integer) else len(index)
    if count > len(view.inner):
        return view.dtype
    return View(view.dtype, view.inner[count:], view.inner[count - 1])


@infer_global(operator.getitem)
class _ViewGet(AbstractTemplate):
    def generic(self, args, kws):
        view, index = args
        if isinstance(view, View) and _is_index(index):
            return signature(_indexed(view, index), view, index)
        return None


@infer_global(operator.setitem)
class _ViewSet(AbstractTemplate):
    def generic(self, args, kws):
        view, index, _ = args
        if isinstance(view, View) and _is_index(index):
            return signature(types.none, view, index, view.dtype)
        return None


def _place(context, builder, view, value, index_type, index):
    """Where an index is, and the sizes behind the first dimension."""
    given = cgutils.create_struct_proxy(view)(context, builder, value)
    sizes = [
        getattr(given, f"size{d}") if n is None else context.get_constant(types.intp, n)
        for d, n in enumerate(view.inner)
    ]
    one = isinstance(index_type, types.Integer)
    at = [index] if one else cgutils.unpack_tuple(builder, index, len(index_type))
    of = [index_type] if one else list(index_type)
    at = [context.cast(builder, value, kind, types.intp) for value, kind in zip(at, of, strict=True)]
    offset = at[0]
    for d, extent in enumerate(sizes):
        offset = builder.mul(offset, extent)
        if d + 1 < len(at):
            offset = builder.add(offset, at[d + 1])
    return builder.gep(given.data, [offset]), sizes


@lower_builtin(operator.getitem, View, types.Any)
def _get(context, builder, sig, args):
    view, index = sig.args
    place, sizes = _place(context, builder, view, args[0], index, args[1])
    made = sig.return_type
    if not isinstance(made, View):
        return builder.load(place, align=_BYTES)
    out = cgutils.create_struct_proxy(made)(context, builder)
    out.data = place
    rest = sizes[len(sizes) - len(made.inner) :]
    for d, n in enumerate(made.inner):
        if n is None:
            setattr(out, f"size{d}", rest[d])
    return out._getvalue()


@lower_builtin(operator.setitem, View, types.Any, types.Any)
def _set(context, builder, sig, args):
    view, index, _ = sig.args
    builder.store(args[2], _place(context, builder, view, args[0], index, args[1])[0], align=_BYTES)


@intrinsic_of
def clear(typingctx, view):
    """Make everything 0 in a view whose sizes are all known."""
    number = view.outer
    for n in view.inner:
        number *= n

    def lower(context, builder, sig, args):
        data = cgutils.create_struct_proxy(view)(context, builder, args[0]).data
        nothing = context.get_data_type(view.dtype)(None)
        with cgutils.for_range(builder, context.get_constant(types.intp, number)) as loop:
            builder.store(nothing, builder.gep(data, [loop.index]), align=_BYTES)
        return context.get_dummy_value()

    return types.none(view), lower


def _viewed(dtype, given):
    """Type and code of a view of an array, whose sizes behind the first are lengths of tuples, or numbers."""
    counts = tuple(one.count if isinstance(one, types.UniTuple) else None for one in given)
    made = View(dtype, counts)

    def lower(context, builder, sig, args):
        array = context.make_array(sig.args[0])(context, builder, args[0])
        out = cgutils.create_struct_proxy(made)(context, builder)
        out.data = builder.bitcast(array.data, out.data.type)
        for d, n in enumerate(counts):
            if n is None:
                setattr(out, f"size{d}", context.cast(builder, args[2 + d], given[d], types.intp))
        return out._getvalue()

    return made, lower


@intrinsic_of
def wide1(typingctx, array, width):
    """An array (N, WIDTH) as a view (N,) of lanes, or (N, 1) of numbers: the length of the tuple `width`. The array has to
    live as long."""
    made, lower = _viewed(types.float64 if width.count == 1 else lanes, [])
    return made(array, width), lower


@intrinsic_of
def wide2(typingctx, array, width, n):
    """`wide1` of (N, n, WIDTH); n the length of a tuple, or a number."""
    made, lower = _viewed(types.float64 if width.count == 1 else lanes, [n])
    return made(array, width, n), lower


@intrinsic_of
def wide3(typingctx, array, width, n, m):
    """`wide2` of (N, n, m, WIDTH)."""
    made, lower = _viewed(types.float64 if width.count == 1 else lanes, [n, m])
    return made(array, width, n, m), lower


def _on_stack(dtype, sizes):
    """Type and code of a view of memory on the stack, as large as the lengths of the tuples are."""
    counts = [one.count for one in sizes]
    made = View(dtype, tuple(counts[1:]), counts[0])

    def lower(context, builder, sig, args):
        number = 1
        for count in counts:
            number *= count
        with builder.goto_entry_block():
            data = builder.alloca(ir.ArrayType(context.get_data_type(dtype), number))
            data.align = 32
        out = cgutils.create_struct_proxy(made)(context, builder)
        out.data = builder.bitcast(data, out.data.type)
        return out._getvalue()

    return made, lower


@intrinsic_of
def vector(typingctx, like, n):
    """A view (n,) of memory on the stack for what the view `like` is of, with anything in it; n the length of a tuple."""
    made, lower = _on_stack(like.dtype, [n])
    return made(like, n), lower


@intrinsic_of
def matrix(typingctx, like, n, m):
    """`vector` (n, m)."""
    made, lower = _on_stack(like.dtype, [n, m])
    return made(like, n, m), lower


def size(n):
    """A number that kernels know as they are compiled."""
    return (0,) * n
