"""The hash of code depends on what the code does, wherever it is in the package."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import pytest

from scenenet.core import code_hash as codehash
from scenenet.core.errors import InputError

SCRIPTS = Path(__file__).parents[2] / "workflow" / "scripts"


class Package:
    """A small package on the import path, and a script that uses it."""

    def __init__(self, folder: Path, name: str) -> None:
        self.folder = folder
        self.name = name
        self.write("__init__.py", "")

    def write(self, path: str, text: str) -> Path:
        file = self.folder / self.name / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text.replace("PACKAGE", self.name))
        return file

    def script(self, text: str, name: str = "stage.py") -> Path:
        file = self.folder / name
        file.write_text(text.replace("PACKAGE", self.name))
        return file

    def used(self, *scripts: Path) -> set[str]:
        """Names of the modules that the scripts use, without the scripts and the package."""
        self.forget()
        used = {name for name, _ in codehash.used_code(scripts, self.name)}
        return {n.removeprefix(f"{self.name}.") for n in used} - {s.name for s in scripts}

    def hash(self, *scripts: Path) -> str:
        self.forget()
        return codehash.code_hash(scripts, self.name)

    @staticmethod
    def forget() -> None:
        """Clear the caches: code is read once per process, but these tests change it."""
        for cached in (codehash._locate, codehash._read, codehash._data_files):
            cached.cache_clear()
        importlib.invalidate_caches()


@pytest.fixture
def package(tmp_path, monkeypatch) -> Package:
    name = "codehash_example"
    monkeypatch.syspath_prepend(tmp_path)
    yield Package(tmp_path, name)
    sys.modules.pop(name, None)
    Package.forget()


SOURCE = '''
"""What the module is for."""

LIMIT = 3
"""How much is too much."""


class Scale:
    """A scale."""

    factor: float = 2.0
    """What it multiplies by."""


def double(x):
    """Twice x."""
    # because two are better
    return Scale.factor * x
'''


@pytest.mark.parametrize(
    ("what", "old", "new"),
    [
        ("comment", "# because two are better", "# for two reasons"),
        ("docstring of the module", "What the module is for.", "Something else."),
        ("docstring of a class", "A scale.", "A different scale."),
        ("docstring of an attribute", "What it multiplies by.", "Factor."),
        ("docstring of a constant", "How much is too much.", "The limit."),
        ("docstring of a function", "Twice x.", "2 x."),
        ("docstring that goes", '    """Twice x."""\n', ""),
        ("layout", "Scale.factor * x", "(\n        Scale.factor\n        * x\n    )"),
    ],
)
def test_an_edit_without_effect_keeps_the_hash(package, what, old, new):
    package.write("numbers.py", SOURCE)
    script = package.script("from PACKAGE.numbers import double")
    before = package.hash(script)
    assert old in SOURCE
    package.write("numbers.py", SOURCE.replace(old, new))
    assert package.hash(script) == before


@pytest.mark.parametrize(
    ("old", "new"), [("2.0", "2.5"), ("LIMIT = 3", "LIMIT = 4"), ("* x", "+ x")]
)
def test_an_edit_with_an_effect_changes_the_hash(package, old, new):
    package.write("numbers.py", SOURCE)
    script = package.script("from PACKAGE.numbers import double")
    before = package.hash(script)
    package.write("numbers.py", SOURCE.replace(old, new))
    assert package.hash(script) != before


def test_touching_a_file_keeps_the_hash(package):
    module = package.write("numbers.py", SOURCE)
    script = package.script("from PACKAGE.numbers import double")
    before = package.hash(script)
    module.touch()
    script.touch()
    assert package.hash(script) == before


def test_editing_the_script_changes_the_hash(package):
    before = package.hash(package.script("x = 1"))
    assert package.hash(package.script("x = 2")) != before


@pytest.mark.parametrize(
    "text",
    [
        "import PACKAGE.far",
        "from PACKAGE import far",
        "from PACKAGE.far import reach",
        "def later():\n    from PACKAGE.far import reach\n    return reach",
        "def later():\n    import PACKAGE.far as f\n    return f.reach",
        "from PACKAGE.near import reach",  # which imports far
    ],
)
def test_every_way_to_import_a_module_counts(package, text):
    package.write("near.py", "from .far import reach")
    package.write("far.py", "reach = 1")
    package.write("other.py", "unused = 1")
    script = package.script(text)
    assert "far" in package.used(script)
    assert "other" not in package.used(script)


def test_relative_imports_are_followed_from_a_package_within(package):
    package.write("inner/__init__.py", "")
    package.write("inner/a.py", "from . import b\nfrom ..far import reach")
    package.write("inner/b.py", "x = 1")
    package.write("far.py", "reach = 1")
    script = package.script("from PACKAGE.inner.a import b")
    assert package.used(script) >= {"inner.a", "inner.b", "far"}


def test_imports_for_type_checkers_do_not_count(package):
    package.write(
        "near.py",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from PACKAGE import far\n"
        "else:\n    from PACKAGE import other",
    )
    package.write("far.py", "x = 1")
    package.write("other.py", "x = 1")
    used = package.used(package.script("import PACKAGE.near"))
    assert "other" in used
    assert "far" not in used


def test_an_init_that_only_imports_names_is_transparent(package):
    package.write(
        "inner/__init__.py",
        '"""Doc."""\nfrom PACKAGE.inner.a import one\nfrom PACKAGE.inner.b import two as second\n'
        '__all__ = ["one", "second"]',
    )
    package.write("inner/a.py", "one = 1")
    package.write("inner/b.py", "two = 2")
    assert package.used(package.script("from PACKAGE.inner import one")) == {"inner.a"}
    assert package.used(package.script("from PACKAGE.inner import second")) == {"inner.b"}
    assert package.used(package.script("from PACKAGE.inner.a import one")) == {"inner.a"}


def test_a_package_used_as_a_whole_counts_all_that_its_init_imports(package):
    package.write("inner/__init__.py", "from .a import one\nfrom .b import two")
    package.write("inner/a.py", "one = 1")
    package.write("inner/b.py", "two = 2")
    for text in ("from PACKAGE import inner", "import PACKAGE.inner"):
        assert package.used(package.script(text)) >= {"inner", "inner.a", "inner.b"}


def test_an_init_that_does_something_counts_with_every_module_of_its_package(package):
    package.write("inner/__init__.py", "from .a import one\none.register()")
    package.write("inner/a.py", "one = 1")
    package.write("inner/b.py", "two = 2")
    used = package.used(package.script("from PACKAGE.inner.b import two"))
    assert used == {"inner", "inner.a", "inner.b"}


def test_a_module_that_scans_its_package_counts_every_module_there(package):
    package.write("shapes/__init__.py", "")
    package.write("shapes/known/__init__.py", "")
    package.write("shapes/known/cone.py", "x = 1")
    package.write("shapes/registry.py", "import pkgutil\nfrom PACKAGE.shapes import known")
    script = package.script("from PACKAGE.shapes.registry import known")
    before = package.hash(script)
    assert "shapes.known.cone" in package.used(script)
    package.write("shapes/known/cube.py", "x = 1")
    assert package.hash(script) != before


def test_templates_of_a_package_count_with_its_modules(package):
    package.write("page/__init__.py", "from .write import write")
    package.write("page/write.py", "write = 1")
    package.write("page/templates/page.html", "<p>")
    package.write("page/__pycache__/write.cpython-311.pyc", "compiled")
    script = package.script("from PACKAGE.page import write")
    before = package.hash(script)
    assert package.used(script) == {"page.write", "page/templates/page.html"}
    package.write("page/templates/page.html", "<h1>")
    assert package.hash(script) != before


def test_a_script_counts_the_scripts_in_its_folder_that_it_imports(package):
    package.script("import helper", "stage.py")
    helper = package.script("from PACKAGE.far import reach", "helper.py")
    package.write("far.py", "reach = 1")
    script = package.script("import helper")
    assert package.used(script) == {"helper.py", "far"}
    before = package.hash(script)
    helper.write_text(helper.read_text() + "\nx = 1")
    assert package.hash(script) != before


def test_circular_imports_are_handled(package):
    package.write("a.py", "from PACKAGE import b")
    package.write("b.py", "from PACKAGE import a")
    assert package.used(package.script("import PACKAGE.a")) == {"a", "b"}


def test_an_invalid_script_gives_an_error_with_its_place(package):
    script = package.script("x = = 1")
    with pytest.raises(InputError, match=r"stage\.py: line 1: the file is not valid Python"):
        package.hash(script)


def used_by(script: str) -> set[str]:
    return {name for name, _ in codehash.used_code([SCRIPTS / f"{script}.py"])}


def test_predicting_depends_on_the_kernels_though_it_imports_none_by_name():
    assert "scenenet.geneo.kernels.cylinder" in used_by("predict")


def test_crops_and_training_do_not_depend_on_the_wording_of_a_check():
    """Both import the package of point clouds."""
    assert "scenenet.pointcloud.quality.report" in used_by("check")
    assert "scenenet.pointcloud.quality.report" not in used_by("crops") | used_by("train")


def test_no_stage_depends_on_the_command_line_or_on_the_configuration():
    scripts = {file.stem for file in SCRIPTS.glob("*.py")} - {"_job", "_results"}
    assert len(scripts) > 10
    for script in scripts:
        assert not used_by(script) & {
            "scenenet.cli.app",
            "scenenet.config.schema",
            "scenenet.core.code_hash",
            "scenenet.core.parsed_source",
        }


def test_the_report_depends_on_its_template():
    assert "report/assets/page.html" in used_by("report")
