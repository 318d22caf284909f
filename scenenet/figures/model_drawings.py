"""Pictures of models: scores, training, kernels, numbers, studies (thesis 4.4, 5.2, 5.3).

Every function that draws writes one PNG and returns (alternative text, caption).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from scenenet.errors import InputError
from scenenet.figures.chosen import champion_of
from scenenet.published import Thesis
from scenenet.results import Results, parameter_columns
from scenenet.studies.settings import StudySettings


def draw_curves(results: Results, thesis: Thesis | None, out: Path) -> tuple[str, str]:
    from scenenet.figures.charts import precision_recall

    curves = {
        model: [r.evaluation["pr_curve"] for r in results.of_model(model)]
        for model in results.models
        if any(r.evaluation["pr_curve"] for r in results.of_model(model))
    }
    published = {}
    for model, kind in results.models.items():
        if thesis is None:
            break
        recall, precision = (thesis.value(f"models.{kind}.{n}") for n in ("recall", "precision"))
        if recall is not None and precision is not None:
            published[model] = (recall, precision)
    return precision_recall(curves, out, published), (
        "Every voxel of the test crops, with changing threshold tau. Thin lines are single seeds, "
        "the thick one is their mean with one standard deviation around it; a seed that never "
        "reaches a recall counts as precision 0 there. Diamonds mark the thesis' scores "
        "(Table 5.3), which were measured on other data. As thesis Figure 5.7."
    )


def draw_training(results: Results, model: str, out: Path) -> tuple[str, str]:
    from scenenet.figures.charts import training

    histories = _histories(results, model)
    dashed = any("validation_loss" in history for history in histories.values())
    return training(histories, out), (
        f"Training loss of {model} after each epoch, one line per seed"
        + (", the loss on the validation crops dashed." if dashed else ".")
    )


def draw_paths(results: Results, model: str, out: Path) -> tuple[str, str]:
    from scenenet.figures.charts import parameter_paths

    histories = _histories(results, model)
    names = parameter_columns(next(iter(histories.values())))
    return parameter_paths(histories, names, out), (
        f"The {len(names)} parameters of {model} after each epoch, one line per seed."
    )


def draw_kernels(results: Results, model: str, out: Path) -> tuple[str, str]:
    import torch

    from scenenet.figures.charts import kernels
    from scenenet.modelfile import read_model
    from scenenet.models import CNN, SceneNet

    champion = champion_of(results, model)
    trained, _ = read_model(champion.model_files[0])
    parts: dict[str, np.ndarray] = {}
    with torch.no_grad():
        summed, _ = trained.observer()
        if isinstance(trained, SceneNet):
            parts = dict(zip(trained.names, trained.kernels().numpy(), strict=True))
        elif isinstance(trained, CNN):
            parts = {f"kernel {i + 1}": k.numpy() for i, k in enumerate(trained.weight)}
    alt = kernels({**parts, "all together": summed.numpy()}, out)
    figures = "As thesis Figures 4.2 to 4.4." if isinstance(trained, SceneNet) else ""
    return alt, (
        f"Slices through the middle of each kernel of {model}, seed {champion.seed} (best on "
        "validation): from the side above, from the top below. Red adds to the answer where a "
        f"voxel is occupied, blue takes away. Each kernel has its own scale. {figures}"
    ).strip()


def draw_parameters(results: Results, model: str, out: Path) -> tuple[str, str]:
    from scenenet.figures.charts import parameters
    from scenenet.modelfile import read_model
    from scenenet.models import SceneNet

    models = [read_model(r.model_files[0])[0] for r in results.of_model(model) if r.model_files]
    of_seeds = [trained.shape_parameters() for trained in models if isinstance(trained, SceneNet)]
    if not of_seeds:
        raise InputError(f"no tuned model called {model}", file=results.folder / "models" / model)
    values = {name: [numbers[name] for numbers in of_seeds] for name in of_seeds[0]}
    return parameters(values, out), (
        f"The trained parameters of {model}: bars are means over {len(of_seeds)} seeds with one "
        "standard deviation, dots are single seeds. Lengths are in voxels; the last mixing weight "
        "is one minus the others. As thesis Figure 5.5."
    )


def draw_study(
    results: Results, study: StudySettings, thesis: Thesis | None, out: Path
) -> tuple[str, str]:
    from scenenet.figures import studies
    from scenenet.studies.summary import summarise

    runs = results.study_runs(study.name)
    if runs is None:
        raise InputError("has not been run", file=results.folder / "studies" / study.name)
    summary = summarise(study, runs, thesis or Thesis(source="", numbers={}))
    if study.is_grid:
        names, values = zip(*study.vary.items(), strict=True)
        first, second = (name.rpartition(".")[2] for name in names)
        alt = studies.heat_map(summary, (first, second), (len(values[0]), len(values[1])), out)
    else:
        alt = studies.rows(summary, out)
    hollow = " Hollow points are the thesis'." if any(v.thesis for v in study.variants) else ""
    return alt, (
        f"{study.asks} Scores of the tower class on the {study.part} crops at the tau that is best "
        f"on validation, {_seeds(study)}.{hollow} Thesis {study.place}."
    )


def _histories(results: Results, model: str) -> dict[str, Any]:
    histories = {f"seed {r.seed}": r.history for r in results.of_model(model)
                 if r.history is not None}  # fmt: skip
    if not histories:
        raise InputError("no training history", file=results.folder / "train" / model)
    return histories


def _seeds(study: StudySettings) -> str:
    n = len(study.seeds)
    return "one seed" if n == 1 else f"mean and spread over {n} seeds"
