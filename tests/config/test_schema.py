"""Errors in a configuration are explained, and the schema follows from the settings."""

from __future__ import annotations

import subprocess
import sys

import jsonschema
import pytest
import yaml

from scenenet.config import reference as config_reference
from scenenet.config.schema import Config, load
from scenenet.config.written import merged
from scenenet.core.errors import InputError
from scenenet.core.files import read_json
from scenenet.core.settings import changed
from scenenet.pointcloud.targets import Target
from scenenet.training.presets import preset

MODELS = [{"name": "scenenet", "kind": "scenenet"}, {"name": "cnn", "kind": "cnn"}]


def raw(**settings):
    return {"models": MODELS, "seeds": [0], **settings}


def complaint(**settings) -> str:
    with pytest.raises(InputError) as caught:
        load(raw(**settings))
    return str(caught.value)


def shipped(root, name):
    read = [yaml.safe_load((root / "config" / n).read_text()) for n in ("config.yaml", name)]
    return merged(*read)


@pytest.mark.parametrize("name", ["config.yaml", "full.yaml", "test.yaml", "ts40k.yaml"])
def test_the_shipped_configurations_are_valid(project_root, name):
    config = load(shipped(project_root, name))
    assert {model.kind for model in config.models} == {"scenenet", "cnn"}


def test_the_shipped_configurations_write_to_different_folders_and_names(project_root):
    names = ("config.yaml", "full.yaml", "test.yaml", "ts40k.yaml")
    configs = [load(shipped(project_root, name)) for name in names]
    assert len({config.results_dir for config in configs}) == 4
    assert len({config.dataset for config in configs}) == 4
    # All share one store; with different settings each would create it again.
    assert len({config.tracking for config in configs}) == 1


def test_the_default_protocol_is_that_of_the_thesis(project_root):
    config = load(shipped(project_root, "config.yaml"))
    assert (config.split.train, config.split.validation, config.split.test) == (0.2, 0.1, 0.7)
    for name in ("scenenet", "cnn"):
        model = config.model_named(name)
        training, loss = model.training, model.training.loss
        assert (training.optimiser, training.learning_rate) == ("rmsprop", 0.001)
        assert (training.batch_size, training.epochs) == (8, 50)
        assert (loss.alpha, loss.epsilon, loss.rho_shape, loss.rho_mixing) == (5, 0.1, 5, 5)
        assert model.kernel_size == (9, 9, 9)
    assert len(config.seeds) >= 5


def test_the_full_configuration_is_chapter_5_at_its_own_scale(project_root):
    config = load(merged(shipped(project_root, "studies.yaml"), shipped(project_root, "full.yaml")))
    lines = config.synthetic.surveys
    assert sum(line.towers for line in lines) == 2823
    sheet = (project_root / "config" / "full.tsv").read_text().splitlines()[1:]
    assert [row.split("\t")[0] for row in sheet] == [line.name for line in lines]
    assert len({line.seed for line in lines}) == len(lines)
    assert (config.split.train, config.split.validation, config.split.test) == (0.2, 0.1, 0.7)
    assert len(config.seeds) == 5
    for model in config.models:
        assert model.protocol == "thesis"
        assert (model.training.epochs, model.training.learning_rate) == (50, 0.001)
        assert model.training.batch_size == 8
    listed = shipped(project_root, "studies.yaml")["studies"]
    assert [study.name for study in config.studies] == [study["name"] for study in listed]
    written = [config.study_named(name) for name in ("ablations", "starts", "epochs")]
    for study in written:
        for changes in (study.common, *(variant.changes for variant in study.variants)):
            assert changes.get("training.learning_rate", 0.001) == 0.001
    # What a study varies stays.
    assert config.study_named("learning-rate").vary["training.learning_rate"][0] == 0.1


STUDY = {"title": "t", "place": "p", "asks": "a", "variants": [{"name": "v"}]}


