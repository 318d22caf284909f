"""Extra dimensions of points: which ones, and which values, LAS can store."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import laspy

Dimension = np.dtype | type | str | tuple[np.dtype | type | str, str]
"""Type of a dimension to add, or (type, description)."""
TYPES = tuple(np.dtype(t) for t in ("u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4", "f8"))
TEXT_BYTES = 32
"""Most bytes of a name, and of a description."""
OWN_MARK = "scenenet:"
"""Start of the description of dimensions that this package adds, so that it can replace them."""


def new_dimensions(names: Mapping[str, Dimension], *, own: bool) -> list[laspy.ExtraBytesParams]:
    """The dimensions ``names``; ``own`` marks them with ``OWN_MARK``. Long descriptions are cut.

    Raises:
        ValueError: LAS cannot store a dimension with this name or type.
    """
    import laspy

    taken = {"x", "y", "z"}
    taken.update(n.lower() for f in range(11) for n in laspy.PointFormat(f).dimension_names)
    made = []
    for name, given in names.items():
        kind, description = given if isinstance(given, tuple) else (given, "")
        dtype = np.dtype(kind)
        dtype = np.dtype(np.uint8) if dtype == np.bool_ else dtype.newbyteorder("<")
        if dtype not in TYPES:
            raise ValueError(f"an extra dimension cannot have the type {dtype}; use one of {TYPES}")
        if not 0 < len(name.encode()) <= TEXT_BYTES or name.lower() in taken:
            raise ValueError(
                f"{name!r} cannot be the name of an extra dimension: use 1 to {TEXT_BYTES} bytes, "
                "and "
                "no name of a standard LAS dimension"
            )
        text = f"{OWN_MARK} {description}" if own else description
        short = text.encode("ascii", errors="replace")[:TEXT_BYTES].decode()
        made.append(laspy.ExtraBytesParams(name, dtype, description=short))
    return made


def checked(
    arrays: Mapping[str, np.ndarray], dimensions: list[laspy.ExtraBytesParams], n: int
) -> dict[str, np.ndarray]:
    """The values of ``n`` points, converted to the types of their dimensions.

    Raises:
        ValueError: an array is missing, unexpected or of the wrong shape, or a value does not fit.
    """
    expected = sorted(dimension.name for dimension in dimensions)
    if sorted(arrays) != expected:
        raise ValueError(f"values for {sorted(arrays)}, but expected for {expected}")
    result = {}
    for dimension in dimensions:
        array, dtype = np.asarray(arrays[dimension.name]), dimension.type
        if array.shape != (n,):
            raise ValueError(f"{dimension.name} must have the shape ({n},), not {array.shape}")
        if dtype.kind in "iu":
            limits = np.iinfo(dtype)
            whole = array.dtype.kind in "iub"
            if not whole or (n and not limits.min <= array.min() <= array.max() <= limits.max):
                raise ValueError(f"{dimension.name} has values outside the range of {dtype}")
        result[dimension.name] = array.astype(dtype)
    return result
