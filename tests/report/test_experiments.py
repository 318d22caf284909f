"""An experiment in tables, figure, MLflow and page."""

from __future__ import annotations

from dataclasses import replace

import pandas as pd
import pytest

from scenenet.config.schema import Config
from scenenet.experiments.components import run as components
from scenenet.experiments.components.settings import ITS_OWN, NOTHING, RULES_ALONE, WITH, WITHOUT
from scenenet.experiments.cross_validation import run as cross_validation
from scenenet.experiments.label_noise.run import COLUMNS
from scenenet.experiments.label_noise.settings import LABELS
from scenenet.experiments.registry import EXPERIMENTS
from scenenet.experiments.run_tables import with_times
from scenenet.figures import draw_all, plan
from scenenet.figures.experiments import EXPERIMENT_DRAWINGS
from scenenet.metrics.score_columns import AT_TAU, WHOLE_TOWERS
from scenenet.report.context import ReportContext
from scenenet.report.page import SECTIONS
from scenenet.report.sections import experiments as experiment_sections
from scenenet.report.sections.experiments import EXPERIMENT_SECTIONS
from scenenet.results.tables import write_tables
from scenenet.tracking.experiment_runs import (
    EXPERIMENT_GROUPS,
    Origin,
    component_groups,
    fold_groups,
    label_noise_groups,
    origin_of,
)


def noise_runs() -> pd.DataFrame:
    rows = []
    for level in (0.0, 0.4, 0.6):
        for seed in (0, 1):
            for model, f05 in ((LABELS, 1 - level), ("scenenet", 0.5), ("boosted trees", 0.4)):
                row = dict.fromkeys(COLUMNS, 0.25) | {"level": level, "share": level}
                row |= {"seed": seed, "model": model, "alive": True, "truth_f05": f05 + seed / 100}
                rows.append(row)
    return pd.DataFrame(rows)


@pytest.fixture
def noisy(results):
    (results.folder / "label_noise").mkdir()
    noise_runs().to_csv(results.folder / "label_noise" / "runs.csv", index=False)
    return replace(results, experiments=("label_noise",))


def test_table_figure_and_section(noisy, thesis):
    write_tables(noisy, thesis, noisy.folder / "tables", names=())
    table = pd.read_csv(noisy.folder / "tables" / "label_noise.csv")
    assert list(table["model"][:3]) == [LABELS, "scenenet", "boosted trees"]
    (drawing,) = [d for d in plan(noisy) if d.section == "label_noise"]
    (picture,) = draw_all([drawing], noisy.folder / "figures")
    assert picture.file.stat().st_size > 5000
    assert "scenenet 0.25 and 0.51" in picture.alt
    section = experiment_sections.label_noise(ReportContext(noisy, thesis))
    assert section is not None
    verdict = "scenenet is nearer to the truth than its labels in all of 2 trainings (F0.5 0.51)"
    assert verdict in section.blocks[0].text
    kinds = [block.kind for block in section.blocks]
    assert kinds == ["text", "facts", "figure", "notes", "table"]


def test_no_experiment_no_section(results, thesis):
    assert experiment_sections.label_noise(ReportContext(results, thesis)) is None
    assert all(drawing.section != "label_noise" for drawing in plan(results))


def test_a_parent_for_each_model_and_level_and_a_run_for_each_seed():
    trained = noise_runs()[["level", "seed", "model"]]
    times = trained[trained["model"] != LABELS].assign(training_seconds=2.0)
    groups = label_noise_groups(with_times(noise_runs(), times), Origin("tiny"))
    assert len(groups) == 9
    group = next(g for g in groups if g.parent.name == "scenenet, 60% wrong")
    assert [child.key for child in group.children] == [
        "label_noise/tiny/scenenet, 60% wrong/seed-0",
        "label_noise/tiny/scenenet, 60% wrong/seed-1",
    ]
    assert group.parent.metrics["truth_f05"] == pytest.approx(0.505)
    assert group.parent.metrics["truth_f05_std"] == pytest.approx(0.01 / 2**0.5)
    assert group.children[1].metrics["truth_f05"] == pytest.approx(0.51)
    assert group.children[1].params == {"level": 0.6, "model": "scenenet", "seed": 1}
    assert group.parent.seconds == 4.0
    assert group.children[0].metrics["training_seconds"] == 2.0
    (labels, *_) = groups
    assert labels.children[0].metrics["training_seconds"] is None
    keys = [record.key for g in groups for record in (g.parent, *g.children)]
    assert len(set(keys)) == len(keys)


