"""Model files: readable JSON for SCENE-Net, safetensors for the CNN; never pickle."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from pydantic import (
    Field,
    SerializerFunctionWrapHandler,
    TypeAdapter,
    ValidationError,
    model_serializer,
)
from torch import Tensor

from scenenet.convolution.coarsening import OBSERVED_M
from scenenet.core.errors import InputError
from scenenet.core.files import atomic, write_json
from scenenet.core.provided_code import MEASUREMENTS
from scenenet.core.settings import Settings
from scenenet.dataset.voxels import LARGEST_VOXEL, SMALLEST_VOXEL, Fit
from scenenet.models.base import VoxelModel
from scenenet.models.cnn import CNN
from scenenet.models.code_records import CodeMissing, record_of, require, require_kernels
from scenenet.models.evidence import Evidence
from scenenet.models.geneo_model import GeneoModel
from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.models.packaged import PACKAGED
from scenenet.models.scenenet import SceneNet
from scenenet.models.settings import LARGEST_KERNEL, KernelSize, MetricSettings, TargetText
from scenenet.pointcloud.targets import TOWER, Target

FORMAT = "scenenet-model"
FORMAT_VERSION = 1
COMPOSED_VERSION = 5
"""Version of the file of a SCENE-Net in metres that is not one kernel: it has kernels with a
direction or a first observer, is not a sum of kernels, or observes blocks of another size."""
METRIC_VERSION = 4
"""Version of the file of every other SCENE-Net in metres."""
SEARCHED_VERSION = 3
"""Version of the same file before numbers were measured: all of them are searched."""
FIELD_VERSION = 2
"""Version of the same file from version 0.1 of this package, where the lengths are ``field``."""
MEASUREMENT_KEY = "measurement_source"
"""Key of the record of a measurement from outside the package (``models.code_records``)."""


class ModelCard(Settings):
    """The facts that using a model requires, and its origin."""

    name: str = Field(description="name in results and tables")
    codes: str = Field(description="class scheme of the training labels")
    target: TargetText = Field(TOWER.text, description="what it finds")
    measurement: str = Field(description="phi of its input")
    fit: Fit = Field(description="kind of grid that it was trained on")
    resolution: int = Field(gt=0, description="voxels per edge of that grid, for fit cube")
    voxel_size: float = Field(
        ge=SMALLEST_VOXEL,
        le=LARGEST_VOXEL,
        description="m, median of the training crops; surveys are predicted at this size",
    )
    tau: float | None = Field(None, gt=0, le=1, description="threshold; None before tuning")
    provenance: dict[str, Any] = Field(
        default_factory=dict, description="seed, configuration, data and code of the training"
    )

    @property
    def finds(self) -> Target:
        """What the model finds."""
        return Target.parse(self.target)

    @model_serializer(mode="wrap")
    def _plain(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Without the target where it is the tower, as in files of earlier versions."""
        raw = dump(self)
        return {n: raw[n] for n in raw if n != "target" or not self.finds.is_tower}

    def with_tau(self, tau: float) -> ModelCard:
        """The card with another threshold."""
        return self.model_copy(update={"tau": tau})

    def threshold(self) -> float:
        """tau.

        Raises:
            InputError: the model has not been tuned.
        """
        if self.tau is None:
            raise InputError(
                f"model {self.name!r} has no detection threshold",
                remedy="Tune it first; models under results/models are tuned",
            )
        return self.tau


def suffix(kind: str) -> str:
    """Ending of the file of a model of ``kind``."""
    return ".json" if kind == SceneNet.kind else ".safetensors"


def write_model(path: str | Path, model: VoxelModel, card: ModelCard) -> None:
    """Write ``model`` to ``path`` (``.json`` for SCENE-Net, ``.safetensors`` for the CNN).

    Raises:
        InputError: a number of the model is not finite.
        ValueError: the ending of ``path`` is not the one of the model's kind.
    """
    try:
        _require_finite(model, card)
    except InputError as error:
        raise InputError(
            f"the model is not written: {error.problem}", file=path, remedy="Train it again"
        ) from None
    model = model.at(model.observed_size(card.voxel_size))
    head = {
        "format": FORMAT,
        "format_version": _version(model),
        "kind": model.kind,
        "kernel_size": list(model.kernel_size),
        **card.model_dump(),
        **record_of(card.measurement, MEASUREMENTS, MEASUREMENT_KEY),
    }
    if Path(path).suffix != suffix(model.kind):
        raise ValueError(f"the file of a {model.kind} must end in {suffix(model.kind)}, not {path}")
    if isinstance(model, GeneoModel):
        write_json(path, head | _numbers(model))
        return
    from safetensors.torch import save_file

    with atomic(path) as partial:
        tensors = {name: value.contiguous() for name, value in model.state_dict().items()}
        save_file(tensors, partial, metadata={"model": json.dumps(head)})


