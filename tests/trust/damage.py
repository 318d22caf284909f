"""Damage to a file: bytes, counts and structure, the same for the same seed and number."""

from __future__ import annotations

import io
import json
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

Damage = Callable[[bytes, np.random.Generator], tuple[bytes, str]]
"""Takes intact bytes; returns damaged ones and what was done to them."""

WHOLE = (0, 1, -1, 2, 255, 65535, 2**31 - 1, 2**31, 2**32 - 1, 2**40, 2**62)
REAL = (0.0, -0.0, 1.0, -1.0, 1e-300, 1e9, 1e300, float("nan"), float("inf"), -float("inf"))
JSON_VALUES: tuple[Any, ...] = (
    None, True, 0, 1, -1, 2, 3, 64, 1000, 10**9, 10**400, 0.5, -0.5, 1e-300, 1e300, float("nan"),
    float("inf"), "", "x", "\0", "../../x", "9" * 400, "cylinder", [], [1], [0, 0, 0], [9, 9, 9],
    [500, 500, 800], [[]], {}, {"kernel": "cylinder"},
)  # fmt: skip

LAS_FIELDS = (
    *((at, "<B") for at in (6, 24, 25, 104)),
    *((at, "<H") for at in (94, 105)),
    *((at, "<I") for at in (96, 100, 107, 111, 115, 243)),
    *((at, "<Q") for at in (227, 235, 247, 255, 263)),
    *((at, "<d") for at in range(131, 227, 8)),
)
"""Position and type of the numbers in the public header block (LAS 1.4 R15, section 2.4)."""


def damaged(kind: str, contents: list[bytes], seed: int, number: int) -> tuple[bytes, str]:
    """The damaged file of a number, and what was done to it."""
    rng = np.random.default_rng([seed, number, zlib.crc32(kind.encode())])
    content = contents[number % len(contents)]
    ways = DAMAGES[kind]
    data, what = ways[int(rng.integers(len(ways)))](content, rng)
    if rng.random() < 0.15:  # twice
        data, more = _ANY[int(rng.integers(len(_ANY)))](data, rng)
        what = f"{what}, {more}"
    return data, what


# Any file


def _at(rng: np.random.Generator, size: int) -> int:
    """A place in a file, half of the time near its start, where the structure is."""
    limit = min(size, 1024) if rng.random() < 0.5 else size
    return int(rng.integers(max(limit, 1)))


def _flip(data: bytes, rng: np.random.Generator) -> tuple[bytes, str]:
    changed = bytearray(data)
    places = [_at(rng, len(data)) for _ in range(int(rng.integers(1, 9)))]
    for at in places:
        if changed:
            changed[at] ^= int(rng.integers(1, 256))
    return bytes(changed), f"bytes {places} changed"


def _cut(data: bytes, rng: np.random.Generator) -> tuple[bytes, str]:
    size = _at(rng, len(data))
    return data[:size], f"cut to {size} bytes"


def _insert(data: bytes, rng: np.random.Generator) -> tuple[bytes, str]:
    at, n = _at(rng, len(data)), int(rng.integers(1, 65))
    return data[:at] + rng.bytes(n) + data[at:], f"{n} bytes inserted at {at}"


def _remove(data: bytes, rng: np.random.Generator) -> tuple[bytes, str]:
    at, n = _at(rng, len(data)), int(rng.integers(1, 65))
    return data[:at] + data[at + n :], f"{n} bytes removed at {at}"


def _fill(data: bytes, rng: np.random.Generator) -> tuple[bytes, str]:
    at, n = _at(rng, len(data)), int(rng.integers(1, 257))
    byte = (b"\0", b"\xff")[int(rng.integers(2))]
    n = min(n, len(data) - at)
    return data[:at] + byte * n + data[at + n :], f"{n} bytes at {at} set to {byte!r}"


def _copy(data: bytes, rng: np.random.Generator) -> tuple[bytes, str]:
    source, at, n = _at(rng, len(data)), _at(rng, len(data)), int(rng.integers(1, 257))
    block = data[source : source + n]
    return data[:at] + block + data[at + len(block) :], f"{n} bytes copied from {source} to {at}"


_ANY: tuple[Damage, ...] = (_flip, _cut, _insert, _remove, _fill, _copy)


# Numbers of a binary header


def _pick(values, rng: np.random.Generator) -> Any:
    return values[int(rng.integers(len(values)))]