def test_only_the_named_studies_are_run():
    defined = [{**STUDY, "name": name} for name in ("first", "second", "third")]
    config = load(raw(studies=defined, only_studies=["third", "first"]))
    assert [study.name for study in config.studies] == ["first", "third"]
    # The resolved settings are a configuration of the same run.
    assert load(config.plain()).studies == config.studies
    with pytest.raises(InputError, match="only_studies: fourth is not one of the studies: first"):
        load(raw(studies=defined, only_studies=["fourth"]))


def test_studies_have_at_most_the_seeds_that_the_settings_allow():
    defined = [
        {**STUDY, "name": "many", "seeds": [5, 3, 1, 0]},
        {**STUDY, "name": "few", "seeds": [7]},
    ]
    config = load(raw(studies=defined, study_seeds=2))
    assert [study.seeds for study in config.studies] == [(5, 3), (7,)]
    assert load(config.plain()).studies == config.studies


def test_values_for_studies_replace_only_what_a_study_sets():
    study = {
        "name": "s", "title": "t", "place": "p", "asks": "a",
        "common": {"training.learning_rate": 0.01},
        "variants": [
            {"name": "a"},
            {"name": "b", "changes": {"training.learning_rate": 0.1, "training.epochs": 3}},
        ],
    }  # fmt: skip
    values = {"training.learning_rate": 0.001, "training.decay": 0.5}
    (found,) = load(raw(studies=[study], study_values=values)).studies
    assert found.common == {"training.learning_rate": 0.001}
    assert found.variants[0].changes == {}
    assert found.variants[1].changes == {"training.learning_rate": 0.001, "training.epochs": 3}


def test_a_configuration_with_all_defaults_written_out_is_the_same(project_root):
    config = load(shipped(project_root, "test.yaml"))
    assert load(config.plain()) == config


def test_common_training_settings_apply_unless_a_model_overrides_them():
    own = {"name": "slow", "kind": "scenenet", "training": {"epochs": 200, "loss": {"alpha": 1}}}
    config = load(
        raw(
            models=[*MODELS, own],
            training={"epochs": 7, "learning_rate": 0.01, "loss": {"epsilon": 0.5}},
        )
    )
    common, slow = config.model_named("cnn").training, config.model_named("slow").training
    assert (common.epochs, common.learning_rate, common.loss.epsilon) == (7, 0.01, 0.5)
    assert (slow.epochs, slow.learning_rate) == (200, 0.01)
    assert (slow.loss.alpha, slow.loss.epsilon) == (1, 0.5)


def test_a_typo_is_refused_with_the_corrected_line():
    message = complaint(voxels={"resolutoin": 128})
    assert "voxels.resolutoin: there is no such setting. Did you mean 'resolution'?" in message
    assert message.endswith("      voxels:\n        resolution: 128")


def test_an_unknown_key_is_refused_with_the_known_ones():
    message = complaint(zzz=1)
    assert "zzz: there is no such setting" in message
    assert "voxels" in message


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ({"voxels": {"resolution": 63}}, "voxels.resolution: 63 is not allowed"),
        ({"training": {"loss": {"alpha": -1}}}, "training.loss.alpha: -1 is not allowed"),
        ({"split": {"train": 0.5}}, "split: train, validation and test must sum to 1"),
        (
            {"towers": 3},
            "towers: is 3, but groups the settings eps, min_points, sparse_points, "
            "sparse_height, cell",
        ),
        ({"seeds": [0, 0]}, "seeds: 0 is listed more than once"),
        ({"seeds": []}, "seeds: [] is not allowed"),
        ({"predict": {"model": "best"}}, "'best' is not one of the models: scenenet, cnn"),
        ({"models": [{"name": "a b", "kind": "cnn"}]}, "models[0].name: 'a b' is not allowed"),
        ({"models": [{"name": "cnn"}]}, "models[0].kind: is missing"),
        ({"synthetic": {"surveys": [{"towers": 3}]}}, "synthetic.surveys[0].name: is missing"),
    ],
)
def test_a_wrong_value_is_named_with_its_key(settings, expected):
    assert expected in complaint(**settings)


