"""Figures of models: scores, training, kernels, parameters, studies (thesis 4.4, 5.2, 5.3).

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
from scenenet.results.folder import Results
from scenenet.results.seed_result import parameter_columns

if TYPE_CHECKING:
    from scenenet.models.base import VoxelModel


def draw_curves(results: Results, thesis: Thesis | None, out: Path) -> tuple[str, str]:
    from scenenet.figures.plots.curves import precision_recall

    # Without labelled voxels there is no recall, and no curve.
    scored = {
        model: [r.evaluation.leading for r in results.of_model(model)
                if r.evaluation.leading.average_precision is not None]
        for model in results.models
    }  # fmt: skip
    against = "truth" if any(r.evaluation.truth for r in results.trained) else "labels"
    curves = {model: [one.pr_curve for one in of] for model, of in scored.items() if of}
    published = {}
    for model, kind in results.models.items():
        if thesis is None:
            break
        recall, precision = (thesis.value(f"models.{kind}.{n}") for n in ("recall", "precision"))
        if recall is not None and precision is not None:
            published[model] = (recall, precision)
    return precision_recall(curves, out, published), (
        "Precision and recall over all voxels of the test crops, against the "
        f"{against}, for every threshold tau. Thin lines: single seeds. Thick line: their mean, "
        "with one standard deviation; a seed that does not reach a recall counts with precision 0 "
        "there. Diamonds: scores of the thesis (Table 5.3), measured on other data. Compare thesis "
        "Figure 5.7."
    )


def draw_training(results: Results, model: str, out: Path) -> tuple[str, str]:
    from scenenet.figures.plots.curves import training

    histories = _histories(results, model)
    dashed = any("validation_loss" in history for history in histories.values())
    return training(histories, out), (
        f"Training loss of {model} after each epoch, one line per seed"
        + ("; dashed: the loss on the validation crops." if dashed else ".")
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
    before = "" if start is None else f"The upper rows show the kernels {start.origin}. "
    figures = "Compare thesis Figures 4.2 to 4.4." if isinstance(trained, GeneoModel) else ""
    return alt, (
        f"Slices through the middle of each kernel of {model}, seed {champion.seed} (best on "
        "validation). An occupied voxel raises the output where the kernel is red and lowers it "
        "where it is blue. Each kernel has its own scale, equal before and after training. "
        f"{before}{figures}"
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
    hollow = f"; hollow circles are mean values {found.began}" if starts else ""
    return alt, (
        f"The trained parameters of {model}: bars are means over {len(found.after)} seeds with one "
        f"standard deviation, dots are single seeds{hollow}. Lengths are in metres; parameters in "
        "voxels are multiplied by the voxel edge of the training. The last mixing weight is one "
        "minus the others. Diamond: value of the thesis. Compare thesis Figure 5.5."
    )


def draw_study(
    results: Results, study: StudySettings, thesis: Thesis | None, out: Path
) -> tuple[str, str]:
    from scenenet.experiments.studies.summary import summarise
    from scenenet.figures.plots import studies

    runs = results.study_runs(study.name)
    if runs is None:
        raise InputError("the study has not been run", file=results.folder / "study" / study.name)
    summary = summarise(study, runs, thesis or Thesis(source="", numbers={}))
    if study.is_grid:
        names, values = zip(*study.vary.items(), strict=True)
        first, second = (name.rpartition(".")[2] for name in names)
        alt = studies.heat_map(summary, (first, second), (len(values[0]), len(values[1])), out)
    else:
        alt = studies.rows(summary, out)
    hollow = (
        " Hollow points: scores of the thesis." if any(v.thesis for v in study.variants) else ""
    )
    return alt, (
        f"{study.asks} Scores of the tower class on the {study.part} crops, at the tau that is "
        f"best on the validation crops, {_seeds(study)}.{hollow} Thesis {study.place}."
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
