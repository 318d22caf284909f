"""The files that a tile index names: VPC, STAC item collection or GeoPackage.

A virtual point cloud (``.vpc``, of PDAL and QGIS) is a STAC item collection: JSON with an item for
each tile, whose asset is the file. In a ``.vpz`` it is in a ZIP archive. A GeoPackage has a row for
each tile, and the file in a column, as ``pdal tindex`` writes it.
"""

from __future__ import annotations

import json
import re
import zipfile
import zlib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import unquote

from scenenet.core.errors import InputError
from scenenet.core.files import read_json
from scenenet.core.gdal import load_pyogrio

SUFFIXES = frozenset({".las", ".laz"})
"""Endings of the files that belong to a survey of tiles; COPC files end in ``.copc.laz``."""
ARCHIVE_SUFFIX, MEMBER_SUFFIX = ".vpz", ".vpc"
ITEM_SUFFIXES = frozenset({MEMBER_SUFFIX, ".json", ".geojson"})
INDEX_SUFFIXES = ITEM_SUFFIXES | {ARCHIVE_SUFFIX, ".gpkg"}
"""Endings of tile indexes."""
COLUMNS = ("location", "path", "filename")
"""Columns of a GeoPackage that can have the files; ``pdal tindex`` writes the first one."""
REMOTE = re.compile(r"/vsi|(?!file:)[a-z][a-z0-9+.-]+:/", re.IGNORECASE)
"""Start of a place that is not a local file: a URL, or a virtual file of GDAL. One letter before
the colon is a drive."""
NAMED = 5
"""Most entries that a message names one by one."""
LARGEST_MEMBER = 1 << 28
"""Most bytes of the index in an archive; a tile takes about 2000."""
LONGEST_NAME, LONGEST = 200, 2000
"""Most bytes of the name of a file or folder, and of a path. File systems allow 255 and 4096, and
results have a longer ending."""


@dataclass(frozen=True)
class TileIndex:
    """The files of a tile index.

    Attributes:
        files: the files, each once, in the order of the index; whether they exist is not looked at.
        refused: entries that are not local files, under their names, with the reason.
        notes: what looks wrong about the index, as sentences.
    """

    files: tuple[Path, ...]
    refused: Mapping[Path, InputError]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _Entry:
    """An entry of an index: its place in it, for messages, and the file that it names."""

    place: str
    href: str | None


def read_index(path: Path) -> TileIndex:
    """The files that a tile index names.

    Paths are relative to the index. A GeoPackage may also have paths from the working directory, as
    ``pdal tindex`` writes what its command line named; they count where the first do not exist.

    Raises:
        InputError: the file is not a tile index, names no file, or is one page of several.
    """
    table = path.suffix.lower() == ".gpkg"
    entries = list(_rows(path) if table else _items(path))
    if not entries:
        raise InputError("the tile index names no file", file=path, remedy="Write it again")
    files: dict[Path, Path] = {}
    refused: dict[Path, InputError] = {}
    again: Counter[Path] = Counter()
    for entry in entries:
        if problem := _problem(entry.href):
            refused[Path(entry.place)] = InputError(
                problem, file=path, place=entry.place, remedy="Correct or remove the entry"
            )
            continue
        tile = _local(path, entry.href or "", from_here=table)
        if tile.resolve() in files:
            again[files[tile.resolve()]] += 1
        else:
            files[tile.resolve()] = tile
    return TileIndex(tuple(files.values()), refused, tuple(_repeated(again)))


def _items(path: Path) -> Iterator[_Entry]:
    """The items of a STAC item collection, or the only one of a STAC item."""
    try:
        data = _in_archive(path) if path.suffix.lower() == ARCHIVE_SUFFIX else read_json(path)
    except OSError as error:
        raise InputError(error.strerror or "cannot be read", file=path) from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"the tile index is not JSON ({error})", file=path) from None
    items = data.get("features", [data]) if isinstance(data, dict) else None
    if not isinstance(items, list) or not any(_assets(item) for item in items):
        kind = data.get("type") if isinstance(data, dict) else None
        raise InputError(
            "this is not a tile index: no item in it has assets"
            + (f" (its type is {kind!r})" if kind else ""),
            file=path,
            remedy="Give a virtual point cloud (.vpc) or a STAC item collection, with its items in "
            "this file",
        )
    links = data["links"] if isinstance(data.get("links"), list) else []
    if any(isinstance(link, dict) and link.get("rel") == "next" for link in links):
        raise InputError(
            "the item collection continues in another file (a link with rel next)",
            file=path,
            remedy="Write all its items into one file",
        )
    for number, item in enumerate(items, start=1):
        name = item.get("id") if isinstance(item, dict) else None
        known = isinstance(name, str) and name.isprintable() and "/" not in name
        place = f"item {number}" + (f" ({name})" if known else "")
        yield _Entry(place, _point_file(item))