def crossed_runs(truth: bool = False) -> pd.DataFrame:
    """Against the truth, if it is known, the order of the models is the opposite."""
    rows = []
    of_truth = [name for name in cross_validation.COLUMNS if name.startswith("truth_")]
    for model, base in (("scenenet", 0.7), ("cnn", 0.3), ("boosted trees", 0.8)):
        for seed in (0, 1):
            for fold, crops in ((1, "a b"), (2, "c d")):
                row = dict.fromkeys(cross_validation.COLUMNS, 0.5) | {"voxels": AT_TAU}
                row |= {"model": model, "seed": seed, "fold": fold, "crops": crops, "alive": True}
                row |= {"f05": base + seed / 50 + fold / 10, "tp": 5, "fp": 1, "fn": 4, "tn": 90}
                row |= {"truth_f05": 1 - row["f05"]} if truth else dict.fromkeys(of_truth)
                rows.append(row)
    return pd.DataFrame(rows)


def test_every_experiment_has_settings_a_figure_runs_in_mlflow_and_a_section():
    """Packages above the registry register by name; none may be missing."""
    names = set(EXPERIMENTS)
    assert names == set(EXPERIMENT_DRAWINGS) == set(EXPERIMENT_GROUPS) == set(EXPERIMENT_SECTIONS)
    for name, experiment in EXPERIMENTS.items():
        settings = Config.model_fields[name].annotation
        assert experiment.switch in settings.model_fields
        assert EXPERIMENT_SECTIONS[name] in SECTIONS


def test_both_ways_to_count_have_their_own_names():
    runs = crossed_runs()
    both = pd.concat([runs, runs.assign(voxels=WHOLE_TOWERS)])
    names = [group.parent.name for group in fold_groups(both, Origin("tiny"))]
    assert names[:2] == ["scenenet", "cnn"]
    assert names[3] == "scenenet, whole towers"
    assert len(set(names)) == 6


def test_cross_validation_is_the_main_result_if_it_was_run(results, thesis):
    (results.folder / "cross_validation").mkdir()
    crossed_runs().to_csv(results.folder / "cross_validation" / "runs.csv", index=False)
    crossed = replace(results, experiments=("cross_validation",))
    write_tables(crossed, thesis, crossed.folder / "tables", names=())
    (drawing,) = [d for d in plan(crossed) if d.section == "cross_validation"]
    (picture,) = draw_all([drawing], crossed.folder / "figures")
    assert picture.file.stat().st_size > 5000
    assert "folds from 0.81 to 0.91" in picture.alt
    section = experiment_sections.cross_validation(ReportContext(crossed, thesis))
    assert section is not None and section.title.startswith("Main result")
    assert "boosted trees 0.960, scenenet 0.860, cnn 0.460" in section.blocks[0].text
    assert [block.kind for block in section.blocks] == ["text", "facts", "figure", "table"]
    assert experiment_sections.cross_validation(ReportContext(results, thesis)) is not None
    (results.folder / "tables" / "cross_validation.csv").unlink()
    assert experiment_sections.cross_validation(ReportContext(results, thesis)) is None


def test_the_cross_validation_leads_with_the_truth_where_it_is_known(results, thesis):
    (results.folder / "cross_validation").mkdir()
    runs = crossed_runs(truth=True)
    runs.to_csv(results.folder / "cross_validation" / "runs.csv", index=False)
    crossed = replace(results, experiments=("cross_validation",))
    write_tables(crossed, thesis, crossed.folder / "tables", names=())
    (drawing,) = [d for d in plan(crossed) if d.section == "cross_validation"]
    (picture,) = draw_all([drawing], crossed.folder / "figures")
    assert (
        "scenenet: precision 0.50, recall 0.50, F0.5 0.14, folds from 0.09 to 0.19" in picture.alt
    )
    assert "against the truth" in picture.alt and "scores are against the truth" in picture.caption
    section = experiment_sections.cross_validation(ReportContext(crossed, thesis))
    best_first = "against the truth, best first: cnn 0.540, scenenet 0.140, boosted trees 0.040"
    assert best_first in section.blocks[0].text
    assert section.blocks[1].items[0] == ("F0.5, cnn", "0.540")
    labels = [column.label for column in section.blocks[-1].columns]
    assert labels.index("F0.5 (truth)") < labels.index("F0.5 (labels)")
    (group, *_) = fold_groups(runs, Origin("tiny"))
    assert group.parent.metrics["truth_f05"] == pytest.approx(0.14)


