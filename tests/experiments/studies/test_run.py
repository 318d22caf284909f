"""A study trains each variant once and scores it like a single training."""

from __future__ import annotations

import pandas as pd
import pytest
import torch

from scenenet.dataset.crops import CropSettings, cut_crops
from scenenet.dataset.labelled_towers import TowerSettings, survey_towers
from scenenet.dataset.split import SplitSettings, split_crops
from scenenet.dataset.voxels import VoxelSettings
from scenenet.experiments.published import Thesis
from scenenet.experiments.studies import run
from scenenet.experiments.studies.run import COLUMNS, run_study
from scenenet.experiments.studies.settings import StudySettings
from scenenet.experiments.studies.summary import summarise
from scenenet.models.settings import ModelSettings, TrainingSettings
from scenenet.synthetic import SyntheticSettings, make_survey

MODEL = ModelSettings(
    name="m", kind="scenenet", kernel_size=(5, 5, 5),
    training=TrainingSettings(epochs=2, learning_rate=0.01, batch_size=2),
)  # fmt: skip
GRID = VoxelSettings(resolution=32)
SPLIT = SplitSettings(train=0.4, validation=0.2, test=0.4, stretch=1, neighbour=30)


def study(**fields) -> StudySettings:
    defined = {"name": "s", "title": "t", "place": "5", "asks": "?", "seeds": (0, 1)}
    return StudySettings(**(defined | fields))


@pytest.fixture(scope="module")
def crops(tmp_path_factory):
    """Crops of a synthetic line of seven towers."""
    folder = tmp_path_factory.mktemp("study")
    settings = SyntheticSettings(towers=7, seed=4, density=12, tower_density=24)
    make_survey(settings, folder / "line.laz")
    towers = survey_towers(folder / "line.laz", "edp", TowerSettings()).towers
    manifest = folder / "manifest.json"
    cut_crops("line", folder / "line.laz", "edp", towers, CropSettings(),
              folder / "crops.zarr.zip", manifest)  # fmt: skip
    return [manifest]


def test_every_combination_is_a_variant():
    both = study(vary={"training.loss.alpha": (0, 5), "kernel_size": ((9, 5, 5), (9, 9, 9))})
    plans = both.plans(MODEL, GRID, SPLIT)
    assert [plan.name for plan in plans] == [
        "alpha 0, kernel_size 9x5x5", "alpha 0, kernel_size 9x9x9",
        "alpha 5, kernel_size 9x5x5", "alpha 5, kernel_size 9x9x9",
    ]  # fmt: skip
    assert [plan.model.training.loss.alpha for plan in plans] == [0, 0, 5, 5]
    assert plans[1].model.kernel_size == (9, 9, 9)
    assert all(plan.model.training.epochs == 2 for plan in plans)


def test_changes_apply_to_their_variant_and_common_ones_to_all():
    defined = study(
        common={"training.epochs": 7},
        variants=[
            {
                "name": "a",
                "changes": {"voxels.resolution": 64, "split.train": 0.2, "split.test": 0.6},
            },
            {"name": "b", "changes": {"applied.kernel_size": [9, 3, 3], "applied.resolution": 128}},
        ],
    )
    a, b = defined.plans(MODEL, GRID, SPLIT)
    assert (a.model.training.epochs, b.model.training.epochs) == (7, 7)
    assert (a.voxels.resolution, a.applied_voxels.resolution, a.split.train) == (64, 64, 0.2)
    assert (b.voxels.resolution, b.applied_voxels.resolution) == (32, 128)
    assert (a.applied_size, b.applied_size) == (None, (9, 3, 3))


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"training.los.alpha": 1}, "los"),
        ({"training.epochs": -1}, "epochs"),
        ({"split.train": 0.9}, "sum to 1"),
        ({"applied.tau": 0.5}, "applied.tau"),
        ({"voxels.resolution": 48}, "resolution"),
        ({"kind": "cnn", "training.init": "unranged"}, "a CNN has no parameter ranges"),
    ],
)
def test_an_invalid_change_is_named(changes, named):
    with pytest.raises(ValueError, match=named):
        study(variants=[{"name": "wrong", "changes": changes}]).plans(MODEL, GRID, SPLIT)


def test_a_reference_variant_may_precede_the_combinations():
    defined = study(
        variants=[{"name": "none"}],
        vary={"training.decay": (0.05, 0.25), "training.decay_every": (10, 20)},
    )
    plans = defined.plans(MODEL, GRID, SPLIT)
    assert [plan.name for plan in plans] == [
        "none", "decay 0.05, decay_every 10", "decay 0.05, decay_every 20",
        "decay 0.25, decay_every 10", "decay 0.25, decay_every 20",
    ]  # fmt: skip
    assert [plan.model.training.decay for plan in plans] == [0.0, 0.05, 0.05, 0.25, 0.25]
    assert not defined.is_grid
    assert study(vary=defined.vary).is_grid


def test_small_numbers_are_written_out():
    defined = study(
        vary={"training.loss.epsilon": (0.00001, 0.1), "training.loss.alpha": (5, 0.001)}
    )
    names = [variant.name for variant in defined.all_variants()]
    assert names[:2] == ["epsilon 0.00001, alpha 5", "epsilon 0.00001, alpha 0.001"]