def test_the_message_about_a_wrong_value_has_the_default_and_the_unit():
    message = complaint(detection={"eps": "near"})
    assert "(m, " in message
    assert message.endswith("      detection:\n        eps: 6.0")


def test_all_mistakes_are_reported_together():
    message = complaint(towers={"epps": 1}, crops={"radius": 2}, seeds="none")
    assert message.startswith("configuration: 3 settings are wrong\n")
    for key in ("towers.epps", "crops.radius", "seeds"):
        assert f"  {key}: " in message


def test_a_mistake_in_the_common_training_settings_is_reported_once():
    assert complaint(training={"epoch": 3}).count("no such setting") == 1


def test_a_mistake_in_one_model_is_reported_for_that_model():
    models = [MODELS[0], {"name": "cnn", "kind": "cnn", "training": {"epoch": 3}}]
    message = complaint(models=models)
    assert "models[1].training.epoch: there is no such setting" in message
    assert "one setting is wrong" in message


def test_a_setting_of_an_earlier_version_is_refused_by_its_new_name():
    message = complaint(noise={"levels": [0, 0.2]})
    assert "noise: this setting is now called label_noise" in message
    assert load(raw(label_noise={"levels": [0, 0.2]})).label_noise.levels == (0, 0.2)


def test_mappings_are_merged_and_lists_replaced():
    base = {"a": {"b": 1, "c": [1, 2]}, "d": 1}
    assert merged(base, {"a": {"c": [3]}, "d": None}) == {"a": {"b": 1, "c": [3]}, "d": None}


