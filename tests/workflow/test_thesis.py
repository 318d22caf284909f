"""Every table and figure of thesis chapters 4 and 5 that we make has its place in the results, and
holds the thesis' numbers where there are any."""

from __future__ import annotations

import pandas as pd
import pytest
import yaml

from scenenet.files import read_json

pytestmark = pytest.mark.workflow

TABLES = {
    "Table 5.1": ("tables/classes.csv", "thesis_percent"),
    "5.1.2": ("tables/towers.csv", "thesis_mean"),
    "5.1.4": ("tables/voxelisation.csv", "thesis_seconds"),
    "Table 5.3": ("tables/models.csv", "thesis_precision"),
    "5.2.6": ("tables/times.csv", "thesis_training_seconds"),
    "Table 5.5": ("tables/study-ablations.csv", "thesis_precision"),
    "chapter 5": ("tables/thesis_and_ours.csv", "thesis"),
}
FIGURES = {
    "Figures 4.2-4.4": "kernels-scenenet",
    "Figures 5.1, 5.3": "surveys",
    "Figure 5.2": "clusters-first",
    "Figure 5.4": "voxels",
    "Figure 5.5": "parameters-scenenet",
    "Figure 5.7": "precision-recall",
    "Figures 5.8, 5.9, best": "crop-best",
    "Figures 5.8, 5.9, median": "crop-median",
    "Figures 5.8, 5.9, worst": "crop-worst",
    "Table 5.5": "study-ablations",
    "5.2.5": "noise",
}
STUDIES = {
    "ablations": "Table 5.5",
    "kernel-after-training": "Table 5.4",
    "resolution-after-training": "5.2.7, Figure 5.10",
    "measurement": "5.3.2",
    "fidelity": "5.3.3",
    "penalty": "5.3.3, Figure 4.5",
    "alpha-epsilon": "5.3.3",
    "epochs": "5.3.4",
    "batch-size": "5.3.4",
    "learning-rate": "5.3.4",
    "decay": "5.3.4",
    "kernel-in-training": "5.3.4",
    "initialisation": "5.3.4",
    "starts": "5.2.6",
    "optimiser": "5.3.4",
    "split": "5.3.4",
}


@pytest.mark.parametrize("place", TABLES)
def test_a_table_is_there_with_the_thesis_beside(finished, place):
    path, published = TABLES[place]
    table = pd.read_csv(finished.results / path)
    assert len(table) > 0
    if place != "5.1.4":  # the thesis has times for 32, 64 and 128 voxels; the tiny run for one
        assert table[published].notna().any()
    assert published in table


@pytest.mark.parametrize("place", FIGURES)
def test_a_figure_is_there_with_a_caption_and_words_for_it(finished, place):
    picture = finished.results / "figures" / f"{FIGURES[place]}.png"
    assert picture.stat().st_size > 5000
    said = read_json(picture.with_suffix(".json"))
    assert len(said["caption"]) > 60
    assert len(said["alt"]) > 40


def test_5_2_5_is_a_study_of_wrong_labels_with_the_truth_beside(finished):
    table = pd.read_csv(finished.results / "tables" / "noise.csv")
    assert set(table["model"]) == {"the labels", "scenenet", "cnn", "black box"}
    assert list(table["level"].unique()) == [0.0, 0.4]
    assert (table["share"] - table["level"]).abs().max() < 0.05
    labels = table[table["model"] == "the labels"].set_index("level")
    assert labels.loc[0.0, "truth_f05"] == 1 > labels.loc[0.4, "truth_f05"]
    runs = pd.read_csv(finished.results / "noise" / "runs.csv")
    assert len(runs) == 2 * 2 * 4  # levels, seeds, models and the labels
    logged = read_json(finished.results / "mlflow" / "noise.json")
    assert logged["experiment"].endswith("-noise")
    page = (finished.results / "report" / "index.html").read_text()
    assert "Trained on wrong labels" in page


@pytest.mark.parametrize("rank", ["best", "median", "worst"])
def test_figure_5_6_is_a_crop_with_what_each_geneo_answers(finished, rank):
    scene = read_json(finished.results / "scenes" / f"{rank}.json")
    assert list(scene["shares"]) == ["cylinder", "arrow", "negative_sphere"]


def test_every_study_of_the_thesis_is_in_the_configuration(project_root):
    told = yaml.safe_load((project_root / "config" / "studies.yaml").read_text())["studies"]
    assert {study["name"]: study["place"] for study in told} == STUDIES


LISTED = {
    "alpha-epsilon": {
        "training.loss.alpha": [0.001, 0.1, 1, 2, 3, 5, 8, 10, 20, 50, 100],
        "training.loss.epsilon": [0.00001, 0.0001, 0.001, 0.01],
    },
    "epochs": {"training.epochs": [10, 25, 50, 100, 500, 1000]},
    "batch-size": {"training.batch_size": [2, 4, 8, 16, 24, 32]},
    "learning-rate": {"training.learning_rate": [0.1, 0.001, 0.0001, 0.00001]},
    "decay": {"training.decay": [0.05, 0.1, 0.2, 0.25], "training.decay_every": [10, 20, 25]},
    "kernel-in-training": {
        "kernel_size": [[6, 5, 5], [6, 6, 6], [9, 5, 5], [9, 6, 6], [8, 8, 8], [9, 9, 9]]
    },
    "optimiser": {"training.optimiser": ["sgd", "adam", "rmsprop"]},
}
"""Values that the thesis lists in 5.3.3 and 5.3.4."""
ADDED = {"alpha-epsilon": [0.1], "learning-rate": [0.01]}
"""What is tried besides: the epsilon of 5.2.1, and the rate that we use."""


@pytest.mark.parametrize("name", LISTED)
def test_a_study_varies_what_the_thesis_lists(project_root, name):
    told = yaml.safe_load((project_root / "config" / "studies.yaml").read_text())["studies"]
    (vary,) = [study["vary"] for study in told if study["name"] == name]
    assert vary.keys() == LISTED[name].keys()
    for setting, listed in LISTED[name].items():
        missing = [value for value in listed if value not in vary[setting]]
        more = [value for value in vary[setting] if value not in listed]
        assert not missing
        assert set(map(str, more)) <= set(map(str, ADDED.get(name, [])))


def test_alpha_and_epsilon_make_the_55_combinations_that_the_thesis_counts(project_root):
    told = yaml.safe_load((project_root / "config" / "studies.yaml").read_text())["studies"]
    (grid,) = [study["vary"] for study in told if study["name"] == "alpha-epsilon"]
    assert [len(values) for values in grid.values()] == [11, 5]