def test_another_architecture_or_protocol_is_a_change_as_any_other():
    defined = study(
        variants=[
            {"name": "cnn", "changes": {"kind": "cnn", "training.init": "informed"}},
            {"name": "metres", "changes": {"protocol": "operational", "search.searches": 1}},
        ]
    )
    cnn, metres = (plan.model for plan in defined.plans(MODEL, GRID, SPLIT))
    assert (cnn.kind, cnn.training.init, cnn.training.epochs) == ("cnn", "informed", 2)
    assert (metres.kind, metres.protocol, metres.search.searches) == ("scenenet", "operational", 1)


def test_jobs_divide_the_seeds_and_keep_the_variants_of_a_seed_together():
    defined = study(seeds=range(5), variants=[{"name": name} for name in "abcd"])
    assert defined.jobs(60) == {"seeds-0-4": (0, 1, 2, 3, 4)}
    assert defined.jobs(9) == {"seeds-0-1": (0, 1), "seeds-2-3": (2, 3), "seeds-4": (4,)}
    assert list(defined.jobs(1)) == [f"seeds-{seed}" for seed in range(5)]


def test_a_study_without_variants_or_with_equal_ones_is_refused():
    with pytest.raises(ValueError, match="give variants, or vary, or both"):
        study()
    with pytest.raises(ValueError, match="a is listed more than once"):
        study(variants=[{"name": "a"}, {"name": "a"}])
    with pytest.raises(ValueError, match="seed 2 is listed more than once"):
        study(variants=[{"name": "a"}], seeds=(0, 2, 2))


def files(folder):
    return folder / "runs.csv", folder / "times.csv"


def test_a_row_for_every_variant_and_seed(crops, tmp_path, monkeypatch):
    trained = []
    original = run.fit
    monkeypatch.setattr(run, "fit", lambda *a, **k: trained.append(a) or original(*a, **k))
    defined = study(
        variants=[
            {"name": "as trained"},
            {"name": "smaller", "changes": {"applied.kernel_size": [5, 3, 3]}},
            {"name": "cylinder", "changes": {"geneos": ["cylinder"]}},
        ]
    )
    table = run_study(crops, defined, MODEL, GRID, SPLIT, *files(tmp_path))
    assert len(table) == 6
    assert len(trained) == 4  # the smaller kernels are sampled from the same trainings
    assert list(table["parameters"]) == [11, 11, 11, 11, 2, 2]
    read = pd.read_csv(tmp_path / "runs.csv")
    assert tuple(read.columns) == COLUMNS
    times = pd.read_csv(tmp_path / "times.csv")
    assert list(times.columns) == ["variant", "seed", "training_seconds", "inference_ms"]
    assert len(times) == 6 and (times[["training_seconds", "inference_ms"]] > 0).all(axis=None)
    scores = table.set_index(["variant", "seed"])[["precision", "recall", "f05", "tau", "loss"]]
    again = run_study(crops, defined, MODEL, GRID, SPLIT, *files(tmp_path / "again"))
    pd.testing.assert_frame_equal(
        scores, again.set_index(["variant", "seed"])[list(scores)], check_exact=True
    )
    assert (tmp_path / "again" / "runs.csv").read_bytes() == (tmp_path / "runs.csv").read_bytes()
    assert scores.loc[("as trained", 0), "loss"] == scores.loc[("smaller", 0), "loss"]
    assert scores["f05"].nunique() > 1


def test_models_of_other_kinds_are_trained_and_scored_too(crops, tmp_path):
    defined = study(
        seeds=(0,),
        variants=[
            {"name": "ranges"},
            {"name": "none", "changes": {"training.init": "unranged"}},
            {"name": "cnn", "changes": {"kind": "cnn"}},
            {
                "name": "metres",
                "changes": {
                    "protocol": "operational", "search.searches": 1, "search.trial": 1,
                    "search.starts": 8, "search.generations": 1, "search.population": 4,
                },
            },
        ],
    )  # fmt: skip
    table = run_study(crops, defined, MODEL, GRID, SPLIT, *files(tmp_path))
    rows = {row["variant"]: row for row in table.to_dict("records")}
    assert {name: row["kind"] for name, row in rows.items()} == {
        "ranges": "scenenet", "none": "scenenet", "cnn": "cnn", "metres": "scenenet",
    }  # fmt: skip
    assert rows["cnn"]["parameters"] == 3 * (5 * 5 * 5 + 1)
    assert pd.isna(rows["cnn"]["lowest_weight"])
    assert pd.isna(rows["cnn"]["lowest_shape"])
    # Two steps of 0.01 leave numbers from positive ranges positive, and those of N(0, 1) mixed.
    assert rows["ranges"]["lowest_shape"] > 0
    drawn = torch.randn(11, generator=torch.Generator().manual_seed(0))
    assert rows["none"]["lowest_shape"] == pytest.approx(drawn[:9].min().item(), abs=0.3)
    # In metres numbers are positive by construction.
    assert min(rows["metres"]["lowest_weight"], rows["metres"]["lowest_shape"]) > 0


