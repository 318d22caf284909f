"""The experiments: name, setting that switches it on, table, finding.

A figure, MLflow runs and a section of the report are registered by the name of the experiment in
``scenenet.figures.experiments``, ``scenenet.tracking.experiment_runs`` and
``scenenet.report.sections.experiments``, because those packages import this one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import pandas as pd

from scenenet.experiments.components.summary import summarise_components, who_does_the_work
from scenenet.experiments.cross_validation.summary import ranking, summarise_folds
from scenenet.experiments.label_noise.summary import claim, summarise_label_noise


@dataclass(frozen=True)
class Experiment:
    """Many trainings of all models that answer one question.

    Attributes:
        name: group of its settings, folder of its results, stem of its table and of its figure,
            section of the report, ending of its MLflow experiment.
        switch: its setting that is empty or zero if the experiment is off.
        title: heading in the report.
        place: section of the thesis.
        section: category of its table and figure in the Snakemake report.
        contents: what is trained and what is scored, a sentence or two.
        summarise: runs (a row per training) -> the table of the report.
        finding: table and model name -> architecture -> what the table shows, in sentences.
    """

    name: str
    switch: str
    title: str
    place: str
    section: str
    contents: str
    summarise: Callable[[pd.DataFrame], pd.DataFrame]
    finding: Callable[[pd.DataFrame, Mapping[str, str]], str]


EXPERIMENTS: Mapping[str, Experiment] = {
    experiment.name: experiment
    for experiment in (
        Experiment(
            name="cross_validation",
            switch="leave_out",
            title="Cross-validation",
            place="5.2.4",
            section="models",
            contents="Every crop is a test crop once; models are trained and tuned on the others.",
            summarise=summarise_folds,
            finding=ranking,
        ),
        Experiment(
            name="components",
            switch="run",
            title="Who does the work",
            place="5.2.4",
            section="models",
            contents="Rules alone, random and published parameters, trivial answers and a method "
            "without training beside every model, with and without rules, on points and voxels.",
            summarise=summarise_components,
            finding=who_does_the_work,
        ),
        Experiment(
            name="label_noise",
            switch="levels",
            title="Label noise",
            place="5.2.5",
            section="studies",
            contents="Models are trained on labels of which a known share is wrong, and scored "
            "against labels of the same quality and against the truth.",
            summarise=summarise_label_noise,
            finding=claim,
        ),
    )
}
"""Every experiment by its name, in the order of the report."""
