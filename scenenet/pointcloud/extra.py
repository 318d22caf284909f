"""Extra dimensions of LAS points: how the bytes beyond the point format are described.

The description is a record (user ``LASF_Spec``, number 4) of 192 bytes for each dimension: LAS 1.4
R15, section 2.7 and Table 24.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from scenenet.pointcloud.header import LasHeader

USER, RECORD_ID = "LASF_Spec", 4
ENTRY = 192
NAME_BYTES = DESCRIPTION_BYTES = 32
TYPES = tuple(np.dtype(t) for t in ("u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4", "f8"))
"""Types of LAS data type 1-10; 11-20 are pairs and 21-30 triples of them, 0 is plain bytes."""
OWN_MARK = "scenenet: "
"""Begins the description of dimensions that this package adds, so that it may replace its own."""
STANDARD_NAMES = frozenset({
    "x", "y", "z", "intensity", "bit_fields", "raw_classification", "return_number",
    "number_of_returns", "scan_direction_flag", "edge_of_flight_line", "classification",
    "classification_flags", "synthetic", "key_point", "withheld", "overlap", "scanner_channel",
    "scan_angle", "scan_angle_rank", "user_data", "point_source_id", "gps_time", "red", "green",
    "blue", "nir", "wavepacket_index", "wavepacket_offset", "wavepacket_size",
    "return_point_wave_location", "x_t", "y_t", "z_t",
})  # fmt: skip


@dataclass(frozen=True)
class ExtraDimension:
    """One extra dimension.

    Attributes:
        name: its name.
        description: up to 32 bytes of text.
        size: bytes in a point record.
        entry: the 192 bytes that describe it in the file.
    """

    name: str
    description: str
    size: int
    entry: bytes

    @property
    def is_own(self) -> bool:
        return self.description.startswith(OWN_MARK.strip())


def extra_dimensions(header: LasHeader) -> tuple[ExtraDimension, ...]:
    """The extra dimensions of a file; their sizes add up to the extra bytes of its points.

    Bytes that no entry describes become a dimension of plain bytes called ``ExtraBytes``. Where
    the entries describe more bytes than the points have, they are not believed.
    """
    described: list[ExtraDimension] = []
    for vlr in header.vlrs:
        if (vlr.user_id, vlr.record_id) == (USER, RECORD_ID):
            data = vlr.data
            for at in range(0, len(data) - ENTRY + 1, ENTRY):
                described.append(_parse(data[at : at + ENTRY]))
    left = header.n_extra_bytes - sum(d.size for d in described)
    if left < 0 or any(d.size == 0 for d in described):
        described, left = [], header.n_extra_bytes
    while left:  # an entry can describe 255 plain bytes
        size = min(left, 255)
        taken = {d.name for d in described}
        name = next(n for n in _numbered("ExtraBytes") if n not in taken)
        described.append(_plain_bytes(name, size))
        left -= size
    return tuple(described)


def extra_names(header: LasHeader) -> tuple[str, ...]:
    return tuple(d.name for d in extra_dimensions(header))


def new_dimension(name: str, dtype: np.dtype, description: str, *, own: bool) -> ExtraDimension:
    """The entry of a dimension that is to be added; with ``own``, one that may be replaced later.

    Raises:
        ValueError: the name, or the type, is not one that LAS can hold. Descriptions are cut.
    """
    dtype = np.dtype(dtype)
    if dtype not in TYPES:
        raise ValueError(f"an extra dimension cannot hold {dtype}: take one of {TYPES}")
    raw = name.encode()
    if not raw or len(raw) > NAME_BYTES or name.lower() in STANDARD_NAMES:
        raise ValueError(
            f"{name!r} cannot name an extra dimension: 1 to {NAME_BYTES} bytes, and none of the "
            "names that LAS gives its own dimensions"
        )
    text = (OWN_MARK if own else "") + description
    told = text.encode("ascii", errors="replace")[:DESCRIPTION_BYTES]
    entry = struct.pack("<2xBB32s4x120x32s", TYPES.index(dtype) + 1, 0, raw, told)
    return ExtraDimension(name, told.decode("ascii"), dtype.itemsize, entry)


def _numbered(name: str):
    yield name
    number = 2
    while True:
        yield f"{name}{number}"
        number += 1


def _plain_bytes(name: str, size: int) -> ExtraDimension:
    entry = struct.pack("<2xBB32s4x120x32s", 0, size, name.encode(), b"Un-registered ExtraBytes")
    return ExtraDimension(name, "Un-registered ExtraBytes", size, entry)


def _parse(entry: bytes) -> ExtraDimension:
    data_type, options = entry[2], entry[3]
    if data_type == 0:
        size = options
    elif data_type <= 30:
        size = TYPES[(data_type - 1) % 10].itemsize * ((data_type - 1) // 10 + 1)
    else:
        size = 0
    return ExtraDimension(_text(entry[4:36]), _text(entry[160:192]), size, entry)


def _text(raw: bytes) -> str:
    return raw.split(b"\0", 1)[0].decode("latin-1")
