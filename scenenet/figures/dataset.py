"""Figures of the data: towers, surveys, grids (thesis 5.1).

Every function that draws writes one PNG and returns (alternative text, caption).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from scenenet.core.errors import InputError
from scenenet.figures.selection import (
    POINTS_PER_PICTURE,
    champion_of,
    crop_cloud,
    ranked,
    thinned,
    voxel_classes,
)
from scenenet.results.folder import Results
from scenenet.results.result_files import read_result

GRID_RESOLUTIONS = (32, 64, 128)


def draw_clusters(
    results: Results, survey: str, path: str, codes: str, out: Path
) -> tuple[str, str]:
    from scenenet.dataset.labelled_towers import TowerSettings, cluster
    from scenenet.figures.plots.point_clouds import clusters
    from scenenet.pointcloud import iter_chunks

    settings = TowerSettings.model_validate(_tower_settings(results, survey))
    parts = [chunk.xyz[chunk.is_tower] for chunk in iter_chunks(path, codes)]
    xyz = np.concatenate([*parts, np.empty((0, 3))])
    labels = cluster(xyz, settings).tower
    keep = thinned(len(xyz))
    alt = clusters(xyz[keep, :2], labels[keep], out)
    return alt, (
        f"Points labelled tower in {survey} from above, with a number for each DBSCAN cluster (eps "
        f"{settings.eps:g} m, at least {settings.min_points} points); crosses belong to no "
        f"cluster. The line is rotated to the horizontal axis; the axes have different scales. "
        f"Compare thesis Figure 5.2."
    )


def draw_labels(survey: str, path: str, codes: str, out: Path) -> tuple[str, str]:
    """A whole survey coloured by its labels (thesis Figure 5.1)."""
    from scenenet.figures.plots.point_clouds import labelled_survey
    from scenenet.pointcloud import iter_chunks, survey_info

    step = max(1, -(-survey_info(path).n_points // POINTS_PER_PICTURE))
    places, names = [np.empty((0, 3))], [np.empty(0, "U10")]
    start = 0
    for chunk in iter_chunks(path, codes):
        groups = chunk.roles
        keep = np.isin(groups, ("tower", "conductor"))
        # Every n-th of the other points, counted over the whole survey and not per chunk.
        keep[(-start) % step :: step] = True
        start += len(groups)
        places.append(chunk.xyz[keep])
        names.append(groups[keep])
    xyz, found = np.concatenate(places), np.concatenate(names)
    kept = thinned(len(xyz), 3 * POINTS_PER_PICTURE)
    return labelled_survey(xyz[kept], found[kept], out), (
        f"{survey} from above and from the side, along its main direction, coloured by its labels. "
        "Points are thinned, those of towers and conductors less than the others. Compare thesis "
        "Figure 5.1."
    )


def draw_surveys(results: Results, out: Path) -> tuple[str, str]:
    """The crop with the median number of points of each synthetic survey, three of recorded
    ones."""
    from scenenet.dataset.zarr_store import StoreReader
    from scenenet.figures.plots.surveys import compare_crops
    from scenenet.pointcloud import class_scheme

    shown = {}
    for survey in results.surveys:
        reader = StoreReader(results.folder / "crops" / survey / "manifest.json")
        ordered = sorted(reader.manifest["crops"], key=lambda entry: (entry["points"], entry["id"]))
        made = (results.folder / "synthetic" / f"{survey}.provenance.json").exists()
        ranks = (0.5,) if made else (0.17, 0.5, 0.83)
        chosen = {int(rank * len(ordered)): None for rank in ranks if ordered}
        for entry in (ordered[place] for place in chosen):
            arrays = reader.get(entry["id"])
            keep = thinned(len(arrays["xyz"]))
            codes = arrays["classification"][keep]
            kinds = class_scheme(reader.manifest["codes"]).looks(codes)
            title = f"{entry['id']}\n({'synthetic' if made else 'recorded'})"
            shown[title] = (arrays["xyz"][keep], kinds)
    if not shown:
        raise InputError("no survey has a crop to show", file=results.folder)
    return compare_crops(shown, out), (
        "Crops from the side and from above, all at the same scale: for a synthetic survey the "
        "crop with the median number of points, for a recorded survey three crops. Points are "
        "coloured by their label. Compare thesis Figure 5.3."
    )


def draw_grids(results: Results, reference: str, out: Path) -> tuple[str, str]:
    from scenenet.dataset.voxels import VoxelGrid, voxelise
    from scenenet.figures.plots.point_clouds import voxel_grids

    sample = ranked(champion_of(results, reference), "best")
    cloud = crop_cloud(results, sample.id)
    groups = cloud.roles
    grids = {}
    for resolution in GRID_RESOLUTIONS:
        voxels = voxelise(cloud, VoxelGrid.cube(cloud.xyz, resolution))
        zyx = np.stack(np.unravel_index(voxels.index, voxels.grid.shape), axis=1)
        names = voxel_classes(groups, voxels.grid.voxel_of(cloud.xyz), voxels.index)
        grids[f"{resolution}³, voxels of {voxels.grid.voxel_size:.2f} m"] = (zyx, names)
    return voxel_grids(grids, out), (
        f"Occupied voxels of crop {sample.id} at three resolutions, coloured by their "
        "content: a voxel is drawn as tower if it contains any tower point, else as conductor, "
        "vegetation, ground or other. Compare thesis Figure 5.4."
    )


def _tower_settings(results: Results, survey: str) -> Mapping[str, Any]:
    """The settings with which the towers of a survey were found; empty without a record."""
    path = results.folder / "towers" / survey / "provenance.json"
    if not path.exists():
        return {}
    from scenenet.dataset.labelled_towers import TowerSettings

    recorded = read_result(path).get("settings", {})
    return {name: recorded[name] for name in TowerSettings.model_fields if name in recorded}
