"""Class schemes: one table, from which the codes of all stages follow."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scenenet.pointcloud.class_schemes import (
    LOOK_COLOURS,
    ROLE_COLOURS,
    SCHEMES,
    class_scheme,
    difference,
    markdown,
)
from scenenet.synthetic import codes as synthetic_codes

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.parametrize(
    ("name", "role", "codes"),
    [
        ("edp", "tower", {15}),
        ("edp", "conductor", {16, 17}),
        ("edp", "vegetation", {3, 4, 5}),
        ("edp", "ground", {2, 10, 11}),
        ("edp", "noise", {7}),
        ("asprs", "tower", {15}),
        ("asprs", "conductor", {13, 14}),
        ("asprs", "vegetation", {3, 4, 5}),
        ("asprs", "ground", {2, 11}),
        ("asprs", "noise", {7, 18}),
        ("ts40k", "tower", {4}),
        ("ts40k", "conductor", {5}),
        ("ts40k", "vegetation", {2, 3}),
        ("ts40k", "ground", {1}),
        ("ts40k", "noise", {0}),
    ],
)
def test_a_role_has_the_codes_of_its_standard(name, role, codes):
    assert class_scheme(name).with_role(role) == codes


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
def test_a_scheme_lists_every_code_once_and_in_order(scheme):
    codes = [entry.code for entry in scheme.codes]
    assert codes == sorted(set(codes))
    assert list(scheme.classes) == codes
    assert SCHEMES[scheme.name] is scheme
    assert set(scheme.roles(np.array(codes, np.uint8))) <= set(ROLE_COLOURS)
    assert set(scheme.looks(np.array(codes, np.uint8))) <= set(LOOK_COLOURS)


def by_name(names: np.ndarray) -> dict[str, list[int]]:
    return {name: np.flatnonzero(names == name).tolist() for name in sorted({*names} - {"other"})}


def test_pictures_show_edp_codes_as_the_public_crops_use_them():
    every = np.arange(256).astype(np.uint8)
    assert by_name(class_scheme("edp").roles(every)) == {
        "conductor": [16, 17],
        "ground": [2, 9, 10, 11, 19],
        "tower": [15],
        "vegetation": [3, 4, 5, 12],
    }
    assert by_name(class_scheme("edp").looks(every)) == {
        "conductor": [16, 17],
        "ground": [2, 9, 10, 19],
        "low": [3, 4, 11],
        "stray": [7],
        "tall": [5, 12],
        "tower": [15],
    }


def test_pictures_show_other_schemes_by_role():
    every = np.arange(256).astype(np.uint8)
    assert by_name(class_scheme("asprs").looks(every)) == {
        "conductor": [13, 14], "ground": [2, 11], "stray": [7, 18], "tall": [3, 4, 5], "tower": [15]
    }  # fmt: skip
    assert by_name(class_scheme("ts40k").roles(every)) == {
        "conductor": [5], "ground": [1], "tower": [4], "vegetation": [2, 3]
    }  # fmt: skip


def test_a_code_outside_the_scheme_is_named_undefined():
    assert class_scheme("ts40k").class_name(4) == "Power line support tower"
    assert class_scheme("ts40k").class_name(15) == "undefined (15)"


def test_synthetic_surveys_have_the_codes_of_the_public_crops():
    names = ("UNCLASSIFIED", "GROUND", "GRASS", "SCRUB", "TREE", "STRAY", "WATER", "BARE", "LOW",
             "TALL", "TOWER", "CONDUCTOR", "BARE_TOO")  # fmt: skip
    codes = [getattr(synthetic_codes, name) for name in names]
    assert codes == [1, 2, 3, 4, 5, 7, 9, 10, 11, 12, 15, 16, 19]


def test_the_documentation_has_the_table_of_schemes():
    pages = [p.read_text(encoding="utf-8") for p in DOCS.rglob("*.md")]
    start = "<!-- class schemes -->\n"
    tables = [
        page.partition(start)[2].partition("\n<!-- end -->")[0] for page in pages if start in page
    ]
    remedy = "print scenenet.pointcloud.class_schemes.markdown() between the two comments"
    assert tables == [markdown()], remedy


def test_the_difference_names_towers_and_conductors_of_every_scheme():
    assert difference().startswith(
        "edp: tower 15, conductor 16, 17; asprs: tower 15, conductor 13, 14; "
        "ts40k: tower 4, conductor 5"
    )
