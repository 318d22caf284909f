"""A missing extra is named before any work is done."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

import pytest

from scenenet.cli.app import main
from scenenet.core.errors import InputError
from scenenet.core.extras import EXTRAS, require


@pytest.mark.parametrize("extra", EXTRAS)
def test_an_extra_that_is_installed_is_accepted(extra):
    require(extra, "the test")


@pytest.mark.parametrize("extra", EXTRAS)
def test_a_missing_extra_says_what_to_install(extra, monkeypatch):
    missing = EXTRAS[extra][0]
    monkeypatch.setattr("scenenet.core.extras.find_spec", lambda name: name != missing or None)
    message = rf"the test needs {missing}.*pip install 'scenenet\[{extra}\]'"
    with pytest.raises(InputError, match=message):
        require(extra, "the test")


def test_every_module_is_brought_by_its_extra(project_root: Path):
    project = tomllib.loads((project_root / "pyproject.toml").read_text())["project"]
    for extra, modules in EXTRAS.items():
        brought = {re.match(r"[\w-]+", r)[0] for r in project["optional-dependencies"][extra]}
        assert set(modules) <= brought


def test_explain_without_the_report_ends_with_code_1(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr("scenenet.core.extras.find_spec", lambda name: None)
    monkeypatch.delitem(sys.modules, "scenenet.report.explanation_page", raising=False)
    with pytest.raises(SystemExit) as end:
        main(["explain", "a.laz", "--model", "m.json", "--out", str(tmp_path / "why.html")])
    assert end.value.code == 1
    assert "pip install 'scenenet[report]'" in capsys.readouterr().err
