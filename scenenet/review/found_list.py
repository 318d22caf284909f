"""A tower list that a prediction or a review wrote, and what the files beside it say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scenenet.core.errors import InputError
from scenenet.core.files import read_json
from scenenet.detection.survey_tower import CONTRIBUTION, row_types
from scenenet.line.notes import LineNote
from scenenet.prediction.line_lists import CONDUCTORS, NOTES, REJECTED
from scenenet.prediction.summary import SUMMARY
from scenenet.review.listed_conductor import ListedConductor
from scenenet.review.tables.layer import layers_of
from scenenet.review.tables.table import Row, Table, read_table

if TYPE_CHECKING:
    import pyproj

ENDING = ".towers.csv"
"""How the tower list of a prediction ends."""

REVIEWED = ".reviewed"
"""What follows the name of the survey in the name of a reviewed list."""

METRES = ("metre", "metre", "metre")


@dataclass(frozen=True)
class ListedTower:
    """A tower of a list.

    Attributes:
        id: its number.
        x, y: in the CRS and the units of the survey.
        values: column of the list -> its value; None where the list has none.
    """

    id: int
    x: float
    y: float
    values: Mapping[str, Any]


@dataclass(frozen=True)
class FoundList:
    """The towers that were found in a survey.

    Attributes:
        path: the file with the list.
        name: of the survey.
        columns: of the list -> type of its values: ``int``, ``float`` or ``str``.
        towers: in the order of the file.
        crs: of the survey; None if it is not known.
        unit_sizes, unit_names: sizes in m of the units of its x, y and z, and their names.
        coverage: the area with points, as shapely polygons in the units of the survey; None if it
            is not known.
        tau: of the model; None if it is not known.
        voxel_size: m, of the prediction; None if it is not known.
        classified: whether the prediction gave towers a class code.
        notes: places that the line between the towers says something of, in the units of the
            survey; none where no line was looked for.
        conductors: of the line, those last that the prediction left out because people had rejected
            them.
    """

    path: Path
    name: str
    columns: Mapping[str, type]
    towers: tuple[ListedTower, ...]
    crs: pyproj.CRS | None = None
    unit_sizes: tuple[float, float, float] = (1.0, 1.0, 1.0)
    unit_names: tuple[str, str, str] = METRES
    coverage: Any = None
    tau: float | None = None
    voxel_size: float | None = None
    classified: bool = False
    notes: tuple[LineNote, ...] = ()
    conductors: tuple[ListedConductor, ...] = ()

    @property
    def places(self) -> np.ndarray:
        """(N, 2) x and y of the towers, in the units of the survey."""
        return np.array([(tower.x, tower.y) for tower in self.towers]).reshape(-1, 2)

    @property
    def geneos(self) -> list[str]:
        """Names of the GENEOs with a contribution."""
        return [c.removeprefix(CONTRIBUTION) for c in self.columns if c.startswith(CONTRIBUTION)]

    @property
    def is_reviewed(self) -> bool:
        """Whether ``scenenet review`` wrote it."""
        return "decision" in self.columns


def find_list(given: str | Path) -> FoundList:
    """The tower list at a path.

    Args:
        given: the CSV file or the GeoPackage of a prediction or a review, or a folder with the
            results of one prediction. What the list itself does not have comes from the summary
            and the GeoPackage beside it, where they are.

    Raises:
        InputError: there is no tower list, there are several, or it cannot be read.
    """
    path = _list_in(Path(given))
    stem = path.name.removesuffix(path.suffix).removesuffix(".towers")
    name = stem.removesuffix(REVIEWED)
    table = read_table(path, "towers" if path.suffix.lower() == ".gpkg" else None)
    columns = _columns(table)
    towers = tuple(_tower(row, columns) for row in table.rows)
    _require_different(towers, table)
    package = path if path.suffix.lower() == ".gpkg" else path.with_name(f"{name}.gpkg")
    covered = package if "coverage" in _layers(package) else path.with_name(f"{name}.gpkg")
    coverage, crs = _coverage(covered)
    facts = _summary(path.with_name(name + SUMMARY))
    return FoundList(
        path, name, columns, towers, crs=table.crs or crs or _crs(facts.get("crs")),
        coverage=coverage, notes=_notes(covered),
        conductors=(*_conductors(covered, CONDUCTORS), *_conductors(covered, REJECTED)),
        **_of_summary(facts),
    )  # fmt: skip


def _list_in(given: Path) -> Path:
    """The file with the list that a user names."""
    remedy = f"Name the file NAME{ENDING} or NAME.gpkg of a prediction, or the folder with them"
    if not given.is_dir():
        if given.suffix.lower() not in (".csv", ".gpkg"):
            raise InputError("a tower list is a .csv or .gpkg file", file=given, remedy=remedy)
        return given
    found = sorted(given.glob(f"*{ENDING}"))
    if len(found) == 1:
        return found[0]
    if not found:
        raise InputError(f"there is no tower list (*{ENDING}) in it", file=given, remedy=remedy)
    names = ", ".join(path.name for path in found)
    raise InputError(
        f"it has {len(found)} tower lists ({names})",
        file=given,
        remedy=f"Name one of them, such as {found[0]}",
    )


def _columns(table: Table) -> dict[str, type]:
    """The columns of a list with the types of their values.

    Raises:
        InputError: it is not a tower list.
    """
    missing = [name for name in ("id", "x", "y") if name not in table.columns]
    if missing:
        raise table.error(
            f"this is not a tower list: it has no column {', '.join(missing)}",
            "Name the list that scenenet predict wrote",
        )
    geneos = [c.removeprefix(CONTRIBUTION) for c in table.columns if c.startswith(CONTRIBUTION)]
    known = row_types(geneos)
    return {column: known.get(column, str) for column in table.columns}


def _tower(row: Row, columns: Mapping[str, type]) -> ListedTower:
    """The tower in a row.

    Raises:
        InputError: a value is not a number, or there is no id or place.
    """
    values: dict[str, Any] = {}
    for name, kind in columns.items():
        values[name] = (
            row.whole_number(name) if kind is int
            else row.number(name) if kind is float
            else row.text(name)
        )  # fmt: skip
    for name in ("id", "x", "y"):
        if values[name] is None:
            raise row.error(f"it has no {name}", "Name an unchanged tower list")
    return ListedTower(values["id"], values["x"], values["y"], values)


def _require_different(towers: Sequence[ListedTower], table: Table) -> None:
    seen: set[int] = set()
    for tower, row in zip(towers, table.rows, strict=True):
        if tower.id in seen:
            raise row.error(f"the id {tower.id} occurs twice", "Name an unchanged tower list")
        seen.add(tower.id)


def _layers(package: Path) -> list[str]:
    try:
        return layers_of(package) if package.is_file() else []
    except InputError:
        return []


def _coverage(package: Path) -> tuple[Any, pyproj.CRS | None]:
    """The polygons of the layer ``coverage`` and their CRS; None for what is not known."""
    import pyogrio
    import pyproj
    import shapely

    if "coverage" not in _layers(package):
        return None, None
    facts, _, geometry, _ = pyogrio.raw.read(package, layer="coverage", columns=[])
    crs = None if facts["crs"] is None else pyproj.CRS(facts["crs"])
    # An empty layer has no polygon, and an empty survey covers nothing.
    return shapely.union_all(shapely.from_wkb(geometry)), crs


def _notes(package: Path) -> tuple[LineNote, ...]:
    """The rows of the layer with the places to look at along the line; none without a line."""
    import pyogrio

    if NOTES not in _layers(package):
        return ()
    facts, _, _, values = pyogrio.raw.read(package, layer=NOTES, read_geometry=False)
    rows = zip(*(column.tolist() for column in values), strict=True)
    return tuple(LineNote(**dict(zip(facts["fields"], row, strict=True))) for row in rows)


def _conductors(package: Path, layer: str) -> list[ListedConductor]:
    """The rows of a layer with conductors; none without one."""
    import pyogrio
    import shapely

    if layer not in _layers(package):
        return []
    facts, _, geometry, values = pyogrio.raw.read(package, layer=layer)
    found = []
    columns = [column.tolist() for column in values]
    for shape, *row in zip(shapely.from_wkb(geometry), *columns, strict=True):
        own = dict(zip(facts["fields"], row, strict=True))
        xyz = shapely.get_coordinates(shape, include_z=True)
        found.append(
            ListedConductor(own["span_id"], own["conductor_id"], xyz, own, layer == REJECTED)
        )
    return found


def _summary(path: Path) -> Mapping[str, Any]:
    """What the summary of the prediction says; nothing if there is none."""
    try:
        facts = read_json(path)
    except (OSError, ValueError):
        return {}
    return facts if isinstance(facts, dict) else {}


def _of_summary(facts: Mapping[str, Any]) -> dict[str, Any]:
    """The attributes of ``FoundList`` that a summary has."""
    named = {"unit_sizes": "unit_sizes_m", "unit_names": "units"}
    found: dict[str, Any] = {n: tuple(facts[key]) for n, key in named.items() if key in facts}
    found |= {"tau": facts.get("tau"), "voxel_size": facts.get("voxel_size_m")}
    return found | {"classified": bool(facts.get("settings", {}).get("classify"))}


def _crs(text: str | None) -> pyproj.CRS | None:
    import pyproj

    try:
        return None if text is None else pyproj.CRS(text)
    except pyproj.exceptions.CRSError:
        return None
