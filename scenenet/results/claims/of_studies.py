"""The claims that the studies repeat (thesis 5.2.7, 5.3)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from scenenet.results.claims import intervals
from scenenet.results.claims.claim import EQUAL, NEGATIVE, NOTHING, POSITIVE, Claim, about
from scenenet.results.claims.evidence import Evidence
from scenenet.results.claims.intervals import Interval

Measure = Callable[[Evidence], Interval | None]
Skill = tuple[str, Callable[[Evidence], pd.Series]]

BEST, CYLINDER, ARROW = "E: one of each", "A: cylinder", "B: arrow"
EPSILONS = ("0.00001", "0.0001", "0.001", "0.01", "0.1")
ALPHAS = ("0.1", "1", "2", "3", "5", "8", "10", "20", "50")
DECAYS = tuple(f"decay {d}, decay_every {n}" for d in (0.05, 0.1, 0.2, 0.25) for n in (10, 20, 25))


def _skilled(study: str, variant: str) -> Skill:
    return f"{variant} of study {study}", lambda e: e.study(study, variant, "f05")


def _gain(study: str, one: str, other: str, score: str = "f05") -> Measure:
    """A score of a variant minus that of another, of the same seeds."""
    return lambda e: intervals.paired(e.study(study, one, score), e.study(study, other, score))


def _score(study: str, variant: str, score: str) -> Measure:
    return lambda e: intervals.mean(e.study(study, variant, score))


def _mean(e: Evidence, study: str, variants: Sequence[str], score: str = "f05") -> pd.Series:
    """Mean of a score over variants, by seed."""
    return pd.DataFrame({name: e.study(study, name, score) for name in variants}).mean(axis=1)


def _over(first: Sequence[str], second: Sequence[str], score: str) -> Measure:
    """A score of some combinations of alpha and epsilon minus that of others, in pairs. There is
    one seed: the replicates are the values of the other number."""

    def measure(e: Evidence) -> Interval | None:
        found = [
            pd.concat([e.study("alpha-epsilon", name, score) for name in names], ignore_index=True)
            for names in (first, second)
        ]
        return intervals.paired(*found) if len(found[0]) == len(found[1]) else None

    return measure


def _alpha(alpha: str) -> list[str]:
    return [f"alpha {alpha}, epsilon {epsilon}" for epsilon in EPSILONS]


def _epsilon(epsilon: str) -> list[str]:
    return [f"alpha {alpha}, epsilon {epsilon}" for alpha in ALPHAS]


def _lowest_detects_nothing(e: Evidence) -> Interval | None:
    runs = [e.study("alpha-epsilon", name, "recall") for name in _alpha("0.001")]
    return intervals.mean(pd.concat(runs, ignore_index=True))


def _lower_loss(e: Evidence) -> Interval | None:
    density = e.study("measurement", "measurement density", "loss")
    presence = e.study("measurement", "measurement presence", "loss")
    return intervals.mean((density - presence) / density)


def _negative(e: Evidence, penalty: str) -> pd.Series:
    variant = f"init unranged, penalty {penalty}"
    return (e.study("penalty", variant, "lowest_weight") < 0).astype(float)


def _compared(
    name: str,
    place: str,
    says: str,
    statistic: str,
    holds: tuple[float, float],
    study: str,
    one: str,
    other: str,
    reference: str | None = None,
) -> Claim:
    """A claim about the F0.5 of a variant minus that of another of the same study.

    Args:
        name, place, says, statistic, holds: of the claim.
        study, one, other: what is compared.
        reference: the variant that must have skill; None for ``one``.
    """
    skill = (_skilled(study, reference or one),)
    return Claim(name, place, says, statistic, holds, _gain(study, one, other), skill, study)


def _ablation(name: str, variant: str, says: str) -> Claim:
    """One of each detects more than another number of operators."""
    return _compared(
        f"ablation.{name}", "5.3.5, Table 5.5", says, f"F0.5, one of each minus {variant}",
        POSITIVE, "ablations", BEST, variant,
    )  # fmt: skip


def _alone(name: str, variant: str, says: str) -> Claim:
    """An operator alone finds nothing. It only means something where all together find towers."""
    return Claim(
        f"ablation.{name}", "5.3.5, Table 5.5", says, f"recall of {variant}", NOTHING,
        _score("ablations", variant, "recall"), (_skilled("ablations", BEST),), "ablations",
    )  # fmt: skip


SCENENET: Skill = ("SCENE-Net", lambda e: e.model("scenenet", "f05", live=True))
SMALL, TALL = "9x9x9", "9x5x5"
RESAMPLED = (_skilled("kernel-after-training", SMALL), _skilled("kernel-after-training", TALL))

KERNELS = (
    Claim(
        "kernel.precision", "5.2.7, Table 5.4",
        "Kernels trained at 9x9x9 are more precise at 9x5x5.",
        "precision at 9x5x5 minus that at 9x9x9", POSITIVE,
        _gain("kernel-after-training", TALL, SMALL, "precision"), RESAMPLED,
        "kernel-after-training",
    ),
    Claim(
        "kernel.recall", "5.2.7, Table 5.4", "Kernels trained at 9x9x9 find less at 9x5x5.",
        "recall at 9x5x5 minus that at 9x9x9", NEGATIVE,
        _gain("kernel-after-training", TALL, SMALL, "recall"), RESAMPLED, "kernel-after-training",
    ),
    Claim(
        "kernel.iou", "5.2.7, Table 5.4", "The IoU is the same at 9x5x5 and at 9x9x9.",
        "mean IoU over tower and background at 9x5x5 minus that at 9x9x9", (-0.02, 0.02),
        _gain("kernel-after-training", TALL, SMALL, "miou"), RESAMPLED, "kernel-after-training",
    ),
    _compared(
        "resolution", "5.2.7, Figure 5.10",
        "A model trained at 64 voxels a side is as good at 128.", "F0.5 at 128 minus that at 64",
        (-EQUAL, np.inf), "resolution-after-training", "resolution 128", "resolution 64",
        "resolution 64",
    ),
    Claim(
        "kernel.bigger", "5.3.4", "Bigger kernels are better in training.",
        "F0.5 with 9x9x9 minus the mean of 6x5x5 and 6x6x6", POSITIVE,
        lambda e: intervals.paired(
            e.study("kernel-in-training", "kernel_size 9x9x9", "f05"),
            _mean(e, "kernel-in-training", ("kernel_size 6x5x5", "kernel_size 6x6x6")),
        ),
        (_skilled("kernel-in-training", "kernel_size 9x9x9"),), "kernel-in-training",
    ),
    Claim(
        "kernel.consistent", "5.3.4", "Bigger kernels are more consistent.",
        "spread of F0.5 over seeds with 9x9x9 over that with 6x6x6", (0.0, 1.0),
        lambda e: intervals.spread_ratio(
            e.study("kernel-in-training", "kernel_size 9x9x9", "f05"),
            e.study("kernel-in-training", "kernel_size 6x6x6", "f05"),
        ),
        (_skilled("kernel-in-training", "kernel_size 9x9x9"),), "kernel-in-training",
    ),
)  # fmt: skip

LOSS = (
    _compared(
        "measurement.better", "5.3.2", "Presence is a better measurement than density.",
        "F0.5 with presence minus that with density", POSITIVE,
        "measurement", "measurement presence", "measurement density",
    ),
    Claim(
        "measurement.loss", "5.3.2", "The loss is lower by 42 % with presence than with density.",
        "share of the loss with density that presence saves", about(0.42), _lower_loss,
        (_skilled("measurement", "measurement presence"),), "measurement",
    ),
    _compared(
        "fidelity", "5.3.3", "Cross entropy is all-around worse than the squared error.",
        "F0.5 with the squared error minus that with cross entropy", POSITIVE,
        "fidelity", "fidelity squared", "fidelity cross_entropy",
    ),
    Claim(
        "penalty", "5.3.3, Figure 4.5",
        "A quadratic penalty leaves negative weights where a linear one does not.",
        "share of the seeds that end with a negative weight, quadratic minus linear, drawn without "
        "ranges", POSITIVE,
        lambda e: intervals.paired(_negative(e, "quadratic"), _negative(e, "linear")),
        (), "penalty",
    ),
    Claim(
        "alpha.high", "5.3.3", "A high alpha makes many false positives.",
        "precision at alpha 100 minus that at alpha 5, over the values of epsilon", NEGATIVE,
        _over(_alpha("100"), _alpha("5"), "precision"), (SCENENET,), "alpha-epsilon",
    ),
    Claim(
        "alpha.low", "5.3.3", "A low alpha detects nothing.",
        "recall at alpha 0.001, over the values of epsilon", NOTHING, _lowest_detects_nothing,
        (SCENENET,), "alpha-epsilon",
    ),
    Claim(
        "epsilon.high", "5.3.3", "A high epsilon detects less.",
        "recall at epsilon 0.1 minus that at 0.00001, over the values of alpha from 0.1 to 50",
        NEGATIVE, _over(_epsilon("0.1"), _epsilon("0.00001"), "recall"), (SCENENET,),
        "alpha-epsilon",
    ),
    Claim(
        "epsilon.low", "5.3.3", "A low epsilon makes many false positives.",
        "precision at epsilon 0.00001 minus that at 0.1, over the values of alpha from 0.1 to 50",
        NEGATIVE, _over(_epsilon("0.00001"), _epsilon("0.1"), "precision"), (SCENENET,),
        "alpha-epsilon",
    ),
)  # fmt: skip

TRAINING = (
    _compared(
        "epochs.enough", "5.3.4", "No more than 10 epochs are effective.",
        "F0.5 after 10 epochs minus that after 50", (-EQUAL, np.inf),
        "epochs", "epochs 10", "epochs 50", "epochs 50",
    ),
    Claim(
        "epochs.consistent", "5.3.4", "50 epochs are more consistent across runs than 10.",
        "spread of F0.5 over seeds after 50 epochs over that after 10", (0.0, 1.0),
        lambda e: intervals.spread_ratio(
            e.study("epochs", "epochs 50", "f05"), e.study("epochs", "epochs 10", "f05")
        ),
        (_skilled("epochs", "epochs 50"),), "epochs",
    ),
    Claim(
        "batch.time", "5.3.4", "Bigger batches take longer to train.",
        "training time with batches of 32 minus that with batches of 8, s", POSITIVE,
        _gain("batch-size", "batch_size 32", "batch_size 8", "training_seconds"), timed=True,
    ),
    Claim(
        "decay", "5.3.4", "Any decay of the learning rate halts training.",
        "F0.5 with decay, mean over the kinds, minus that without", NEGATIVE,
        lambda e: intervals.paired(_mean(e, "decay", DECAYS), e.study("decay", "none", "f05")),
        (_skilled("decay", "none"),), "decay",
    ),
    _compared(
        "init.ranges", "5.3.4", "Initial values drawn without ranges are worse.",
        "F0.5 with ranges minus that without", POSITIVE,
        "initialisation", "thesis ranges", "no ranges",
    ),
    _compared(
        "init.hand", "5.3.4", "Initial values set by hand are worse.",
        "F0.5 with ranges minus that with values set by hand", POSITIVE,
        "initialisation", "thesis ranges", "by hand",
    ),
    *(
        _compared(
            f"optimiser.{other}", "5.3.4",
            f"RMSProp and {name} make no noticeable difference.",
            f"F0.5 with RMSProp minus that with {name}", (-EQUAL, EQUAL),
            "optimiser", "optimiser rmsprop", f"optimiser {other}",
        )
        for other, name in (("adam", "Adam"), ("sgd", "SGD"))
    ),
    Claim(
        "crops.enough", "5.3.4",
        "Little more than 500 training crops, a fifth of the dataset, are enough.",
        "F0.5 with a fifth of the crops minus that with half of them", (-EQUAL, np.inf),
        lambda e: intervals.apart(e.study("split", "20 %", "f05"), e.study("split", "50 %", "f05")),
        (_skilled("split", "50 %"),), "split",
    ),
)  # fmt: skip

ABLATIONS = (
    _alone("cylinder", CYLINDER, "A cylinder alone detects nothing."),
    _alone("arrow", ARROW, "An arrow alone detects nothing."),
    Claim(
        "ablation.sphere", "5.3.5, Table 5.5",
        "The negative sphere is essential: a cylinder with it detects more than alone.",
        "F0.5 of cylinder and negative sphere minus that of the cylinder", POSITIVE,
        _gain("ablations", "C: cylinder, negative sphere", CYLINDER),
        (_skilled("ablations", BEST),), "ablations",
    ),
    _ablation("no_arrow", "C: cylinder, negative sphere",
              "One of each is better than cylinder and negative sphere."),
    _ablation("no_cylinder", "D: arrow, negative sphere",
              "One of each is better than arrow and negative sphere."),
    _ablation("two", "F: two of each", "One of each is better than two of each."),
    _ablation("three", "G: three of each", "One of each is better than three of each."),
)  # fmt: skip

CLAIMS = (*KERNELS, *LOSS, *TRAINING, *ABLATIONS)
