"""Every reproduced table and figure of thesis chapters 4 and 5 is in the results, and
has the numbers of the thesis, if there are any."""

from __future__ import annotations

import re

import pandas as pd
import pytest
import yaml
from markupsafe import escape

from scenenet.core.files import read_json

pytestmark = pytest.mark.workflow

TABLES = {
    "Table 5.1": ("tables/classes.csv", "thesis_percent"),
    "5.1.2": ("tables/towers.csv", "thesis_mean"),
    "5.1.4": ("tables/voxelisation.csv", "thesis_seconds"),
    "Table 5.3": ("tables/models.csv", "thesis_precision"),
    "Figure 5.5": ("tables/parameters.csv", "thesis"),
    "5.2.6, training": ("tables/times.csv", "thesis_training_seconds"),
    "5.2.6, inference": ("tables/times.csv", "thesis_inference_ms"),
    "5.2.6, useful CNN": ("tables/times.csv", "thesis_useful_seconds"),
    "3.4, 4.3": ("tables/certificate.csv", "thesis"),
    "Table 5.5": ("tables/study-ablations.csv", "thesis_precision"),
    "5.2.6, starts": ("tables/study-starts.csv", "alive"),
    "chapter 5": ("tables/published_numbers.csv", "thesis"),
}
FIGURES = {
    "Figures 4.2-4.4": "kernels-scenenet",
    "Figure 5.1": "labels-first",
    "Figure 5.3": "surveys",
    "Figure 5.2": "clusters-first",
    "Figure 5.4": "voxels",
    "Figure 5.5": "parameters-scenenet",
    "Figure 5.7": "precision-recall",
    "Figures 5.8, 5.9, best": "crop-best",
    "Figures 5.8, 5.9, median": "crop-median",
    "Figures 5.8, 5.9, worst": "crop-worst",
    "Figure 5.10": "resolutions",
    "Table 5.5": "study-ablations",
    "5.2.5": "label_noise",
    "5.2.6, starts": "study-starts",
}
STUDIES = {
    "without-training": "Table 5.3",
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
def test_a_table_exists_with_the_numbers_of_the_thesis(finished, place):
    path, published = TABLES[place]
    table = pd.read_csv(finished.results / path)
    assert len(table) > 0
    assert table[published].notna().any()


@pytest.mark.parametrize("place", FIGURES)
def test_a_figure_exists_with_a_caption_and_an_alternative_text(finished, place):
    picture = finished.results / "figures" / f"{FIGURES[place]}.png"
    assert picture.stat().st_size > 5000
    entry = read_json(picture.with_suffix(".json"))
    assert len(entry["caption"]) > 60
    assert len(entry["alt"]) > 40


def test_5_2_5_is_an_experiment_with_label_noise_scored_against_the_truth_as_well(finished):
    table = pd.read_csv(finished.results / "tables" / "label_noise.csv")
    assert set(table["model"]) == {"the labels", "scenenet", "cnn", "boosted trees"}
    assert list(table["level"].unique()) == [0.0, 0.4]
    assert (table["share"] - table["level"]).abs().max() < 0.05
    labels = table[table["model"] == "the labels"].set_index("level")
    assert labels.loc[0.0, "truth_f05"] == 1 > labels.loc[0.4, "truth_f05"]
    runs = pd.read_csv(finished.results / "label_noise" / "runs.csv")
    assert len(runs) == 2 * 2 * 4  # levels, seeds, models and the labels
    logged = read_json(finished.results / "mlflow" / "label_noise.json")
    assert logged["experiment"].endswith("-label_noise")
    page = (finished.results / "report" / "index.html").read_text()
    assert "Label noise" in page


@pytest.mark.parametrize("place", FIGURES)
def test_a_figure_is_on_the_page_and_names_its_counterpart_in_the_thesis(finished, place):
    entry = read_json(finished.results / "figures" / f"{FIGURES[place]}.json")
    page = (finished.results / "report" / "index.html").read_text(encoding="utf-8")
    assert escape(entry["alt"]) in page
    number = re.search(r"\d[.\d]*\d", place)
    assert number[0] in entry["caption"], entry["caption"]


def test_the_three_kernels_are_drawn_before_training_and_after(finished):
    entry = read_json(finished.results / "figures" / "kernels-scenenet.json")
    for kernel in ("cylinder", "arrow", "negative_sphere"):
        for stage in ("at the start", "trained"):
            assert f"{kernel} {stage} from" in entry["alt"]
    assert "drawn from the seed" in entry["caption"]


def test_every_parameter_is_in_metres_with_a_sentence(finished):
    table = pd.read_csv(finished.results / "tables" / "parameters.csv")
    assert len(table) == 12
    assert set(table["unit"].astype(str)) == {"m", "m^2", "1"}
    assert table["initial"].notna().all()
    assert (table["sentence"].str.len() > 20).all()
    page = (finished.results / "report" / "index.html").read_text(encoding="utf-8")
    for sentence in table["sentence"]:
        assert escape(sentence) in page


def test_times_are_measured_and_memory_is_that_of_a_process_with_torch(finished):
    table = pd.read_csv(finished.results / "tables" / "times.csv").set_index("model")
    for model in ("scenenet", "cnn"):
        row = table.loc[model]
        assert row["inference_ms"] > 0
        assert row["inference_ms_128"] > 0
        assert row["training_seconds"] > 0
    assert (table["peak_memory_mb"] > 100).all()
    alone = read_json(finished.results / "train/scenenet/seed-0/resources.json")["peak_memory_mb"]
    assert 100 < alone <= table.loc["scenenet", "peak_memory_mb"] + 1  # rounded
    assert "boosted trees" in table.index


def test_properties_are_verified_and_the_opening_names_the_model_that_classifies(finished):
    table = pd.read_csv(finished.results / "tables" / "certificate.csv")
    ours = table[table["model"] == "scenenet"].set_index("property")
    assert len(ours) == 8
    for exact in ("translation by whole voxels", "quarter turns about z"):
        assert bool(ours.loc[f"equivariant under {exact}", "holds"])
    page = (finished.results / "report" / "index.html").read_text(encoding="utf-8")
    opening = page[page.index('id="overview"') :].partition("</section>")[0]
    for entry in (
        "scenenet, a SCENE-Net with 11 parameters",
        "classifies the new surveys",
        "cnn, a convolutional network",
        "boosted trees, gradient boosted decision trees",
    ):
        assert entry in opening


@pytest.mark.parametrize("rank", ["best", "median", "worst"])
def test_figure_5_6_is_a_crop_with_the_contribution_of_each_geneo(finished, rank):
    scene = read_json(finished.results / "interactive_crop" / f"{rank}.json")
    assert list(scene["shares"]) == ["cylinder", "arrow", "negative_sphere"]


def test_every_study_of_the_thesis_is_in_the_configuration(project_root):
    studies = yaml.safe_load((project_root / "config" / "studies.yaml").read_text())["studies"]
    assert STUDIES.items() <= {study["name"]: study["place"] for study in studies}.items()


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
"""Values added to these: the epsilon of 5.2.1, and our learning rate."""


@pytest.mark.parametrize("name", LISTED)
def test_a_study_varies_what_the_thesis_lists(project_root, name):
    studies = yaml.safe_load((project_root / "config" / "studies.yaml").read_text())["studies"]
    (vary,) = [study["vary"] for study in studies if study["name"] == name]
    assert vary.keys() == LISTED[name].keys()
    for setting, listed in LISTED[name].items():
        missing = [value for value in listed if value not in vary[setting]]
        more = [value for value in vary[setting] if value not in listed]
        assert not missing
        assert set(map(str, more)) <= set(map(str, ADDED.get(name, [])))


def test_alpha_and_epsilon_make_the_55_combinations_that_the_thesis_counts(project_root):
    studies = yaml.safe_load((project_root / "config" / "studies.yaml").read_text())["studies"]
    (grid,) = [study["vary"] for study in studies if study["name"] == "alpha-epsilon"]
    assert [len(values) for values in grid.values()] == [11, 5]


def test_5_1_4_has_a_time_for_each_grid_of_the_thesis(finished):
    table = pd.read_csv(finished.results / "tables" / "voxelisation.csv").set_index("grid")
    assert list(table.index) == ["cube-32", "cube-64", "cube-128"]
    assert (table["seconds"] > 0).all()
    assert table["thesis_seconds"].notna().all()
    assert table["occupied_voxels"].is_monotonic_increasing
