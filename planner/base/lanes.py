"""Numbers side by side for kernels: a value of `WIDTH` float64 that one instruction of the processor works on.

A kernel that is written for numbers works on lanes as well, in arrays of them (views.py). What it may not do is branch on a
comparison of lanes: that gives a mask, by which `where` chooses and which `anywhere` looks into.
"""

# mypy: ignore-errors

import operator
from typing import Any, ClassVar

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typeconv import Conversion
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import (
    intrinsic,
    lower_builtin,
    lower_cast,
    models,
    register_model,
)


def intrinsic_of(function: Any) -> Any:
    """numba's `intrinsic`, for type checkers that do not look inside."""
    return intrinsic(function)


WIDTH = 4  # float64 in a register of AVX2


class _Lanes(types.Type):
    """Of so many numbers."""

    def __init__(self):
        super().__init__(name="lanes")

    def unify(self, typingctx, other):
        return self if isinstance(other, types.Number) else None

    def can_convert_from(self, typingctx, other):
        return Conversion.safe if isinstance(other, types.Number) else None


class _Mask(types.Type):
    """Of so many truth values."""

    def __init__(self):
        super().__init__(name="mask")


lanes, mask = _Lanes(), _Mask()
DOUBLES, _BITS = ir.VectorType(ir.DoubleType(), WIDTH), ir.VectorType(ir.IntType(1), WIDTH)


@register_model(_Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, dmm, fe_type):
        super().__init__(dmm, fe_type, DOUBLES)


@register_model(_Mask)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, dmm, fe_type):
        super().__init__(dmm, fe_type, _BITS)


def _spread(builder, value):
    """One number in all lanes."""
    one = builder.insert_element(ir.Constant(DOUBLES, ir.Undefined), value, ir.IntType(32)(0))
    same = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(one, ir.Constant(DOUBLES, ir.Undefined), same)


@lower_cast(types.Number, _Lanes)
def _cast(context, builder, fromty, toty, value):
    return _spread(builder, context.cast(builder, value, fromty, types.float64))


def _binary(operation, result, instruction):
    """Let kernels use an operation on two lanes, or on two masks."""
    of = mask if operation in (operator.and_, operator.or_) else lanes

    @infer_global(operation)
    class _Template(ConcreteTemplate):
        cases: ClassVar = [signature(result, of, of)]

    @lower_builtin(operation, of, of)
    def _lower(context, builder, sig, args):
        return instruction(builder, *args)


for _name, _instruction in (
    ("add", ir.IRBuilder.fadd),
    ("sub", ir.IRBuilder.fsub),
    ("mul", ir.IRBuilder.fmul),
    ("truediv", ir.IRBuilder.fdiv),
):
    _binary(getattr(operator, _name), lanes, _instruction)
    _binary(getattr(operator, f"i{_name}"), lanes, _instruction)
for _operation, _sign in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
    (operator.eq, "=="),
):
    _binary(_operation, mask, lambda builder, a, b, sign=_sign: builder.fcmp_ordered(sign, a, b))
_binary(operator.and_, mask, ir.IRBuilder.and_)
_binary(operator.or_, mask, ir.IRBuilder.or_)


@infer_global(operator.neg)
class _Negative(ConcreteTemplate):
    cases: ClassVar = [signature(lanes, lanes)]


@lower_builtin(operator.neg, lanes)
def _negative(context, builder, sig, args):
    return builder.fneg(args[0])


def _of(*given):
    """The type that a function of these has: lanes as soon as one of them is."""
    return lanes if lanes in given else types.float64


@intrinsic_of
def where(typingctx, condition, a, b):
    """a where the condition holds, else b."""
    of = lanes if condition == mask else _of(a, b)
    return of(condition, of, of), lambda context, builder, sig, args: builder.select(*args)


@intrinsic_of
def larger(typingctx, a, b):
    """The larger one of a and b; b where one is no number."""
    of = _of(a, b)
    return of(of, of), lambda context, builder, sig, args: builder.select(
        builder.fcmp_ordered(">", *args), *args
    )


@intrinsic_of
def smaller(typingctx, a, b):
    """The smaller one of a and b; b where one is no number."""
    of = _of(a, b)
    return of(of, of), lambda context, builder, sig, args: builder.select(
        builder.fcmp_ordered("<", *args), *args
    )


def _function(name):
    """One of LLVM's functions of one number."""

    def lower(context, builder, sig, args):
        of = args[0].type
        suffix = "f64" if of == ir.DoubleType() else f"v{WIDTH}f64"
        function = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(of, [of]), f"llvm.{name}.{suffix}"
        )
        return builder.call(function, args)

    return lower


@intrinsic_of
def root(typingctx, a):
    """The square root."""
    return _of(a)(_of(a)), _function("sqrt")


@intrinsic_of
def whole(typingctx, a):
    """The largest whole number that is not above a."""
    return _of(a)(_of(a)), _function("floor")


@intrinsic_of
def magnitude(typingctx, a):
    """The absolute value."""
    return _of(a)(_of(a)), _function("fabs")


@intrinsic_of
def anywhere(typingctx, condition):
    """Whether it holds in any lane."""

    def lower(context, builder, sig, args):
        if condition == types.boolean:
            return args[0]
        whole = builder.bitcast(args[0], ir.IntType(WIDTH))
        return builder.icmp_unsigned("!=", whole, whole.type(0))

    return types.boolean(condition), lower


@intrinsic_of
def pick(typingctx, value, lane):
    """The number in one lane."""

    def lower(context, builder, sig, args):
        return builder.extract_element(*args) if value == lanes else args[0]

    return types.float64(value, types.intp), lower


@intrinsic_of
def put(typingctx, value, lane, number):
    """The value with another number in one lane."""

    def lower(context, builder, sig, args):
        return builder.insert_element(args[0], args[2], args[1]) if value == lanes else args[2]

    return value(value, types.intp, types.float64), lower
