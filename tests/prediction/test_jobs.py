"""The stages of a survey of tiles as jobs give what one process gives."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pyproj
import pytest

from scenenet.core.errors import InputError
from scenenet.core.files import write_json
from scenenet.core.provenance import fingerprint
from scenenet.detection.settings import DetectionSettings
from scenenet.models.model_file import write_model
from scenenet.pointcloud import PointCloud, read, write_las
from scenenet.pointcloud.reading import survey_info
from scenenet.prediction.jobs.find_towers import find_towers_of
from scenenet.prediction.jobs.joined import fullest_in
from scenenet.prediction.jobs.predict_tile import model_voxel_size, predict_tile
from scenenet.prediction.jobs.write_lists import write_lists
from scenenet.prediction.jobs.write_tile import write_tile
from scenenet.prediction.result_files import PredictionFiles
from scenenet.prediction.settings import PredictSettings
from scenenet.prediction.survey_files import SurveyFiles
from scenenet.prediction.work.block_file import BlockFile
from scenenet.prediction.work.work_file import PlannedFile, read_file
from scenenet.prediction.writers import predict_to_files

LONE_POLES = DetectionSettings(min_conductor=0)
SETTINGS = PredictSettings(classify=True)


@pytest.fixture(scope="module")
def tiles(scene, tmp_path_factory) -> Path:
    """Two tiles with a pole at their border, where voxels have points of both."""
    cloud = scene([(15.5, 15.5)], size=(31.0, 31.0), tree=None)
    folder = tmp_path_factory.mktemp("jobs") / "line"
    folder.mkdir()
    west = cloud.xyz[:, 0] < 500_015.3
    for name, own in (("a", west), ("b", ~west)):
        tile = PointCloud(cloud.xyz[own], cloud.classification[own], crs=pyproj.CRS(32629))
        write_las(folder / f"{name}.laz", tile)
    return folder


def run_jobs(survey: SurveyFiles, model: Path, folder: Path, fullest: bool) -> PredictionFiles:
    """All jobs, one after another."""
    work, files = folder / "work", PredictionFiles.of(survey, folder)
    size = model_voxel_size(model, SETTINGS)
    works = [work / f"{path.stem}.work" for path in survey.files]
    for path, out in zip(survey.files, works, strict=True):
        read_file(path, path.name, out, size, 1000)
    most = fullest_in(survey, works, model) if fullest else None
    predictions = [out.with_suffix(".predictions") for out in works]
    for number, out in enumerate(predictions):
        others = works[:number] + works[number + 1 :]
        predict_tile(works[number], others, model, out, 400.0, most, SETTINGS)
    find_towers_of(survey, works, predictions, model, LONE_POLES, work / "towers", work / "near")
    records = [out.with_suffix(".json") for out in works]
    written = [path.stem for path in survey.files if (work / "near" / f"{path.stem}.json").exists()]
    for number, path in enumerate(survey.files[: len(written)]):
        near = work / "near" / f"{path.stem}.json"
        write_tile(works[number], [predictions[number]], near, files.points[path], records[number],
                   SETTINGS, None)  # fmt: skip
    done = records[: len(written)]
    write_lists(survey, works, [predictions], work / "towers", done, [model], files, SETTINGS,
                LONE_POLES)  # fmt: skip
    return files


def same_files(survey: SurveyFiles, model: Path, folder: Path, density: bool) -> PredictionFiles:
    """Predict a survey in one process and by jobs, and compare every file but the summary."""
    one = PredictionFiles.of(survey, folder / "one")
    predict_to_files(survey, model, one, SETTINGS, LONE_POLES)
    jobs = run_jobs(survey, model, folder / "jobs", density)
    for path in [*one.points.values(), *one.lists]:
        twin = folder / "jobs" / path.relative_to(folder / "one")
        assert path.exists() == twin.exists()
        if path.exists():
            assert twin.read_bytes() == path.read_bytes(), path.name
    return jobs


@pytest.mark.parametrize("measurement", ["presence", "density"])
def test_jobs_give_the_files_of_one_process(tiles, pole_finder, tmp_path, measurement):
    trained, card = pole_finder
    model = tmp_path / "model.json"
    write_model(model, trained, card.model_copy(update={"measurement": measurement}))
    jobs = same_files(SurveyFiles.of(tiles), model, tmp_path, measurement == "density")
    assert all(jobs.is_own(path) for path in [*jobs.points.values(), *jobs.lists, jobs.summary])


def test_a_file_in_another_system_at_the_same_numbers_has_no_effect(tiles, model, tmp_path):
    folder = tmp_path / "line"
    shutil.copytree(tiles, folder)
    points = read(tiles / "b.laz")
    few = PointCloud(points.xyz[::7], points.classification[::7], crs=pyproj.CRS(32630))
    write_las(folder / "c.laz", few)
    jobs = same_files(SurveyFiles.of(folder), model, tmp_path, density=False)
    assert "c.laz,left out" in jobs.status.read_text()


def test_a_distance_that_is_too_small_for_the_voxels_is_refused(tiles, model, tmp_path):
    read_file(tiles / "a.laz", "a.laz", tmp_path / "a.work", 1.0, 1000)
    with pytest.raises(InputError, match="need the tiles within"):
        predict_tile(tmp_path / "a.work", [], model, tmp_path / "out", 60.0, None, SETTINGS)


def test_a_model_of_voxels_that_the_tiles_were_not_read_into_is_refused(tiles, model, tmp_path):
    read_file(tiles / "a.laz", "a.laz", tmp_path / "a.work", 0.75, 1000)
    with pytest.raises(InputError, match="read without them") as error:
        predict_tile(tmp_path / "a.work", [], model, tmp_path / "out", 400.0, None, SETTINGS)
    assert error.value.file == str(model)


def test_a_file_that_is_not_the_planned_one_is_not_used(tiles, tmp_path):
    box = (0.0, 0.0, 1.0, 1.0)
    for planned, reason in (
        (PlannedFile("sha256:other", None), "replaced while the workflow ran"),
        (PlannedFile(None, box), "outside the bounding box of its header"),
        (PlannedFile(None, None), "outside the bounding box of its header"),
    ):
        file = read_file(tiles / "a.laz", "a.laz", tmp_path / "a.work", 1.0, 1000, None, planned)
        assert reason in str(file.error)


def test_a_copy_that_took_the_place_of_a_file_is_written_and_another_file_is_not(
    tiles, model, tmp_path
):
    folder = tmp_path / "line"
    shutil.copytree(tiles, folder)
    path, out = folder / "a.laz", [tmp_path / name for name in ("w", "p", "near", "a.laz", "r")]
    known = fingerprint(path)
    info = survey_info(path)
    box = (*info.mins[:2], *info.maxs[:2])
    read_file(path, "a.laz", out[0], 1.0, 1000, None, PlannedFile(known, box))
    predict_tile(out[0], [], model, out[1], 400.0, None, SETTINGS)
    inputs = out[0], [out[1]], *out[2:]
    write_json(out[2], {"system": BlockFile(out[0]).facts["system"], "structures": []})
    shutil.copy(path, tmp_path / "copy")
    (tmp_path / "copy").replace(path)
    with pytest.raises(InputError, match="changed, replaced or removed"):
        write_tile(*inputs, SETTINGS, None)
    write_tile(*inputs, SETTINGS, None, known)
    assert out[3].exists()
    shutil.copy(folder / "b.laz", path)
    with pytest.raises(InputError, match="changed, replaced or removed"):
        write_tile(*inputs, SETTINGS, None, known)


def test_a_tower_is_in_the_small_file_of_each_tile_that_it_reaches_into(tiles, model, tmp_path):
    survey = SurveyFiles.of(tiles)
    run_jobs(survey, model, tmp_path, fullest=False)
    sizes = {path.name: path.stat().st_size for path in (tmp_path / "work" / "near").iterdir()}
    assert sizes.keys() == {"a.json", "b.json"}
    one, other = ((tmp_path / "work" / "near" / name).read_bytes() for name in sizes)
    assert one == other and np.all(np.array(list(sizes.values())) > 500)