def _put(data: bytes, at: int, code: str, rng: np.random.Generator) -> tuple[bytes, str]:
    """Replace a number by an extreme one, or one near it."""
    if at + struct.calcsize(code) > len(data):
        return _flip(data, rng)
    (before,) = struct.unpack_from(code, data, at)
    if code == "<d":
        value = _pick((*REAL, before * 1000, -before, before + 1), rng)
    else:
        near = (before + 1, before - 1, before // 2, before * 2)
        value = int(_pick((*WHOLE, *near), rng)) % 256 ** struct.calcsize(code)
    changed = bytearray(data)
    struct.pack_into(code, changed, at, value)
    return bytes(changed), f"number at byte {at} ({code}) changed from {before} to {value}"


def _las_number(data: bytes, rng: np.random.Generator) -> tuple[bytes, str]:
    return _put(data, *_pick(LAS_FIELDS, rng), rng)


def _record_number(data: bytes, rng: np.random.Generator) -> tuple[bytes, str]:
    """A number in the records before the points: extra dimensions, compression, octree, CRS."""
    start, end = struct.unpack_from("<HI", data, 94)
    return _put(data, int(rng.integers(start, max(end, start + 1))), _pick(_CODES, rng), rng)


def _chunk_number(data: bytes, rng: np.random.Generator) -> tuple[bytes, str]:
    """The position of the chunk table, a number in it, or one of the octree at the end."""
    (offset,) = struct.unpack_from("<I", data, 96)
    (chunk_table,) = struct.unpack_from("<q", data, offset)
    at = offset if rng.random() < 0.3 else int(rng.integers(chunk_table, len(data)))
    return _put(data, at, _pick(_CODES, rng), rng)


_CODES = ("<B", "<H", "<I", "<Q")


# Text headers


def _npy_header(data: bytes, rng: np.random.Generator) -> tuple[bytes, str]:
    changes = (
        ("'<f8'", ("'|O'", "'<c16'", "'<U8'", "'<i8'", "'>f8'", "'<f2'", "'|V8'", "'<M8[s]'", "8")),
        ("False", ("True", "None", "1")),
        ("4)", ("3)", "5)", "0)", "-4)", "4, 1)", f"{2**62})", "4", ")", "1e9)")),
        ("(", ("(-", "(0", f"({2**40}", f"({2**64}", "((", "()", "")),
        ("shape", ("Shape", "descr", "")),
        ("{", ("[", "__import__('os').abort() or {")),
    )
    (size,) = struct.unpack_from("<H", data, 8)
    head, body = data[10 : 10 + size].decode("latin-1"), data[10 + size :]
    old, choices = _pick(changes, rng)
    new = _pick(choices, rng)
    text = head.replace(old, new, 1)
    if rng.random() < 0.7:
        text = text.rstrip().ljust(size - 1)[: size - 1] + "\n"
    packed = struct.pack("<H", len(text) % 65536)
    return data[:8] + packed + text.encode("latin-1") + body, f"{old!r} is {new!r} in the header"


def _zip_member(data: bytes, rng: np.random.Generator) -> tuple[bytes, str]:
    """Damage inside a member of a zip archive, whose checksums are then right again."""
    source = zipfile.ZipFile(io.BytesIO(data))
    names = source.namelist()
    weights = np.array([6.0 if name.endswith("data.pkl") else 1.0 for name in names])
    chosen = str(rng.choice(names, p=weights / weights.sum()))
    made = io.BytesIO()
    what = ""
    with zipfile.ZipFile(made, "w") as archive:
        for name in names:
            content = source.read(name)
            if name == chosen:
                content, what = _ANY[int(rng.integers(len(_ANY)))](content, rng)
                if rng.random() < 0.1:
                    continue
            archive.writestr(name, content)
    return made.getvalue(), f"{chosen.split('/', 1)[-1]}: {what}"


def _json_values(data: bytes, rng: np.random.Generator) -> tuple[bytes, str]:
    value = json.loads(data)
    what = change_json(value, rng)
    return json.dumps(value).encode(), what


def _safetensors_head(data: bytes, rng: np.random.Generator) -> tuple[bytes, str]:
    """A value of the header of the tensors, or of the model card inside it."""
    (size,) = struct.unpack_from("<Q", data, 0)
    head, body = json.loads(data[8 : 8 + size]), data[8 + size :]
    if rng.random() < 0.6:
        card = json.loads(head["__metadata__"]["model"])
        what = "card: " + change_json(card, rng)
        head["__metadata__"]["model"] = json.dumps(card)
    else:
        what = change_json(head, rng)
    text = json.dumps(head).encode()
    text += b" " * (-len(text) % 8)
    return struct.pack("<Q", len(text)) + text + body, what


def change_json(root: Any, rng: np.random.Generator) -> str:
    """Replace, remove or rename one value of a JSON document; says which."""
    path, holder, key = _pick(list(_places(root)), rng)
    roll = rng.random()
    if roll < 0.1:
        del holder[key]
        return f"{path} removed"
    if roll < 0.2 and isinstance(holder, dict):
        holder[f"{key}x"] = holder.pop(key)
        return f"{path} renamed"
    if roll < 0.3 and isinstance(holder, list):
        holder.insert(key, holder[key])
        return f"{path} doubled"
    value = _pick(JSON_VALUES, rng)
    if roll < 0.6 and isinstance(holder[key], int | float):
        value = holder[key] * _pick((-1, 1000, 1e-6, 1e6), rng)
    holder[key] = value
    return f"{path} is {str(value)[:40]!r}"


def _places(value: Any, path: str = "") -> Iterator[tuple[str, Any, Any]]:
    items = value.items() if isinstance(value, dict) else enumerate(value)
    for key, inside in items:
        yield f"{path}/{key}", value, key
        if isinstance(inside, dict | list):
            yield from _places(inside, f"{path}/{key}")


_LAS: tuple[Damage, ...] = (*_ANY, *[_las_number] * 4, *[_record_number] * 2)
DAMAGES: dict[str, tuple[Damage, ...]] = {
    "las": _LAS,
    "laz": (*_LAS, *[_chunk_number] * 2),
    "copc": (*_LAS, *[_chunk_number] * 3),
    "npy": (*_ANY, *[_npy_header] * 4),
    "pt": (*_ANY, *[_zip_member] * 10),
    "json": (*_ANY, *[_json_values] * 10),
    "safetensors": (*_ANY, *[_safetensors_head] * 10),
}
"""Format -> ways to damage it, each as likely as another."""
