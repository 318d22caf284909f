"""The sections on the models: scores, towers found, parameters, training (thesis 5.2)."""

from __future__ import annotations

from scenenet.report.blocks import Block, Column, Section, table
from scenenet.report.context import VOXEL_SCORES, Material, beside
from scenenet.results.score_tables import TRIVIAL


def models(material: Material) -> Section | None:
    """Table 5.3 and Figure 5.7."""
    frame = material.table("models")
    if frame is None:
        return None
    columns = [
        Column("model", "model"),
        Column("counted", "counted"),
        Column("voxels", "tower voxels"),
        Column("parameters", "parameters", "count"),
        *beside(VOXEL_SCORES),
    ]
    caption = (
        "Scores of the tower class over all voxels of the test crops at the tau chosen on "
        "validation, mean ± standard deviation over seeds, beside thesis Table 5.3. IoU mean is "
        "over background and tower, as the thesis' IoU. The thesis "
        "counts useful trainings only and was measured on other data, so the columns can be "
        "compared in kind, not digit by digit. Tower voxels are those that reach tau, as in the "
        "thesis, or those of whole towers that are found with them; the next table has both for "
        "every model. "
        f"“{TRIVIAL}” is a model that never says tower."
    )
    seeds = material.table("seeds")
    blocks: list[Block] = [table(frame, columns, caption, "tables/models.csv")]
    blocks += _whole_towers(material)
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


def _whole_towers(material: Material) -> list[Block]:
    frame = material.table("whole_towers")
    if frame is None:
        return []
    names = [("precision", "P"), ("recall", "R"), ("f05", "F0.5"), ("iou_tower", "IoU")]
    columns = [Column("model", "model")]
    for part, said in (("tau", "reach tau"), ("towers", "whole towers")):
        columns += [
            Column(f"{part}_{name}", f"{label}, {said}", "score2", f"{part}_{name}_std")
            for name, label in names
        ]
    caption = (
        "The same test crops and the same answers, counted in two ways: voxels that reach tau, and "
        "voxels of whole towers, body and all, where height, body and wires say that it is one. "
        "The rules are the same for every model and nothing in them is trained "
        "(docs/method/detection.md). Mean ± standard deviation over seeds. The thesis counts "
        "voxels that reach tau."
    )
    return [table(frame, columns, caption, "tables/whole_towers.csv")]


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
            Column("thesis_training_seconds", "thesis, one training", "seconds", published=True),
            Column("seconds_per_epoch", "one epoch", "seconds"),
            Column("useful_seconds", "until one detects anything", "seconds"),
            Column("thesis_useful_seconds", "thesis, useful CNN", "seconds", published=True),
            Column("inference_ms", "a crop of 64³ [ms]", "number"),
            Column("thesis_inference_ms", "thesis, a crop [ms]", "number", published=True),
            Column("inference_ms_128", "a crop of 128³ [ms]", "number"),
            Column("peak_memory_mb", "peak memory [MB]", "count"),
        ]
        caption = (
            "Time of training and of inference. The thesis' times (5.2.6) are of an NVIDIA GeForce "
            "RTX 3070 and, in training, of far more crops; ours are of the machine this ran on, on "
            "one CPU core. A crop is timed from its occupied voxels to the probability of every "
            "voxel, median over crops and repeats; making voxels of points is not in it. “Until "
            "one detects anything” is the time of a training over the share of them that do. "
            "Peak memory is the largest resident set of a training process, Python, its libraries "
            "and the crops included (of the boosted trees: of training and scoring every seed)."
        )
        blocks = [table(frame, columns, caption, "tables/times.csv"), *blocks]
    return Section("training", "Training", blocks) if blocks else None
