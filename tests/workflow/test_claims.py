"""The numbers in tables and page are calculated again from models, voxels and split, without code
of the package: kernels from the formulas of the thesis, convolution by shifts, counts by numpy."""

from __future__ import annotations

import csv
import json
import math
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import zarr
from zarr.storage import ZipStore

pytestmark = pytest.mark.workflow

MODEL = "scenenet"
AT_THE_BORDER = 0.005
"""Tolerance of a score: a few voxels are so close to tau that rounding decides."""


def kernel_of(model: dict) -> np.ndarray:
    """The summed kernel (kz, ky, kx) by thesis 4.4 and Eq. 4.1."""
    kz, ky, kx = model["kernel_size"]
    z, y, x = np.meshgrid(
        *(np.arange(k) - (k - 1) // 2 for k in (kz, ky, kx)), indexing="ij", sparse=True
    )
    d2 = y**2 + x**2

    def shell(squared, r2, sigma):
        return np.exp(-((squared - r2) ** 2) / (2 * sigma**2)) * np.ones((kz, ky, kx))

    summed = np.zeros((kz, ky, kx))
    for geneo in model["geneos"]:
        p = {name: entry["value"] for name, entry in geneo["parameters"].items()}
        if geneo["kernel"] == "negative_sphere":
            kernel = shell(d2 + z**2, p["r"] ** 2, p["sigma"]) - p["omega"]
        else:
            r2 = p["r"] ** 2
            if geneo["kernel"] == "arrow":
                above = z - z[kz - round(kz / 3)]  # the head takes the upper third
                theta = p["beta"] * math.pi / (2 + np.maximum(above, 0))
                r2 = np.where(above < 0, r2, p["r_c"] ** 2 * np.sin(theta))
            kernel = shell(d2, r2, p["sigma"])
            kernel = kernel - kernel.mean(axis=(1, 2), keepdims=True)
        summed += model["mixing_weights"][geneo["name"]] * kernel
    return summed


def answer_of(kernel: np.ndarray, occupied: np.ndarray) -> np.ndarray:
    """(tanh(H))_+ of a grid of 0 and 1."""
    sizes = kernel.shape
    padded = np.pad(occupied, [((k - 1) // 2, k - 1 - (k - 1) // 2) for k in sizes])
    observed = np.zeros(occupied.shape)
    for place in np.ndindex(*sizes):
        window = tuple(slice(i, i + n) for i, n in zip(place, occupied.shape, strict=True))
        observed += kernel[place] * padded[window]
    return np.maximum(np.tanh(observed), 0)


def crops_scored(results: Path) -> dict[str, str]:
    """Crop -> survey, of the test part."""
    with (results / "split" / "split.csv").open() as stream:
        return {r["crop"]: r["survey"] for r in csv.DictReader(stream) if r["part"] == "test"}


@pytest.fixture(scope="module")
def recounted(finished) -> dict[str, float]:
    """Precision, recall, F0.5 and IoU of the best seed on validation, counted again."""
    best = max(
        (json.loads(p.read_text()) | {"seed": p.stem}
         for p in sorted((finished.results / "tune" / MODEL).glob("seed-?.json"))),
        key=lambda tuned: tuned["validation"]["f05"],
    )  # fmt: skip
    model = json.loads((finished.results / "models" / MODEL / f"{best['seed']}.json").read_text())
    kernel = kernel_of(model)
    tp = fp = fn = 0
    for crop, survey in crops_scored(finished.results).items():
        folder = finished.results / "voxels" / survey / "cube-32"
        samples = json.loads((folder / "manifest.json").read_text())["samples"]
        (shape,) = (entry["shape"] for entry in samples if entry["id"] == crop)
        store = zarr.open_group(ZipStore(folder / "voxels.zarr.zip", mode="r"), mode="r")
        index, tower = store[crop]["index"][...], store[crop]["tower"][...].astype(bool)
        occupied, truth = np.zeros(math.prod(shape)), np.zeros(math.prod(shape), bool)
        occupied[index], truth[index[tower]] = 1, True
        predicted = answer_of(kernel, occupied.reshape(shape)).reshape(-1) >= model["tau"]
        tp += int((predicted & truth).sum())
        fp += int((predicted & ~truth).sum())
        fn += int((~predicted & truth).sum())
    precision, recall = tp / max(1, tp + fp), tp / (tp + fn)
    assert tp > 0, "a model that finds nothing proves nothing here"
    return {
        "seed": best["seed"].removeprefix("seed-"),
        "precision": precision,
        "recall": recall,
        "f05": 1.25 * precision * recall / (0.25 * precision + recall),
        "iou_tower": tp / (tp + fp + fn),
    }


def claimed(results: Path, seed: str) -> dict[str, str]:
    """The row of ``tables/models.csv`` on the seed that predicts."""
    with (results / "tables" / "models.csv").open() as stream:
        rows = [r for r in csv.DictReader(stream) if r["model"] == MODEL]
    (row,) = (r for r in rows if r["counted"] == f"seed {seed}, best on validation")
    return row


@pytest.mark.parametrize("score", ["precision", "recall", "f05", "iou_tower"])
def test_a_score_in_the_table_is_that_of_the_model_on_the_crops_scored(finished, recounted, score):
    reported = float(claimed(finished.results, recounted["seed"])[score])
    assert reported == pytest.approx(recounted[score], abs=AT_THE_BORDER)


class Rows(HTMLParser):
    """The cells of every row of a page."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.rows: list[list[str]] = []
        self.cell = False
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        if tag == "tr":
            self.rows.append([])
        self.cell = tag in ("td", "th") or (self.cell and tag not in ("tr", "table"))
        if tag in ("td", "th") and self.rows:
            self.rows[-1].append("")

    def handle_endtag(self, tag):
        if tag in ("td", "th"):
            self.cell = False

    def handle_data(self, data):
        if self.cell and self.rows and self.rows[-1]:
            self.rows[-1][-1] += data.strip()


def test_the_page_prints_what_the_table_says(finished, recounted):
    row = claimed(finished.results, recounted["seed"])
    html = (finished.results / "report" / "index.html").read_text(encoding="utf-8")
    rows = [r for r in Rows(html).rows if r[:2] == [MODEL, row["counted"]] and len(r) > 7]
    scores = ("precision", "recall", "f05", "iou_tower")
    assert any(all(f"{float(row[s]):.2f}" in r for s in scores) for r in rows), rows
    opening = re.search(r'id="overview".*?</section>', html, re.DOTALL)
    assert opening
    words = " ".join(re.sub(r"<[^>]+>", "", opening[0]).split())
    labels = re.search(r"Against the labels, [^.]* they are (\d+)% and (\d+)%", words)
    truth = re.search(
        r"(\d+)% are tower in truth \(precision\); it finds (\d+)% of the true", words
    )
    assert labels and truth, words
    for of_labels, of_truth, score in zip(
        labels.groups(), truth.groups(), ("precision", "recall"), strict=True
    ):
        close = {"abs": AT_THE_BORDER + 0.005}
        assert float(of_labels) / 100 == pytest.approx(recounted[score], **close)
        assert float(of_truth) / 100 == pytest.approx(float(row[f"truth_{score}"]), **close)