def test_initial_models_are_scored_without_training(crops, tmp_path):
    published = {"training.init": "published", "kernel_size": [9, 5, 5]}
    defined = study(
        common={"training.epochs": 0},
        variants=[{"name": "published", "changes": published}, {"name": "drawn"}],
    )
    table = run_study(crops, defined, MODEL, GRID, SPLIT, *files(tmp_path))
    assert (table["epochs"] == 0).all()
    assert table["loss"].isna().all()
    one, other = table[table["variant"] == "published"]["f05"]
    assert one == other  # whatever the seed
    one, other = table[table["variant"] == "drawn"]["lowest_shape"]
    assert one != other


def test_a_study_may_be_limited_to_some_crops_of_each_part(crops, tmp_path, monkeypatch):
    trained_on = []
    fit = run.fit

    def recorded(training, *arguments, **options):
        trained_on.append([sample.id for sample in training])
        return fit(training, *arguments, **options)

    monkeypatch.setattr(run, "fit", recorded)
    defined = study(seeds=(0,), variants=[{"name": "short", "changes": {"training.epochs": 1}}])
    split = SPLIT.model_copy(update={"train": 0.6, "test": 0.2})
    scored = []
    for most in (None, 9, 2):
        table = run_study(crops, defined, MODEL, GRID, split, *files(tmp_path), most)
        assert list(table["training_crops"]) == [len(trained_on[-1])]
        scored += list(table["scored_crops"])
    parts = split_crops(crops, split)["part"].value_counts()
    assert scored == [parts["test"], parts["test"], min(parts["test"], 2)]
    every, nine, part = trained_on
    assert nine == every and len(every) > 2
    assert part == [every[0], every[len(every) // 2]]


def test_a_diverged_training_counts_as_dead_and_the_others_continue(crops, tmp_path):
    lost = {"training.learning_rate": 1e30, "training.optimiser": "sgd", "training.epochs": 4}
    defined = study(variants=[{"name": "lost", "changes": lost}, {"name": "kept"}])
    table = run_study(crops, defined, MODEL, GRID, SPLIT, *files(tmp_path))
    diverged = table[table["variant"] == "lost"]
    assert len(table) == 4
    assert diverged["loss"].isna().all()
    assert not diverged["alive"].any()
    assert (diverged[["precision", "recall", "f05"]] == 0).all(axis=None)
    assert diverged["miou"].between(0.49, 0.5).all()
    assert (diverged["parameters"] == 11).all()
    assert table.loc[table["variant"] == "kept", "loss"].notna().all()
    lost_row, _ = summarise(defined, table, Thesis(source="s", numbers={})).to_dict("records")
    assert (lost_row["alive"], lost_row["f05"]) == (0, 0.0)


def test_the_summary_is_over_seeds_with_the_scores_of_the_thesis():
    defined = study(variants=[{"name": "a", "thesis": "ablation.a"}, {"name": "b"}])
    runs = pd.DataFrame(
        [
            {"variant": v, "seed": s, "alive": f > 0, "f05": f}
            for v, s, f in [("a", 0, 0.2), ("a", 1, 0.4), ("b", 0, 0.0), ("b", 1, 0.3)]
        ]
    )
    for name in set(COLUMNS) - set(runs):
        runs[name] = 1.0
    number = {"value": 0.5, "place": "Table 5.5"}
    thesis = Thesis(source="s", numbers={"ablation.a.precision": number})
    a, b = summarise(defined, runs, thesis).to_dict("records")
    assert a["f05"] == pytest.approx(0.3)
    assert a["f05_std"] == pytest.approx(0.141421, abs=1e-6)
    assert (a["live_share"], b["live_share"]) == (1.0, 0.5)
    assert (a["alive"], b["alive"]) == (2, 1)
    assert a["thesis_precision"] == 0.5
    assert pd.isna(b["thesis_precision"])


def test_negative_numbers_are_counted_by_seed():
    defined = study(variants=[{"name": name} for name in ("a", "b", "cnn")], seeds=(0, 1, 2, 3))
    lowest = {
        "a": ([0.1, -0.1, 0.2, 0.3], [0.5, 0.5, 0.5, -0.2]),  # by weight, by shape
        "b": ([0.1, 0.1, 0.2, 0.3], [0.5, 0.4, 0.0, 0.2]),
        "cnn": ([float("nan")] * 4, [float("nan")] * 4),
    }
    runs = pd.DataFrame(
        [
            dict.fromkeys(COLUMNS, 0.5)
            | {"variant": v, "seed": s, "alive": True}
            | {"lowest_weight": weights[s], "lowest_shape": shapes[s]}
            for v, (weights, shapes) in lowest.items()
            for s in range(4)
        ]
    )
    a, b, cnn = summarise(defined, runs, Thesis(source="s", numbers={})).to_dict("records")
    assert (a["negative_share"], b["negative_share"]) == (0.5, 0.0)
    assert (a["lowest_weight"], a["lowest_shape"]) == (-0.1, -0.2)
    assert pd.isna(cnn["negative_share"])
