"""The jobs of a survey use one file: not one that replaced it between two of them."""

from __future__ import annotations

import importlib.util
import json
import shutil
import sys
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from fixtures.project import PARTS, copy_parts

from scenenet.core.errors import InputError
from scenenet.core.provenance import fingerprint


@pytest.fixture(scope="module")
def job_script(project_root):
    """The module that every script of the workflow starts with."""
    path = project_root / "workflow" / "scripts" / "_job.py"
    spec = importlib.util.spec_from_file_location("_job", path)
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(params=["file", "folder of samples"])
def survey(request, tmp_path):
    """A survey, and the file of it that the tests replace."""
    folder = tmp_path / "survey"
    folder.mkdir()
    for name in ("a.npy", "b.npy"):
        np.save(folder / name, np.arange(4.0)[None])
    return (folder / "a.npy" if request.param == "file" else folder), folder / "a.npy"


def job_of(job_script, survey, planned, towers_record=None):
    inputs = SimpleNamespace(survey=str(survey), towers_record=towers_record)
    return job_script.Job({"input": {"survey": planned}}, inputs, SimpleNamespace(), 1)


@pytest.mark.parametrize("limit", [0, 2**30], ids=["known by time", "known by content"])
def test_a_survey_that_was_replaced_after_the_planning_is_refused(job_script, survey, limit):
    path, file = survey
    job = job_of(job_script, path, fingerprint(path, limit))
    with job_script._one_survey(job):
        pass
    np.save(file, np.arange(8.0)[None])
    refused = pytest.raises(InputError, match="replaced while the workflow ran")
    with refused, job_script._one_survey(job):
        pytest.fail("the job has started")


def test_a_survey_that_is_replaced_during_the_job_is_refused(job_script, survey):
    path, file = survey
    job = job_of(job_script, path, fingerprint(path))
    refused = pytest.raises(InputError, match=r"a\.npy: the file was changed, replaced or removed")
    with refused, job_script._one_survey(job):
        np.save(file, np.arange(8.0)[None])


def test_labelled_towers_of_another_survey_are_refused(job_script, survey, tmp_path):
    path, file = survey
    record = tmp_path / "provenance.json"
    record.write_text(json.dumps({"inputs": {"survey": fingerprint(path)}}))
    with job_script._one_survey(job_of(job_script, path, fingerprint(path), record)):
        pass
    np.save(file, np.arange(8.0)[None])
    refused = pytest.raises(InputError, match="after its labelled towers were found")
    with refused, job_script._one_survey(job_of(job_script, path, fingerprint(path), record)):
        pytest.fail("the job has started")


@pytest.mark.workflow
def test_crops_are_not_cut_around_the_towers_of_another_survey(
    project_root, project_in, recorded, scene, tmp_path
):
    from scenenet.pointcloud import write_las

    project = project_in(tmp_path / "project")
    copy_parts(project_root, project.folder, PARTS)
    test = yaml.safe_load((project.folder / "config" / "test.yaml").read_text())
    test["synthetic"]["surveys"] = []
    own = {"results_dir": "results", "surveys": "config/surveys.tsv", "studies": []}
    project.configure({**test, **own})
    (project.folder / "config" / "surveys.tsv").write_text("survey\tpath\tcodes\trole\n")
    project.add_row("own", "data/own.laz", "edp", "train")
    (project.folder / "data").mkdir()
    survey = project.folder / "data" / "own.laz"
    shutil.copyfile(recorded, survey)
    project.run("--cores", "1", "results/towers/own/towers.csv")
    write_las(survey, scene())
    # With all triggers the towers would be searched again.
    crops = ("--cores", "1", "--rerun-triggers", "mtime", "--", "results/crops/own/manifest.json")
    done = project.snakemake(*crops)
    assert done.returncode != 0
    assert "data/own.laz: the survey was replaced" in done.stdout
    assert not list((project.results / "crops").rglob("*.*"))
