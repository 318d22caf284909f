"""tanh and ReLU in one step, which turn the response of the observer into a probability (thesis
4.3)."""

from __future__ import annotations

import math

import numpy as np
from numba.core import types
from numba.extending import overload

_HIGHEST = np.float32(10.0)
"""From this value on tanh is 1 in float32."""
_STEPS_PER_UNIT = np.float32(2 / math.log(2))
_LN2_HIGH = np.float32(0.693359375)
_LN2_LOW = np.float32(math.log(2) - 0.693359375)
_TAYLOR = tuple(np.float32(1 / math.factorial(n)) for n in range(1, 8))


def activate(response):
    """(tanh(response))_+ of one float32 or float64; NaN stays NaN.

    Only compiled code can call it. In float32 the error is at most two units in the last place. The
    float32 version only uses additions, multiplications and one division, so that a loop over it
    runs in vector registers: tanh x = (e^2x - 1) / (e^2x + 1), and e^2x = 2^n e^r with a short
    series for e^r - 1.
    """
    raise NotImplementedError("activate runs in compiled code only")


@overload(activate, inline="always")
def _activate(response):
    if response == types.float64:

        def activate_double(response):
            return 0.0 if response <= 0.0 else math.tanh(response)

        return activate_double

    c1, c2, c3, c4, c5, c6, c7 = _TAYLOR
    half, zero, two = np.float32(0.5), np.float32(0.0), np.float32(2.0)

    def activate_single(response):
        x = _HIGHEST if response > _HIGHEST else response
        x = zero if x < zero else x
        n = np.int32(x * _STEPS_PER_UNIT + half)
        whole = np.float32(n)
        r = (two * x - whole * _LN2_HIGH) - whole * _LN2_LOW
        series = r * (c1 + r * (c2 + r * (c3 + r * (c4 + r * (c5 + r * (c6 + r * c7))))))
        # 2^n, from its bits.
        power = np.int32((n + np.int32(127)) << np.int32(23)).view(np.float32)
        exponential_less_one = power * series + (power - np.float32(1.0))
        return exponential_less_one / (exponential_less_one + two)

    return activate_single
