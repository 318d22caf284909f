"""The sections on the models: scores, towers found, training (thesis 5.2)."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from scenenet.experiments.label_noise.settings import LABELS
from scenenet.metrics.score_columns import (
    AT_TAU,
    MATCH_COLUMNS,
    POINT_COLUMNS,
    SCORE_COLUMNS,
    WHOLE_TOWERS,
    MatchColumn,
)
from scenenet.report.blocks import Block, Column, Section, Text, table
from scenenet.report.context import (
    AGAINST_TRUTH,
    VOXEL_SCORES,
    Against,
    ReportContext,
    against,
    against_column,
    against_each,
    with_published,
)
from scenenet.results.score_tables import TRIVIAL


def models(context: ReportContext) -> Section | None:
    """Table 5.3 and Figure 5.7."""
    frame = context.table("models")
    if frame is None:
        return None
    measured = against(frame, "f05")
    blocks: list[Block] = []
    if AGAINST_TRUTH in measured:
        blocks.append(
            Text(
                "Annotators label the surroundings of a tower as tower. The labels of these "
                "surveys say how well a model agrees with annotators, the truth says how well it "
                "finds towers. Models are trained and tuned on labels alone; scores against the "
                "truth come first, over the test crops whose truth is known."
            )
        )
    blocks += [_scores(frame, one) for one in measured]
    blocks += _whole_towers(context)
    blocks += context.figures("models")
    seeds = context.table("seeds")
    if seeds is not None:
        blocks.append(_each_seed(seeds, measured))
    return Section("models", "Scores of the models", blocks)


def _scores(frame: pd.DataFrame, measured: Against) -> Block:
    columns = [
        Column("model", "model"),
        Column("counted", "trainings"),
        Column("voxels", "voxels that count"),
        Column("parameters", "parameters", "count"),
    ]
    if measured is AGAINST_TRUTH:
        columns += [against_column(column, measured) for column in VOXEL_SCORES]
        caption = (
            "Against the truth: scores of the tower class over all voxels of the test crops, at "
            "the tau chosen on the labels of the validation crops, mean ± standard deviation over "
            f"seeds. “{TRIVIAL}” is a model that never predicts tower."
        )
        return table(frame, columns, caption, "tables/models.csv")
    columns += with_published(VOXEL_SCORES)
    caption = (
        "Against the labels: scores of the tower class over all voxels of the test crops, at the "
        "tau chosen on the validation crops, mean ± standard deviation over seeds, with the scores "
        "of thesis Table 5.3. The mean IoU is over background and tower, as in the thesis. The "
        "thesis used other data and reports live models only, so compare the order of the models "
        "and not the digits. “Voxels that count” are those at or above tau, as in the thesis, or "
        f"those of whole towers that are found with them; the next table has both for every model. "
        f"“{TRIVIAL}” is a model that never predicts tower."
    )
    return table(frame, columns, caption, "tables/models.csv")


def _each_seed(seeds: pd.DataFrame, measured: Sequence[Against]) -> Block:
    scores = [
        *(Column(c.name, c.label, "score") for c in VOXEL_SCORES),
        Column("average_precision", "average precision", "score"),
    ]
    columns = [
        Column("model", "model"),
        Column("seed", "seed", "count"),
        Column("alive", "live", "yes"),
        Column("tau", "tau", "score"),
        Column("validation_f05", "F0.5, validation", "score"),
        *against_each(scores, measured),
    ]
    caption = (
        "Every single training: scores on the test crops at the tau chosen on the validation "
        "crops. A live model detects at least one voxel labelled tower."
    )
    return table(seeds, columns, caption, "tables/seeds.csv", folded=True)


def _whole_towers(context: ReportContext) -> list[Block]:
    frame = context.table("whole_towers")
    if frame is None:
        return []
    scores = [
        Column(f"{part}_{c.name}", f"{c.short}, {voxels}", "score2", f"{part}_{c.name}_std")
        for part, voxels in (("tau", AT_TAU), ("towers", WHOLE_TOWERS))
        for c in SCORE_COLUMNS
        if c.tower_only
    ]
    return [_both_ways(frame, scores, one) for one in against(frame, "tau_f05")]


def _both_ways(frame: pd.DataFrame, scores: Sequence[Column], measured: Against) -> Block:
    columns = [Column("model", "model"), *(against_column(column, measured) for column in scores)]
    caption = (
        f"Against the {measured.name}: "
        "the same predictions on the same test crops, counted in two ways: the voxels at or above "
        "tau, as in the thesis, and the voxels of whole towers. A whole tower is accepted by its "
        "height, its body and its conductors, and every voxel with one of its points counts. The "
        "rules are the same for every model, and nothing in them is trained "
        "(docs/method/detection.md). Mean ± "
        "standard deviation over seeds."
    )
    return table(frame, columns, caption, "tables/whole_towers.csv")


def positions(context: ReportContext) -> Section | None:
    """Tower positions in metres (thesis 5.2.4), and the points of towers."""
    frame = context.table("tower_scores")
    if frame is None:
        return None
    blocks: list[Block] = []
    for measured in against(frame, "n_true"):
        caption = (
            f"Towers as objects on the test crops: a predicted tower within 5 m of a "
            f"{measured.adjective} one is a hit. Every crop has a labelled tower at its centre, "
            "which is easier than a whole survey. Height and base are compared with the highest "
            f"{measured.adjective} point and with the ground under the axis. The thesis does not "
            "report these scores."
        )
        columns = _of_matches(MATCH_COLUMNS, measured)
        blocks.append(table(frame, columns, caption, "tables/tower_scores.csv"))
    blocks += _points(context)
    return Section("positions", "Towers found", blocks)


def _points(context: ReportContext) -> list[Block]:
    points = context.table("point_scores")
    if points is None:
        return []
    blocks: list[Block] = []
    for measured in against(points, "n_true"):
        if points[f"{measured.prefix}n_true"].isna().all():
            continue
        caption = (
            f"Points of the test crops with a tower id, as in a classified survey, against the "
            f"{measured.adjective} tower points. Each crop is predicted as a survey of its own."
        )
        if measured is AGAINST_TRUTH:
            caption += f" The row “{LABELS}” scores the labels as if a model had predicted them."
        shown = points[points[f"{measured.prefix}n_true"].notna()]
        columns = _of_matches(POINT_COLUMNS, measured)
        blocks.append(table(shown, columns, caption, "tables/point_scores.csv"))
    return blocks


def _of_matches(scores: Sequence[MatchColumn], measured: Against) -> list[Column]:
    columns = [Column("model", "model"), Column("counted", "trainings")]
    for c in scores:
        label = c.label.replace("labelled", measured.adjective)
        spread = None if c.kind == "count" else f"{c.name}_std"
        columns.append(against_column(Column(c.name, label, c.kind, spread), measured))
    return columns


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
