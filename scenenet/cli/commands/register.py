"""``scenenet register``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from scenenet.cli.options import AsJson, FoundTowers, Overwrite, coordinate_system
from scenenet.cli.output import show

EXAMPLES = (
    "scenenet register found/ --assets register.csv",
    "scenenet register found/line.gpkg --assets assets.gpkg --layer poles --out compared",
    "scenenet register found/ --assets register.csv --x LON --y LAT --crs EPSG:4326 --json",
)

SHOWN = 20
"""Entries that are printed for people; the files have all."""


def command(
    found: FoundTowers,
    assets: Annotated[
        Path, typer.Option("--assets", help="Register: a CSV file, GeoPackage or Shapefile.")
    ],
    within: Annotated[
        float, typer.Option(min=0.1, help="Largest distance of an asset and its tower, m.")
    ] = 10.0,
    moved: Annotated[
        float,
        typer.Option(min=0.0, help="Tolerance, m: a tower further from its place has moved."),
    ] = 2.0,
    x: Annotated[str | None, typer.Option("--x", help="Column with x or the longitude.")] = None,
    y: Annotated[str | None, typer.Option("--y", help="Column with y or the latitude.")] = None,
    id: Annotated[str | None, typer.Option("--id", help="Column with the ids of assets.")] = None,
    layer: Annotated[str | None, typer.Option(help="Layer of a GeoPackage.")] = None,
    crs: Annotated[
        str | None,
        typer.Option(
            "--crs",
            metavar="SYSTEM",
            help="Coordinate system of a register that states none: EPSG:CODE, or a file with WKT "
            "(.prj).  [default: EPSG:4326 for columns lon and lat, else that of the survey]",
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", help="Folder for the results.")] = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Compare an asset register with the towers that were found.

    Each asset gets at most one tower, and each tower at most one asset. An asset is matched, moved
    (its tower is further away than --moved), missing (no tower within --within), outside (missing,
    and the survey has no points there) or without place (no coordinates). A tower that no asset has
    is new.

    With --out, NAME.register.csv has a row for each asset and each new tower, NAME.register.gpkg
    the layers assets, new and moves, and NAME.register.json what --json prints.

    Differences are a result: they do not change the exit code.
    """
    import sys

    from scenenet.core.outputs import check_outputs
    from scenenet.review.found_list import find_list
    from scenenet.review.register.assets import read_assets
    from scenenet.review.register.compare import compare
    from scenenet.review.register.files import register_files, write_comparison

    if moved > within:
        raise typer.BadParameter(f"must not be above --within, {within:g}", param_hint="--moved")
    if (x is None) != (y is None):
        raise typer.BadParameter("give --x and --y, or neither", param_hint="--x")
    towers = find_list(found)
    files = None if out is None else register_files(towers, out)
    if files is not None:
        check_outputs(files.outputs(), [assets, towers.path], overwrite=overwrite)
    system = coordinate_system(crs)
    listed = read_assets(assets, towers.crs, x=x, y=y, id=id, crs=system, layer=layer)
    comparison = compare(towers, listed, within, moved)
    if not comparison.coverage_known:
        print(
            f"warning: {towers.path}: the coverage of the survey is not known "
            f"({towers.name}.gpkg is not beside it): assets outside it count as missing",
            file=sys.stderr,
        )
    if files is not None:
        write_comparison(comparison, towers, files)
    unwritten = ["nothing was written; name a folder with --out"] if files is None else []
    show(comparison.to_json(), as_json, lambda result: [*_lines(result), *unwritten])


def _lines(result: dict[str, Any]) -> list[str]:
    """The counts, and the entries that differ."""
    counts = result["counts"]
    lines = [
        f"{counts['assets']} assets, {counts['towers']} towers: {counts['matched']} matched, "
        f"{counts['moved']} moved more than {result['moved_m']:g} m, {counts['missing']} missing, "
        f"{counts['new']} new, {counts['outside']} outside the survey, "
        f"{counts['without_place']} without coordinates"
    ]
    if (shift := result["shift_m"]) is not None:
        lines.append(
            f"towers lie {_signed(shift[0])} m east and {_signed(shift[1])} m north of their "
            "places in the register, in the median"
        )
    differing = [entry for entry in result["entries"] if entry["status"] != "matched"]
    lines += [_entry(entry) for entry in differing[:SHOWN]]
    if len(differing) > SHOWN:
        lines.append(f"and {len(differing) - SHOWN} more: --out writes all, --json prints them")
    return lines


def _signed(metres: float) -> str:
    """A way in cm, without the sign of a zero."""
    return f"{round(metres, 2) + 0.0:+.2f}"


def _entry(entry: dict[str, Any]) -> str:
    names = [f"{what} {entry[what]}" for what in ("asset", "tower") if entry[what] is not None]
    line = f"{entry['status']}: {', '.join(names)}"
    place = [entry["tower_x"], entry["tower_y"]]
    if place[0] is None:
        place = [entry["asset_x"], entry["asset_y"]]
    if place[0] is not None:
        line += f" at {place[0]:.2f}, {place[1]:.2f}"
    if entry["distance_m"] is not None:
        line += (
            f", {entry['distance_m']:.2f} m from its place ({_signed(entry['east_m'])} m "
            f"east, {_signed(entry['north_m'])} m north)"
        )
    return line