def read_model(path: str | Path) -> tuple[VoxelModel, ModelCard]:
    """Read a model file.

    Raises:
        InputError: the file does not exist, this version cannot read it, or a number in it is
            not finite or out of bounds.
        CodeMissing: a kernel from outside the package is not provided, or is another one.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(
            "there is no such model file",
            file=path,
            remedy=f"Name a file, or a model of the package: {' or '.join(PACKAGED)}",
        )
    _refuse_survey(path)
    try:
        if path.suffix == ".safetensors":
            return _read_cnn(path)
        return _read_scenenet(json.loads(path.read_text(encoding="utf-8")))
    except InputError as error:
        if error.file is not None:  # of a kernel file
            raise
        raise type(error)(error.problem, file=path, remedy=error.remedy) from None
    except ValidationError as error:
        fault = error.errors()[0]
        key = ".".join(map(str, fault["loc"]))
        message = fault["msg"].removeprefix("Value error, ")
        raise InputError(
            f"not a readable model file ({key} = {fault['input']!r}: {message})",
            file=path,
            remedy="Correct the value, or train the model again",
        ) from None
    except (AttributeError, KeyError, OverflowError, TypeError, ValueError, RuntimeError) as error:
        raise InputError(
            f"not a readable model file ({type(error).__name__}: {error})",
            file=path,
            remedy="Name a .json or .safetensors file that scenenet train wrote",
        ) from None


def _refuse_survey(path: Path) -> None:
    """Refuse a survey that is given as a model.

    Raises:
        InputError: it is a LAS or LAZ file.
    """
    try:
        with path.open("rb") as stream:
            is_survey = stream.read(4) == b"LASF"
    except OSError:  # said by whoever reads the model
        return
    if is_survey:
        raise InputError(
            "this is a LAS or LAZ file, not a model",
            file=path,
            remedy="Name a .json or .safetensors file that scenenet train wrote",
        )


def is_model_file(path: str | Path) -> bool:
    """Whether the file is a model that this version can read, given its kernels."""
    try:
        read_model(path)
    except CodeMissing:
        return True
    except InputError:
        return False
    return True


def _version(model: VoxelModel) -> int:
    """The version of the file of a model."""
    if not isinstance(model, MetricSceneNet):
        return FORMAT_VERSION
    usual = model.linear and model.metric.observed == OBSERVED_M
    return METRIC_VERSION if usual else COMPOSED_VERSION


def _observer(model: GeneoModel, prefix: str, values: Mapping[str, float]) -> dict[str, Any]:
    """The kernels and mixing weights of an observer, with the numbers that ``prefix`` begins."""
    geneos = []
    for name, geneo in zip(model.names, model.geneos, strict=True):
        parameters = {
            p.name: {
                "value": values[f"{prefix}{name}.{p.name}"],
                "unit": model.unit_of(p),
                "meaning": p.meaning,
            }
            for p in model.parameters_of(name)
        }
        entry = {"name": name, "kernel": geneo, **record_of(geneo), "parameters": parameters}
        geneos.append(entry)
    mixing = {name: values[f"{prefix}lambda.{name}"] for name in model.names}
    return {"geneos": geneos, "mixing_weights": mixing}


def _numbers(model: GeneoModel) -> dict[str, Any]:
    """The parameters of a SCENE-Net in a readable form."""
    values = model.shape_parameters()
    (_, own), *before = model.stages()
    lengths: dict[str, Any] = {}
    if before:
        (prefix, first) = before[0]
        lengths["first"] = _observer(first, prefix, values)
    if isinstance(model, MetricSceneNet):
        lengths["metric"] = model.metric.model_dump()
        known = {name: said.model_dump() for name, said in model.evidence.items()}
        lengths |= {"evidence": known} if known else {}
    return {"units": model.units, **_observer(own, "", values), **lengths}


def _read_scenenet(data: Mapping[str, Any]) -> tuple[GeneoModel, ModelCard]:
    _check_head(data)
    _require_measurement(data)
    require_kernels([*data["geneos"], *data.get("first", {"geneos": []})["geneos"]])
    geneos = [entry["kernel"] for entry in data["geneos"]]
    version = data["format_version"]
    model: GeneoModel
    if version == FORMAT_VERSION:
        model = SceneNet(geneos, _size(data))
    else:
        lengths = dict(data["field" if version == FIELD_VERSION else "metric"])
        if version in (FIELD_VERSION, SEARCHED_VERSION):
            lengths["numbers"] = "searched"
        before = data["first"]["geneos"] if "first" in data else ()
        first = [entry["kernel"] for entry in before]
        model = MetricSceneNet.composed(geneos, first, MetricSettings(**lengths))
        said = data.get("evidence", {})
        model.evidence = {name: Evidence(**found) for name, found in said.items()}
    numbers = _read_numbers(data, "")
    if "first" in data:
        numbers |= _read_numbers(data["first"], "first.")
    model.set_shape_parameters(numbers)
    card = _card(data)
    _require_finite(model, card)
    return model.at(model.observed_size(card.voxel_size)), card


def _read_numbers(observer: Mapping[str, Any], prefix: str) -> dict[str, float]:
    """The numbers of ``_observer``, by name."""
    shapes = {
        f"{prefix}{entry['name']}.{symbol}": float(parameter["value"])
        for entry in observer["geneos"]
        for symbol, parameter in entry["parameters"].items()
    }
    weights = observer["mixing_weights"].items()
    return shapes | {f"{prefix}lambda.{name}": float(weight) for name, weight in weights}


def _read_cnn(path: Path) -> tuple[CNN, ModelCard]:
    from safetensors import SafetensorError, safe_open

    try:
        with safe_open(path, framework="pt") as stream:
            head = json.loads((stream.metadata() or {})["model"])
            tensors = {name: stream.get_tensor(name) for name in list(stream.keys())}
    except SafetensorError as error:
        raise ValueError(str(error)) from None
    _check_head(head)
    _require_measurement(head)
    size = _size(head)
    _check_weights(tensors, size)
    model = CNN(len(tensors["bias"]), size)
    model.load_state_dict(tensors)
    card = _card(head)
    _require_finite(model, card)
    return model, card


def _check_weights(tensors: Mapping[str, Tensor], size: KernelSize) -> None:
    """Compare the weights with the head before memory is taken for what the head claims."""
    kernels = len(tensors["bias"]) if "bias" in tensors and tensors["bias"].dim() == 1 else 0
    expected = {"weight": (kernels, *size), "bias": (kernels,)}
    found = {name: tuple(tensor.shape) for name, tensor in tensors.items()}
    if kernels < 1 or found != expected:
        raise InputError(
            f"the file has weights of the shapes {found}, and a CNN with kernels of "
            f"{'x'.join(map(str, size))} voxels has weight (n, {', '.join(map(str, size))}) and "
            "bias (n,)",
            remedy="Name a file that scenenet train has written",
        )
    for name, tensor in tensors.items():
        if tensor.dtype != torch.float32:
            raise InputError(f"{name} has the type {tensor.dtype}, not torch.float32")


def _require_finite(model: VoxelModel, card: ModelCard) -> None:
    """Refuse a model that would answer NaN.

    Raises:
        InputError: a number of it, or the kernel that follows from its numbers, is not finite.
    """
    if isinstance(model, GeneoModel):
        for name, number in model.shape_parameters().items():
            if not math.isfinite(number):
                raise InputError(f"{name} is {number}, not a finite number")
    for name, parameter in model.named_parameters():
        tensor = parameter.detach()
        wrong = torch.nonzero(~torch.isfinite(tensor))
        if len(wrong):
            place = wrong[0].tolist()
            value = float(tensor[tuple(place)])
            raise InputError(f"{name}{place or ''} is {value}, not a finite number")
    sampled = model.at(model.observed_size(card.voxel_size))
    with torch.no_grad():
        kernels = (
            [stage.kernels() for _, stage in sampled.stages()]
            if isinstance(sampled, GeneoModel)
            else [sampled.observer()[0]]
        )
    if not all(bool(torch.isfinite(kernel).all()) for kernel in kernels):
        raise InputError("the kernel that follows from the numbers of the model is not finite")


def _check_head(data: Mapping[str, Any]) -> None:
    if not isinstance(data, Mapping) or data.get("format") != FORMAT:
        raise InputError(
            "not a model file of scenenet", remedy="Name a file that scenenet train wrote"
        )
    readable = (FORMAT_VERSION, FIELD_VERSION, SEARCHED_VERSION, METRIC_VERSION, COMPOSED_VERSION)
    if data["format_version"] not in readable:
        raise InputError(
            f"model format {data['format_version']}; this version reads formats "
            f"{', '.join(map(str, readable))}",
            remedy="Use the version of scenenet that wrote it, or train the model again",
        )


def _require_measurement(data: Mapping[str, Any]) -> None:
    """Compare the measurement of a model file with the one that is provided; no code is run.

    Raises:
        CodeMissing: it is missing, or is another one than the model was trained with.
        InputError: there is no such measurement.
    """
    name, record = data["measurement"], data.get(MEASUREMENT_KEY)
    require(name, record, MEASUREMENTS, of_package=name in MEASUREMENTS.built_in())
    if name not in MEASUREMENTS.known():
        known = ", ".join(sorted(MEASUREMENTS.built_in()))
        raise InputError(
            f"its measurement {name!r} is not one of {known}",
            remedy="Use the version of scenenet that wrote it",
        )


def _size(data: Mapping[str, Any]) -> KernelSize:
    given = data["kernel_size"]
    try:
        return TypeAdapter(KernelSize).validate_python(given)
    except ValidationError:
        raise InputError(
            f"not a readable model file (kernel_size is {given!r}, not three whole numbers from 1 "
            f"to {LARGEST_KERNEL})"
        ) from None


def _card(data: Mapping[str, Any]) -> ModelCard:
    known = {"target": TOWER.text, **data}
    return ModelCard(**{name: known[name] for name in ModelCard.model_fields})
