"""The kind of a point-cloud file, from its first bytes and its suffix."""

from __future__ import annotations

import difflib
from pathlib import Path

from scenenet.core.errors import InputError

SUFFIXES = {".las": "las", ".laz": "las", ".npy": "npy", ".pt": "pt"}
"""Suffix -> reader. COPC files end in ``.copc.laz``; the header, not the suffix, says whether LAS
points are compressed."""
LFS_START = b"version https://git-lfs"
READABLE = "Give a LAS, LAZ or COPC file (.las, .laz), or a TS40K sample (.npy, .pt)"
OTHER_KINDS = {
    b"PK\x03\x04": "a zip archive",
    b"\x1f\x8b": "gzip-compressed",
    b"7z\xbc\xaf": "a 7z archive",
    b"ply": "a PLY file",
    b"ASTM-E57": "an E57 file",
    b"# .PCD": "a PCD file",
    b"<!DOCTYPE": "a web page, perhaps of a failed download",
    b"<html": "a web page, perhaps of a failed download",
}


def kind_of(path: str | Path) -> str:
    """``las`` (LAZ and COPC too), ``npy`` or ``pt``.

    Raises:
        InputError: the file is missing, empty or of another kind, or its content and suffix
            disagree.
    """
    path = Path(path)
    _check_there(path)
    try:
        with path.open("rb") as stream:
            start = stream.read(32)
    except OSError as error:
        raise InputError(
            f"the file cannot be read ({error.strerror})",
            file=path,
            remedy="Check its permissions and the disk it is on",
        ) from error
    if not start:
        raise InputError(
            "the file is empty (0 bytes)", file=path, remedy="Get it again from its source"
        )
    if start.startswith(LFS_START):
        raise InputError(
            "this is a git-LFS pointer, not the file itself",
            file=path,
            remedy="Download the file: git lfs pull",
        )
    by_name = SUFFIXES.get(path.suffix.lower())
    by_content = _content_kind(start)
    if by_name is None:
        though = f", though its content is {by_content}" if by_content in ("las", "npy") else ""
        raise InputError(
            f"the suffix {path.suffix!r} does not belong to a point cloud{though}",
            file=path,
            remedy=READABLE,
        )
    if by_name == "pt" and by_content in (None, "zip"):
        return "pt"  # torch writes a zip archive; older versions wrote a file without a signature
    if by_content != by_name:
        raise InputError(
            f"the suffix is {path.suffix}, but the content is {_describe(start, by_content)}",
            file=path,
            remedy=f"Rename the file, or get it again. {READABLE}",
        )
    return by_name


def _check_there(path: Path) -> None:
    if path.is_file():
        return
    if path.is_dir():
        raise InputError("this is a folder, not a file", file=path, remedy=READABLE)
    remedy = "Check the path"
    if not path.parent.is_dir():
        remedy = f"The folder {path.parent} does not exist either: check the path"
    else:
        # By the stem: names with the same ending are alike by that alone.
        stems: dict[str, list[str]] = {}
        for entry in sorted(path.parent.iterdir()):
            if entry.is_file():
                stems.setdefault(entry.stem, []).append(entry.name)
        near = [
            name
            for stem in difflib.get_close_matches(path.stem, stems, n=3)
            for name in stems[stem]
        ]
        if near:
            remedy = f"Did you mean {' or '.join(near[:3])} in the same folder?"
    raise InputError("there is no such file", file=path, remedy=remedy)


def _content_kind(start: bytes) -> str | None:
    if start.startswith(b"LASF"):
        return "las"
    if start.startswith(b"\x93NUMPY"):
        return "npy"
    return "zip" if start.startswith(b"PK\x03\x04") else None


def _describe(start: bytes, kind: str | None) -> str:
    if kind in ("las", "npy"):
        return {"las": "LAS", "npy": "a numpy array"}[kind]
    for mark, name in OTHER_KINDS.items():
        if start.startswith(mark):
            return name
    return f"neither LAS nor a numpy array (it starts with {start[:8]!r})"
