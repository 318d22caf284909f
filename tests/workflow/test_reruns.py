"""What runs again after a change, and what does not (docs/development/reruns.md)."""

from __future__ import annotations

import os
import re
import shutil
import sqlite3

import pytest
from fixtures.kernel_file import RING

pytestmark = pytest.mark.workflow

CLASSIFIED = {"predict": 1, "prediction_map": 1, "review_template": 1, "report": 1}
"""Jobs of a survey to classify, without a review."""
PREDICTED = {**CLASSIFIED, "review": 1}
"""Jobs after a change of the best model; there is one survey to classify, which was reviewed."""

SHOWN = {"figures": 1, "track": 1, "register": 1, "interactive_crop": 1}
"""Jobs that show the scores of models, besides the tables and the report."""

SCORED = {
    "tune_scenenet": 2,
    "tune_cnn": 2,
    "champion_scenenet": 1,
    "champion_cnn": 1,
    "certificate": 2,
    "inference_time": 2,
    "evaluate": 4,
    "tables": 1,
    **SHOWN,
    **PREDICTED,
}
"""Jobs after the training of two models of each kind."""

TRAINED = {"train_scenenet": 2, "train_cnn": 2, **SCORED}
STUDIED = {"study": 2, "join_study": 2, "study_figure": 2, "track_studies": 1}
"""There are two studies, of one model."""


def experiments(**jobs: int) -> dict[str, int]:
    """The jobs of some experiments, each of which is joined, drawn and logged."""
    n = len(jobs)
    return {**jobs, "join_runs": n, "experiment_figure": n, "track_experiment": n}


NOISE = experiments(label_noise=2)
"""Label noise with two seeds, each with a survey of its own."""
APART = experiments(components=4)
"""The method taken apart: two models, the boosted trees, and what is not trained."""
BOTH = experiments(label_noise=2, components=4)
NOT_TREES = experiments(label_noise=2, components=3)
"""The training settings do not concern the boosted trees."""
BASELINE = {"boosted_trees": 1}
LEARNED = {**TRAINED, **STUDIED, **BASELINE, **APART}
"""Jobs after a change of the voxels."""
FROM_CROPS = {**LEARNED, "voxelisation_time": 1, "dataset_tables": 1}
"""Jobs after a change of the crops."""
SETTINGS = {"resolved_config": 1}
"""The resolved configuration is written after each change of a setting."""

MISSING = re.compile(r"Missing output files: ([^;\n]+)")

# Surveys


def test_a_new_survey_in_the_sheet_runs_its_own_jobs_and_the_report(project):
    shutil.copy(project.folder / "data/own.laz", project.folder / "data/another.laz")
    project.add_row("another", "data/another.laz", "edp", "new")
    assert project.planned() == {"check": 1, **CLASSIFIED}


def test_a_file_put_into_the_inbox_runs_its_own_jobs_and_the_report(project):
    inbox = project.folder / "surveys"
    inbox.mkdir()
    shutil.copy(project.folder / "data/own.laz", inbox / "Line 7.laz")
    assert project.planned() == {"check": 1, **CLASSIFIED}
    assert "Classifying Line_7" in project.run("-n")


def test_a_survey_to_train_on_makes_a_larger_dataset_and_reads_no_other_survey_again(project):
    shutil.copy(project.folder / "data/own.laz", project.folder / "data/another.laz")
    project.add_row("another", "data/another.laz", "edp", "train")
    own = {"check": 1, "towers": 1, "crops": 1, "voxels": 1, "tower_map": 1,
           "survey_map": 1}  # fmt: skip
    assert project.planned() == {**own, "split": 1, **FROM_CROPS}


def test_touching_a_survey_runs_nothing(project):
    (project.folder / "data/own.laz").touch()
    assert project.planned() == {}


def test_replacing_a_survey_by_an_older_file_runs_its_jobs(project):
    survey = project.folder / "data/own.laz"
    other = project.folder / "other.laz"
    other.write_bytes(survey.read_bytes() + b"\0")
    os.utime(other, (1_000_000_000, 1_000_000_000))
    shutil.copy2(other, survey)  # as cp -p and rsync -a do
    assert project.planned() == {"check": 1, **PREDICTED}


def test_naming_other_class_codes_runs_the_jobs_that_read_them(project):
    project.edit("config/surveys.tsv", "own.laz\tedp", "own.laz\tasprs")
    assert project.planned() == {"check": 1, "report": 1}