def test_a_run_for_each_fold_and_the_main_numbers_on_the_parent():
    job = {"config": "c", "code": "d", "version": "1", "inputs": {"voxels": "x"}}
    origin = origin_of("ts40k", {"inputs": {"runs": "y"}}, job)
    (group, *_) = groups = fold_groups(crossed_runs(), origin)
    assert [g.parent.name for g in groups] == ["scenenet", "cnn", "boosted trees"]
    assert [child.key for child in group.children] == [
        f"cross_validation/ts40k/scenenet/seed-{seed}/fold-{fold}"
        for seed in (0, 1)
        for fold in (1, 2)
    ]
    assert group.parent.metrics["f05"] == pytest.approx(0.86)
    assert group.parent.metrics["spread_f05"] == pytest.approx(0.02 / 2**0.5)
    assert group.parent.metrics["pooled_precision"] == pytest.approx(5 / 6)
    assert group.children[1].params["crops"] == "c d"
    assert group.parent.tags["scenenet.code"] == group.children[0].tags["scenenet.code"] == "d"


def component_runs(truth: bool) -> pd.DataFrame:
    """A model that the rules hardly need, against the truth if it is known."""
    rows = []
    cases = [
        (NOTHING, ITS_OWN, 0, 0), (RULES_ALONE, WITH, 0, 8), ("scenenet", WITHOUT, 0, 2),
        ("scenenet", WITH, 0, 8), ("scenenet", WITHOUT, 1, 2), ("scenenet", WITH, 1, 7),
    ]  # fmt: skip
    for model, rules, seed, hits in cases:
        row = dict.fromkeys(components.COLUMNS) | {"model": model, "rules": rules, "seed": seed}
        row |= {"fold": 1, "crops": "a b", "alive": hits > 0, "parameters": 11}
        for against in ("truth_", "")[0 if truth else 1 :]:
            for what in ("point", "voxel"):
                counts = {"tp": hits, "fp": 2, "fn": 10 - hits}
                row |= {f"{against}{what}_{name}": n for name, n in counts.items()}
                row[f"{against}{what}_f05"] = hits / 10
            row |= {f"{against}towers": 2, f"{against}towers_found": hits // 4}
            row |= {f"{against}towers_false": seed}
        rows.append(row)
    return pd.DataFrame(rows)


@pytest.mark.parametrize("truth", [True, False])
def test_who_does_the_work_in_table_figure_and_section(results, thesis, truth):
    (results.folder / "components").mkdir()
    component_runs(truth).to_csv(results.folder / "components" / "runs.csv", index=False)
    apart = replace(results, experiments=("components",))
    write_tables(apart, thesis, apart.folder / "tables", names=())
    table = pd.read_csv(apart.folder / "tables" / "components.csv")
    assert list(table["model"]) == [NOTHING, RULES_ALONE, "scenenet", "scenenet"]
    (drawing,) = [d for d in plan(apart) if d.section == "components"]
    (picture,) = draw_all([drawing], apart.folder / "figures")
    assert picture.file.stat().st_size > 5000
    against = "the truth" if truth else "the labels"
    assert f"against {against}" in picture.alt and f"against {against}" in picture.caption
    assert "rules alone, with rules: 0.80; scenenet, without rules: 0.38" in picture.alt
    section = experiment_sections.components(ReportContext(apart, thesis))
    assert [block.kind for block in section.blocks] == ["text", "figure", "table"]
    text = section.blocks[0].text
    assert f"F0.5 of points against {against}: rules alone 0.80; scenenet with rules" in text
    assert "adds little to the rules" in text
    labels = [column.label for column in section.blocks[-1].columns]
    first = "F0.5 of points, worst (truth)" if truth else "F0.5 of points, worst"
    assert first in labels


def test_a_parent_for_each_source_and_answer():
    groups = component_groups(component_runs(truth=True), Origin("tiny"))
    names = [group.parent.name for group in groups]
    assert names == [NOTHING, RULES_ALONE, "scenenet, without rules", "scenenet, with rules"]
    assert [child.key for child in groups[3].children] == [
        "components/tiny/scenenet, with rules/seed-0/fold-1",
        "components/tiny/scenenet, with rules/seed-1/fold-1",
    ]
    assert groups[3].parent.metrics["truth_point_f05"] == pytest.approx(0.75)
    assert groups[3].children[1].params["rules"] == WITH
