"""Kernels from outside the package: found by name, run only when they are used, never silently."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from fixtures.kernel_file import RING

from scenenet.core.errors import InputError
from scenenet.core.provided_code import KERNELS, _provided
from scenenet.geneo import kernel_named, kernel_names
from scenenet.models.code_records import CodeMissing
from scenenet.models.model_file import ModelCard, is_model_file, read_model, write_model
from scenenet.models.scenenet import SceneNet
from scenenet.models.settings import ModelSettings

pytestmark = pytest.mark.usefixtures("nothing_provided")

BALANCED = "zero_sum(ring.expand(lattice.size), lattice.inside)"
"""What the ring returns."""

CARD = ModelCard(
    name="rings", codes="edp", measurement="presence", fit="cube", resolution=64, voxel_size=1.0
)


@pytest.fixture
def ring(tmp_path):
    path = tmp_path / "ring.py"
    path.write_text(RING)
    return path


def test_a_provided_kernel_trains_like_any_other(ring):
    KERNELS.provide([ring])
    assert "ring" in kernel_names()
    assert ModelSettings(name="m", kind="scenenet", geneos=["cylinder", "ring"]).geneos[1] == "ring"
    model = SceneNet(["cylinder", "ring"], (5, 5, 5))
    model.kernels()[1].square().sum().backward()
    assert float(model.shapes["ring"]["r"].grad) != 0


def test_the_variable_names_files_and_folders(ring, tmp_path, monkeypatch):
    folder = tmp_path / "more"
    folder.mkdir()
    (folder / "halo.py").write_text(RING.replace('"ring"', '"halo"'))
    (folder / "test_halo.py").write_text("raise AssertionError('a test is not a kernel')")
    monkeypatch.setenv(KERNELS.variable, f"{ring}{os.pathsep}{folder}")
    assert set(KERNELS.provided()) == {"ring", "halo"}
    assert kernel_named("halo").name == "halo"


def test_the_names_of_kernels_are_known_without_running_them_and_without_torch(tmp_path):
    path = tmp_path / "broken.py"
    path.write_text("raise RuntimeError('this must not run')")
    code = (
        "import sys\n"
        "from scenenet.models.settings import ModelSettings\n"
        "ModelSettings(name='m', kind='scenenet', geneos=['broken'])\n"
        "assert 'torch' not in sys.modules\n"
    )
    environment = {**os.environ, KERNELS.variable: str(path)}
    subprocess.run([sys.executable, "-c", code], env=environment, check=True)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x = 1\n", r"ring\.py: the file registers no kernel\. Decorate"),
        ("x = 1\ny = z\n", r"ring\.py: line 2: .*fails with NameError: name 'z' is not defined"),
        ("x = (\n", r"ring\.py: line 1: .*fails with SyntaxError"),
        ("import sys\nsys.exit(3)\n", r"ring\.py: line 2: .*SystemExit: 3"),
        (RING.replace('"ring"', '"other"'), r"registers 'other', and a kernel has the name of its"),
        (RING + RING.replace('"ring"', '"second"'), "registers 'ring', 'second'"),
        (RING.replace('"voxel"', '"foot"'), "has r in 'foot', which is not one of"),
        (RING.replace("0.5, 3.0", "3.0, 0.5"), "has r from 3 to 0.5, which is not a range"),
        (RING.replace(BALANCED, "ring.sum()"), r"gives \(\) for a lattice of \(7, 5, 5\)"),
        (RING.replace('shape["r"] ** 2,', 'shape["s"],'), r"line 11: .*KeyError: 's'"),
        (RING.replace(BALANCED, f'{BALANCED} * float("nan")'), "not finite for r = 1.22"),
        (RING.replace(BALANCED, f"{BALANCED}.double()"), r"gives values of torch\.float64"),
        (RING.replace("(Shape", "Shape").replace('"),)', '")'), "must have parameters, a tuple"),
        (RING.replace("    def sample", "    def simple"), "TypeError: Can't instantiate"),
        (RING.replace(BALANCED, f"{BALANCED}.detach()"), "cannot be differentiated"),
    ],
)  # fmt: skip
def test_a_faulty_file_is_named_with_the_place(tmp_path, text, message):
    path = tmp_path / "ring.py"
    path.write_text(text)
    KERNELS.provide([path])
    with pytest.raises(InputError, match=message) as raised:
        kernel_named("ring")
    assert str(path) in str(raised.value)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("Ring.py", "which must have small letters"),
        ("arrow_2.py", "must not end in a number"),
        ("cylinder.py", "a kernel of the package is called 'cylinder' as well"),
        ("ring.txt", r"not a Python file"),
    ],
)
def test_a_name_that_no_kernel_can_have_is_refused_at_once(tmp_path, name, message):
    path = tmp_path / name
    path.write_text(RING)
    with pytest.raises(InputError, match=message):
        KERNELS.provide([path])


def test_paths_without_a_kernel_are_refused(tmp_path):
    with pytest.raises(InputError, match="there is no such kernel file"):
        KERNELS.provide([tmp_path / "missing.py"])
    with pytest.raises(InputError, match="the folder has no kernel file"):
        KERNELS.provide([tmp_path])
    assert KERNELS.name_fault("a" * 40) is not None


def test_two_files_of_one_name_are_refused(ring, tmp_path):
    (tmp_path / "b").mkdir()
    other = tmp_path / "b" / "ring.py"
    other.write_text(RING)
    with pytest.raises(InputError, match=r"2 kernels are called 'ring': .*ring\.py and .*ring\.py"):
        KERNELS.provide([ring, other])
    KERNELS.provide([ring, tmp_path / "." / "ring.py"])  # the same file twice is one kernel


def test_an_unknown_name_lists_the_known_ones_with_the_closest(ring):
    KERNELS.provide([ring])
    with pytest.raises(InputError, match=r"'rng'; did you mean 'ring'\? Name one of: arrow, "):
        kernel_named("rng")


@pytest.fixture
def model(ring, tmp_path):
    """A model file with a kernel that is no longer provided."""
    KERNELS.provide([ring])
    path = tmp_path / "model.json"
    write_model(path, SceneNet(["cylinder", "ring"], (5, 5, 5)), CARD)
    read_model(path)
    _provided.cache_clear()
    os.environ[KERNELS.variable] = ""
    return path


def test_a_model_file_never_finds_its_kernel_by_itself(model, monkeypatch):
    monkeypatch.chdir(model.parent)  # where ring.py is
    with pytest.raises(CodeMissing, match=r"needs the kernel 'ring' of the file ring\.py"):
        read_model(model)
    assert is_model_file(model)


def test_another_kernel_of_the_name_is_refused_before_it_runs(model, tmp_path):
    (tmp_path / "b").mkdir()
    other = tmp_path / "b" / "ring.py"
    other.write_text("raise RuntimeError('this must not run')")
    KERNELS.provide([other])
    with pytest.raises(CodeMissing, match=r"and .*ring\.py is another one"):
        read_model(model)


def test_a_model_file_without_the_digest_is_refused(model, ring):
    import json

    data = json.loads(model.read_text())
    del data["geneos"][1]["source"]
    model.write_text(json.dumps(data))
    KERNELS.provide([ring])
    with pytest.raises(CodeMissing, match="does not say which file its kernel 'ring' had"):
        read_model(model)


def test_built_in_kernels_leave_no_record(tmp_path):
    write_model(tmp_path / "m.json", SceneNet(["cylinder"], (5, 5, 5)), CARD)
    assert "source" not in (tmp_path / "m.json").read_text()


@pytest.fixture
def package(tmp_path, monkeypatch):
    """An installed package with a kernel, as pip leaves it on disk."""
    site = tmp_path / "site"
    (site / "rings").mkdir(parents=True)
    (site / "rings" / "__init__.py").write_text("raise RuntimeError('not before it is used')")
    (site / "rings" / "kernel.py").write_text(RING)
    info = site / "rings-1.2.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: rings\nVersion: 1.2\n")
    entries = "ring = rings.kernel:Ring\ncylinder = rings.kernel:Ring\nhalo = rings.kernel:Ring\n"
    (info / "entry_points.txt").write_text(f"[scenenet.geneos]\n{entries}")
    monkeypatch.syspath_prepend(site)
    _provided.cache_clear()
    yield site
    for name in ("rings", "rings.kernel"):
        sys.modules.pop(name, None)


def test_an_installed_package_provides_a_kernel(package, tmp_path):
    assert "ring" in KERNELS.known()
    with pytest.raises(InputError, match=r"kernel\.py: .*RuntimeError: not before it is used"):
        kernel_named("ring")
    (package / "rings" / "__init__.py").write_text("")
    path = tmp_path / "model.json"
    write_model(path, SceneNet(["ring"], (5, 5, 5)), CARD)
    assert '"distribution": "rings"' in path.read_text()
    read_model(path)
    with pytest.raises(InputError, match="'halo' refers to a kernel called 'ring'"):
        kernel_named("halo")

    found = [str(error) for error in KERNELS.faults(KERNELS.provided(), packages=True)]
    assert found == [
        "rings 1.2: a kernel of the package is called 'cylinder' as well. Give the file and its "
        "kernel another name"
    ]
    assert type(kernel_named("cylinder")).__module__ == "scenenet.geneo.kernels.cylinder"
    KERNELS.provide()  # a fault of a package that is not used stops nothing

    metadata = package / "rings-1.2.dist-info" / "METADATA"
    metadata.write_text(metadata.read_text().replace("1.2", "1.3"))
    _provided.cache_clear()
    with pytest.raises(CodeMissing, match=r"rings 1\.2 .*, and rings 1\.3 provides it now"):
        read_model(path)
