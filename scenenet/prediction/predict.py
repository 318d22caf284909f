"""Prediction of a whole survey: files are read, then predicted, then searched for towers.

Each of these stages is a function of files, so that the workflow can run it as a job of its own:
``read_file``, ``predict_file`` and ``find_in_survey``; ``write_points`` follows them.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TypeVar

from scenenet.clearance.records import SurveyClearances
from scenenet.clearance.settings import ClearanceSettings
from scenenet.core.files import read_json, write_json
from scenenet.core.free_memory import give_back
from scenenet.core.outputs import check_space
from scenenet.core.progress import quiet, track
from scenenet.core.scratch import scratch_folder, temporary_directory
from scenenet.detection.settings import DetectionSettings
from scenenet.pointcloud.class_schemes import ClassScheme
from scenenet.pointcloud.targets import WIRE
from scenenet.prediction.area_points import WireVoxels
from scenenet.prediction.found_clearances import find_clearances_in_survey
from scenenet.prediction.found_line import FoundLine, Rejects, WireSearch, find_line_in_survey
from scenenet.prediction.found_towers import FoundTowers, TowerSearch, find_in_survey
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.survey_files import SurveyFiles, look_at
from scenenet.prediction.survey_prediction import FurtherModel, SurveyPrediction
from scenenet.prediction.used_models import ModelPaths, UsedModel, finds_lines, use_models
from scenenet.prediction.work.block_file import BlockFile
from scenenet.prediction.work.survey_work import SurveyWork
from scenenet.prediction.work.tile_predictions import TilePredictions
from scenenet.prediction.work.tile_predictor import fullest_voxel, predict_file
from scenenet.prediction.work.tiling import Layer
from scenenet.prediction.work.work_file import WorkFile, read_file
from scenenet.prediction.work.work_folder import WorkFolder

Item = TypeVar("Item")

SCRATCH_BYTES = 20
"""Bytes of temporary files for a point: 12 for its position, and up to 3.1 for the voxels, measured
on airborne and mobile surveys."""

FURTHER_SCRATCH_BYTES = 10
"""Bytes of temporary files for a point, for each further model: its voxels, which may be as many as
the points, and their predictions."""


@contextmanager
def predict_survey(
    survey: str | Path | SurveyFiles,
    models: ModelPaths,
    settings: PredictSettings,
    detection: DetectionSettings,
    work: WorkFolder | None = None,
    scheme: ClassScheme | None = None,
    clearance: ClearanceSettings | None = None,
    rejects: Rejects | None = None,
) -> Iterator[SurveyPrediction]:
    """Predict every occupied voxel of a survey and, with a model of towers, find its towers.

    Several models find different targets. The survey is decoded once, for all of them.

    All files of a survey are read before towers are searched for, so the result does not depend on
    where the survey was cut. Memory is bounded by a chunk of points and a tile of voxels. The
    predictions lie in a temporary folder, which is removed at the end of the ``with`` block::

        with predict_survey("line.laz", "model.json", PredictSettings(), DetectionSettings()) as p:
            print(p.towers, p.look_up(xyz).probability)

    ``scenenet.prediction.writers`` writes a prediction to files.

    Args:
        survey: LAS, LAZ, COPC or TS40K sample; a folder, a pattern or a tile index of LAS and LAZ
            files, of which one that cannot be used has its error in ``files``.
        models: model file with tau, or several for different targets.
        work: folder for the files between the stages, with those of an earlier call that was
            stopped; None for a temporary one.
        scheme: of the class codes in the survey (``use_models``); where lines are found, they say
            what is near the conductors.
        clearance: how the clearances of these lines are measured; None for the defaults.
        rejects: conductors that people rejected; None for none.

    Raises:
        InputError: the survey or a model cannot be used.
        OutputError: the disk of the temporary files has too little space.
    """
    started = time.perf_counter()
    if not isinstance(survey, SurveyFiles):
        survey = SurveyFiles.of(survey)
    used = use_models(models, settings, scheme)
    first, tau = used[0], used[0].card.threshold()
    layers = list(dict.fromkeys([Layer(first.voxel_size), *(each.layer for each in used)]))
    headers, _ = look_at(survey)
    size = scratch_bytes(len(used)) * sum(info.n_points for info in headers.values())
    place = temporary_directory() if work is None else work.folder
    check_space({place: size - (0 if work is None else work.bytes_kept())})
    with nullcontext(work) if work is not None else _scratch() as folder:
        classes = finds_lines(used)  # noise has a class whatever the scheme is
        _read_files(survey, folder, layers, settings.chunk_points, classes=classes)
        give_back()
        joined = SurveyWork.open(survey, folder.reads(survey))
        tiles = [_predict_files(joined, folder, each) for each in used]
        give_back()
        found = FoundTowers.none()
        search = TowerSearch(joined.spool, tiles[0], joined.system.unit_sizes, tau, detection)
        if first.target.is_tower:
            if not folder.towers.exists():
                write_json(folder.towers, find_in_survey(search, survey.given.name).to_json())
            found = FoundTowers.from_json(read_json(folder.towers))
            give_back()
        further = [
            FurtherModel(each, joined.spool_at(each.layer), predicted)
            for each, predicted in zip(used[1:], tiles[1:], strict=True)
        ]
        line, clearances = None, None
        wires = next((each for each in further if each.used.target.name == WIRE), None)
        if first.target.is_tower and wires is not None:
            label = f"{survey.given.name}: spans traced"
            lines = _line(folder, wires.search, search, found, label)
            lines = lines.reviewed(rejects, joined.system)
            line, found = lines.line, lines.towers
            own = clearance or ClearanceSettings()
            clearances = _clearances(joined, folder, lines, wires.search, own, scheme)
        yield SurveyPrediction.of(
            joined,
            tiles[0],
            found,
            model=first.model,
            card=first.card,
            settings=settings,
            detection=detection,
            started=started,
            code=first.code,
            further=further,
            line=line,
            clearance=clearance,
            clearances=clearances,
            scheme=scheme if classes else None,
        )


def scratch_bytes(n_models: int) -> int:
    """Bytes of temporary files for a point, with a number of models."""
    return SCRATCH_BYTES + FURTHER_SCRATCH_BYTES * (n_models - 1)


@contextmanager
def _scratch() -> Iterator[WorkFolder]:
    with scratch_folder() as folder:
        yield WorkFolder(folder)


def _read_files(
    survey: SurveyFiles,
    folder: WorkFolder,
    layers: Sequence[Layer],
    chunk_points: int,
    *,
    classes: bool,
) -> None:
    """Read the files that are not in ``folder`` yet, for different layers; points are kept in
    tiles of the first one, with their ``classes`` if they are asked for."""
    first, *further = layers
    names, reads = survey.names, folder.reads(survey)

    def read(path: Path) -> None:
        named = path, names[path], reads[path]
        size, crs = first.voxel_size, survey.crs
        read_file(*named, size, chunk_points, crs, further=further, classes=classes)

    left = [path for path, out in reads.items() if not out.exists()]
    _each(left, f"{survey.given.name}: files read", read)


def _predict_files(joined: SurveyWork, folder: WorkFolder, used: UsedModel) -> TilePredictions:
    """Predict the tiles of the files that are not in ``folder`` yet; each tile once."""
    spool = joined.spool_at(used.layer)
    fullest = fullest_voxel(spool, used.card)
    files: list[BlockFile] = []
    done: set[int] = set()

    def predict(work: WorkFile) -> None:
        out = folder.predicted(work.file.name, used.target)
        if not out.exists():
            predict_file(work, spool, out, used.model, used.card, fullest, done=done)
        files.append(BlockFile(out))
        done.update(files[-1].codes("predictions"))

    _each(joined.used, f"{joined.survey.given.name}: files predicted", predict)
    return TilePredictions(files)


def _line(
    folder: WorkFolder, wires: WireSearch, towers: TowerSearch, found: FoundTowers, label: str
) -> FoundLine:
    """The lines between the towers of a survey."""
    if not folder.line.exists():
        write_json(folder.line, find_line_in_survey(wires, towers, found, label).to_json())
    return FoundLine.from_json(read_json(folder.line))


def _clearances(
    joined: SurveyWork,
    folder: WorkFolder,
    found: FoundLine,
    wires: WireSearch,
    settings: ClearanceSettings,
    scheme: ClassScheme | None,
) -> SurveyClearances:
    """What is near the lines of a survey."""
    if not folder.clearances.exists():
        voxels = WireVoxels(wires)
        label = f"{joined.survey.given.name}: clearances measured"
        measured = find_clearances_in_survey(
            joined.spool, found.line, found.towers.structures, voxels, settings, scheme, label
        )
        write_json(folder.clearances, measured.to_json())
    return SurveyClearances.from_json(read_json(folder.clearances))


def _each(items: Sequence[Item], label: str, step: Callable[[Item], None]) -> None:
    """Take a step for each item and report progress: the step's own where there is one item."""
    if len(items) == 1:
        step(items[0])
        return
    for item in track(items, label):
        with quiet():
            step(item)
