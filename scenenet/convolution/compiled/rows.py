"""A multiply-add over a row of neighbouring numbers, as one vector instruction."""

from __future__ import annotations

import numba
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from scenenet.core.compilation import COMPILED

LANES = 16
"""Numbers in a row: 64 bytes of float32, one AVX-512 register, two of AVX2 or four of SSE."""


@intrinsic
def add_row(typing_context, into, i, row, j, factor):
    """into[i : i + LANES] += factor * row[j : j + LANES], for 1D arrays of one float type.

    The bounds are not checked, and ``into`` and ``row`` must not overlap. A compiler would turn a
    plain loop into the same instructions with a test for overlap, which takes longer than they do.
    """
    signature = types.void(into, types.intp, row, types.intp, row.dtype)

    def generate(context, builder, signature, arguments):
        into_type, _, row_type, _, _ = signature.args
        number = context.get_data_type(row_type.dtype)
        vector = ir.VectorType(number, LANES)
        bytes_each = context.get_abi_sizeof(number)

        def place(array_type, array, offset):
            data = cgutils.create_struct_proxy(array_type)(context, builder, array).data
            return builder.bitcast(builder.gep(data, [offset]), vector.as_pointer())

        target = place(into_type, arguments[0], arguments[1])
        before = builder.load(target, align=bytes_each)
        added = builder.load(place(row_type, arguments[2], arguments[3]), align=bytes_each)
        nothing = ir.Constant(vector, ir.Undefined)
        first = builder.insert_element(nothing, arguments[4], ir.Constant(ir.IntType(32), 0))
        spread = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
        factors = builder.shuffle_vector(first, nothing, spread)
        # "contract" allows a fused multiply-add where the machine has one.
        product = builder.fmul(factors, added, flags=("contract",))
        after = builder.fadd(product, before, flags=("contract",))
        builder.store(after, target, align=bytes_each)
        return context.get_dummy_value()

    return signature, generate


@numba.njit(**COMPILED)
def add_rows(into, i, i_step, row, j, j_step, n_rows, lanes, factor):  # pragma: no cover - compiled
    """``add_row`` on ``n_rows`` rows of ``lanes`` numbers, ``i_step`` and ``j_step`` apart."""
    if lanes == LANES:  # the usual case, with one loop less
        for _ in range(n_rows):
            add_row(into, i, row, j, factor)  # type: ignore[call-arg]
            i += i_step
            j += j_step
        return
    for _ in range(n_rows):
        for lane in range(0, lanes, LANES):
            add_row(into, i + lane, row, j + lane, factor)  # type: ignore[call-arg]
        i += i_step
        j += j_step