def test_the_order_and_the_date_of_the_sheet_have_no_effect(project):
    sheet = project.folder / "config/surveys.tsv"
    header, *rows = sheet.read_text().splitlines()
    sheet.write_text("\n".join([header, "# mine", *reversed(rows)]) + "\n")
    assert project.planned() == {}


def test_removing_a_survey_from_the_sheet_only_writes_the_report_again(project):
    project.edit("config/surveys.tsv", "own\tdata/own.laz\tedp\tnew\n", "")
    assert project.planned() == {"report": 1}


def test_another_recipe_generates_one_synthetic_survey_again(project):
    project.edit("config/config.yaml", "seed: 2", "seed: 22")
    own = {"synthesize": 1, "check": 1, "towers": 1, "crops": 1, "voxels": 1, "tower_map": 1,
           "survey_map": 1}  # fmt: skip
    assert project.planned() == {**SETTINGS, **own, "split": 1, **FROM_CROPS}


# Settings


def test_another_emphasis_of_the_loss_trains_again_and_prepares_nothing(project):
    project.configure({"training.loss.alpha": 2.0})
    assert project.planned() == {**SETTINGS, **TRAINED, **STUDIED, **NOT_TREES}


def test_swapping_the_values_of_two_settings_trains_again(project):
    """Snakemake compares the parameters as a set, which does not see the swap."""
    project.configure({"training.loss": {"alpha": 0.1, "epsilon": 5.0}})
    assert project.planned() == {**SETTINGS, **TRAINED, **STUDIED, **NOT_TREES}


def test_writing_out_a_default_changes_nothing(project):
    project.configure({"training.loss": {"alpha": 5, "epsilon": 0.1}, "towers.eps": 10})
    assert project.planned() == {}


def test_a_setting_of_one_stage_runs_that_stage_and_what_follows(project):
    project.configure({"detection.eps": 7.0})
    after = {"evaluate": 4, "tables": 1, **SHOWN}
    assert project.planned() == {**SETTINGS, **after, **PREDICTED, **BASELINE, **APART}


def test_another_resolution_keeps_the_existing_grids(project):
    project.configure({"voxels.resolution": 64})
    assert project.planned() == {**SETTINGS, "voxels": 2, **LEARNED, **BOTH}
    assert (project.results / "voxels/first/cube-32/manifest.json").exists()


def test_predicting_with_another_model_trains_nothing(project):
    project.configure({"predict.model": "cnn"})
    drawn = experiments(components=1)  # the random parameters are those of the model that predicts
    assert project.planned() == {**SETTINGS, **PREDICTED, **SHOWN, **drawn, "tables": 1}


def test_one_more_seed_trains_only_that_seed(project):
    project.configure({"seeds": [0, 1, 2]})
    own = {"train_scenenet": 1, "train_cnn": 1, "tune_scenenet": 1, "tune_cnn": 1, "evaluate": 2}
    assert project.planned() == {**SETTINGS, **TRAINED, **BASELINE, **APART, **own}


def test_one_seed_less_trains_nothing(project):
    project.configure({"seeds": [0]})
    picked = {"champion_scenenet": 1, "champion_cnn": 1, "certificate": 2, "inference_time": 2}
    gathered = {**picked, "tables": 1, **SHOWN}
    assert project.planned() == {**SETTINGS, **gathered, **PREDICTED, **BASELINE, **APART}


def test_one_more_model_leaves_the_others_alone(project):
    kernel = {"name": "tall", "kind": "scenenet", "kernel_size": [15, 5, 5]}
    models = [{"name": n, "kind": n} for n in ("scenenet", "cnn")]
    project.configure({"models": [*models, kernel]})
    own = {"train_scenenet": 2, "tune_scenenet": 2, "evaluate": 2, "champion_scenenet": 1}
    own |= {"certificate": 1, "inference_time": 1}
    gathered = {"tables": 1, "figures": 1, "track": 1, "register": 1, "report": 1}
    assert project.planned() == {**SETTINGS, **own, **gathered, **experiments(components=1)}


def test_another_study_runs_itself_and_what_shows_it(project):
    study = {"name": "seeds", "title": "t", "place": "5.3", "asks": "?", "seeds": [0, 1]}
    studies = [*project.configured("studies"), {**study, "variants": [{"name": "as it is"}]}]
    project.configure({"studies": studies})
    own = {"study": 1, "join_study": 1, "study_figure": 1, "track_studies": 1}
    shown = {"tables": 1, "report": 1, "mlflow_store": 1, "track": 1, "register": 1}
    assert project.planned() == {**SETTINGS, **own, **shown, "track_experiment": 2}


