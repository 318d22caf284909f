"""A run of the whole workflow."""

from __future__ import annotations

import csv
import os
import re
import shutil
import sqlite3

import pytest
import yaml

from scenenet.config.schema import load
from scenenet.core.files import digest, read_json

pytestmark = pytest.mark.workflow

STAGES = {
    *("synthesize", "check", "towers", "crops", "voxels", "split"),
    *("train", "tune", "champion", "evaluate", "predict"),
    *("certificate", "inference_time", "voxelisation_time", "review"),
    *("study", "boosted_trees", "dataset_tables", "tables", "figures", "interactive_crop"),
    *("components", "label_noise", "join_runs"),
    *("track", "track_studies", "track_experiment", "register", "report"),
}

OF_A_CALL = re.compile(r"^(  (Date|Workflow ID|Command): .*|\[.* \d{4}\])$", re.MULTILINE)
"""Lines that Snakemake shows of each call: dates and the like."""


def test_a_run_ends_with_every_result(finished):
    for path in (
        "results/config.yaml",
        "results/models/scenenet.json",
        "results/models/cnn.safetensors",
        "results/tables/models.csv",
        "results/figures/precision-recall.png",
        "results/predict/own/own.laz",
        "results/predict/own/own.towers.geojson",
        "results/mlflow/runs.json",
        "results/mlflow/registry.json",
        "results/study/ablations/runs.csv",
        "results/tables/study-ablations.csv",
        "results/tables/claims.csv",
        "results/figures/study-ablations.png",
        "results/boosted_trees/seed-1.json",
        "results/interactive_crop/median.json",
        "results/report/index.html",
        "mlflow.db",
    ):
        assert (finished.folder / path).stat().st_size > 0, path


def test_a_second_run_has_nothing_to_do(project):
    assert "Nothing to be done" in project.run()


def test_a_plan_is_the_one_that_the_command_shows(project):
    """Tests plan in processes that share the libraries of Snakemake (``fixtures.forked``)."""
    project.configure({"seeds": [0]})
    shown = [plan("-n", "--quiet", "host").stdout for plan in (project.snakemake, project.call)]
    # Snakemake lists some names in any order.
    one, other = (sorted(re.findall(r"[^\s,]+", OF_A_CALL.sub("", text))) for text in shown)
    assert len(one) > 500
    assert one == other


def test_the_scores_are_shown_at_the_end(finished):
    scores = finished.shown.partition("Scores on the test crops of tiny, cube-32")[2]
    for word in ("precision", "recall", "f05", "iou_tower", "miou", "scenenet", "nothing detected"):
        assert word in scores


def test_a_single_result_can_be_requested_before_there_are_scores(project):
    shutil.rmtree(project.results / "tables")
    assert "Scores" not in project.run("results/check/own/report.json", "--force")


def test_progress_of_a_job_is_on_the_terminal_and_in_its_log(finished):
    line = "scenenet seed 0: epochs: done (3)"
    assert line in finished.shown
    assert line in (finished.results / "logs/train/scenenet-seed-0.log").read_text()


def test_the_recorded_settings_are_those_of_the_run(finished):
    written = yaml.safe_load((finished.results / "config.yaml").read_text())
    given = yaml.safe_load((finished.folder / "config" / "config.yaml").read_text())
    assert load(written) == load(given)


def test_every_job_records_the_provenance_of_its_result(finished):
    records = [read_json(p) for p in finished.results.glob("**/*provenance.json")]
    stages = {record["stage"] for record in records}
    assert stages == STAGES
    assert all(len(record["code"]) == 16 for record in records)
    trained = read_json(finished.results / "train/scenenet/seed-1/provenance.json")
    assert trained["seed"] == 1
    assert trained["settings"]["training"]["learning_rate"] == 0.01
    assert trained["config"] == digest(trained["settings"])
    manifest = read_json(finished.results / "voxels/first/cube-32/manifest.json")
    assert trained["inputs"]["manifests"][0] == f"content:{manifest['content']}"
    predicted = read_json(finished.results / "predict/own/provenance.json")
    assert predicted["inputs"]["survey"].startswith("sha256:")


