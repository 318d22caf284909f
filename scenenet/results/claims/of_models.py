"""The claims about trained models, label noise and times (thesis 5.1.2, 5.2)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd

from scenenet.results.claims import intervals
from scenenet.results.claims.claim import EQUAL, NEGATIVE, POSITIVE, Claim, about
from scenenet.results.claims.evidence import Evidence
from scenenet.results.claims.intervals import Interval

SCENENET = ("SCENE-Net", lambda e: e.model("scenenet", "f05", live=True))
CNN = ("the CNN", lambda e: e.model("cnn", "f05", live=True))

SAME_TOWER_M = 5.0
"""Planar distance within which a labelled and a true tower are the same, m."""

MOST_MINUTES = 90.0


def _against_cnn(score: str) -> Callable[[Evidence], Interval | None]:
    """SCENE-Net minus the CNN, live seeds of both, which the thesis compares."""
    return lambda e: intervals.apart(
        e.model("scenenet", score, live=True), e.model("cnn", score, live=True)
    )


def _weight_of_sphere(evidence: Evidence) -> Interval | None:
    ends = {
        one.seed: one.history["lambda.negative_sphere"].iloc[-1]
        for one in evidence.trained("scenenet")
        if one.alive and one.history is not None and "lambda.negative_sphere" in one.history
    }
    return intervals.mean(pd.Series(ends, dtype=float))


def _minutes(evidence: Evidence, kind: str) -> pd.Series:
    seconds = {one.seed: one.seconds for one in evidence.trained(kind)}
    return pd.Series(seconds, dtype=float) / 60


def _per_pair(one: pd.Series, other: pd.Series) -> Interval | None:
    """Ratio of two positive quantities of the same seeds: the mean of its logarithm, as a ratio."""
    with np.errstate(divide="ignore", invalid="ignore"):
        found = intervals.mean(np.log(one / other).replace([np.inf, -np.inf], np.nan))
    if found is None:
        return None
    value, low, high = (float(np.exp(end)) for end in found[:3])
    return Interval(value, low, high, found.n)


def _live_cnns(evidence: Evidence) -> Interval | None:
    alive = evidence.study("starts", "CNN, init thesis", "alive")
    if alive.empty:
        alive = evidence.model("cnn", "alive")
    return intervals.share(alive.astype(bool))


def _separated_towers(evidence: Evidence) -> Interval | None:
    """True towers with exactly one labelled tower at their place."""
    from scipy.spatial import cKDTree

    labelled, found = evidence.results.towers(), []
    for survey, true in evidence.results.true_towers().items():
        places = labelled[survey][["x", "y"]].to_numpy(float)
        near = cKDTree(places).query_ball_point(true[["x", "y"]].to_numpy(float), SAME_TOWER_M)
        found += [len(group) == 1 for group in near]
    return intervals.share(pd.Series(found, dtype=bool))


def _kept_with_noise(kind: str) -> Callable[[Evidence], Interval | None]:
    """F0.5 against the truth at the highest level of label noise minus that without."""
    return lambda e: intervals.paired(
        e.noise(kind, "highest", "truth_f05"), e.noise(kind, "lowest", "truth_f05")
    )


CLAIMS = (
    Claim(
        "towers.separated", "5.1.2, Figure 5.2",
        "DBSCAN separates the points labelled tower into single towers.",
        "share of the true towers with exactly one cluster within 5 m", (0.99, 1.0),
        _separated_towers,
    ),
    Claim(
        "models.precision", "5.2.4.2, Table 5.3", "SCENE-Net is more precise than the CNN.",
        "precision, SCENE-Net minus CNN, live seeds", POSITIVE, _against_cnn("precision"),
        (SCENENET, CNN), "starts",
    ),
    Claim(
        "models.precision_lift", "5.2.4.2",
        "SCENE-Net is more precise than the CNN by about 24 points.",
        "precision, SCENE-Net minus CNN, live seeds", about(0.24), _against_cnn("precision"),
        (SCENENET, CNN), "starts",
    ),
    Claim(
        "models.recall", "5.2.4.2, Table 5.3", "SCENE-Net has a lower recall than the CNN.",
        "recall, SCENE-Net minus CNN, live seeds", NEGATIVE, _against_cnn("recall"),
        (SCENENET, CNN), "starts",
    ),
    Claim(
        "models.iou", "5.2.4.2, Table 5.3", "SCENE-Net has a higher IoU than the CNN.",
        "mean IoU over tower and background, SCENE-Net minus CNN, live seeds", POSITIVE,
        _against_cnn("miou"), (SCENENET, CNN), "starts",
    ),
    Claim(
        "models.curve", "Figure 5.7",
        "SCENE-Net has an area under the precision-recall curve comparable to that of the CNN.",
        "average precision, SCENE-Net minus CNN, live seeds", (-EQUAL, EQUAL),
        _against_cnn("average_precision"), (SCENENET, CNN), "starts",
    ),
    Claim(
        "models.precise", "5.2.4.2", "SCENE-Net is precise rather than complete.",
        "precision minus recall of SCENE-Net", POSITIVE,
        lambda e: intervals.paired(
            e.model("scenenet", "precision", live=True), e.model("scenenet", "recall", live=True)
        ),
        (SCENENET,), "starts",
    ),
    Claim(
        "models.recall_of_labels", "5.2.4.2",
        "The recall of SCENE-Net is low because of wrong labels.",
        "recall against the truth minus that against the labels", POSITIVE,
        lambda e: intervals.paired(
            e.model("scenenet", "truth_recall", live=True),
            e.model("scenenet", "recall", live=True),
        ),
        (SCENENET,),
    ),
    Claim(
        "parameters.sphere", "5.2.2, Figure 5.5",
        "The negative sphere has most of the weight (76 % in the thesis).",
        "weight of the negative sphere after training, live seeds", (0.5, 1.0),
        _weight_of_sphere, (SCENENET,), "ablations",
    ),
    Claim(
        "noise.scenenet", "5.2.5", "SCENE-Net is robust to noisy labels.",
        "F0.5 against the truth with the most wrong labels minus that with none",
        (-EQUAL, np.inf), _kept_with_noise("scenenet"),
        (("SCENE-Net without label noise", lambda e: e.noise("scenenet", "lowest", "truth_f05")),),
    ),
    Claim(
        "noise.cnn", "5.2.5", "The CNN is as robust to noisy labels.",
        "F0.5 against the truth with the most wrong labels minus that with none, of the CNN",
        (-EQUAL, np.inf), _kept_with_noise("cnn"),
        (("the CNN without label noise", lambda e: e.noise("cnn", "lowest", "truth_f05")),),
    ),
    Claim(
        "noise.ground", "5.2.5, Figure 5.9",
        "SCENE-Net detects the body of a tower and ignores what is wrongly labelled around it.",
        "share of the true tower voxels that are detected minus that of the wrongly labelled ones",
        POSITIVE,
        lambda e: intervals.paired(
            e.noise("scenenet", "highest", "truth_recall"),
            e.noise("scenenet", "highest", "wrong_detected"),
        ),
        (("SCENE-Net with label noise", lambda e: e.noise("scenenet", "highest", "truth_f05")),),
    ),
    Claim(
        "starts.cnn", "5.2.6", "Only one in five trained CNNs detects anything.",
        "share of live CNNs", about(0.2), _live_cnns, (), "starts",
    ),
    Claim(
        "times.training", "5.2.6", "SCENE-Net is trained in less than 90 minutes.",
        "training time of SCENE-Net, minutes", (-np.inf, MOST_MINUTES),
        lambda e: intervals.mean(_minutes(e, "scenenet")), timed=True,
    ),
    Claim(
        "times.equal", "5.2.6", "SCENE-Net and the CNN take equally long to train.",
        "training time of the CNN over that of SCENE-Net", about(1.0),
        lambda e: _per_pair(_minutes(e, "cnn"), _minutes(e, "scenenet")), timed=True,
    ),
    Claim(
        "times.inference", "5.2.6", "SCENE-Net takes half the time of the CNN for a crop.",
        "time of the CNN for a crop over that of SCENE-Net", about(43 / 20),
        lambda e: _per_pair(
            e.study("starts", "CNN, init thesis", "inference_ms"),
            e.study("starts", "SCENE-Net, init thesis", "inference_ms"),
        ),
        timed=True,
    ),
)  # fmt: skip