def _in_archive(path: Path) -> Any:
    """The virtual point cloud in a ZIP archive.

    Raises:
        InputError: it is no archive, is damaged, or has no virtual point cloud, or several.
    """
    remedy = "Write it again, or unpack it and give the .vpc"
    try:
        with zipfile.ZipFile(path) as archive:
            names = [n for n in archive.namelist() if n.lower().endswith(MEMBER_SUFFIX)]
            if len(names) != 1:
                problem = f"the archive has {len(names)} virtual point clouds (.vpc), not one"
                raise InputError(problem, file=path, remedy=remedy)
            with archive.open(names[0]) as stream:
                content = stream.read(LARGEST_MEMBER + 1)
    except (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError) as error:
        problem = f"the archive cannot be read ({error or type(error).__name__})"
        raise InputError(problem, file=path, remedy=remedy) from None
    if len(content) > LARGEST_MEMBER:
        raise InputError("the tile index in the archive is too large", file=path, remedy=remedy)
    return json.loads(content)


def _assets(item: Any) -> dict[str, dict[str, Any]]:
    """The assets of an item that name a file."""
    assets = item.get("assets") if isinstance(item, dict) else None
    if not isinstance(assets, dict):
        return {}
    return {
        key: asset
        for key, asset in assets.items()
        if isinstance(asset, dict) and isinstance(asset.get("href"), str)
    }


def _point_file(item: Any) -> str | None:
    """The href of the points of an item; None if it has none. Its data come before other files, and
    overviews repeat some of their points."""
    main: list[str] = []
    other: list[str] = []
    for key, asset in _assets(item).items():
        roles = asset["roles"] if isinstance(asset.get("roles"), list) else []
        if "overview" in roles:
            continue
        (main if key == "data" or "data" in roles else other).append(asset["href"])
    points = [href for href in (*main, *other) if _suffix(href) in SUFFIXES]
    return next(iter([*points, *main]), None)


def _rows(path: Path) -> Iterator[_Entry]:
    """The rows of the first layer of a GeoPackage that has a column with files."""
    gdal = load_pyogrio()
    try:
        for layer in gdal.list_layers(path)[:, 0]:
            fields = gdal.read_info(path, layer=layer)["fields"]
            known = {name.lower(): name for name in fields}
            column = next((known[name] for name in COLUMNS if name in known), None)
            if column is None:
                continue
            read = gdal.raw.read(path, layer=layer, columns=[column], read_geometry=False)
            for number, value in enumerate(read[3][0], start=1):
                href = value if isinstance(value, str) and value.strip() else None
                yield _Entry(f"layer {layer}: row {number}", href)
            return
    except RuntimeError as error:
        raise InputError(f"the tile index cannot be read ({error})", file=path) from None
    raise InputError(
        "this is not a tile index: no layer has a column "
        f"{', '.join(COLUMNS[:-1])} or {COLUMNS[-1]}",
        file=path,
        remedy="Write it with pdal tindex create, or name the column location",
    )


def _problem(href: str | None) -> str:
    """Why an entry is not a local LAS or LAZ file; empty if it is one."""
    if not href:
        return "the entry names no file"
    shown = (href if href.isprintable() else ascii(href))[:LONGEST_NAME]
    if REMOTE.match(href):
        return f"{shown} is not on this machine; download it first"
    if _suffix(href) not in SUFFIXES:
        return f"{shown} is not a LAS or LAZ file"
    sizes = [len(part.encode("utf-8", "replace")) for part in Path(href).parts]
    if not href.isprintable() or max(sizes) > LONGEST_NAME or sum(sizes) > LONGEST:
        return f"{shown} cannot be the name of a file"
    return ""


def _suffix(href: str) -> str:
    """The ending of the path of a URL or file, in small letters."""
    path = re.split("[?#]", href)[0] if REMOTE.match(href) else href
    return PurePosixPath(path).suffix.lower()


def _local(index: Path, href: str, *, from_here: bool) -> Path:
    """The file that an entry names, which may not exist."""
    text = re.sub("^file:(//[^/]*)?", "", href, flags=re.IGNORECASE)
    plain = index.parent / text
    choices = [plain, index.parent / unquote(text)]  # an href may have %20 for a space
    if from_here:
        choices.append(Path(text))
    return next((choice for choice in choices if choice.exists()), plain)


def _repeated(again: Mapping[Path, int]) -> Iterable[str]:
    if again:
        names = ", ".join(path.name for path in list(again)[:NAMED])
        more = f" and {len(again) - NAMED} more" if len(again) > NAMED else ""
        yield (
            f"files that are listed more than once are read once: {names}{more}; repeated entries "
            f"left out: {sum(again.values())}"
        )