def test_the_model_file_names_code_settings_and_data(finished):
    model = read_json(finished.results / "models/scenenet.json")
    assert {"seed", "data", "config", "code", "version"} <= set(model["provenance"])


def test_every_training_is_a_run_in_mlflow(finished):
    runs = read_json(finished.results / "mlflow/runs.json")["runs"]
    assert len(runs) == 3 * (1 + 2)  # a group and two seeds for each model and the boosted trees
    studied = {}
    for study, variants in (("ablations", 2), ("starts", 3)):
        logged = read_json(finished.results / f"mlflow/study-{study}.json")["runs"]
        assert len(logged) == variants * (1 + 1)  # from one seed
        studied |= logged
    noisy = read_json(finished.results / "mlflow/label_noise.json")["runs"]
    assert len(noisy) == 2 * 4 * (1 + 2)  # levels; two models, the boosted trees, the labels; seeds
    measured = read_json(finished.results / "mlflow/components.json")["runs"]
    assert len(measured) == 15 + 23  # groups; those without a seed have one run, the others two
    with sqlite3.connect(finished.folder / "mlflow.db") as store:
        (active,) = store.execute(
            "SELECT count(*) FROM runs WHERE lifecycle_stage = 'active'"
        ).fetchone()
    assert active == len(runs) + len(studied) + len(noisy) + len(measured)


def test_rules_leave_a_benchmark_and_a_log(finished):
    for rule in ("check/own", "train/cnn-seed-1", "predict/own", "tables"):
        assert (finished.results / f"logs/{rule}.log").exists()
        with (finished.results / f"benchmarks/{rule}.tsv").open() as stream:
            (row,) = csv.DictReader(stream, delimiter="\t")
        assert float(row["s"]) > 0


def test_a_survey_that_cannot_be_read_stops_its_own_jobs_and_the_log_says_why(project):
    inbox = project.folder / "surveys"
    inbox.mkdir()
    (inbox / "broken.laz").write_bytes(b"<!DOCTYPE html>")
    done = project.snakemake("results/check/broken/report.json")
    assert done.returncode != 0
    log = (project.results / "logs/check/broken.log").read_text()
    assert log.startswith("Error: surveys/broken.laz: ")
    assert "Traceback" not in log
    assert log.splitlines()[0] in done.stdout
    assert "1 of 2 new surveys failed:\n  surveys/broken.laz: " in done.stdout + done.stderr
    assert project.snakemake("results/report/index.html").returncode == 0
    page = (project.results / "report/index.html").read_text()
    assert "surveys/broken.laz: " in page
    assert page.count("Map, list and picture of each tower") == 1, "of the other survey"


def test_a_fault_of_the_code_leaves_its_traceback_in_the_log(project):
    project.edit("workflow/scripts/check.py", "    report = ", "    1 / 0\n    report = ")
    assert project.snakemake("results/check/own/report.json").returncode != 0
    log = (project.results / "logs/check/own.log").read_text()
    assert "Traceback" in log
    assert "ZeroDivisionError" in log


def test_a_store_that_was_damaged_is_refused(project):
    """The manifest has its digest. The date is unchanged, so only reading can detect the damage."""
    store = project.results / "crops/first/crops.zarr.zip"
    status = store.stat()
    damaged = bytearray(store.read_bytes())
    damaged[len(damaged) // 2] ^= 1
    store.write_bytes(damaged)
    os.utime(store, ns=(status.st_atime_ns, status.st_mtime_ns))
    (project.results / "voxels/first/cube-32/manifest.json").unlink()
    assert project.snakemake("results/voxels/first/cube-32/manifest.json").returncode != 0
    assert "store was changed" in (project.results / "logs/voxels/first-cube-32.log").read_text()
