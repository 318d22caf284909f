"""The sections of the report, each from tables, pictures and published numbers.

A section is a function in ``SECTIONS``; it returns None where the run has nothing for it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scenenet.figures import CROP_RANKS, Picture, plan, read_pictures
from scenenet.published import Thesis
from scenenet.report.blocks import (
    Block,
    Column,
    Facts,
    Figure,
    Notes,
    Scene,
    Section,
    Table,
    Text,
    table,
    write,
)
from scenenet.results import Results, read_table
from scenenet.tables import TRIVIAL

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Material:
    """All that a section may draw from."""

    results: Results
    thesis: Thesis

    @cached_property
    def pictures(self) -> list[Picture]:
        names = [drawing.name for drawing in plan(self.results)]
        maps = [f"clusters-{survey}" for survey in self.results.surveys]
        return read_pictures(self.results.folder / "figures", [*maps, *names])

    def figures(self, section: str) -> list[Block]:
        return [Figure(p) for p in self.pictures if p.section == section and p.survey is None]

    def figures_of(self, survey: str, section: str) -> list[Block]:
        return [Figure(p) for p in self.pictures if p.section == section and p.survey == survey]

    def table(self, name: str) -> pd.DataFrame | None:
        """A table as it was written; None if it is not there or has no rows."""
        path = self.path(name)
        if not path.exists():
            return None
        frame = read_table(path)
        return None if frame.empty else frame

    def path(self, name: str) -> Path:
        return self.results.folder / "tables" / f"{name}.csv"


def _scores(names: Sequence[tuple[str, str]]) -> list[Column]:
    return [Column(name, label, "score2", f"{name}_std") for name, label in names]


VOXEL_SCORES = _scores(
    [
        ("precision", "precision"),
        ("recall", "recall"),
        ("f05", "F0.5"),
        ("iou_tower", "IoU tower"),
        ("miou", "IoU mean"),
    ]
)


def beside(columns: Sequence[Column]) -> list[Column]:
    """Each score with the thesis' right behind it, where the thesis has it."""
    both = []
    for column in columns:
        both.append(column)
        if column.name in ("precision", "recall", "miou"):
            name = f"thesis_{column.name}"
            both.append(Column(name, "thesis", "score2", f"{name}_std", published=True))
    return both


def overview(material: Material) -> Section | None:
    """What a person wants to know first."""
    models = material.table("models")
    results = material.results
    facts: list[tuple[str, str]] = []
    text = "No model has been evaluated in this run."
    if models is not None:
        chosen = models[models["counted"].str.contains("best on validation", na=False)]
        first = (chosen if len(chosen) else models).iloc[0]
        samples = results.of_model(first["model"])[0].evaluation["voxel"]["n_samples"]
        text = (
            f"Scores are of {samples} test crops that no model was trained or tuned on. "
            f"{first['model']} ({first['counted']}) reaches a precision of "
            f"{first['precision']:.2f} at a recall of {first['recall']:.2f} over the voxels of "
            "towers. A model that never says tower has a mean IoU of "
            f"{models.loc[models['model'] == TRIVIAL, 'miou'].iloc[0]:.2f}, because the mean is "
            "over background and tower; the IoU of the tower alone stands beside it everywhere."
        )
        facts = [
            (f"precision, {first['model']}", write(first["precision"], "score")),
            ("recall", write(first["recall"], "score")),
            ("F0.5", write(first["f05"], "score")),
            ("IoU tower", write(first["iou_tower"], "score")),
        ]
        facts += [
            (f"seeds of {model} that detect anything", f"{sum(r.alive for r in of)} of {len(of)}")
            for model in results.models
            if (of := results.of_model(model))
        ]
    predicted = [p for survey in results.predicted if (p := results.prediction(survey))]
    if predicted:
        found = sum(len(towers["features"]) for _, towers in predicted)
        facts.append(("towers in the classified surveys", write(found, "count")))
    return Section("overview", "In short", [Text(text), Facts(facts)])


