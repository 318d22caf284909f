"""Pictures of models: scores, training, kernels, numbers, studies (thesis 4.4, 5.2, 5.3).

Every function that draws writes one PNG and returns (alternative text, caption).
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scenenet.core.errors import InputError
from scenenet.experiments.published import Thesis
from scenenet.experiments.studies.settings import StudySettings
from scenenet.figures.selection import champion_of
from scenenet.results.folder import Results, parameter_columns

if TYPE_CHECKING:
    from scenenet.models.base import VoxelModel


def draw_curves(results: Results, thesis: Thesis | None, out: Path) -> tuple[str, str]:
    from scenenet.figures.plots.curves import precision_recall

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
    from scenenet.figures.plots.curves import training

    histories = _histories(results, model)
    dashed = any("validation_loss" in history for history in histories.values())
    return training(histories, out), (
        f"Training loss of {model} after each epoch, one line per seed"
        + (", the loss on the validation crops dashed." if dashed else ".")
    )


def draw_paths(results: Results, model: str, out: Path) -> tuple[str, str]:
    from scenenet.figures.plots.curves import parameter_paths

    histories = _histories(results, model)
    names = parameter_columns(next(iter(histories.values())))
    return parameter_paths(histories, names, out), (
        f"The {len(names)} parameters of {model} after each epoch, one line per seed."
    )


def draw_kernels(results: Results, model: str, out: Path) -> tuple[str, str]:
    from scenenet.figures.plots.parameters import kernels
    from scenenet.models.geneo_model import GeneoModel
    from scenenet.models.model_file import read_model
    from scenenet.results.initial_models import initial_model

    champion = champion_of(results, model)
    trained, _ = read_model(champion.model_files[0])
    start = initial_model(champion, trained)
    alt = kernels(_slices(trained), out, start and _slices(start.model), trained.voxel_size)
    before = "" if start is None else f"The rows above are those {start.origin}. "
    figures = "As thesis Figures 4.2 to 4.4." if isinstance(trained, GeneoModel) else ""
    return alt, (
        f"Slices through the middle of each kernel of {model}, seed {champion.seed} (best on "
        "validation). Red adds to the answer where a voxel is occupied, blue takes away. Each "
        f"kernel has its own scale, the same before and after. {before}{figures}"
    ).strip()


def _slices(model: VoxelModel) -> dict[str, np.ndarray]:
    """Every kernel of a model (kz, ky, kx), and their sum."""
    import torch

    from scenenet.models.cnn import CNN
    from scenenet.models.geneo_model import GeneoModel

    parts: dict[str, np.ndarray] = {}
    with torch.no_grad():
        summed, _ = model.observer()
        if isinstance(model, GeneoModel):
            parts = dict(zip(model.names, model.kernels().numpy(), strict=True))
        elif isinstance(model, CNN):
            parts = {f"kernel {i + 1}": k.numpy() for i, k in enumerate(model.weight)}
        return {**parts, "all together": summed.numpy()}


def draw_parameters(
    results: Results, model: str, thesis: Thesis | None, out: Path
) -> tuple[str, str]:
    from scenenet.figures.plots.parameters import parameters
    from scenenet.results.model_tables import numbers_in_metres

    found = numbers_in_metres(results, model)
    if found is None:
        raise InputError(f"no tuned model called {model}", file=results.folder / "models" / model)
    starts = {} if found.before.empty else found.before.mean().to_dict()
    share = None if thesis is None else thesis.value("parameters.lambda_negative_sphere")
    published = {} if share is None else {"lambda.negative_sphere": share / 100}
    alt = parameters(
        {name: found.after[name].tolist() for name in found.after},
        out,
        {parameter.name: parameter.unit for parameter in found.parameters},
        starts,
        {name: value for name, value in published.items() if name in found.after},
    )
    hollow = f"; hollow circles are the means {found.began}" if starts else ""
    return alt, (
        f"The trained parameters of {model}: bars are means over {len(found.after)} seeds with one "
        f"standard deviation, dots are single seeds{hollow}. Lengths are in metres: kernels in "
        "voxels times the edge of the voxels they were trained on. The last mixing weight is one "
        "minus the others; the diamond is the thesis'. As thesis Figure 5.5."
    )


def draw_study(
    results: Results, study: StudySettings, thesis: Thesis | None, out: Path
) -> tuple[str, str]:
    from scenenet.experiments.studies.summary import summarise
    from scenenet.figures.plots import studies

    runs = results.study_runs(study.name)
    if runs is None:
        raise InputError("has not been run", file=results.folder / "study" / study.name)
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