def test_another_share_of_wrong_labels_trains_on_these_alone(project):
    project.configure({"label_noise.levels": [0, 0.3]})
    assert project.planned() == {**SETTINGS, **NOISE, "tables": 1, "report": 1}


def test_one_more_seed_of_wrong_labels_trains_only_that_seed(project):
    project.configure({"label_noise.seeds": [0, 1, 2]})
    assert project.planned() == {**SETTINGS, **NOISE, "label_noise": 1, "tables": 1, "report": 1}


def test_cross_validation_is_one_job_per_model_and_reads_the_existing_grids(project):
    project.configure({"cross_validation": {"leave_out": 2}})
    own = experiments(cross_validation=3, components=4)
    logged = {
        "mlflow_store": 1,
        "track": 1,
        "track_studies": 1,
        "track_experiment": 3,
        "register": 1,
    }
    assert project.planned() == {**SETTINGS, **own, **logged, "tables": 1, "report": 1}


# Code


def test_touching_every_script_and_module_runs_nothing(project):
    for folder in ("workflow", "scenenet"):
        for file in (project.folder / folder).rglob("*.py"):
            file.touch()
    for file in ("Snakefile", "workflow/Snakefile"):
        (project.folder / file).touch()
    assert project.planned() == {}


def test_editing_a_docstring_or_a_comment_runs_nothing(project):
    file = project.folder / "scenenet/training/train.py"
    text = file.read_text()
    assert text.startswith('"""')
    file.write_text(text.replace('"""', '"""Again: ', 1) + "# the end\n")
    assert project.planned() == {}


def test_editing_the_training_loop_trains_again_and_prepares_nothing(project):
    with (project.folder / "scenenet/training/train.py").open("a") as stream:
        stream.write("NOTHING = 0\n")
    assert project.planned() == {**TRAINED, **STUDIED, **BOTH}


def test_a_new_kernel_trains_again(project):
    """All figures are drawn by one script, which knows the kernels."""
    kernels = project.folder / "scenenet/geneo/kernels"
    (kernels / "cone.py").write_text("# to come\nNOTHING = 0\n")
    drawn = {"tower_map": 2, "survey_map": 2, "dataset_tables": 1}
    assert project.planned() == {**LEARNED, **BOTH, **drawn}


def test_editing_a_kernel_from_outside_trains_its_models_again(project):
    ring = project.folder / "data/ring.py"
    ring.write_text(RING)
    model = {"name": "rings", "kind": "scenenet", "geneos": ["cylinder", "ring"]}
    models = [{"name": n, "kind": n} for n in ("scenenet", "cnn")]
    project.configure({"kernels": ["data/ring.py"], "models": [*models, model]})
    others, own = (f"results/train/{name}/seed-0/model.json" for name in ("scenenet", "rings"))
    assert project.planned(others) == {}
    project.run(own)
    assert '"file": "ring.py"' in (project.folder / own).read_text()
    assert project.planned(own, others) == {}
    ring.write_text(f"{RING}# another digest\n")
    assert project.planned(own, others) == {"train_scenenet": 1}


def test_editing_the_report_writes_the_report_again(project):
    with (project.folder / "scenenet/report/assets/style.css").open("a") as stream:
        stream.write("p { color: black }\n")
    assert project.planned() == {"report": 1}


def test_editing_the_check_reads_no_survey_for_the_dataset(project):
    with (project.folder / "scenenet/pointcloud/quality/check.py").open("a") as stream:
        stream.write("NOTHING = 0\n")
    assert project.planned() == {"check": 3, "tables": 1, "dataset_tables": 1, "report": 1}


def test_editing_the_command_line_runs_nothing(project):
    with (project.folder / "scenenet/cli/app.py").open("a") as stream:
        stream.write("NOTHING = 0\n")
    assert project.planned() == {}


def test_editing_a_script_runs_its_rule(project):
    with (project.folder / "workflow/scripts/predict.py").open("a") as stream:
        stream.write("NOTHING = 0\n")
    assert project.planned() == PREDICTED


# Results


def test_every_result_file_is_a_target(project):
    """Snakemake makes a missing file again only if it is a target, or if a job that runs reads it.

    One dry run in which everything is made again shows the targets; to delete each of 200 files in
    turn would take an hour.
    """
    first = ("synthesize", "check", "resolved_config", "label_noise", "mlflow_store")
    shown = project.run("-n", "--quiet", "host", "--forcerun", *first)
    last = shown.partition("All results are complete\nReason: ")[2].partition("\n")[0]
    targets = set(last.partition("Input files updated by another job: ")[2].split(", "))
    written = {
        path.relative_to(project.folder).as_posix()
        for path in project.results.rglob("*")
        if path.is_file()
    }
    # Results are complete without synthetic surveys; they are made again for a job that reads them.
    others = ("logs", "benchmarks", "synthetic")
    results = {path for path in written if path.split("/")[1] not in others}
    assert len(results) > 150
    assert results - targets == set()