def test_reading_a_configuration_loads_nothing_heavy():
    heavy = "torch numba mlflow sklearn matplotlib zarr laspy"
    code = (
        "import scenenet.config.schema, sys; "
        f"print([m for m in '{heavy}'.split() if m in sys.modules])"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert shown.stdout.strip() == "[]"


@pytest.mark.parametrize(
    ("model", "names"),
    [
        ({"kind": "cnn", "geneos": ["arrow"]}, "geneos"),
        ({"kind": "cnn", "protocol": "operational"}, "protocol"),
        ({"kind": "scenenet", "n_kernels": 3, "search": {}}, "search, n_kernels"),
        (
            {"kind": "scenenet", "protocol": "operational", "kernel_size": [9, 9, 9]},
            "kernel_size",
        ),
        (
            {"kind": "scenenet", "protocol": "operational", "training": {"epochs": 5}},
            "training",
        ),
    ],
)
def test_a_setting_without_effect_is_refused(model, names):
    assert f"{names}: without effect for" in complaint(models=[{"name": "m", **model}])


def test_a_cnn_of_protocol_operational_is_refused_with_what_to_write_instead():
    message = complaint(models=[{"name": "m", "kind": "cnn", "protocol": "operational"}])
    assert "models[0]: protocol: without effect for a cnn; remove it" in message
    assert "training.init: informed" in message


WIRES = {"name": "wires", "target": "wire"}


@pytest.mark.parametrize(
    ("observers", "predicting", "message"),
    [
        ([WIRES], ["wire"], "predict.observers: wire is not one of the observers: wires"),
        ([], ["wires"], "wires is not one of the observers: there are none"),
        ([WIRES, {**WIRES, "name": "fine"}], ["wires", "fine"], "wires and fine both find wire"),
        ([WIRES], ["wires", "wires"], "lists an observer twice"),
        ([{**WIRES, "name": "m"}], [], "models and observers: m is listed more than once"),
        ([{**WIRES, "target": "tower"}], [], "models of towers stand in models"),
        ([{**WIRES, "target": "lamp"}], [], "observers[0].target: there is no target 'lamp'"),
        ([{**WIRES, "changes": {"search.strats": 3}}], [], "changes: search.strats"),
        ([{**WIRES, "changes": {"kind": "cnn"}}], [], "kind cannot be changed"),
        ([{**WIRES, "changes": {"measurement": "density"}}], [], "measures presence"),
    ],
)
def test_an_observer_that_cannot_be_used_is_refused(observers, predicting, message):
    model = {"name": "m", "kind": "scenenet"}
    chosen = {"model": "m", "observers": predicting}
    assert message in complaint(models=[model], observers=observers, predict=chosen)


def test_an_observer_has_the_settings_of_the_command_line_but_for_its_changes():
    observer = load(raw(observers=[{**WIRES, "changes": {"search.starts": 9}}])).observers[0]
    usual = preset("scenenet", "operational", target=Target("wire"))
    own = observer.model()
    assert own.search.starts == 9
    assert changed(own, {"name": usual.name, "search.starts": usual.search.starts}) == usual
    assert (observer.grid().fit, observer.grid().voxel_size) == ("metric", 0.5)


def test_lines_follow_from_an_observer_of_wires_that_predicts():
    observers = [WIRES, {"name": "crowns", "target": "vegetation"}]
    for names, lines in (([], False), (["crowns"], False), (["crowns", "wires"], True)):
        chosen = {"model": "scenenet", "observers": names}
        assert load(raw(observers=observers, predict=chosen)).finds_lines() is lines


def test_a_voltage_without_limits_is_refused():
    assert "clearance.voltage: there are no limits" in complaint(clearance={"voltage": 900})


def test_an_unknown_kernel_is_refused_with_the_nearest_name():
    model = {"name": "m", "kind": "scenenet", "geneos": ["arrow", "cylindre"]}
    message = complaint(models=[model])
    assert (
        "models[0].geneos[1]: 'cylindre' is not one of the kernels arrow, blob, canopy, cylinder"
        in message
    )
    assert "did you mean 'cylinder'?" in message


def test_the_kernels_of_the_settings_are_those_of_the_registry():
    """The settings list the files, and the registry imports them."""
    code = (
        "from scenenet.models.settings import ModelSettings\n"
        "from pydantic import ValidationError\n"
        "try:\n"
        "    ModelSettings(name='m', kind='scenenet', geneos=('none',))\n"
        "except ValidationError as error:\n"
        "    print(error.errors()[0]['msg'])\n"
        "from scenenet.geneo import kernel_names\n"
        "print(', '.join(kernel_names()))\n"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    message, names = shown.stdout.splitlines()
    shown = f"Value error, 'none' is not one of the kernels {names}; "
    assert message == f"{shown}provide the file of another kernel"


@pytest.mark.parametrize("edge", [0, 65])
def test_a_kernel_has_from_1_to_64_voxels_along_an_edge(edge):
    message = complaint(models=[{"name": "m", "kind": "cnn", "kernel_size": [9, edge, 9]}])
    assert f"models[0].kernel_size[1]: {edge} is not allowed" in message


@pytest.mark.parametrize(("key", "value"), [("radius", 20.5), ("above", 1e9), ("below", -1.0)])
def test_a_length_of_a_model_in_metres_has_bounds(key, value):
    metric = {"kind": "scenenet", "protocol": "operational", "metric": {key: value}}
    message = complaint(models=[{"name": "m", **metric}])
    assert f"models[0].metric.{key}: {value!r} is not allowed" in message


@pytest.mark.parametrize("value", [0.0, 0.001, 1e300])
def test_a_voxel_has_bounds(value):
    message = complaint(voxels={"fit": "metric", "voxel_size": value})
    assert f"voxels.voxel_size: {value!r} is not allowed" in message


@pytest.mark.parametrize(
    ("path", "fault"),
    [
        ("res{survey}", "has a brace, which Snakemake reads as a wildcard"),
        ("res\x00", "has the control character '\\x00'"),
        ("a\nb", "has the control character '\\n'"),
        ("a/" + "x" * 256, "has a name of 256 bytes, more than the 255 of a file name"),
        ("ä" * 128, "has a name of 256 bytes, more than the 255 of a file name"),
        ("x/" * 2048, "has 4096 bytes, more than the 4095 of a path"),
    ],
    ids=["brace", "NUL", "line break", "long name", "long name of bytes", "long path"],
)
@pytest.mark.parametrize("key", ["results_dir", "surveys", "ts40k_dir", "thesis", "folder"])
def test_a_path_that_cannot_be_used_is_refused(key, path, fault):
    setting = {"new_surveys": {"folder": path}} if key == "folder" else {key: path}
    shown = f"new_surveys.{key}" if key == "folder" else key
    assert f"  {shown}: the path {fault}" in complaint(**setting)


def test_the_longest_paths_are_allowed():
    for path in ("x" * 255, "ä" * 127, ("x" * 100 + "/") * 40, "Prüfung 3 (alt)/*[a]"):
        assert load(raw(results_dir=path)).results_dir == path


@pytest.mark.parametrize("text", ["cost in $", "$x_$", "a\x00b"])
def test_a_text_that_a_figure_cannot_draw_is_refused(text):
    study = {"name": "s", "title": "t", "place": "p", "asks": "?"}
    variants = [{"name": "v"}]
    message = complaint(studies=[{**study, "title": text, "variants": variants}])
    assert "studies[0].title: has " in message
    message = complaint(studies=[{**study, "variants": [{"name": text}]}])
    assert "studies[0].variants[0].name: has " in message


def test_only_settings_with_an_effect_are_recorded():
    searched = {"name": "m", "kind": "scenenet", "protocol": "operational"}
    config = load(raw(models=[*MODELS, searched], training={"epochs": 7}))
    recorded = {model["name"]: set(model) for model in config.plain()["models"]}
    assert not recorded["m"] & {"training", "kernel_size", "n_kernels"}
    assert not recorded["cnn"] & {"protocol", "geneos", "metric", "search"}
    assert not recorded["scenenet"] & {"n_kernels", "metric", "search"}
    assert config.plain()["models"][0]["training"]["epochs"] == 7
    assert load(config.plain()) == config


@pytest.mark.parametrize(
    ("old", "key", "new"),
    [
        ({"protocol": "field"}, "models[0]", "write protocol: operational"),
        ({"field": {"radius": 2.0}}, "models[0]", "write metric: instead"),
        ({"training": {"init": "field"}}, "models[0].training", "write init: informed"),
    ],
)
def test_the_name_of_a_setting_in_version_0_1_is_refused_with_the_new_one(old, key, new):
    text = complaint(models=[{"name": "m", "kind": "scenenet", **old}])
    assert f"{key}: " in text and new in text


@pytest.mark.parametrize("name", ["config.schema.json", "surveys.schema.json"])
def test_the_schemas_are_those_of_the_models(project_root, name):
    remedy = "run: python -m scenenet.config.reference --schema workflow/schemas"
    written = read_json(project_root / "workflow" / "schemas" / name)
    assert written == config_reference.schemas()[name], remedy


def test_the_schema_accepts_the_shipped_configuration_and_refuses_a_typo(project_root):
    schema = config_reference.schemas()["config.schema.json"]
    settings = shipped(project_root, "config.yaml")
    jsonschema.validate(settings, schema)
    with pytest.raises(jsonschema.ValidationError, match="resolutoin"):
        jsonschema.validate({**settings, "voxels": {"resolutoin": 1}}, schema)


def test_the_table_of_settings_is_that_of_the_models(project_root):
    remedy = "run: python -m scenenet.config.reference --reference config/README.md"
    written = (project_root / "config" / "README.md").read_text(encoding="utf-8")
    assert written == config_reference.reference(), remedy


def test_every_setting_has_a_description():
    missing = [
        f"{title}: {key}"
        for title, model in config_reference.SECTIONS.items()
        for key, field in config_reference.settings_of(model)
        if not field.description
    ]
    assert missing == []


def test_only_models_and_seeds_are_required():
    """Models and seeds have no default; everything else has one."""
    required = [name for name, field in Config.model_fields.items() if field.is_required()]
    assert required == ["models", "seeds"]
