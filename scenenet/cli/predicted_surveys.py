"""What ``scenenet predict`` does first: it looks at models, limits and files before it predicts."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from scenenet.cli.inputs import Failures
from scenenet.models.packaged import WIRES, packaged_model
from scenenet.pointcloud.class_schemes import SCHEMES, ClassScheme
from scenenet.pointcloud.targets import WIRE

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from scenenet.clearance.settings import ClearanceSettings
    from scenenet.prediction.result_files import PredictionFiles
    from scenenet.prediction.settings import PredictSettings
    from scenenet.prediction.survey_files import SurveyFiles
    from scenenet.prediction.used_models import UsedModel
    from scenenet.review.rejected_conductors import RejectedConductors

WIRE_CODES = ", ".join(f"{name} {each.main_code('conductor')}" for name, each in SCHEMES.items())
"""The class code of conductors in each scheme, in words."""


def replaceable_codes(classify: bool, text: str | None) -> tuple[int, ...] | None:
    """The class codes of ``--classify-from``; None for every code.

    Raises:
        typer.BadParameter: these are not class codes, or nothing is classified.
    """
    if text is None:
        return None
    if not classify:
        raise typer.BadParameter("needs --classify", param_hint="--classify-from")
    codes = [part.strip() for part in text.split(",")]
    if not all(code.isdecimal() and int(code) < 256 for code in codes):
        raise typer.BadParameter(
            f"{text!r} is not a list of class codes from 0 to 255, such as 0,1,5",
            param_hint="--classify-from",
        )
    return tuple(int(code) for code in codes)


def clearance_settings(
    voltage: float | None, limits: Path | None, sags: Path | None
) -> ClearanceSettings:
    """How clearances are measured.

    Raises:
        typer.BadParameter: there are limits, and no voltage.
        InputError: the limits or sags cannot be used, or there is no limit for the voltage.
    """
    from scenenet.clearance.limits_file import read_limits
    from scenenet.clearance.sags import read_sags
    from scenenet.clearance.settings import ClearanceSettings

    if limits is not None and voltage is None:
        raise typer.BadParameter("needs --voltage", param_hint="--limits")
    given: dict[str, Any] = {} if limits is None else {"limits": read_limits(limits)}
    if sags is not None:
        given["sags"] = read_sags(sags)
    settings = ClearanceSettings(voltage=voltage, **given)
    settings.applied()  # fail before the work
    return settings


def chosen_models(
    models: list[Path], line: bool, settings: PredictSettings, scheme: ClassScheme | None
) -> tuple[list[Path], bool, bool]:
    """The models that predict, with that of wires that ``--line`` asks for; whether they find
    towers, and whether lines follow from what they find."""
    from scenenet.prediction.used_models import finds_lines, use_models

    used = use_models(models, settings, scheme)
    if line and not any(each.target.name == WIRE for each in used):
        models = [*models, packaged_model(WIRES)]
        used = use_models(models, settings, scheme)
    _require_codes(used, settings, scheme)
    return models, used[0].target.is_tower, finds_lines(used)


def rejected_conductors(decisions: Sequence[Path] | None) -> RejectedConductors | None:
    """The conductors that review files reject; None without a file.

    Raises:
        InputError: a file cannot be read, or rows cannot be used.
    """
    from scenenet.review.rejected_conductors import RejectedConductors

    rejects = RejectedConductors.of(decisions or ())
    if rejects is not None:
        rejects.check()
    return rejects


def refuse_without_lines(options: Mapping[str, object]) -> None:
    """Refuse the options that need lines where no line is looked for.

    Raises:
        typer.BadParameter: one is given.
    """
    for option, value in options.items():
        if value:
            needed = (
                "a model of towers (--model)"
                if option == "--line"
                else "--line, or a model of towers and one of target wire (--model, twice)"
            )
            raise typer.BadParameter(f"needs {needed}", param_hint=option)


def ready_surveys(
    named: Mapping[Path, SurveyFiles],
    results: Mapping[Path, PredictionFiles],
    models: Sequence[Path],
    overwrite: bool,
    failures: Failures,
) -> list[Path]:
    """The surveys that can be predicted, after a look at their headers, at the files that would be
    replaced and at the space on the disks."""
    from scenenet.core.outputs import check_outputs
    from scenenet.prediction.result_files import require_space
    from scenenet.prediction.survey_files import look_at

    outputs = [output for each in results.values() for output in each.outputs()]
    inputs = [path for survey in named.values() for path in (survey.given, *survey.files)]
    check_outputs(outputs, [*inputs, *models], overwrite=overwrite)
    seen = failures.look_at(named, lambda given: look_at(named[given])[0])
    points = {g: {path: i.n_points for path, i in headers.items()} for g, headers in seen.items()}
    require_space([(results[given], counts) for given, counts in points.items()], len(models))
    return list(seen)


def _require_codes(
    used: Sequence[UsedModel], settings: PredictSettings, scheme: ClassScheme | None
) -> None:
    """Refuse to classify wires without the scheme that has their code.

    Raises:
        typer.BadParameter: there is a model of wires, and no scheme.
    """
    if settings.classify and scheme is None and any(each.target.name == WIRE for each in used):
        raise typer.BadParameter(
            "--classify with a model of target wire needs the class scheme of the survey "
            f"({WIRE_CODES})",
            param_hint="--codes",
        )