@pytest.mark.parametrize(
    "files",
    [
        # Nothing but the report depends on these.
        (
            "check/own/report.json",
            "figures/surveys.png",
            "figures/labels-first.json",
            "interactive_crop/best.json",
            "inference_time/cnn.json",
            "certificate/scenenet.json",
            "tables/seeds.csv",
            "tables/scores.json",
            "mlflow/registry.json",
            "train/cnn/seed-0/resources.json",
            "predict/own/own.towers.geojson",
            "study/ablations/times.csv",
            "label_noise/times.csv",
            "config.yaml",
        ),
        ("towers/first/towers.csv", "evaluate/scenenet/seed-1.provenance.json"),
        ("split/split.csv", "tune/cnn/seed-0.json", "models/cnn.safetensors"),
    ],
)
def test_deleted_results_are_missed(project, files):
    for file in files:
        (project.results / file).unlink()
    shown = project.run("-n", "--quiet", "host")
    missed = set(re.findall(r"results/[^\s,;]+", " ".join(MISSING.findall(shown))))
    assert {f"results/{file}" for file in files} <= missed


def test_a_deleted_synthetic_survey_is_made_again_for_the_job_that_reads_it(project):
    (project.results / "synthetic/first.laz").unlink()
    assert project.planned() == {}
    (project.results / "check/first/report.json").unlink()
    assert project.planned()["synthesize"] == 1


@pytest.mark.parametrize("file", ["crops.zarr.zip", "manifest.json"])
def test_a_deleted_store_or_manifest_is_made_again(project, file):
    (project.results / "crops/first" / file).unlink()
    assert project.planned() == {"crops": 1, "split": 1, "voxels": 1, **FROM_CROPS}


def test_a_deleted_cache_of_voxels_is_made_again(project):
    (project.results / "voxels/second/cube-32/voxels.zarr.zip").unlink()
    assert project.planned() == {"voxels": 1, **TRAINED, **BASELINE, **APART}


@pytest.mark.parametrize(
    ("file", "rule"), [("evaluate/cnn/seed-1.json", "evaluate"), ("tables/models.csv", "tables")]
)
def test_a_deleted_result_is_made_again(project, file, rule):
    (project.results / file).unlink()
    assert project.planned()[rule] == 1


def test_a_deleted_prediction_is_made_again(project):
    (project.results / "predict/own/own.laz").unlink()
    assert project.planned() == PREDICTED


def test_a_deleted_mlflow_store_is_made_again_with_all_its_runs(project):
    (project.folder / "mlflow.db").unlink()
    logged = {"track": 1, "track_studies": 1, "track_experiment": 2, "register": 1}
    assert project.planned() == {"mlflow_store": 1, **logged, "report": 1}


def test_an_emptied_mlflow_store_is_made_again_with_all_its_runs(project):
    (project.folder / "mlflow.db").write_bytes(b"")
    assert project.planned()["mlflow_store"] == 1


def test_a_store_that_cannot_be_made_loses_no_run_of_others(project):
    """Snakemake restores or deletes the outputs of a job that fails; the database is none."""
    script = project.folder / "workflow/scripts/mlflow_store.py"
    script.write_text(
        "import sqlite3\n"
        "with sqlite3.connect('mlflow.db') as store:\n"
        "    store.execute(\"UPDATE experiments SET name = 'by another' WHERE name = 'Default'\")\n"
        "raise SystemExit('stopped')\n"
    )
    assert project.snakemake("--until", "mlflow_store").returncode == 1
    with sqlite3.connect(project.folder / "mlflow.db") as store:
        names = {name for (name,) in store.execute("SELECT name FROM experiments")}
    assert "by another" in names
    assert project.planned()["mlflow_store"] == 1


def test_runs_that_other_users_log_to_mlflow_run_nothing(project):
    (project.folder / "mlflow.db").touch()
    assert project.planned() == {}


def test_other_published_numbers_are_compared_without_training(project):
    project.edit("config/thesis.yaml", "source: ", "source: Once more, ")
    drawn = {"figures": 1, "study_figure": 2, "track": 1, "track_studies": 1, "register": 1}
    assert project.planned() == {"tables": 1, "dataset_tables": 1, **drawn, "report": 1}
