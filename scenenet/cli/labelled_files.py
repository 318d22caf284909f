"""Training and scoring with labelled files, without the workflow."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from scenenet.cli.inputs import Failures
from scenenet.core.errors import InputError, in_file, warn
from scenenet.core.outputs import check_space
from scenenet.core.scratch import scratch_folder, temporary_directory
from scenenet.core.unchanged import unchanged
from scenenet.dataset.crops import (
    Crop,
    CropClouds,
    CropSettings,
    CropSpace,
    Truth,
    crop_of,
    cut_crops,
)
from scenenet.dataset.labelled_towers import LabelledTowers, TowerSettings, survey_towers
from scenenet.dataset.split import SplitSettings, split_crops
from scenenet.dataset.voxel_cache import VOXEL_BYTES, Dataset, build, load
from scenenet.dataset.voxels import VoxelSettings
from scenenet.detection.settings import DetectionSettings
from scenenet.evaluation.result import Evaluation, PointScores, TowerScores
from scenenet.evaluation.scoring import score
from scenenet.evaluation.surveys import LabelledSurvey, SurveyScores, score_survey
from scenenet.evaluation.tune import with_answer
from scenenet.interpretability.determination import determination
from scenenet.interpretability.parameter_sentences import parameters_of
from scenenet.metrics.voxel_scores import VoxelScores
from scenenet.models.base import VoxelModel
from scenenet.models.geneo_model import GeneoModel
from scenenet.models.model_file import read_model, write_model
from scenenet.models.settings import ModelSettings, TuningSettings
from scenenet.pointcloud import PointCloud, survey_in_metres
from scenenet.pointcloud.quality.screening import survey_warnings
from scenenet.pointcloud.reading import same_points
from scenenet.pointcloud.ts40k import sample_files
from scenenet.training.train import card_of, fit
from scenenet.training.tuning import choose
from scenenet.training.tuning_result import Tuning


@dataclass(frozen=True)
class LabelledFiles:
    """The content of labelled files.

    Attributes:
        dataset: their crops on grids.
        parts: part of each crop by its id; empty without a split or with a single crop.
        surveys: the surveys and TS40K samples, those without a crop included.
        read: the files that could be read.
        skipped: files or samples without a crop, and labelled points that are no tower, with the
            reason.
        warnings: what looks wrong about the files, as sentences that begin with the path.
        clouds: the points of each crop by its id, in the folder that they were written to.
    """

    dataset: Dataset = field(default_factory=lambda: Dataset([], [], "", []))
    parts: dict[str, str] = field(default_factory=dict)
    surveys: list[LabelledSurvey] = field(default_factory=list)
    read: list[Path] = field(default_factory=list)
    skipped: list[dict[str, str]] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    clouds: Mapping[str, PointCloud] = field(default_factory=dict)


def read_labelled(
    paths: Sequence[Path],
    codes: str,
    grid: VoxelSettings,
    failures: Failures,
    scratch: Path,
    split: SplitSettings | None = None,
    truths: Sequence[Path] = (),
) -> LabelledFiles:
    """Cut crops around the labelled towers of files, and voxelise them.

    Args:
        paths: surveys (cut into crops around their towers), and TS40K samples or folders of them.
        codes: class scheme of the labels.
        failures: gets the errors of the files that cannot be read; the others are read.
        scratch: an empty folder, for the points of the crops.
        split: the shares of the split; a single crop is not split.
        truths: for each of ``paths`` a file with the same points in the same order, with the true
            classes, or a folder of such samples; empty where the truth is not known.

    Raises:
        OutputError: the disk of the temporary files has too little space.
    """
    files = LabelledFiles()
    pairs: list[tuple[Path, Path | None]] = [
        (path, truths[number] if truths else None) for number, path in enumerate(paths)
    ]
    seen = failures.look_at(dict.fromkeys(pairs), _look)
    stored = sum(space.stored + VOXEL_BYTES * space.points for space in seen.values())
    spooled = max((space.temporary for space in seen.values()), default=0)
    check_space({temporary_directory(): stored + spooled})
    manifests: list[tuple[Path, Path]] = []
    for number, (path, truth) in enumerate(pairs, start=1):
        if (path, truth) not in seen:
            continue
        # The number keeps files of the same name in different folders apart.
        name = path.stem if len(paths) == 1 else f"{number}-{path.stem}"
        used = [path] if truth is None else [path, truth]
        with failures.collect(), unchanged(*used), in_file(path):
            folder = scratch / f"{number}"
            manifests.append(_read_file(path, truth, name, codes, grid, folder, files))
    crops = [crops for crops, _ in manifests]
    dataset = load([voxels for _, voxels in manifests])
    parts = {}
    if split is not None and len(dataset.samples) > 1:
        table = split_crops(crops, split)
        parts = dict(zip(table["crop"], table["part"], strict=True))
    return replace(files, dataset=dataset, parts=parts, clouds=CropClouds(crops))


def _look(pair: tuple[Path, Path | None]) -> CropSpace:
    """Look at the headers and the unit of a survey and its truth, or for the files of samples.

    Raises:
        InputError: a file cannot be used.
    """
    path, truth = pair
    if truth is not None and path.is_dir() != truth.is_dir():
        kinds = ("a file", "a folder") if truth.is_dir() else ("a folder", "a file")
        raise InputError(f"the truth of {kinds[0]} cannot be {kinds[1]}", file=truth)
    if not sample_files(path):
        survey_in_metres(path)
    if truth is not None and not path.is_dir():
        same_points(path, truth)
    return CropSpace.of(path)


def _read_file(
    path: Path,
    truth: Path | None,
    name: str,
    codes: str,
    grid: VoxelSettings,
    folder: Path,
    files: LabelledFiles,
) -> tuple[Path, Path]:
    """Add what a file holds to ``files``.

    Returns:
        the manifests of its crops and of their grids, in ``folder``.
    """
    found = survey_towers(path, codes, TowerSettings())
    warnings = survey_warnings(path, codes)
    warn(path, warnings)
    files.warnings.extend(f"{path}: {text}" for text in warnings)
    files.skipped.extend({"sample": path.name, "reason": note} for note in found.notes())
    crops, voxels = folder / "crops.json", folder / "voxels.json"
    standing = None
    if truth is not None:
        true = survey_towers(truth, codes, TowerSettings())
        files.skipped.extend(
            {"sample": path.name, "reason": f"in the truth, {note}"} for note in true.notes()
        )
        standing = Truth(truth, true.towers)
    facts = cut_crops(
        name, path, codes, found.towers, CropSettings(), folder / "crops.zarr.zip", crops, standing
    )
    build(crops, grid, folder / "voxels.zarr.zip", voxels)
    files.read.append(path)
    files.skipped.extend(facts["skipped"])
    cut = [crop_of(entry) for entry in facts["crops"]]
    files.surveys.extend(_surveys(path, name, codes, found, standing, cut))
    if not sample_files(path) and len(found.towers) == 0:
        labelled = int(found.left_out["points"].sum())
        reason = f"no tower among its {labelled} points labelled tower"
        files.skipped.append({"sample": path.name, "reason": reason})
    return crops, voxels


def _surveys(
    path: Path,
    name: str,
    codes: str,
    found: LabelledTowers,
    truth: Truth | None,
    crops: Sequence[Crop],
) -> Iterator[LabelledSurvey]:
    """The survey at ``path``, or each of its TS40K samples."""
    samples = sample_files(path)
    if not samples:
        of_truth = () if truth is None else (truth.path, truth.towers)
        yield LabelledSurvey(path, codes, found.towers, tuple(crops), False, *of_truth)
    for sample in samples:
        towers = found.towers[found.towers["sample"] == sample.stem]
        own = tuple(crop for crop in crops if crop.id == f"{name}-{sample.stem}")
        true = None if truth is None else truth.of_sample(sample)
        of_truth = () if truth is None or true is None else (true, truth.towers_in(true))
        yield LabelledSurvey(sample, codes, towers, own, True, *of_truth)


def train_files(
    paths: Sequence[Path],
    codes: str,
    grid: VoxelSettings,
    settings: ModelSettings,
    tuning: TuningSettings,
    seeds: Sequence[int],
    validation: float,
    detection: DetectionSettings,
    provenance: dict[str, Any],
    out: str | Path,
    failures: Failures,
) -> dict[str, Any]:
    """Train with several seeds, tune each model on the validation crops, and write the best one.

    Args:
        validation: share of the crops for tuning. With 0 or a single crop, models are tuned on the
            training crops. The scores are then too high, and ``tuned_on`` is ``training``.
        detection: what makes a tower; the model whose towers are best is chosen.

    Returns:
        the scores of each seed, the chosen seed, the parameters of the chosen model and whether
        the crops determine them, the numbers of crops, the skipped files, and what looks wrong
        about the files.

    Raises:
        InputError: no file has a labelled tower.
        typer.Exit: no file could be read.
    """
    split = SplitSettings(train=1 - validation, validation=validation, test=0, neighbour=0)
    with scratch_folder() as scratch:
        wanted = split if validation > 0 else None
        files = read_labelled(paths, codes, grid, failures, scratch, wanted)
        data = files.dataset
        _require_crops(files, paths, failures)
        kept = [s for s in data.samples if files.parts.get(s.id) == "validation"]
        provenance = provenance | {"files": [path.name for path in files.read]}
        training = [s for s in data.samples if files.parts.get(s.id) != "validation"]
        tuned_on, others = (kept, training) if kept else (training, [])
        candidates = []
        for seed in seeds:
            model, _ = fit(training, kept, settings, seed)
            card = card_of(replace(data, samples=training), settings, grid, seed, provenance)
            tuned, card, result = choose(model, card, tuned_on, tuning, others)
            result = with_answer(result, tuned, card, tuned_on, files.clouds, detection)
            candidates.append((seed, tuned, card, result))
    seed, tuned, card, result = max(candidates, key=lambda entry: entry[3].decisive)
    write_model(out, tuned, card)
    return {
        "model": str(out),
        "seed": seed,
        "tau": result.tau,
        "kernel_size": list(result.kernel_size),
        "tuned_on": "validation" if kept else "training",
        "scores": asdict(result.validation),
        "whole_towers": _plain(result.whole_towers),
        "seeds": [_of_seed(number, found) for number, _, _, found in candidates],
        "numbers": _numbers(tuned, [candidate for _, candidate, _, _ in candidates]),
        "crops": {"training": len(training), "validation": len(kept)},
        "skipped": files.skipped,
        "warnings": files.warnings,
    }


def _of_seed(seed: int, found: Tuning) -> dict[str, Any]:
    """What the tuning found for one seed."""
    return {
        "seed": seed,
        "kernel_size": list(found.kernel_size),
        **asdict(found.validation),
        "whole_towers": _plain(found.whole_towers),
    }


def _plain(scores: VoxelScores | None) -> dict[str, Any] | None:
    return None if scores is None else asdict(scores)


def _numbers(chosen: VoxelModel, models: Sequence[VoxelModel]) -> list[dict[str, Any]]:
    """The parameters of the chosen model, with what the models of all seeds say about each; none
    for models in voxels."""
    said = determination([model for model in models if isinstance(model, GeneoModel)])
    if not said or not isinstance(chosen, GeneoModel):
        return []
    values = chosen.shape_parameters()
    return [
        {"name": p.name, "value": values[p.name], "unit": p.unit, **said[p.name]._asdict()}
        for p in parameters_of(chosen, chosen.voxel_size or 1.0)
        if p.name in said
    ]


def evaluate_files(
    paths: Sequence[Path],
    model: str | Path,
    codes: str,
    grid: VoxelSettings | None,
    detection: DetectionSettings,
    failures: Failures,
    truths: Sequence[Path] = (),
) -> dict[str, Any]:
    """Scores of a model on labelled files, against their labels and against the truth.

    Points are scored by the prediction that ``scenenet predict`` makes for each file, whatever the
    grid.

    Args:
        grid: the grid for the voxel scores; None for the model's own voxel size. With None, towers
            are detected in whole surveys instead of crops around the labelled towers, so that
            false towers everywhere count, also in surveys without towers.
        truths: as in ``read_labelled``.

    Returns:
        the evaluation as plain values, with ``skipped`` and ``warnings``.

    Raises:
        InputError: the model cannot be used, or no file has a crop or survey to score.
        typer.Exit: no file could be read.
    """
    trained, card = read_model(model)
    whole_surveys = grid is None
    grid = grid or VoxelSettings(fit="metric", voxel_size=card.voxel_size)
    with scratch_folder() as scratch:
        files = read_labelled(paths, codes, grid, failures, scratch, truths=truths)
    if not (whole_surveys and files.surveys):
        _require_crops(files, paths, failures)
    found = SurveyScores()
    grids = {sample.id: sample.grid for sample in files.dataset.samples}
    for survey in files.surveys:
        with failures.collect():
            found += score_survey(survey, model, detection, grids)
    scored = files.dataset.only(found.by_crop)
    result = score(trained, card, scored, lambda sample: found.by_crop[sample.id])
    result = _of_whole_files(result, found, towers=whole_surveys)
    return result.to_json() | {"skipped": files.skipped, "warnings": files.warnings}


def _of_whole_files(result: Evaluation, found: SurveyScores, *, towers: bool) -> Evaluation:
    """The scores of crops with the points of whole files instead, and with their towers if asked.

    Without a crop there is nothing to count in voxels, neither for the labels nor for the truth.
    """
    true = found.points.truth
    truth = None if true is None else result.truth or result.labels
    if truth is not None and true is not None:
        truth = replace(truth, points=PointScores.of(true))
        if towers and found.true_towers is not None:
            truth = replace(truth, towers=TowerScores.of(found.true_towers))
    of_labels = found.points.labels_against_truth
    return replace(
        result,
        points=PointScores.of(found.points.labels),
        towers=TowerScores.of(found.towers) if towers else result.towers,
        truth=truth,
        labels_against_truth=None if of_labels is None else PointScores.of(of_labels),
    )


def _require_crops(files: LabelledFiles, paths: Sequence[Path], failures: Failures) -> None:
    """End the command if there is no crop.

    Raises:
        typer.Exit: because files failed.
        InputError: because no file has a labelled tower.
    """
    if files.dataset.samples:
        return
    failures.end()
    reasons = "; ".join(f"{entry['sample']}: {entry['reason']}" for entry in files.skipped)
    raise InputError(
        f"no labelled tower in it ({reasons})",
        file=", ".join(str(path) for path in paths),
        remedy="Check --codes, and that the points of towers are labelled 15",
    )
