"""Model files: readable JSON for SCENE-Net, safetensors for the CNN; never pickle."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import Field

from scenenet.core.errors import InputError
from scenenet.core.files import atomic, write_json
from scenenet.core.settings import Settings
from scenenet.dataset.voxels import Fit, Measurement
from scenenet.geneo import kernel_named
from scenenet.models.base import VoxelModel
from scenenet.models.cnn import CNN
from scenenet.models.geneo_model import GeneoModel
from scenenet.models.metric_scenenet import MetricSceneNet
from scenenet.models.scenenet import SceneNet
from scenenet.models.settings import KernelSize, MetricSettings

FORMAT = "scenenet-model"
FORMAT_VERSION = 1
METRIC_VERSION = 3
"""Of a SCENE-Net in metres, which versions without metric kernels cannot read."""
FIELD_VERSION = 2
"""The same as version 0.1 of this package wrote it: the lengths are called ``field`` there."""


class ModelCard(Settings):
    """What has to be known to use a model, and where it is from."""

    name: str = Field(description="name in results and tables")
    codes: str = Field(description="class scheme of the labels it learnt from")
    measurement: Measurement = Field(description="phi of its input")
    fit: Fit = Field(description="grid that it was trained on")
    resolution: int = Field(gt=0, description="voxels an edge of that grid, for fit cube")
    voxel_size: float = Field(
        gt=0, description="m, median of the training crops; surveys are predicted at this size"
    )
    tau: float | None = Field(None, gt=0, le=1, description="threshold; None before tuning")
    provenance: dict[str, Any] = Field(
        default_factory=dict, description="seed, config, data and code that made it"
    )

    def with_tau(self, tau: float) -> ModelCard:
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
    """Ending of the file that a model of ``kind`` is kept in."""
    return ".json" if kind == SceneNet.kind else ".safetensors"


def write_model(path: str | Path, model: VoxelModel, card: ModelCard) -> None:
    """Write ``model`` to ``path`` (``.json`` for SCENE-Net, ``.safetensors`` for the CNN)."""
    model = model.at(card.voxel_size)
    head = {
        "format": FORMAT,
        "format_version": METRIC_VERSION if model.units == "m" else FORMAT_VERSION,
        "kind": model.kind,
        "kernel_size": list(model.kernel_size),
        **card.model_dump(),
    }
    if Path(path).suffix != suffix(model.kind):
        raise ValueError(f"a {model.kind} is kept in *{suffix(model.kind)}, not {path}")
    if isinstance(model, GeneoModel):
        write_json(path, head | _numbers(model))
        return
    from safetensors.torch import save_file

    with atomic(path) as partial:
        tensors = {name: value.contiguous() for name, value in model.state_dict().items()}
        save_file(tensors, partial, metadata={"model": json.dumps(head)})


def read_model(path: str | Path) -> tuple[VoxelModel, ModelCard]:
    """Read a model back.

    Raises:
        InputError: there is no such file, or it is not a model file this version can read.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError("there is no such model file", file=path)
    try:
        if path.suffix == ".safetensors":
            return _read_cnn(path)
        return _read_scenenet(json.loads(path.read_text(encoding="utf-8")))
    except InputError as error:
        raise InputError(error.problem, file=path, remedy=error.remedy) from None
    except (AttributeError, KeyError, TypeError, ValueError, RuntimeError) as error:
        raise InputError(
            f"not a readable model file ({type(error).__name__}: {error})",
            file=path,
            remedy="Name a .json or .safetensors file that scenenet train has written",
        ) from None


def _numbers(model: GeneoModel) -> dict[str, Any]:
    """The parameters of a SCENE-Net as a person would write them down."""
    values = model.shape_parameters()
    geneos = []
    for name, geneo in zip(model.names, model.geneos, strict=True):
        parameters = {
            p.name: {
                "value": values[f"{name}.{p.name}"],
                "unit": model.unit_of(p),
                "meaning": p.meaning,
            }
            for p in kernel_named(geneo).parameters
        }
        geneos.append({"name": name, "kernel": geneo, "parameters": parameters})
    mixing = {name: values[f"lambda.{name}"] for name in model.names}
    lengths = {"metric": model.metric.model_dump()} if isinstance(model, MetricSceneNet) else {}
    return {"units": model.units, "geneos": geneos, "mixing_weights": mixing} | lengths


def _read_scenenet(data: Mapping[str, Any]) -> tuple[GeneoModel, ModelCard]:
    _check_head(data)
    geneos = [entry["kernel"] for entry in data["geneos"]]
    key = {METRIC_VERSION: "metric", FIELD_VERSION: "field"}.get(data["format_version"])
    model: GeneoModel
    if key is None:
        model = SceneNet(geneos, _size(data))
    else:
        model = MetricSceneNet(geneos, MetricSettings(**data[key]))
    numbers = {
        f"{entry['name']}.{symbol}": float(parameter["value"])
        for entry in data["geneos"]
        for symbol, parameter in entry["parameters"].items()
    }
    mixing = {f"lambda.{name}": float(w) for name, w in data["mixing_weights"].items()}
    model.set_shape_parameters(numbers | mixing)
    card = _card(data)
    return model.at(card.voxel_size), card


def _read_cnn(path: Path) -> tuple[CNN, ModelCard]:
    from safetensors import SafetensorError, safe_open

    try:
        with safe_open(path, framework="pt") as stream:
            head = json.loads((stream.metadata() or {})["model"])
            names = list(stream.keys())
            tensors = {name: stream.get_tensor(name) for name in names}
    except SafetensorError as error:
        raise ValueError(str(error)) from None
    _check_head(head)
    model = CNN(len(tensors["bias"]), _size(head))
    model.load_state_dict(tensors)
    return model, _card(head)


def _check_head(data: Mapping[str, Any]) -> None:
    if not isinstance(data, Mapping) or data.get("format") != FORMAT:
        raise InputError(
            "not a model file of scenenet", remedy="Name a file that scenenet train has written"
        )
    readable = (FORMAT_VERSION, FIELD_VERSION, METRIC_VERSION)
    if data["format_version"] not in readable:
        raise InputError(
            f"model format {data['format_version']}, this version reads "
            f"{', '.join(map(str, readable))}",
            remedy="Use the version of scenenet that wrote it, or train it again",
        )


def _size(data: Mapping[str, Any]) -> KernelSize:
    kz, ky, kx = (int(k) for k in data["kernel_size"])
    return kz, ky, kx


def _card(data: Mapping[str, Any]) -> ModelCard:
    return ModelCard(**{name: data[name] for name in ModelCard.model_fields})
