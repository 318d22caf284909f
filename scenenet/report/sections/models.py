"""The sections on the models: scores, towers found, training (thesis 5.2)."""

from __future__ import annotations

from scenenet.metrics.score_columns import (
    AT_TAU,
    MATCH_COLUMNS,
    SCORE_COLUMNS,
    WHOLE_TOWERS,
)
from scenenet.report.blocks import Block, Column, Section, table
from scenenet.report.context import VOXEL_SCORES, ReportContext, with_published
from scenenet.results.score_tables import TRIVIAL


def models(context: ReportContext) -> Section | None:
    """Table 5.3 and Figure 5.7."""
    frame = context.table("models")
    if frame is None:
        return None
    columns = [
        Column("model", "model"),
        Column("counted", "trainings"),
        Column("voxels", "voxels that count"),
        Column("parameters", "parameters", "count"),
        *with_published(VOXEL_SCORES),
    ]
    caption = (
        "Scores of the tower class over all voxels of the test crops, at the tau chosen on the "
        "validation crops, mean ± standard deviation over seeds, with the scores of thesis Table "
        "5.3. The mean IoU is over background and tower, as in the thesis. The thesis used other "
        "data and reports live models only, so compare the order of the models and not the digits. "
        "“Voxels that count” are those at or above tau, as in the thesis, or those of whole towers "
        f"that are found with them; the next table has both for every model. “{TRIVIAL}” is a "
        f"model that never predicts tower."
    )
    seeds = context.table("seeds")
    blocks: list[Block] = [table(frame, columns, caption, "tables/models.csv")]
    blocks += _whole_towers(context)
    blocks += context.figures("models")
    if seeds is not None:
        columns = [
            Column("model", "model"),
            Column("seed", "seed", "count"),
            Column("alive", "live", "yes"),
            Column("tau", "tau", "score"),
            Column("validation_f05", "F0.5, validation", "score"),
            *(Column(c.name, c.label, "score") for c in VOXEL_SCORES),
            Column("average_precision", "average precision", "score"),
        ]
        caption = "Every single training: scores on the test crops at the tau chosen on the "
        "validation crops. A live model detects at least one tower voxel."
        blocks.append(table(seeds, columns, caption, "tables/seeds.csv", folded=True))
    return Section("models", "Scores of the models", blocks)


def _whole_towers(context: ReportContext) -> list[Block]:
    frame = context.table("whole_towers")
    if frame is None:
        return []
    columns = [Column("model", "model")]
    for part, voxels in (("tau", AT_TAU), ("towers", WHOLE_TOWERS)):
        columns += [
            Column(f"{part}_{c.name}", f"{c.short}, {voxels}", "score2", f"{part}_{c.name}_std")
            for c in SCORE_COLUMNS
            if c.tower_only
        ]
    caption = (
        "The same predictions on the same test crops, counted in two ways: the voxels at or above "
        "tau, as in the thesis, and the voxels of whole towers. A whole tower is accepted by its "
        "height, its body and its conductors, and all of its body counts. The rules are the same "
        "for every model, and nothing in them is trained (docs/method/detection.md). Mean ± "
        "standard deviation over seeds."
    )
    return [table(frame, columns, caption, "tables/whole_towers.csv")]


def positions(context: ReportContext) -> Section | None:
    """Tower positions in metres (thesis 5.2.4)."""
    frame = context.table("tower_scores")
    if frame is None:
        return None
    columns = [
        Column("model", "model"),
        Column("counted", "trainings"),
        *(
            Column(c.name, c.label, c.kind, None if c.kind == "count" else f"{c.name}_std")
            for c in MATCH_COLUMNS
        ),
    ]
    caption = (
        "Towers as objects on the test crops: a predicted tower within 5 m of a labelled one is a "
        "hit. Every crop has a tower at its centre, which is easier than a whole survey. The "
        "thesis does not report these scores."
    )
    found = table(frame, columns, caption, "tables/tower_scores.csv")
    return Section("positions", "Towers found", [found])


def training(context: ReportContext) -> Section | None:
    """Training curves and times (thesis 5.2.6)."""
    blocks = context.figures("training")
    frame = context.table("times")
    if frame is not None:
        columns = [
            Column("model", "model"),
            Column("n_seeds", "trainings", "count"),
            Column("epochs", "epochs", "count"),
            Column("training_seconds", "one training", "seconds", "training_seconds_std"),
            Column("thesis_training_seconds", "thesis, one training", "seconds", published=True),
            Column("seconds_per_epoch", "one epoch", "seconds"),
            Column("useful_seconds", "until a live model", "seconds"),
            Column(
                "thesis_useful_seconds", "thesis, until a live model", "seconds", published=True
            ),
            Column("inference_ms", "crop of 64³ voxels [ms]", "number"),
            Column("thesis_inference_ms", "thesis, crop [ms]", "number", published=True),
            Column("inference_ms_128", "crop of 128³ voxels [ms]", "number"),
            Column("peak_memory_mb", "peak memory [MB]", "count"),
        ]
        caption = (
            "Time of training and of inference. The times of the thesis (5.2.6) are for an NVIDIA "
            "GeForce RTX 3070 and, in training, for far more crops; the times of this run are for "
            "one CPU core of the machine that it ran on. Inference is timed from the occupied "
            "voxels of a crop to the probability of every voxel, median over crops and repeats, "
            "without voxelisation. “Until a live model” is the time of one training divided by the "
            "share of live models. Peak memory is the largest resident set of a training process, "
            "with Python, its libraries and the crops (boosted trees: training and scoring every "
            "seed)."
        )
        blocks = [table(frame, columns, caption, "tables/times.csv"), *blocks]
    blocks += _experiment_times(context)
    return Section("training", "Training", blocks) if blocks else None


def _experiment_times(context: ReportContext) -> list[Block]:
    """Times of the studies and experiments; apart from their scores, which do not differ between
    equal runs."""
    frame = context.table("experiment_times")
    if frame is None:
        return []
    columns = [
        Column("experiment", "study or experiment"),
        Column("case", "variant or model"),
        Column("n_trainings", "trainings", "count"),
        Column("training_seconds", "one training", "seconds", "training_seconds_std"),
        Column("inference_ms", "one crop [ms]", "number"),
    ]
    caption = "Times of the trainings of the studies and experiments, mean ± standard deviation."
    return [table(frame, columns, caption, "tables/experiment_times.csv", folded=True)]
