"""Claims are judged by intervals over seeds, and a trivial predictor never shows skill."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import yaml
from scipy.stats import ttest_ind

from scenenet.experiments.published import Thesis
from scenenet.experiments.studies.run import COLUMNS as STUDY_COLUMNS
from scenenet.experiments.studies.settings import StudySettings
from scenenet.metrics.score_columns import SCORES
from scenenet.results.claims import intervals
from scenenet.results.claims.claim import HOLDS, NOT, OPEN
from scenenet.results.claims.table import CLAIMS, claims
from scenenet.results.folder import Results

SKILLED = [claim.name for claim in CLAIMS if claim.skilled]
SEEDS = range(5)


@pytest.fixture
def studies(project_root) -> list[StudySettings]:
    """The studies of the configuration, with five seeds each."""
    listed = yaml.safe_load((project_root / "config" / "studies.yaml").read_text())["studies"]
    return [StudySettings(**{**one, "seeds": tuple(SEEDS)}) for one in listed]


def run_of(results: Results, studies: list[StudySettings], score) -> Results:
    """A run in which every training has the voxel scores ``score(study, variant, seed)``: a dict of
    precision, recall and f05, which may have further columns of a study."""
    for kind in ("scenenet", "cnn"):
        template = json.loads((results.folder / f"evaluate/{kind}/seed-0.json").read_text())
        for name in ("tune", "train"):
            assert (results.folder / name / kind).is_dir()
        for seed in SEEDS:
            found = score("models", kind, seed)
            scores = {name: found.get(name, found["f05"]) for name in SCORES}
            voxel = {**template["voxel"], **scores}
            changed = {
                "seed": seed, "alive": found["recall"] > 0,
                "average_precision": found["f05"],
                **dict.fromkeys(("voxel", "voxel_observer", "voxel_towers"), voxel),
            }  # fmt: skip
            path = results.folder / "evaluate" / kind / f"seed-{seed}.json"
            path.write_text(json.dumps(template | changed))
    for study in studies:
        rows = [
            dict.fromkeys(STUDY_COLUMNS, 1.0)
            | {"variant": variant.name, "seed": seed, "lowest_weight": 0.1}
            | {"average_precision": found["f05"], "alive": found["recall"] > 0}
            | dict.fromkeys(SCORES, found["f05"]) | found
            for variant in study.all_variants() for seed in study.seeds
            if (found := score(study.name, variant.name, seed))
        ]  # fmt: skip
        folder = results.folder / "study" / study.name
        folder.mkdir(parents=True)
        pd.DataFrame(rows).to_csv(folder / "runs.csv", index=False)
    return replace(results, seeds=list(SEEDS), studies=studies)


def verdicts(results: Results, thesis: Thesis) -> pd.DataFrame:
    return claims(results, thesis).set_index("name")


def test_there_are_enough_claims_and_each_says_what_it_asserts():
    assert len(CLAIMS) >= 25
    assert len({claim.name for claim in CLAIMS}) == len(CLAIMS)
    for claim in CLAIMS:
        assert claim.says.endswith(".") and claim.statistic and claim.place
        assert claim.asserted[0] < claim.asserted[1]
        assert not all(map(math.isinf, claim.asserted))


TRIVIAL = {
    "nothing": {"precision": 0.0, "recall": 0.0, "f05": 0.0, "miou": 0.5},
    # Of 4000 occupied voxels 100 are tower, so marking all has a precision of 0.025.
    "everything": {"precision": 0.025, "recall": 1.0, "f05": 1.25 * 0.025 / 1.00625, "miou": 0.01},
}


@pytest.mark.parametrize("marked", TRIVIAL)
def test_a_trivial_predictor_shows_no_claim_about_skill(
    results: Results, thesis: Thesis, studies, marked: str
):
    run = run_of(results, studies, lambda study, variant, seed: TRIVIAL[marked])
    found = verdicts(run, thesis)
    assert len(SKILLED) > 25
    assert set(found.loc[SKILLED, "verdict"]) == {OPEN}
    assert not found.loc[SKILLED, "remark"].eq("").any()


def test_one_model_without_skill_is_no_proof_for_the_other(
    results: Results, thesis: Thesis, studies
):
    """A CNN that marks everything is less precise than SCENE-Net; that says nothing."""

    def score(study, variant, seed):
        good = {"precision": 0.7, "recall": 0.2, "f05": 0.45 + 0.01 * seed}
        return TRIVIAL["everything"] if variant == "cnn" else good

    found = verdicts(run_of(results, studies, score), thesis)
    assert found.loc["models.precision", "verdict"] == OPEN
    assert "the CNN has no skill" in found.loc["models.precision", "remark"].replace("The", "the")
    assert found.loc["models.precise", "verdict"] == HOLDS


def test_effects_are_told_from_their_opposite_and_from_what_cannot_be_told(
    results: Results, thesis: Thesis, studies
):
    """The ablations are as in Table 5.5, presence is worse than density, and the initial values
    differ from seed to seed more than by their kind."""

    def score(study, variant, seed):
        f05 = 0.5 + 0.004 * seed
        if study == "ablations":
            f05 -= {"A": 9, "B": 9, "C": 0.2, "D": 0.3, "E": 0, "F": 0.1, "G": -0.1}[variant[0]]
        if study == "measurement":
            f05 += 0.2 * (variant == "measurement density")
        if study == "initialisation":
            f05 += 0.1 * np.random.default_rng([seed, len(variant)]).normal()
        recall = 0.0 if f05 < 0 else 0.2
        cnn = {"precision": 0.44 + 0.01 * seed} if variant == "cnn" else {}
        return {"precision": 0.68, "recall": recall, "f05": max(f05, 0.0)} | cnn

    found = verdicts(run_of(results, studies, score), thesis)
    for name in ("cylinder", "arrow", "sphere", "no_arrow", "no_cylinder", "two"):
        assert found.loc[f"ablation.{name}", "verdict"] == HOLDS, name
    assert found.loc["ablation.three", "verdict"] == NOT
    assert found.loc["measurement.better", "verdict"] == NOT
    assert found.loc["measurement.better", "value"] == pytest.approx(-0.2)
    assert "Best: measurement density" in found.loc["measurement.better", "remark"]
    assert found.loc["init.ranges", "verdict"] == OPEN
    assert found.loc["models.precision", "verdict"] == HOLDS
    assert found.loc["models.precision_lift", "value"] == pytest.approx(0.22)
    assert found.loc["models.precision_lift", "verdict"] == HOLDS
    assert found.loc["epochs.enough", "verdict"] == HOLDS


def test_a_run_without_studies_leaves_their_claims_open(results: Results, thesis: Thesis):
    found = verdicts(results, thesis)
    assert found.loc["ablation.two", "verdict"] == OPEN
    assert found.loc["ablation.two", "remark"] == "This run has no study ablations."
    assert found.loc["batch.time", "remark"] == "Not measured in this run."
    # "Above 0" is written as a bound of 0, "below 0" as well, and not as -0.
    bounds = found.loc[["models.precision", "models.recall"], ["asserted_low", "asserted_high"]]
    assert [str(b) for b in bounds.stack().dropna()] == ["0.0", "0.0"]
    # Two seeds of which one is dead, and two of 0.8 and 0.6: nothing can be told.
    assert set(found.loc[[n for n in SKILLED if n.startswith("models.")], "verdict"]) == {OPEN}


def test_every_variant_that_a_claim_names_is_in_the_configuration(
    results: Results, thesis: Thesis, studies
):
    """Else a claim would stay open for ever after a study is renamed."""
    good = {"precision": 0.7, "recall": 0.2, "f05": 0.5}
    run = run_of(results, studies, lambda study, variant, seed: good | {"f05": 0.5 + 0.01 * seed})
    found = verdicts(run, thesis)
    missing = set(found.index[found["value"].isna()])
    elsewhere = {"noise.scenenet", "noise.cnn", "noise.ground", "models.recall_of_labels",
                 "towers.separated", "times.inference", "batch.time"}  # fmt: skip
    # Times, truth and label noise are not in this folder, and equal spreads have no ratio.
    assert missing <= elsewhere | {"batch.time"}


def test_label_noise_is_judged_against_the_truth(results: Results, thesis: Thesis):
    rows = [
        {"model": kind, "level": level, "seed": seed, "truth_f05": 0.8 - drop * level + 0.01 * seed,
         "truth_recall": 0.7, "wrong_detected": 0.1 + 0.01 * seed}
        for kind, drop in (("scenenet", 0.0), ("cnn", 0.5)) for level in (0.0, 0.2, 0.6)
        for seed in range(4)
    ]  # fmt: skip
    (results.folder / "label_noise").mkdir()
    pd.DataFrame(rows).to_csv(results.folder / "label_noise" / "runs.csv", index=False)
    found = verdicts(replace(results, experiments=["label_noise"]), thesis)
    assert found.loc["noise.scenenet", "verdict"] == HOLDS
    assert found.loc["noise.cnn", "verdict"] == NOT
    assert found.loc["noise.cnn", "value"] == pytest.approx(-0.3)
    assert found.loc["noise.ground", "verdict"] == HOLDS


def test_towers_are_separated_if_each_true_one_has_one_cluster(results: Results, thesis: Thesis):
    towers = pd.read_csv(results.folder / "towers" / "north" / "towers.csv")
    many = pd.concat([towers.assign(x=towers["x"] + 1000 * i) for i in range(200)])
    many.to_csv(results.folder / "towers" / "north" / "towers.csv", index=False)
    many.to_csv(results.folder / "towers" / "north" / "true_towers.csv", index=False)
    assert verdicts(results, thesis).loc["towers.separated", "verdict"] == HOLDS
    many[::2].to_csv(results.folder / "towers" / "north" / "towers.csv", index=False)
    assert verdicts(results, thesis).loc["towers.separated", "verdict"] == NOT


def test_intervals_have_their_published_width():
    """Values from tables of the distributions."""
    found = intervals.mean(pd.Series([1.0, 2.0, 3.0, 4.0, 5.0]))
    assert found[:3] == pytest.approx((3.0, 3 - 1.963, 3 + 1.963), abs=1e-3)
    assert intervals.share(pd.Series([True] * 4 + [False] * 16))[:3] == pytest.approx(
        (0.2, 0.0573, 0.4366), abs=1e-4
    )
    assert intervals.share(pd.Series([False] * 5))[:3] == pytest.approx((0, 0, 0.5218), abs=1e-4)
    one, other = pd.Series([0.0, 2.0, 4.0]), pd.Series([1.0, 2.0, 3.0])
    welch = ttest_ind(one, other, equal_var=False).confidence_interval(0.95)
    assert intervals.apart(one, other)[:3] == pytest.approx((0, *welch))
    assert intervals.spread_ratio(one, other)[:3] == pytest.approx((2, 0.3203, 12.49), abs=1e-2)
    assert intervals.paired(one, other).n == 3
    assert intervals.mean(pd.Series([0.5])).n == 1
    assert intervals.mean(pd.Series(dtype=float)) is None