def data(material: Material) -> Section | None:
    """Surveys and Table 5.1."""
    checks = material.results.checks()
    blocks: list[Block] = [_survey_list(checks)] if checks else []
    for survey, report in checks.items():
        if warnings := [_warning(item) for item in report.get("warnings", [])]:
            blocks.append(Notes(f"The check of {survey} warns", warnings))
    classes = material.table("classes")
    if classes is not None:
        columns = [
            Column("code", "code", "count"),
            Column("class", "class"),
            Column("points", "points", "count"),
            Column("share_percent", "share [%]", "percent"),
            Column("lowest_percent", "lowest survey [%]", "percent"),
            Column("highest_percent", "highest survey [%]", "percent"),
            Column("thesis_percent", "thesis [%]", "percent", published=True),
        ]
        caption = (
            f"Share of each class in all points of {_listed(material.results.surveys)}, beside "
            "thesis Table 5.1. The thesis' data are strips along lines of EDP in Portugal; the "
            "shares agree only as far as the surveys are alike."
        )
        blocks.append(table(classes, columns, caption, "tables/classes.csv"))
    blocks += material.figures("data")
    return Section("data", "The surveys", blocks) if blocks else None


def towers(material: Material) -> Section | None:
    """Thesis 5.1.2."""
    frame = material.table("towers")
    if frame is None:
        return None
    columns = [
        Column("property", "property"),
        Column("unit", "unit"),
        Column("towers", "towers", "count"),
        Column("mean", "mean", "number", "std"),
        Column("lowest", "lowest", "number"),
        Column("highest", "highest", "number"),
        Column("thesis_mean", "thesis mean", "number", published=True),
        Column("thesis_lowest", "thesis lowest", "number", published=True),
        Column("thesis_highest", "thesis highest", "number", published=True),
    ]
    caption = (
        "Towers found by DBSCAN in the points labelled tower, mean and standard deviation over "
        "towers, beside thesis 5.1.2. Spacing is to the next tower along the line."
    )
    maps = [f for survey in material.results.surveys for f in material.figures_of(survey, "towers")]
    return Section("towers", "The labelled towers", [
        table(frame.fillna({"unit": ""}), columns, caption, "tables/towers.csv"), *maps,
    ])  # fmt: skip


def voxels(material: Material) -> Section | None:
    """Thesis 5.1.4."""
    frame = material.table("voxelisation")
    blocks = material.figures("voxels")
    if frame is not None:
        columns = [
            Column("grid", "grid"),
            Column("samples", "crops", "count"),
            Column("seconds", "time a crop", "seconds", "seconds_std"),
            Column("thesis_seconds", "thesis, time a crop", "seconds", published=True),
            Column("occupied_voxels", "occupied voxels", "count"),
            Column("tower_voxels", "tower voxels", "count"),
            Column("tower_share_percent", "towers in the occupied [%]", "share"),
        ]
        caption = (
            "Voxelised crops: mean time without reading files, and mean number of voxels. The "
            "thesis' times (5.1.4) are of an Intel CPU of the 8th generation; ours are of the "
            "machine this ran on."
        )
        blocks = [table(frame, columns, caption, "tables/voxelisation.csv"), *blocks]
    return Section("voxels", "Voxels", blocks) if blocks else None


def models(material: Material) -> Section | None:
    """Table 5.3 and Figure 5.7."""
    frame = material.table("models")
    if frame is None:
        return None
    columns = [
        Column("model", "model"),
        Column("counted", "counted"),
        Column("parameters", "parameters", "count"),
        *beside(VOXEL_SCORES),
    ]
    caption = (
        "Scores of the tower class over all voxels of the test crops at the tau chosen on "
        "validation, mean ± standard deviation over seeds, beside thesis Table 5.3. IoU mean is "
        "over background and tower, as the thesis' IoU. The thesis "
        "counts useful trainings only and was measured on other data, so the columns can be "
        "compared in kind, not digit by digit. "
        f"“{TRIVIAL}” is a model that never says tower."
    )
    seeds = material.table("seeds")
    blocks: list[Block] = [table(frame, columns, caption, "tables/models.csv")]
    blocks += material.figures("models")
    if seeds is not None:
        columns = [
            Column("model", "model"),
            Column("seed", "seed", "count"),
            Column("alive", "detects anything", "yes"),
            Column("tau", "tau", "score"),
            Column("validation_f05", "F0.5 on validation", "score"),
            *(Column(c.name, c.label, "score") for c in VOXEL_SCORES),
            Column("average_precision", "area below P-R", "score"),
        ]
        caption = "Every training by itself: scores on the test crops, tau from validation."
        blocks.append(table(seeds, columns, caption, "tables/seeds.csv", folded=True))
    return Section("models", "The models side by side", blocks)


