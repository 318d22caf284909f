"""A small result folder, as the stages leave it, for tables, pictures, MLflow and the page."""

from __future__ import annotations

import json
from pathlib import Path

import laspy
import numpy as np
import pandas as pd
import pytest
import torch

from scenenet.certificates import certificate
from scenenet.figures import draw_all, plan
from scenenet.modelfile import ModelCard, write_model
from scenenet.models import SceneNet, new_model
from scenenet.protocol import ModelSettings, TrainingSettings
from scenenet.published import Thesis, read_thesis
from scenenet.report import write_report
from scenenet.results import Results
from scenenet.store import create
from scenenet.tables import write_tables

EPOCHS = 4
GROWTH = 0.9
"""What training multiplies every number of these models by."""
CROPS = ("north-0001", "north-0002", "north-0003")
DEAD = {("cnn", 1)}
"""Trainings that detect nothing."""

ORIGIN = np.array([512_000.0, 4_630_000.0, 100.0])


@pytest.fixture(scope="session")
def thesis(project_root: Path) -> Thesis:
    return read_thesis(project_root / "config" / "thesis.yaml")


@pytest.fixture
def growth() -> float:
    return GROWTH


@pytest.fixture
def results(tmp_path: Path) -> Results:
    """Two models of two seeds, one of these dead; one labelled and one classified survey."""
    made = Results(
        tmp_path / "results",
        models={"scenenet": "scenenet", "cnn": "cnn"},
        seeds=[0, 1],
        surveys=["north"],
        predicted=["fresh"],
    )
    _write_survey(made.folder)
    for model in made.models:
        for seed in made.seeds:
            _write_training(made.folder, model, seed)
        _write_facts(made.folder, model)
    _write_prediction(made.folder / "predict" / "fresh")
    return made


@pytest.fixture
def page(results: Results, thesis: Thesis, tmp_path: Path) -> Path:
    """The report of ``results``, with three of its pictures."""
    write_tables(results, thesis, results.folder / "tables")
    chosen = ("training-scenenet", "precision-recall", "prediction-fresh")
    draw_all([d for d in plan(results, thesis) if d.name in chosen], results.folder / "figures")
    out = tmp_path / "report" / "index.html"
    write_report(results, thesis, out)
    return out


def write_json(path: Path, data: object) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(data))


