"""Pictures show the content of the result files, with an alternative text."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.image import imread

from scenenet.core.errors import InputError
from scenenet.experiments.published import Thesis
from scenenet.figures import draw_all, plan, read_pictures
from scenenet.figures.plots import curves as charts
from scenenet.figures.plots import grids
from scenenet.figures.plots import parameters as numbers
from scenenet.figures.plots import point_clouds as scenes
from scenenet.figures.selection import voxel_classes
from scenenet.pointcloud import PointCloud, class_scheme, write_las
from scenenet.results.folder import Results


def inked(path: Path) -> float:
    """Share of pixels that are not white."""
    return float((imread(path)[..., :3].min(axis=-1) < 0.99).mean())


def test_the_plan_names_every_picture_before_anything_has_run(tmp_path: Path):
    empty = Results(
        tmp_path, {"scenenet": "scenenet", "cnn": "cnn"}, seeds=[0], predicted=["fresh"]
    )
    names = [drawing.name for drawing in plan(empty, sources={"north": ("north.laz", "edp")})]
    assert names == [
        "labels-north", "clusters-north", "voxels", "precision-recall",
        "training-scenenet", "kernels-scenenet", "parameters-scenenet", "paths-scenenet",
        "training-cnn", "kernels-cnn", "crop-best", "crop-median", "crop-worst", "resolutions",
        "prediction-fresh",
    ]  # fmt: skip


def test_surveys_of_the_data_set_are_shown_in_one_figure(results: Results):
    names = {d.name: d.section for d in plan(results)}
    assert names["surveys"] == "data"


def test_a_folder_of_single_crops_has_no_map_of_its_towers(results: Results):
    names = [drawing.name for drawing in plan(results, sources={"ts40k": ("samples", "edp")})]
    assert "clusters-ts40k" not in names


def test_every_planned_picture_is_drawn_and_described(
    results: Results, thesis: Thesis, tmp_path: Path
):
    planned = plan(results, thesis)
    draw_all(planned, tmp_path / "figures")
    pictures = read_pictures(tmp_path / "figures", [drawing.name for drawing in planned])
    assert [p.name for p in pictures] == [d.name for d in planned]
    for picture in pictures:
        assert inked(picture.file) > 0.01, picture.name
        assert len(picture.alt) > 40, picture.name
        assert len(picture.caption) > 40, picture.name


def test_the_same_results_give_the_same_files(results: Results, tmp_path: Path):
    planned = [d for d in plan(results) if d.name in ("training-scenenet", "crop-best")]
    draw_all(planned, tmp_path / "a")
    draw_all(planned, tmp_path / "b")
    for name in ("training-scenenet.png", "training-scenenet.json", "crop-best.png"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_a_picture_that_went_missing_is_noticed(results: Results, tmp_path: Path):
    drawing = next(d for d in plan(results) if d.name == "training-cnn")
    (picture,) = draw_all([drawing], tmp_path)
    picture.file.unlink()
    with pytest.raises(InputError, match=r"training-cnn\.png: the picture is missing"):
        read_pictures(tmp_path, ["training-cnn"])


def test_crops_are_chosen_by_the_f05_of_the_seed_that_predicts(results: Results, tmp_path: Path):
    crops = [d for d in plan(results) if d.section == "crops"]
    captions = {p.name: p.caption for p in draw_all(crops, tmp_path)}
    assert "north-0003" in captions["crop-best"]
    assert "north-0002" in captions["crop-median"]
    assert "north-0001" in captions["crop-worst"]


def test_the_map_of_towers_counts_them_and_the_noise(results: Results, tmp_path: Path):
    rng = np.random.default_rng(0)
    at = np.repeat([[0.0, 0, 0], [300, 0, 0], [150, 80, 0]], [400, 400, 5], axis=0)
    xyz = rng.normal(at, 1.0) + np.array([500_000, 4_600_000, 50])
    codes = np.full(len(xyz), 15, np.uint8)
    write_las(tmp_path / "north.laz", PointCloud(xyz, codes, class_scheme("edp")))
    sources = {"north": (str(tmp_path / "north.laz"), "edp")}
    planned = plan(replace(results, models={}, predicted=[], surveys=[]), sources=sources)
    labels, picture = draw_all(planned, tmp_path)
    assert "Drawn: tower 100.0 %" in labels.alt
    assert "805 points labelled tower in 2 clusters" in picture.alt
    assert "5 points belong to none" in picture.alt


def test_the_area_below_a_curve_is_precision_times_recall_gained(tmp_path: Path):
    # Recall 0.2 at precision 1 and 0.4 more at precision 0.5: 0.2 + 0.2.
    curve = {"precision": [0.5, 1.0, 0.0], "recall": [0.6, 0.2, 0.0]}
    alt = charts.precision_recall({"scenenet": [curve]}, tmp_path / "curve.png")
    assert "area of 0.400" in alt


def test_a_dead_seed_halves_the_mean_area(tmp_path: Path):
    live = {"precision": [1.0, 0.0], "recall": [0.4, 0.0]}
    dead = {"precision": [0.0, 0.0], "recall": [0.0, 0.0]}
    alt = charts.precision_recall({"cnn": [live, dead]}, tmp_path / "curve.png")
    assert "area of 0.200 ± 0.283" in alt


def test_training_curves_say_where_they_start_and_end(tmp_path: Path):
    history = pd.DataFrame({"epoch": [1, 2, 3], "loss": [4.0, 2.0, 0.25]})
    alt = charts.training({"seed 7": history}, tmp_path / "loss.png")
    assert "seed 7 from 4 to 0.25" in alt


def test_kernels_and_parameters_of_any_number_can_be_drawn(tmp_path: Path):
    weights = {"one": np.zeros((9, 5, 5)), "two": np.ones((4, 6, 6))}
    numbers.kernels(weights, tmp_path / "kernels.png")
    numbers.parameters({"cylinder.r": [1.0]}, tmp_path / "one.png")
    numbers.parameters({"lambda.arrow": [0.2, 0.4], "arrow.r": [1, 2]}, tmp_path / "two.png")
    for name in ("kernels", "one", "two"):
        assert inked(tmp_path / f"{name}.png") > 0.01


def test_a_survey_is_turned_so_that_its_line_lies_flat(tmp_path: Path):
    steps = np.linspace(0, 1000, 2000)
    xyz = np.column_stack([steps * 0.6, steps * 0.8, np.zeros(2000)])
    alt = scenes.survey_overview(xyz, np.zeros(2000), np.zeros((0, 3)), tmp_path / "survey.png")
    assert "over 1000 m" in alt
    assert "0 detected towers" in alt


def test_a_voxel_has_the_colour_of_what_matters_most_in_it():
    groups = np.array(["ground", "tower", "ground", "vegetation", "conductor", "other"])
    voxel = np.array([7, 7, 3, 3, 9, 12])
    found = voxel_classes(groups, voxel, np.array([3, 7, 9, 12]))
    assert list(found) == ["vegetation", "tower", "conductor", "other"]


def test_axes_of_kernels_in_metres_reach_as_far_as_the_kernel(tmp_path: Path, monkeypatch):
    drawn = []
    monkeypatch.setattr(numbers, "save", lambda figure, out: drawn.append(figure))
    kernel = np.zeros((5, 3, 3))
    kernel[:, 1, 1] = 1
    numbers.kernels({"one": kernel}, tmp_path / "k.png", {"one": kernel / 2}, metres=0.5)
    (figure,) = drawn
    images = [axis.images[0] for axis in figure.axes if axis.images]
    assert [tuple(image.get_extent()) for image in images] == 2 * [
        (-0.75, 0.75, -1.25, 1.25),
        (-0.75, 0.75, -0.75, 0.75),
    ]
    # The same colours before and after.
    assert {image.get_clim() for image in images} == {(-1.0, 1.0)}
    assert figure.axes[0].get_xlabel() == "x [m]"


def test_an_even_kernel_reaches_further_up_than_down(tmp_path: Path, monkeypatch):
    drawn = []
    monkeypatch.setattr(numbers, "save", lambda figure, out: drawn.append(figure))
    numbers.kernels({"one": np.ones((4, 3, 3))}, tmp_path / "k.png")
    side = drawn[0].axes[0].images[0]
    assert tuple(side.get_extent()) == (-1.5, 1.5, -1.5, 2.5)


def test_parameters_are_drawn_with_initial_and_published_values(tmp_path: Path):
    alt = numbers.parameters(
        {"cylinder.r": [0.5, 0.7], "lambda.negative_sphere": [0.2, 0.4]},
        tmp_path / "p.png",
        {"cylinder.r": "m"},
        {"cylinder.r": 1.25},
        {"lambda.negative_sphere": 0.7634},
    )
    assert "cylinder.r 0.6 (initial 1.25)" in alt
    assert inked(tmp_path / "p.png") > 0.01


def test_a_crop_on_two_grids_counts_labelled_and_predicted_voxels(tmp_path: Path):
    rng = np.random.default_rng(0)
    views = []
    for size, n in ((1.0, 50), (0.5, 200)):
        centres = rng.uniform(0, 20, (n, 3))
        tower = np.arange(n) < n // 10
        views.append(grids.GridView(f"{size} m", centres, size, tower, np.linspace(1, 0, n)))
    alt = grids.labels_and_predictions(views, 0.9, tmp_path / "g.png")
    assert "1.0 m: 5 of 50 voxels labelled tower, 5 predicted" in alt
    assert "0.5 m: 20 of 200 voxels labelled tower, 20 predicted" in alt
    assert inked(tmp_path / "g.png") > 0.01
