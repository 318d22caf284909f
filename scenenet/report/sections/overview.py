"""The opening of the page: what a person wants to know first."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from scenenet.report.blocks import Block, Facts, Section, Text, write
from scenenet.report.context import Material
from scenenet.results.folder import BOOSTED_TREES
from scenenet.results.score_tables import TRIVIAL, WHOLE_TOWERS

if TYPE_CHECKING:
    import pandas as pd

NEAR = 0.02
"""F0.5 scores that differ by less are called the same."""


def overview(material: Material) -> Section:
    """The model that predicts, and in a sentence each how the others compare."""
    models = material.table("models")
    results = material.results
    facts: list[tuple[str, str]] = []
    blocks: list[Block] = [Text("No model has been evaluated in this run.")]
    if models is not None:
        first = _speaking(models, results.predicting or models["model"].iloc[0])
        blocks = [Text(_headline(material, models, first))]
        others = [
            _compared(material, _speaking(models, name), first)
            for name in dict.fromkeys([*results.models, BOOSTED_TREES])
            if name != first["model"] and (models["model"] == name).any()
        ]
        blocks += [Text(sentence) for sentence in others]
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
    return Section("overview", "In short", [blocks[0], Facts(facts), *blocks[1:]])


def _headline(material: Material, models: pd.DataFrame, first: Mapping[Any, Any]) -> str:
    n_crops = material.results.of_model(first["model"])[0].evaluation["voxel"]["n_samples"]
    trivial = models.loc[models["model"] == TRIVIAL, "miou"].iloc[0]
    return (
        f"Scores are of {n_crops} test crops that no model was trained or tuned on. "
        f"{first['model']} ({first['counted']}), {_what(material, first)}, is the model that "
        f"predicts. It reaches a precision of {first['precision']:.2f} at a recall of "
        f"{first['recall']:.2f} over {_decision(first)}. A model that never "
        f"says tower has a mean IoU of {trivial:.2f}, because the "
        "mean is over background and tower; the IoU of the tower alone stands beside it "
        "everywhere."
    )


def _compared(material: Material, other: Mapping[Any, Any], first: Mapping[Any, Any]) -> str:
    who = f"{other['model']} ({other['counted']}), {_what(material, other)},"
    if not other["recall"]:
        return f"{who} finds no voxel of a tower."
    apart = other["f05"] - first["f05"]
    if abs(apart) < NEAR:
        beside = f"as good as {first['model']}"
    else:
        beside = f"{abs(apart):.2f} {'better' if apart > 0 else 'worse'} than {first['model']}"
    return (
        f"{who} reaches a precision of {other['precision']:.2f} at a recall of "
        f"{other['recall']:.2f} over {_decision(other)}; with an F0.5 of {other['f05']:.2f} it is "
        f"{beside}.{_alike(material, other, first)}"
    )


def _decision(row: Mapping[Any, Any]) -> str:
    """Which voxels were counted."""
    if row["voxels"] == WHOLE_TOWERS:
        return "the voxels of the whole towers it finds"
    return "the voxels that reach its tau"


def _alike(material: Material, other: Mapping[Any, Any], first: Mapping[Any, Any]) -> str:
    """The same two models with the same voxels counted, where theirs are not."""
    frame = material.table("whole_towers")
    if other["voxels"] == first["voxels"] or frame is None:
        return ""
    f05 = frame.set_index("model")
    said = [
        f"{f05.loc[other['model'], f'{part}_f05']:.2f} against "
        f"{f05.loc[first['model'], f'{part}_f05']:.2f} {of}"
        for part, of in (("towers", "of whole towers"), ("tau", "of voxels that reach tau"))
    ]
    return f" Counted alike, mean over all seeds, it has {' and '.join(said)}."


def _speaking(models: pd.DataFrame, name: str) -> Mapping[Any, Any]:
    """The row that speaks for a model: its seed that predicts, else all seeds."""
    rows = models[models["model"] == name]
    best = rows[rows["counted"].str.contains("best on validation", na=False)]
    return (best if len(best) else rows).iloc[0].to_dict()


def _what(material: Material, row: Mapping[Any, Any]) -> str:
    """What kind of model it is, with the number of its parameters."""
    size = row["parameters"]
    numbers = "" if size != size else f" of {write(size, 'count')} numbers"
    name = row["model"]
    if name == BOOSTED_TREES:
        return f"boosted trees{numbers}"
    if material.results.models[name] == "cnn":
        return f"free kernels{numbers}"
    trained = material.results.of_model(name)[0]
    protocol = ((trained.provenance or {}).get("settings") or {}).get("protocol", "thesis")
    in_metres = protocol == "operational"
    how = "with kernels in metres, searched for" if in_metres else "trained by the thesis' protocol"
    return f"a SCENE-Net{numbers} {how}"
