"""From result files to each picture, and what is said below it.

Every function writes one PNG and returns (alternative text, caption). Crops are chosen by rule
(best, median, worst), never by hand.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scenenet.errors import InputError
from scenenet.published import Thesis
from scenenet.results import Results, SeedResult, parameter_columns, read_result, read_table

if TYPE_CHECKING:
    from scenenet.figures.scenes import View
    from scenenet.pointcloud import PointCloud
    from scenenet.store import StoreReader
    from scenenet.studies.settings import StudySettings

POINTS_PER_PICTURE = 60_000
"""Enough to look dense at the size the pictures have."""

GRID_RESOLUTIONS = (32, 64, 128)


def draw_clusters(
    results: Results, survey: str, path: str, codes: str, out: Path
) -> tuple[str, str]:
    from scenenet.figures.scenes import clusters
    from scenenet.pointcloud import iter_chunks
    from scenenet.towers import TowerSettings, cluster

    settings = TowerSettings.model_validate(_tower_settings(results, survey))
    parts = [chunk.xyz[chunk.is_tower] for chunk in iter_chunks(path, codes)]
    xyz = np.concatenate([*parts, np.empty((0, 3))])
    labels = cluster(xyz, settings)
    keep = _thin(len(xyz))
    alt = clusters(xyz[keep, :2], labels[keep], out)
    return alt, (
        f"Points labelled tower in {survey} from above, each DBSCAN cluster (eps {settings.eps:g} "
        f"m, at least {settings.min_points} points) with a number of its own; crosses belong to "
        "none. The line is turned to lie flat, and the axes differ in scale. As thesis Figure 5.2."
    )


def draw_study(
    results: Results, study: StudySettings, thesis: Thesis | None, out: Path
) -> tuple[str, str]:
    from scenenet.figures import studies
    from scenenet.studies.summary import summarise

    runs = results.study_runs(study.name)
    if runs is None:
        raise InputError("has not been run", file=results.folder / "studies" / study.name)
    summary = summarise(study, runs, thesis or Thesis(source="", numbers={}))
    if len(study.vary) == 2:
        names, values = zip(*study.vary.items(), strict=True)
        first, second = (name.rpartition(".")[2] for name in names)
        alt = studies.heat_map(summary, (first, second), (len(values[0]), len(values[1])), out)
    else:
        alt = studies.rows(summary, out)
    hollow = " Hollow points are the thesis'." if any(v.thesis for v in study.variants) else ""
    return alt, (
        f"{study.asks} Scores of the tower class on the {study.part} crops at the tau that is best "
        f"on validation, {_seeds(study)}.{hollow} Thesis {study.place}."
    )


def _seeds(study: StudySettings) -> str:
    n = len(study.seeds)
    return "one seed" if n == 1 else f"mean and spread over {n} seeds"


def _tower_settings(results: Results, survey: str) -> Mapping[str, Any]:
    """What the towers of a survey were found with; the defaults where no record says."""
    path = results.folder / "towers" / survey / "provenance.json"
    if not path.exists():
        return {}
    from scenenet.towers import TowerSettings

    recorded = read_result(path).get("settings", {})
    return {name: recorded[name] for name in TowerSettings.model_fields if name in recorded}


def draw_surveys(results: Results, out: Path) -> tuple[str, str]:
    """The crop with the median number of points of each survey; of recorded samples more."""
    from scenenet.figures.beside import crops_beside, kinds_of
    from scenenet.store import StoreReader

    shown = {}
    for survey in results.surveys:
        reader = StoreReader(results.folder / "crops" / survey / "manifest.json")
        ordered = sorted(reader.manifest["crops"], key=lambda entry: (entry["points"], entry["id"]))
        made = (results.folder / "synthetic" / f"{survey}.laz").exists()
        ranks = (0.5,) if made else (0.17, 0.5, 0.83)
        chosen = {int(rank * len(ordered)): None for rank in ranks if ordered}
        for entry in (ordered[place] for place in chosen):
            arrays = reader.get(entry["id"])
            keep = _thin(len(arrays["xyz"]))
            codes = arrays["classification"][keep]
            kinds = kinds_of(codes) if reader.manifest["codes"] == "edp" else _plain(codes, reader)
            title = f"{entry['id']}\n({'synthetic' if made else 'recorded'})"
            shown[title] = (arrays["xyz"][keep], kinds)
    if not shown:
        raise InputError("no survey has a crop to show", file=results.folder)
    return crops_beside(shown, out), (
        "Crops from the side and from above, all at the same scale: of a synthetic survey the one "
        "with the median number of points, of recorded ones three. Points are coloured by what "
        "they were labelled."
    )


def _plain(codes: np.ndarray, reader: StoreReader) -> np.ndarray:
    """What points are (N,), by the groups of their class scheme."""
    from scenenet.pointcloud import class_scheme

    scheme = class_scheme(reader.manifest["codes"])
    kinds = np.full(len(codes), "other", dtype="U10")
    for name, group in (("ground", scheme.ground), ("tall", scheme.vegetation),
                        ("stray", scheme.noise), ("wire", scheme.wire),
                        ("tower", scheme.tower)):  # fmt: skip
        kinds[np.isin(codes, list(group))] = name
    return kinds


def draw_grids(results: Results, reference: str, out: Path) -> tuple[str, str]:
    from scenenet.figures.scenes import voxel_grids
    from scenenet.voxels import VoxelGrid, voxelise

    sample = ranked(champion_of(results, reference), "best")
    cloud = crop_cloud(results, sample)
    grids = {}
    for resolution in GRID_RESOLUTIONS:
        voxels = voxelise(cloud, VoxelGrid.cube(cloud.xyz, resolution))
        zyx = np.stack(np.unravel_index(voxels.index, voxels.grid.shape), axis=1)
        grids[f"{resolution}³, voxels of {voxels.grid.voxel_size:.2f} m"] = (zyx, voxels.tower)
    return voxel_grids(grids, out), (
        f"Occupied voxels of crop {sample['id']} at three resolutions, those with a point labelled "
        "tower in red. As thesis Figure 5.4."
    )


def draw_curves(results: Results, thesis: Thesis | None, out: Path) -> tuple[str, str]:
    from scenenet.figures.charts import precision_recall

    curves = {
        model: [r.evaluation["pr_curve"] for r in results.of_model(model)]
        for model in results.models
        if any(r.evaluation["pr_curve"] for r in results.of_model(model))
    }
    published = {}
    for model, kind in results.models.items():
        if thesis is None:
            break
        recall, precision = (thesis.value(f"models.{kind}.{n}") for n in ("recall", "precision"))
        if recall is not None and precision is not None:
            published[model] = (recall, precision)
    return precision_recall(curves, out, published), (
        "Every voxel of the test crops, with changing threshold tau. Thin lines are single seeds, "
        "the thick one is their mean with one standard deviation around it; a seed that never "
        "reaches a recall counts as precision 0 there. Diamonds mark the thesis' scores "
        "(Table 5.3), which were measured on other data. As thesis Figure 5.7."
    )


def draw_training(results: Results, model: str, out: Path) -> tuple[str, str]:
    from scenenet.figures.charts import training

    histories = _histories(results, model)
    dashed = any("validation_loss" in history for history in histories.values())
    return training(histories, out), (
        f"Training loss of {model} after each epoch, one line per seed"
        + (", the loss on the validation crops dashed." if dashed else ".")
    )


def draw_paths(results: Results, model: str, out: Path) -> tuple[str, str]:
    from scenenet.figures.charts import parameter_paths

    histories = _histories(results, model)
    names = parameter_columns(next(iter(histories.values())))
    return parameter_paths(histories, names, out), (
        f"The {len(names)} parameters of {model} after each epoch, one line per seed."
    )


def _histories(results: Results, model: str) -> dict[str, Any]:
    histories = {f"seed {r.seed}": r.history for r in results.of_model(model)
                 if r.history is not None}  # fmt: skip
    if not histories:
        raise InputError("no training history", file=results.folder / "train" / model)
    return histories


def draw_kernels(results: Results, model: str, out: Path) -> tuple[str, str]:
    import torch

    from scenenet.figures.charts import kernels
    from scenenet.modelfile import read_model
    from scenenet.models import CNN, SceneNet

    champion = champion_of(results, model)
    trained, _ = read_model(champion.model_files[0])
    parts: dict[str, np.ndarray] = {}
    with torch.no_grad():
        summed, _ = trained.observer()
        if isinstance(trained, SceneNet):
            parts = dict(zip(trained.names, trained.kernels().numpy(), strict=True))
        elif isinstance(trained, CNN):
            parts = {f"kernel {i + 1}": k.numpy() for i, k in enumerate(trained.weight)}
    alt = kernels({**parts, "all together": summed.numpy()}, out)
    figures = "As thesis Figures 4.2 to 4.4." if isinstance(trained, SceneNet) else ""
    return alt, (
        f"Slices through the middle of each kernel of {model}, seed {champion.seed} (best on "
        "validation): from the side above, from the top below. Red adds to the answer where a "
        f"voxel is occupied, blue takes away. Each kernel has its own scale. {figures}"
    ).strip()


def draw_parameters(results: Results, model: str, out: Path) -> tuple[str, str]:
    from scenenet.figures.charts import parameters
    from scenenet.modelfile import read_model
    from scenenet.models import SceneNet

    models = [read_model(r.model_files[0])[0] for r in results.of_model(model) if r.model_files]
    of_seeds = [trained.shape_parameters() for trained in models if isinstance(trained, SceneNet)]
    if not of_seeds:
        raise InputError(f"no tuned model called {model}", file=results.folder / "models" / model)
    values = {name: [numbers[name] for numbers in of_seeds] for name in of_seeds[0]}
    return parameters(values, out), (
        f"The trained parameters of {model}: bars are means over {len(of_seeds)} seeds with one "
        "standard deviation, dots are single seeds. Lengths are in voxels; the last mixing weight "
        "is one minus the others. As thesis Figure 5.5."
    )


def draw_crop(results: Results, reference: str, rank: str, out: Path) -> tuple[str, str]:
    from scenenet.figures.scenes import View, side_views

    chosen_by = champion_of(results, reference)
    sample = ranked(chosen_by, rank)
    cloud = crop_cloud(results, sample)
    views = [View("labels", class_groups(cloud), "class")]
    views += [_probability(cloud, champion_of(results, model)) for model in results.models]
    keep = _thin(len(cloud))
    thinned = [replace(view, values=view.values[keep]) for view in views]
    return side_views(cloud.xyz[keep], thinned, out), (
        f"Crop {sample['id']}: the {rank} of {len(chosen_by.evaluation['per_sample'])} test crops "
        f"by F0.5 of {reference} (here {sample['f05']:.2f}, precision {sample['precision']:.2f}, "
        f"recall {sample['recall']:.2f}). Points take the probability of their voxel; each model "
        "is the seed that is best on validation. As thesis Figures 5.8 and 5.9."
    )


def draw_prediction(results: Results, survey: str, out: Path) -> tuple[str, str]:
    from scenenet.figures.scenes import survey_overview

    found = results.prediction(survey)
    if found is None:
        raise InputError("was not predicted", file=results.folder / "predict" / survey)
    _, geojson = found
    towers = [
        (*feature["geometry"]["coordinates"][:2], feature["properties"]["base_elevation"])
        for feature in geojson["features"]
    ]
    xyz, probability = _classified_points(results.folder / "predict" / survey / f"{survey}.laz")
    alt = survey_overview(xyz, probability, np.asarray(towers, float).reshape(-1, 3), out)
    return alt, (
        f"{survey} from above and from the side, along its main direction. Colour is the tower "
        "probability of each point (every point that is likely a tower is drawn, the others are "
        "thinned); red marks are the detected towers, numbered as in the list."
    )


def ranked(champion: SeedResult, rank: str) -> Mapping[str, Any]:
    """The best, median or worst test crop by F0.5; ties by name."""
    ordered = sorted(champion.evaluation["per_sample"], key=lambda s: (-s["f05"], s["id"]))
    if not ordered:
        raise InputError(f"{champion.model} seed {champion.seed} was evaluated on no crop")
    return {"best": ordered[0], "median": ordered[len(ordered) // 2], "worst": ordered[-1]}[rank]


def crop_cloud(results: Results, sample: Mapping[str, Any]) -> PointCloud:
    """The points of a test crop, ``sample`` being its entry in an evaluation."""
    from scenenet.pointcloud import PointCloud, class_scheme
    from scenenet.store import StoreReader

    split = read_table(results.folder / "split" / "split.csv").astype({"crop": str})
    survey = split.loc[split["crop"] == sample["id"], "survey"].iloc[0]
    reader = StoreReader(results.folder / "crops" / survey / "manifest.json")
    arrays = reader.get(sample["id"])
    scheme = class_scheme(reader.manifest["codes"])
    return PointCloud(arrays["xyz"], arrays["classification"], scheme)


def class_groups(cloud: PointCloud) -> np.ndarray:
    """(N,) what each point is, as ``figures.CLASS_COLOURS`` names it."""
    groups = np.full(len(cloud), "other", dtype="U10")
    for name in ("ground", "vegetation", "wire", "tower"):
        groups[np.isin(cloud.classification, list(getattr(cloud.scheme, name)))] = name
    return groups


def _probability(cloud: PointCloud, champion: SeedResult) -> View:
    """The answer of a model to a crop, on the grid it was trained on."""
    import torch

    from scenenet.batches import batch
    from scenenet.figures.scenes import View
    from scenenet.modelfile import read_model
    from scenenet.voxels import VoxelSettings, voxelise

    model, card = read_model(champion.model_files[0])
    settings = VoxelSettings(fit=card.fit, resolution=card.resolution, voxel_size=card.voxel_size)
    grid = settings.grid(cloud.xyz)
    occupancy, _ = batch([voxelise(cloud, grid)], card.measurement)
    with torch.no_grad():
        volume = model.at(grid.voxel_size)(occupancy)[0].numpy().reshape(-1)
    return View(champion.model, volume[grid.voxel_of(cloud.xyz)], "probability")


def _classified_points(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """(N, 3) m and (N,) probability of a classified survey, thinned for drawing."""
    import laspy

    positions, probabilities = [], []
    with laspy.open(path) as reader:
        step = max(1, reader.header.point_count // POINTS_PER_PICTURE)
        for chunk in reader.chunk_iterator(1_000_000):
            probability = np.asarray(chunk["tower_probability"], float)
            keep = probability >= 0.5
            keep[::step] = True
            positions.append(np.stack([chunk.x, chunk.y, chunk.z], axis=1)[keep])
            probabilities.append(probability[keep])
    return np.concatenate(positions), np.concatenate(probabilities)


def _thin(n: int) -> np.ndarray:
    """Evenly spread positions of at most ``POINTS_PER_PICTURE`` of ``n`` points."""
    return np.arange(0, n, max(1, -(-n // POINTS_PER_PICTURE)))


def champion_of(results: Results, model: str) -> SeedResult:
    """The seed that is best on validation.

    Raises:
        InputError: the model has not been tuned.
    """
    champion = results.champion(model)
    if champion is None or not champion.model_files:
        raise InputError(f"no tuned model called {model}", file=results.folder / "models" / model)
    return champion