def write_csv(path: Path, rows: list[dict]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    pd.DataFrame(rows).to_csv(path, index=False)


def tower_crop(number: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) and EDP codes (N,) of a tower of 20 m on flat ground, under a wire."""
    rng = np.random.default_rng(number)
    ground = np.column_stack([rng.uniform(-20, 20, (3000, 2)), rng.normal(0, 0.05, 3000)])
    tower = np.column_stack([rng.uniform(-1, 1, (400, 2)), rng.uniform(0, 20, 400)])
    wire = np.column_stack([rng.uniform(-20, 20, 200), np.zeros(200), np.full(200, 19.0)])
    xyz = np.concatenate([ground, tower, wire]) + ORIGIN + [300 * number, 0, 0]
    return xyz, np.repeat(np.array([2, 15, 16], np.uint8), [3000, 400, 200])


def _write_survey(folder: Path) -> None:
    rows = [
        ("Ground", 2, 7000),
        ("Power line support tower", 15, 1000),
        ("Main power line", 16, 2000),
    ]
    classes = [
        {"code": code, "class": name, "points": n, "share_percent": n / 100}
        for name, code, n in rows
    ]
    write_csv(folder / "check" / "north" / "classes.csv", classes)
    write_json(folder / "check" / "north" / "report.json", {"warnings": ["no <CRS> is named"]})
    towers = [
        {"tower": i + 1, "x": ORIGIN[0] + 300 * i, "y": ORIGIN[1], "base": 100.0,
         "top": 100 + height, "height": height, "width": 4.0, "length": 5.0, "points": 400 + i,
         "spacing": spacing}
        for i, (height, spacing) in enumerate([(20.0, 290.0), (30.0, 310.0), (40.0, None)])
    ]  # fmt: skip
    write_csv(folder / "towers" / "north" / "towers.csv", towers)
    crops = folder / "crops" / "north"
    facts = {"survey": "north", "codes": "edp", "crops": []}
    with create(crops / "crops.zarr.zip", crops / "manifest.json", facts) as writer:
        for number, name in enumerate(CROPS):
            xyz, codes = tower_crop(number)
            writer.add(name, {"xyz": xyz, "classification": codes})
            facts["crops"].append({"id": name, "points": len(xyz)})
    times = [
        {"grid": grid, "crop": name, "seconds": seconds, "occupied": 4000, "tower": 100}
        for grid in ("cube-32", "cube-64", "cube-128")
        for name, seconds in zip(CROPS, (0.1, 0.2, 0.3), strict=True)
    ]
    write_csv(folder / "times" / "grids.csv", times)
    split = [{"survey": "north", "crop": name, "stretch": 0, "part": "test"} for name in CROPS]
    write_csv(folder / "split" / "split.csv", split)


def _write_training(folder: Path, model: str, seed: int) -> None:
    dead = (model, seed) in DEAD
    # scenenet: 0.8, 0.6; cnn: 0.4 and dead. Means and spreads can be worked out by hand.
    precision = 0.0 if dead else {"scenenet": 0.8, "cnn": 0.4}[model] - 0.2 * seed
    recall = 0.0 if dead else 0.2
    scores = {"precision": precision, "recall": recall, "f05": precision / 2,
              "iou_tower": recall / 2, "miou": 0.5 + recall / 4}  # fmt: skip
    shared = {"tau": 0.3, "n_samples": len(CROPS)}
    trivial = {"precision": 0.0, "recall": 0.0, "f05": 0.0, "iou_tower": 0.0, "miou": 0.499}
    per_sample = [scores | {"id": name, "f05": 0.1 * i} for i, name in enumerate(CROPS)]
    curve = {"tau": [0.1, 0.3, 0.9], "precision": [precision / 2, precision, 0.0],
             "recall": [2 * recall, recall, 0.0]}  # fmt: skip
    write_json(folder / "evaluate" / model / f"seed-{seed}.json", {
        "model": model, "seed": seed, "alive": not dead, "voxel": scores | shared,
        "voxel_trivial": trivial | shared, "voxel_occupied": scores | shared,
        "voxel_observer": scores | shared, "voxel_towers": scores | shared, "whole_towers": False,
        "towers": {"precision": 1.0, "recall": 0.5, "median_error_m": None if dead else 1.5,
                   "n_true": 3, "n_predicted": 2},
        "per_sample": per_sample, "pr_curve": curve, "average_precision": precision * recall,
    })  # fmt: skip
    write_json(
        folder / "tune" / model / f"seed-{seed}.json",
        {"tau": 0.3, "validation": scores | shared, "curve": curve},
    )
    card = ModelCard(
        name=model,
        codes="edp",
        measurement="presence",
        fit="cube",
        resolution=32,
        voxel_size=1.3,
        tau=0.3,
        provenance={"seed": seed},
    )
    settings = ModelSettings(name=model, kind=model, training=TrainingSettings(epochs=EPOCHS))
    network = new_model(settings, seed)
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.mul_(GROWTH)
    suffix = ".json" if model == "scenenet" else ".safetensors"
    write_model(folder / "models" / model / f"seed-{seed}{suffix}", network, card)
    parameters = network.shape_parameters() if isinstance(network, SceneNet) else {}
    history = [
        {"epoch": e, "loss": 1 / e, "fidelity": 0.9 / e, "penalty": 0.1 / e,
         "validation_loss": 1.1 / e, "seconds": 2.0, **{n: v * e for n, v in parameters.items()}}
        for e in range(1, EPOCHS + 1)
    ]  # fmt: skip
    training = folder / "train" / model / f"seed-{seed}"
    write_csv(training / "history.csv", history)
    write_json(training / "resources.json", {"peak_memory_mb": 500.0 + seed})
    write_json(training / "provenance.json", {
        "stage": "train", "settings": settings.model_dump(mode="json"), "seed": seed,
        "inputs": {"split": "sha256:abc"}, "code": "c0de", "config": "c0f19", "version": "0.1.0",
    })  # fmt: skip


def _write_facts(folder: Path, model: str) -> None:
    """What was worked out and timed for the model that predicts."""
    (file,) = (folder / "models" / model).glob("seed-0.*")
    write_json(folder / "certificates" / f"{model}.json", certificate(file))
    took = {"64": 8.0, "128": 50.0} if model == "scenenet" else {"64": 12.0}
    times = {"model": model, "seed": 0, "crops": 3, "inference_ms": took}
    write_json(folder / "times" / f"{model}.json", times)


def _write_prediction(folder: Path) -> None:
    folder.mkdir(parents=True)
    xyz, codes = tower_crop(0)
    header = laspy.LasHeader(version="1.4", point_format=6)
    header.scales, header.offsets = [0.001] * 3, ORIGIN
    header.add_extra_dim(laspy.ExtraBytesParams("tower_probability", np.float32))
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = xyz.T
    cloud["tower_probability"] = (codes == 15).astype(np.float32)
    cloud.write(folder / "fresh.laz")
    write_json(folder / "fresh.summary.json", {
        "survey": "surveys/fresh.laz", "model": "scenenet", "points": len(xyz), "towers": 1,
        "tau": 0.3, "voxel_size_m": 1.3, "crs": None, "seconds": 1.5,
    })  # fmt: skip
    shares = {"cylinder": 0.6, "arrow": 0.3, "negative_sphere": -0.1}
    properties = {"id": 1, "height": 20.1, "base_elevation": 100.0, "probability": 0.93,
                  "points": 400, "edge_distance": 18.5, "contributions": shares}  # fmt: skip
    point = {"type": "Point", "coordinates": ORIGIN[:2].tolist()}
    feature = {"type": "Feature", "id": 1, "geometry": point, "properties": properties}
    towers = {"type": "FeatureCollection", "features": [feature]}
    write_json(folder / "fresh.towers.geojson", towers)