def positions(material: Material) -> Section | None:
    """Tower positions in metres (thesis 5.2.4)."""
    frame = material.table("tower_scores")
    if frame is None:
        return None
    columns = [
        Column("model", "model"),
        Column("counted", "counted"),
        Column("precision", "precision", "score2", "precision_std"),
        Column("recall", "recall", "score2", "recall_std"),
        Column("median_error_m", "median error [m]", "metres", "median_error_m_std"),
        Column("n_true", "true towers", "count"),
        Column("n_predicted", "predicted towers", "number", "n_predicted_std"),
    ]
    caption = (
        "Towers as a whole on the test crops: a predicted one within 5 m of a true one is a hit. "
        "Every crop has a tower in its middle, which is easier than a whole survey. The thesis "
        "gives no such numbers."
    )
    found = table(frame, columns, caption, "tables/tower_scores.csv")
    return Section("positions", "Towers found", [found])


def learned(material: Material) -> Section | None:
    """Figures 4.2-4.4 and 5.5."""
    blocks = material.figures("learned")
    if not blocks:
        return None
    share = material.thesis.value("parameters.lambda_negative_sphere")
    if share is not None:
        blocks.append(
            Text(
                f"In the thesis' model the negative sphere has a mixing weight of {share:g} % "
                "(5.2.2). Weights of different runs are comparable only as far as the kernels have "
                "values of the same size."
            )
        )
    return Section("learned", "What was learned", blocks)


def crops(material: Material) -> Section | None:
    """Figures 5.8 and 5.9."""
    blocks = [*_scenes(material), *material.figures("crops")]
    if not blocks:
        return None
    said = Text(
        "Three test crops chosen by rule: the one with the highest, the middle and the lowest F0.5."
    )
    return Section("crops", "Right and wrong", [said, *blocks])


def _scenes(material: Material) -> list[Block]:
    """The crops that can be turned (thesis Figures 5.6, 5.8, 5.9)."""
    made: list[Block] = []
    for rank in CROP_RANKS:
        data = material.results.scene(rank)
        if data is None:
            continue
        geneos = [(name, f"part of the {name.replace('_', ' ')}") for name in data["shares"]]
        said = "what was found", "class", "probability"
        colourings = [*zip(("found", "class", "probability"), said, strict=True), *geneos]
        n = len(data["true"])
        made.append(
            Scene(
                rank,
                f"The {rank} test crop, to be turned",
                f"Crop {data['crop']} in voxels of {data['voxel_size']:.2f} m, as {data['model']} "
                f"(seed {data['seed']}) answers it. Drag to turn it, or use the arrow keys, + and "
                "-. Found: green is right, orange is no tower, pink was missed. A part is red "
                "where an operator adds to the answer and blue where it takes away. The scores "
                f"count all voxels of the grid; the slider has {n - 1} thresholds.",
                f"The occupied voxels of crop {data['crop']} in space.",
                colourings,
                data,
            )
        )
    return made


def training(material: Material) -> Section | None:
    """Training curves and times (thesis 5.2.6)."""
    blocks = material.figures("training")
    frame = material.table("times")
    if frame is not None:
        columns = [
            Column("model", "model"),
            Column("n_seeds", "trainings", "count"),
            Column("epochs", "epochs", "count"),
            Column("training_seconds", "one training", "seconds", "training_seconds_std"),
            Column("seconds_per_epoch", "one epoch", "seconds"),
            Column("thesis_training_seconds", "thesis, one training", "seconds", published=True),
        ]
        caption = (
            "Training time of one seed. The thesis trained on an NVIDIA GeForce RTX 3070 with far "
            "more crops; ours is the machine this ran on."
        )
        blocks = [table(frame, columns, caption, "tables/times.csv"), *blocks]
    return Section("training", "Training", blocks) if blocks else None


def _survey_list(checks: Mapping[str, Mapping[str, Any]]) -> Table:
    import pandas as pd

    columns = [
        Column("survey", "survey"),
        Column("n_points", "points", "count"),
        Column("area_m2", "area [m²]", "count"),
        Column("density_per_m2", "points per m²", "share"),
        Column("crs", "CRS"),
        Column("codes", "class codes"),
    ]
    facts = [{"survey": name} | {c.name: report.get(c.name) for c in columns[1:]}
             for name, report in checks.items()]  # fmt: skip
    frame = pd.DataFrame(facts).fillna({"crs": "none", "codes": "not said"})
    return table(frame, columns, "Every survey that was checked, those only classified included.")


def _warning(item: str | Mapping[str, str]) -> str:
    return item if isinstance(item, str) else str(item.get("message", dict(item)))


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names) if 0 < len(names) <= 6 else f"{len(names)} surveys"


SectionMaker = Callable[[Material], Section | None]
