"""Runs in a real MLflow store: one for each training, replaced and never duplicated."""

from __future__ import annotations

import json
import os
import shutil
import sqlite3
from dataclasses import dataclass, replace
from pathlib import Path

import mlflow
import numpy as np
import pandas as pd
import pytest
import torch
from fixtures.forked import tracker
from fixtures.result_folder import results_in, with_observer, with_truth
from mlflow import MlflowClient
from mlflow.entities import ViewType

from scenenet.convolution.occupancy import Occupancy
from scenenet.core.errors import InputError
from scenenet.experiments.run_tables import TIMES
from scenenet.experiments.studies.run import COLUMNS
from scenenet.experiments.studies.settings import StudySettings
from scenenet.figures import draw_all, plan
from scenenet.models.model_file import read_model
from scenenet.models.settings import BOOSTED_TREES
from scenenet.results.folder import Results
from scenenet.results.seed_result import parameter_columns
from scenenet.tracking.logged_model import example
from scenenet.tracking.model_runs import model_groups
from scenenet.tracking.registry import register_champions
from scenenet.tracking.run_log import RunGroup, RunRecord, log_runs
from scenenet.tracking.store import TrackingSettings, create_store, experiment_of, store_id
from scenenet.tracking.study_runs import note_of, study_groups


@pytest.fixture
def settings(empty_database: Path, tmp_path: Path) -> TrackingSettings:
    shutil.copyfile(empty_database, tmp_path / "mlflow.db")
    made = TrackingSettings(uri=f"sqlite:///{tmp_path / 'mlflow.db'}")
    create_store(made, tmp_path / "store.json")
    return made


@pytest.fixture
def client(settings: TrackingSettings) -> MlflowClient:
    return MlflowClient(tracking_uri=settings.uri)


@dataclass(frozen=True)
class Logged:
    """Results and the store in which they are; tests only read them."""

    client: MlflowClient
    settings: TrackingSettings
    results: Results
    folder: Path


@pytest.fixture(scope="module")
def logged(empty_database: Path, made_results: Path, tmp_path_factory) -> Logged:
    """The results of two models of two seeds and of the boosted trees, logged once."""
    folder = tmp_path_factory.mktemp("logged")
    shutil.copyfile(empty_database, folder / "mlflow.db")
    settings = TrackingSettings(uri=f"sqlite:///{folder / 'mlflow.db'}")
    create_store(settings, folder / "store.json")
    shutil.copytree(made_results, folder / "results")
    results = results_in(folder)
    record = json.loads((results.folder / "evaluate" / "scenenet" / "seed-1.json").read_text())
    box = results.folder / "boosted_trees" / "seed-1.json"
    box.parent.mkdir()
    box.write_text(json.dumps(record | {"model": BOOSTED_TREES}))
    planned = [d for d in plan(results) if d.name == "kernels-cnn"]
    pictures = draw_all(planned, folder / "figures")
    log(settings, results, folder, pictures=pictures, protocol="20/10/70 by stretch")
    return Logged(MlflowClient(tracking_uri=settings.uri), settings, results, folder)


@pytest.fixture
def one_model(results: Results) -> Results:
    """The results of the CNN alone: half of the runs, where a test logs more than once."""
    return replace(results, models={"cnn": "cnn"})


def runs(client: MlflowClient, view: int = ViewType.ACTIVE_ONLY) -> dict[str, list]:
    """Runs by name."""
    experiment = client.get_experiment_by_name("scenenet")
    found: dict[str, list] = {}
    for run in client.search_runs([experiment.experiment_id], run_view_type=view):
        found.setdefault(run.info.run_name, []).append(run)
    return found


