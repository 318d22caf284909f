"""The opening of the page: what a person wants to know first."""

from __future__ import annotations

from scenenet.report.blocks import Facts, Section, Text, write
from scenenet.report.material import Material
from scenenet.tables import TRIVIAL


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
