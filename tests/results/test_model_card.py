"""The model of a run is copied with a card that has its data and scores."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from fixtures.result_folder import with_truth

from scenenet.core.errors import InputError
from scenenet.core.files import sha256
from scenenet.models.packaged import packaged_model
from scenenet.results.folder import Results
from scenenet.results.model_card import write_model_card


def test_the_card_has_the_data_and_the_scores_of_the_best_seed(results: Results, tmp_path: Path):
    model, card = tmp_path / "towers.json", tmp_path / "towers.md"
    results = with_truth(results)
    write_model_card(results, packaged_model(), model, card)
    assert model.read_bytes() == packaged_model().read_bytes()
    text = card.read_text(encoding="utf-8")
    assert sha256(model) in text
    assert "SCENE-Net, 11 parameters" in text
    evidence = json.loads(model.read_text())["evidence"]
    open_, known = (
        next(name for name, facts in evidence.items() if facts["determined"] is determined)
        for determined in (False, True)
    )
    rows = {line.split("`")[1]: line for line in text.splitlines() if line.startswith("| `")}
    assert "nominally the " in rows[open_] and "not determined by the" in rows[open_]
    assert "determined" not in rows[known]
    best = results.champion("scenenet")
    assert f"seed {best.seed} of 2" in text
    for against, scores in (("labels", best.evaluation), ("truth", best.evaluation.truth)):
        row = next(
            line for line in text.splitlines() if line.startswith(f"| against the {against}")
        )
        found = round(scores.towers.recall * scores.towers.n_true)
        assert f"| {found} of {scores.towers.n_true} | {scores.towers.n_predicted - found} |" in row
    assert f"| {best.evaluation.truth.points.precision:.2f} |" in row


def test_a_model_in_voxels_is_not_packaged(results: Results, tmp_path: Path):
    voxels = tmp_path / "voxels.json"
    voxels.write_text(json.dumps({"format": "scenenet-model"}))
    out = tmp_path / "out.json"
    with pytest.raises(InputError, match="protocol operational"):
        write_model_card(results, voxels, out, tmp_path / "out.md")
    with pytest.raises(InputError, match="no model to package"):
        write_model_card(replace(results, models={}), packaged_model(), out, tmp_path / "out.md")
    assert not out.exists()