CREATE = (
    "import sys; from scenenet.tracking.store import TrackingSettings, create_store;"
    "create_store(TrackingSettings(uri='sqlite:///mlflow.db'), sys.argv[1])"
)
CREATE_TWICE = """
import os, sys
from scenenet.tracking.store import TrackingSettings, create_store
child = os.fork()
create_store(TrackingSettings(uri="sqlite:///mlflow.db"), f"{int(child == 0)}.json")
if child:
    sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""
"""Two processes create the store at the same time."""
LIMIT_S = 600


def log(settings: TrackingSettings, results: Results, tmp_path: Path, **more) -> dict[str, str]:
    """Log everything; status of each run by the last part of its key."""
    groups = model_groups(results, "corridors", **more)
    written = log_runs(settings, groups, tmp_path / "runs.json", tmp_path / "store.json")
    return {key.split("/", 2)[2]: run["status"] for key, run in written["runs"].items()}


def test_a_training_is_a_run_with_all_its_facts(logged):
    (run,) = runs(logged.client)["scenenet seed 1"]
    assert run.info.status == "FINISHED"
    assert run.info.end_time - run.info.start_time == 8000
    assert run.data.params["training.epochs"] == "4"
    assert run.data.params["training.loss.alpha"] == "5.0"
    assert run.data.metrics["test_precision"] == pytest.approx(0.6)
    assert run.data.metrics["validation_f05"] == pytest.approx(0.3)
    assert run.data.metrics["towers_median_error_m"] == 1.5
    tags = run.data.tags
    assert (tags["model"], tags["seed"], tags["alive"]) == ("scenenet", "1", "true")
    assert tags["protocol"] == "20/10/70 by stretch"
    assert (tags["scenenet.config"], tags["scenenet.code"]) == ("c0f19", "c0de")
    assert tags["scenenet.data"]


def test_scores_against_the_truth_and_of_points_are_metrics(results):
    (before, *_) = model_groups(results, "corridors")
    names = before.children[0].metrics.keys() | before.parent.metrics.keys()
    assert not [name for name in names if "truth" in name or "points" in name]
    (group, *_) = model_groups(with_truth(results), "corridors")
    seed = group.children[0].metrics
    assert (seed["test_precision"], seed["truth_precision"]) == pytest.approx((0.8, 0.2))
    assert (seed["points_precision"], seed["truth_points_precision"]) == (0.5, 0.125)
    assert seed["truth_towers_median_height_error_m"] == 2.25
    assert group.parent.metrics["truth_precision_mean"] == pytest.approx(0.175)


def test_the_data_of_a_training_are_data_sets_with_their_fingerprint(logged):
    client = logged.client
    (run,) = runs(client)["scenenet seed 1"]
    inputs = {one.tags[0].value: one.dataset for one in run.inputs.dataset_inputs}
    assert set(inputs) == {"training", "validation", "test"}
    assert {data.digest for data in inputs.values()} == {run.data.tags["scenenet.data"]}
    assert inputs["test"].name == "corridors, test"
    source = mlflow.data.get_source(inputs["test"])
    assert source.uri == (logged.results.folder / "split" / "split.csv").as_posix()
    assert json.loads(inputs["test"].profile) == {"crops": 3}
    model = client.get_logged_model(run.outputs.model_outputs[0].model_id)
    measured_on = {metric.key: metric.dataset_name for metric in model.metrics}
    assert measured_on["test_f05"] == "corridors, test"
    assert measured_on["validation_f05"] == "corridors, validation"
    assert measured_on["tau"] is None


def test_every_tuned_model_is_a_logged_model_with_signature_and_example(logged):
    client = logged.client
    experiment = client.get_experiment_by_name("scenenet").experiment_id
    models = {model.name: model for model in client.search_logged_models([experiment])}
    assert set(models) == {f"{m}-seed-{s}" for m in ("scenenet", "cnn") for s in (0, 1)}
    model = models["scenenet-seed-1"]
    (run,) = runs(client)["scenenet seed 1"]
    assert model.source_run_id == run.info.run_id
    assert str(model.status) == "READY"
    assert model.params["training.epochs"] == "4"
    assert {m.key: m.value for m in model.metrics}["test_precision"] == pytest.approx(0.6)
    mlflow.set_tracking_uri(logged.settings.uri)
    info = mlflow.models.get_model_info(f"models:/{model.model_id}")
    assert info.signature.inputs.inputs[0].shape == (-1, -1, -1, -1)
    loaded = mlflow.pyfunc.load_model(f"models:/{model.model_id}")
    assert loaded.input_example.shape == example().shape
    assert loaded.predict(example()).shape == example().shape


def test_a_replaced_run_takes_its_logged_model_with_it(settings, client, one_model, tmp_path):
    log(settings, one_model, tmp_path)
    (before,) = runs(client)["cnn seed 0"]
    file = one_model.folder / "evaluate" / "cnn" / "seed-0.json"
    changed = json.loads(file.read_text())
    changed["voxel"]["precision"] = 0.9
    file.write_text(json.dumps(changed))
    log(settings, replace(one_model), tmp_path)
    experiment = client.get_experiment_by_name("scenenet").experiment_id
    logged = [model.model_id for model in client.search_logged_models([experiment])]
    assert len(logged) == 2
    assert before.outputs.model_outputs[0].model_id not in logged


def test_every_epoch_of_loss_and_parameters_is_there(logged):
    client = logged.client
    (run,) = runs(client)["scenenet seed 0"]
    history = client.get_metric_history(run.info.run_id, "loss")
    assert [(m.step, m.value) for m in history] == [(1, 1), (2, 0.5), (3, 1 / 3), (4, 0.25)]
    history = logged.results.seed("scenenet", 0).history
    names = parameter_columns(history)
    assert len(names) == 11 + 1  # the last weight is one minus the others
    for name in names:
        path = client.get_metric_history(run.info.run_id, name)
        assert [(m.step, m.value) for m in path] == list(enumerate(history[name], start=1))


def test_more_measures_than_mlflow_takes_at_once_are_all_logged(settings, client, tmp_path):
    long = RunRecord("k/long", "long", params={f"p{i}": i for i in range(230)},
                     history={"loss": [float(i) for i in range(2500)]},
                     epochs=list(range(1, 2501)), seconds=1.0)  # fmt: skip
    log_runs(settings, [RunGroup(RunRecord("k", "parent"), [long])], tmp_path / "runs.json")
    (run,) = runs(client)["long"]
    assert len(client.get_metric_history(run.info.run_id, "loss")) == 2500
    assert len(run.data.params) == 230


def test_model_and_figures_are_artifacts_next_to_the_database(logged):
    client = logged.client
    (run,) = runs(client)["scenenet seed 0"]
    paths = {
        a.path
        for folder in ("model", "figures")
        for a in client.list_artifacts(run.info.run_id, folder)
    }
    assert paths == {
        "model/seed-0.json", "figures/training.png", "figures/precision_recall.png"
    }  # fmt: skip
    (parent,) = runs(client)["cnn (corridors)"]
    (picture,) = client.list_artifacts(parent.info.run_id, "figures")
    assert picture.path == "figures/kernels-cnn.png"
    stored = logged.folder / "mlartifacts" / "scenenet" / run.info.run_id / "artifacts" / "model"
    assert (stored / "seed-0.json").read_bytes() == (
        logged.results.folder / "models" / "scenenet" / "seed-0.json"
    ).read_bytes()


def test_a_parent_has_the_summary_of_the_runs_under_it(logged):
    client = logged.client
    (parent,) = runs(client)["cnn (corridors)"]
    metrics = parent.data.metrics
    assert metrics["alive_share"] == 0.5
    assert metrics["test_precision_mean"] == pytest.approx(0.2)
    assert metrics["test_precision_std"] == pytest.approx(0.4 / 2**0.5)
    assert metrics["test_precision_live_mean"] == pytest.approx(0.4)
    assert metrics["trivial_miou"] == pytest.approx(0.499)
    assert metrics["champion_seed"] == 0
    for seed in (0, 1):
        (child,) = runs(client)[f"cnn seed {seed}"]
        assert child.data.tags["mlflow.parentRunId"] == parent.info.run_id


def test_the_boosted_trees_have_runs_like_the_models(logged):
    client = logged.client
    (parent,) = runs(client)["boosted trees (corridors)"]
    (seed,) = runs(client)["boosted trees seed 1"]
    assert seed.data.tags["mlflow.parentRunId"] == parent.info.run_id
    assert seed.data.tags["kind"] == BOOSTED_TREES
    assert parent.data.metrics["test_precision_mean"] == pytest.approx(0.6)
    assert [a.path for a in client.list_artifacts(seed.info.run_id)] == ["figures"]


def test_an_observer_has_a_run_whose_tag_says_what_it_finds(results):
    groups = model_groups(with_observer(results), "corridors")
    assert len(groups) == len(model_groups(results, "corridors")) + 2
    group = next(g for g in groups if g.parent.tags["model"] == "wires")
    [run] = group.children
    assert (run.tags["target"], group.parent.tags["target"]) == ("wire", "wire")
    assert run.datasets[0].source.endswith("square_split/wires/split.csv")
    assert run.artifacts.keys() == {"model/wires.json"}


def test_the_boosted_trees_beside_an_observer_have_a_run_of_their_own(results):
    groups = model_groups(with_observer(results), "corridors")
    group = next(g for g in groups if g.parent.tags["model"] == "boosted trees of wires")
    [run] = group.children
    assert (run.tags["kind"], run.tags["target"]) == (BOOSTED_TREES, "wire")
    assert run.metrics["test_precision"] == 0.8


def test_logging_again_keeps_every_run(settings, client, one_model, tmp_path):
    assert set(log(settings, one_model, tmp_path).values()) == {"logged"}
    before = {name: run[0].info.run_id for name, run in runs(client).items()}
    assert set(log(settings, one_model, tmp_path).values()) == {"kept"}
    assert {name: run[0].info.run_id for name, run in runs(client).items()} == before
    assert len(before) == 3


def test_a_changed_result_replaces_its_run_and_its_parent_alone(
    settings, client, results, tmp_path
):
    log(settings, results, tmp_path)
    file = results.folder / "evaluate" / "cnn" / "seed-0.json"
    changed = json.loads(file.read_text())
    changed["voxel"]["precision"] = 0.9
    file.write_text(json.dumps(changed))
    again = log(settings, replace(results), tmp_path)
    logged = {key for key, status in again.items() if status == "logged"}
    assert logged == {"cnn", "cnn/seed-0"}
    found = runs(client)
    assert {name: len(same) for name, same in found.items()} == dict.fromkeys(found, 1)
    assert found["cnn seed 0"][0].data.metrics["test_precision"] == 0.9
    # The seed that was kept moves under the new parent.
    parent = found["cnn (corridors)"][0].info.run_id
    assert found["cnn seed 1"][0].data.tags["mlflow.parentRunId"] == parent


def test_a_seed_that_is_no_longer_configured_leaves_the_group(settings, client, results, tmp_path):
    log(settings, results, tmp_path)
    log(settings, replace(results, seeds=[0]), tmp_path)
    assert sorted(runs(client)) == [
        "cnn (corridors)", "cnn seed 0", "scenenet (corridors)", "scenenet seed 0"
    ]  # fmt: skip


def test_other_data_and_runs_of_other_users_stay(settings, client, one_model, tmp_path):
    experiment = client.get_experiment_by_name("scenenet").experiment_id
    client.create_run(experiment, run_name="by hand")
    log(settings, one_model, tmp_path)
    log_runs(settings, model_groups(one_model, "ts40k"), tmp_path / "runs.json")
    found = runs(client)
    assert len(found["by hand"]) == 1
    assert len(found["cnn seed 0"]) == 2
    assert {"cnn (corridors)", "cnn (ts40k)"} <= set(found)


def test_an_interrupted_run_is_logged_again(settings, client, one_model, tmp_path):
    log(settings, one_model, tmp_path)
    (run,) = runs(client)["cnn seed 0"]
    client.delete_tag(run.info.run_id, "scenenet.digest")
    assert log(settings, one_model, tmp_path)["cnn/seed-0"] == "logged"
    assert len(runs(client)["cnn seed 0"]) == 1


def test_an_experiment_deleted_by_hand_is_restored_without_duplicates(
    settings, client, one_model, tmp_path
):
    log(settings, one_model, tmp_path)
    client.delete_experiment(client.get_experiment_by_name("scenenet").experiment_id)
    create_store(settings, tmp_path / "store.json")
    log(settings, one_model, tmp_path)
    assert [len(same) for same in runs(client).values()] == [1] * 3


def test_a_store_made_anew_has_another_id_and_the_old_record_is_refused(
    settings, empty_database, results, tmp_path
):
    before = store_id(settings.uri)
    assert json.loads((tmp_path / "store.json").read_text())["store"] == before
    create_store(settings, tmp_path / "store.json")
    assert store_id(settings.uri) == before
    (tmp_path / "mlflow.db").unlink()
    shutil.copyfile(empty_database, tmp_path / "mlflow.db")
    # As a later run of the workflow does: MLflow keeps a deleted database open within a process.
    made = tracker().call(CREATE, ["other.json"], tmp_path, os.environ, LIMIT_S)
    assert made.returncode == 0, made.stderr
    assert store_id(settings.uri) not in (None, before)
    with pytest.raises(InputError, match=r"mlflow\.db: is not the MLflow store that .*store\.json"):
        log(settings, results, tmp_path)


def test_a_database_with_runs_of_others_is_kept(empty_database, tmp_path):
    shutil.copyfile(empty_database, tmp_path / "mlflow.db")
    settings = TrackingSettings(uri=f"sqlite:///{tmp_path / 'mlflow.db'}")
    client = MlflowClient(tracking_uri=settings.uri)
    location = (tmp_path / "elsewhere").as_uri()
    other = client.create_run(client.create_experiment("other", location)).info.run_id
    create_store(settings, tmp_path / "store.json", experiments=["ablation"])
    assert client.get_run(other).info.run_id == other
    record = json.loads((tmp_path / "store.json").read_text())
    assert set(record["experiments"]) == {"scenenet", "ablation"}


def test_two_processes_may_make_the_store_at_once(tmp_path):
    made = tracker().call(CREATE_TWICE, [], tmp_path, os.environ, LIMIT_S)
    assert made.returncode == 0, made.stderr
    assert (tmp_path / "0.json").read_bytes() == (tmp_path / "1.json").read_bytes()


@pytest.mark.parametrize(
    ("revision", "reason"),
    [("ffffffffffff", "a newer version"), ("451aebb31d03", "an older version")],
)
def test_a_store_of_another_version_is_refused_and_left_as_it_is(
    empty_database, tmp_path, revision, reason
):
    database = tmp_path / "mlflow.db"
    shutil.copyfile(empty_database, database)
    connection = sqlite3.connect(database)
    connection.execute("UPDATE alembic_version SET version_num = ?", (revision,))
    # Every store that was used has an experiment; one without is taken for half made.
    connection.execute(
        "INSERT INTO experiments (experiment_id, name, artifact_location, lifecycle_stage) "
        "VALUES (7, 'theirs', 'elsewhere', 'active')"
    )
    connection.commit()
    connection.close()
    before = database.read_bytes()
    settings = TrackingSettings(uri=f"sqlite:///{database}")
    with pytest.raises(InputError, match=reason):
        create_store(settings, tmp_path / "store.json")
    assert database.read_bytes() == before


def test_a_file_that_is_no_store_is_refused(tmp_path):
    database = tmp_path / "mlflow.db"
    database.write_text("tower")
    settings = TrackingSettings(uri=f"sqlite:///{database}")
    with pytest.raises(InputError, match=r"mlflow\.db: is damaged, or is not an SQLite database"):
        create_store(settings, tmp_path / "store.json")
    assert database.read_text() == "tower"


def test_a_store_without_its_artifacts_is_refused(settings, tmp_path):
    moved = tmp_path / "moved"
    moved.mkdir()
    (tmp_path / "mlflow.db").rename(moved / "mlflow.db")
    shutil.rmtree(tmp_path / "mlartifacts")
    other = TrackingSettings(uri=f"sqlite:///{moved / 'mlflow.db'}")
    with pytest.raises(InputError, match="the store was moved"):
        create_store(other, tmp_path / "store.json")


def test_the_deprecated_folder_store_is_refused(tmp_path):
    with pytest.raises(InputError, match="MLflow refused the store"):
        create_store(TrackingSettings(uri=str(tmp_path / "mlruns")), tmp_path / "store.json")


def test_a_study_has_an_experiment_of_its_own_with_a_parent_for_each_variant(
    settings, results, tmp_path
):
    study = StudySettings(
        name="ablations", title="t", place="Table 5.5", asks="Which?", seeds=(0, 1),
        variants=({"name": "A", "changes": {"geneos": ["cylinder"]}}, {"name": "E"}),
    )  # fmt: skip
    one = dict.fromkeys((*COLUMNS, *TIMES), 0.5) | {"kind": "cnn", "lowest_weight": float("nan")}
    rows = [one | {"variant": v, "seed": s, "f05": 0.2 + s / 10} for v in "AE" for s in (0, 1)]
    table = pd.DataFrame(rows)
    own = experiment_of(settings, study.name)
    create_store(settings, tmp_path / "store.json", [own.experiment])
    runs_file = results.folder / "study" / study.name / "runs.csv"
    runs_file.parent.mkdir(parents=True)
    table.to_csv(runs_file, index=False)
    drawn = [d for d in plan(replace(results, studies=[study])) if d.section == "studies"]
    pictures = draw_all(drawn, tmp_path / "figures")
    made = {"config": "c0f19", "code": "c0de", "version": "0.1.0", "inputs": {"manifests": ["a"]}}
    groups = study_groups(study, table, "toys", "20/10/70 by stretch", made, pictures)
    note = note_of(study)
    written = log_runs(own, groups, tmp_path / "runs.json", tmp_path / "store.json", note)
    assert len(written["runs"]) == 6
    client = MlflowClient(tracking_uri=settings.uri)
    experiment = client.get_experiment_by_name("scenenet-ablations")
    logged = {r.info.run_name: r.data for r in client.search_runs([experiment.experiment_id])}
    assert logged["A"].metrics["test_f05"] == pytest.approx(0.25)
    assert logged["A"].metrics["test_f05_std"] == pytest.approx(0.0707107)
    assert logged["A, seed 1"].metrics["test_f05"] == pytest.approx(0.3)
    assert logged["A, seed 1"].params["geneos"] == '["cylinder"]'
    assert {logged[name].tags["kind"] for name in ("E", "A, seed 1")} == {"cnn"}
    assert "lowest_weight" not in logged["E"].metrics  # a CNN has none
    assert "test_f05_std" in logged["A"].metrics and "epochs_std" not in logged["A"].metrics
    for name, seed in (("E", None), ("E, seed 0", "0")):
        tags = logged[name].tags
        assert (tags["study"], tags["model"], tags["dataset"]) == ("ablations", "scenenet", "toys")
        assert (tags["protocol"], tags["variant"]) == ("20/10/70 by stretch", "E")
        assert tags["scenenet.code"] == "c0de" and tags["scenenet.data"]
        assert tags.get("seed") == seed
    description = client.get_experiment(experiment.experiment_id).tags["mlflow.note.content"]
    assert "Which?" in description and "Table 5.5" in description
    (run,) = client.search_runs(
        [experiment.experiment_id], "tags.variant = 'E' and tags.seed = '0'"
    )
    (data,) = (one.dataset for one in run.inputs.dataset_inputs)
    assert (data.name, data.digest) == ("toys", run.data.tags["scenenet.data"])
    parent = written["runs"]["study-ablations/toys/E"]["run_id"]
    (picture,) = client.list_artifacts(parent, "figures")
    assert picture.path == "figures/study-ablations.png"
    again = log_runs(own, groups, tmp_path / "runs.json")
    assert {run["status"] for run in again["runs"].values()} == {"kept"}
    # Another run of the same study takes another time and has the same scores.
    slower = study_groups(study, table.assign(training_seconds=9.0), "toys", "20/10/70", made)
    later = log_runs(own, slower, tmp_path / "runs.json")
    for key, run in later["runs"].items():
        first = written["runs"][key]
        assert run["status"] == "logged" and run["digest"] != first["digest"]
        assert run["scores"] == first["scores"]
        assert client.get_run(run["run_id"]).data.tags["scenenet.scores"] == run["scores"]
    better = study_groups(study, table.assign(f05=0.9), "toys", "20/10/70", made)
    assert better[0].parent.scores() != slower[0].parent.scores()


def test_the_best_seed_is_in_the_registry_and_predicts_a_batch_of_any_size(
    settings, results, tmp_path
):
    groups = model_groups(results, "toys")
    log_runs(settings, groups, tmp_path / "runs.json")
    arguments = (settings, results, "toys", tmp_path / "runs.json", tmp_path / "registry.json")
    registered = register_champions(*arguments)
    best = results.champion("scenenet")
    assert registered["scenenet-scenenet"]["seed"] == best.seed
    assert registered["scenenet-scenenet"]["version"] == 1
    grids = np.zeros((3, 9, 8, 7), np.float32)
    grids[0, 2:7, 3, 3] = grids[2, 4, 4, 4] = 1
    # In another process, as a user would load it.
    np.save(tmp_path / "grids.npy", grids)
    code = (
        "import sys, numpy as np, mlflow; mlflow.set_tracking_uri(sys.argv[1]);"
        "model = mlflow.pyfunc.load_model('models:/scenenet-scenenet@champion');"
        "grids = np.load(sys.argv[2] + '/grids.npy');"
        "np.save(sys.argv[2] + '/all.npy', model.predict(grids));"
        "np.save(sys.argv[2] + '/one.npy', model.predict(grids[2:]))"
    )
    loaded = tracker().call(code, [settings.uri, str(tmp_path)], tmp_path, os.environ, LIMIT_S)
    assert loaded.returncode == 0, loaded.stderr
    answer = np.load(tmp_path / "all.npy")
    assert answer.shape == grids.shape
    np.testing.assert_array_equal(np.load(tmp_path / "one.npy")[0], answer[2])
    model, _ = read_model(best.model_files[0])
    indices = [np.flatnonzero(grid) for grid in grids]
    with torch.no_grad():
        expected = model(Occupancy.of_grids(indices, None, (9, 8, 7))).numpy()
    np.testing.assert_allclose(answer, expected, atol=1e-6)

    again = register_champions(*arguments)
    assert again["scenenet-scenenet"]["version"] == 1, "the same champion is not a new version"
    # Another seed becomes the best: the alias moves, the first version stays.
    better = results.folder / "tune" / "scenenet" / f"seed-{1 - best.seed}.json"
    tuning = json.loads(better.read_text())
    tuning["validation"]["f05"] = 0.99
    better.write_text(json.dumps(tuning))
    changed = Results(results.folder, results.models, results.seeds, results.surveys)
    log_runs(settings, model_groups(changed, "toys"), tmp_path / "runs.json")
    moved = register_champions(settings, changed, *arguments[2:])
    new = moved["scenenet-scenenet"]
    assert (new["seed"], new["version"]) == (1 - best.seed, 2)
    client = MlflowClient(tracking_uri=settings.uri)
    assert client.get_model_version_by_alias("scenenet-scenenet", "champion").version == 2
    assert len(client.search_model_versions("name = 'scenenet-scenenet'")) == 2
    # The first version can still be loaded.
    mlflow.set_tracking_uri(settings.uri)
    old = mlflow.pyfunc.load_model("models:/scenenet-scenenet/1")
    np.testing.assert_allclose(old.predict(grids), expected, atol=1e-6)


def test_the_best_of_all_models_is_the_champion_of_the_run(settings, results, tmp_path):
    """The champion of each model has its own name; the name of the run is the best of all."""
    client = MlflowClient(tracking_uri=settings.uri)
    arguments = (settings, results, "toys", tmp_path / "runs.json", tmp_path / "registry.json")
    log_runs(settings, model_groups(results, "toys"), tmp_path / "runs.json")
    registered = register_champions(*arguments)
    assert set(registered) == {"scenenet", "scenenet-scenenet", "scenenet-cnn"}
    assert registered["scenenet"]["model"] == "scenenet"
    version = client.get_model_version_by_alias("scenenet", "champion")
    assert version.run_id == registered["scenenet-scenenet"]["run_id"]
    assert (version.tags["model"], version.tags["seed"]) == ("scenenet", "0")
    # The CNN becomes the best.
    tuned = results.folder / "tune" / "cnn" / "seed-0.json"
    tuning = json.loads(tuned.read_text())
    tuning["validation"]["f05"] = 0.99
    tuned.write_text(json.dumps(tuning))
    changed = Results(results.folder, results.models, results.seeds, results.surveys)
    log_runs(settings, model_groups(changed, "toys"), tmp_path / "runs.json")
    moved = register_champions(settings, changed, *arguments[2:])
    assert (moved["scenenet"]["model"], moved["scenenet"]["version"]) == ("cnn", 2)
    assert moved["scenenet-scenenet"]["version"] == 1
    version = client.get_model_version_by_alias("scenenet", "champion")
    assert version.tags["model"] == "cnn"
    assert (moved["scenenet"]["seed"], version.run_id) == (0, moved["scenenet-cnn"]["run_id"])
