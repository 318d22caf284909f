"""Wires that a model finds at synthetic towers, from the survey to the table."""

from __future__ import annotations

from dataclasses import replace

from scenenet.experiments.wires_at_towers import (
    DENSITIES,
    POLES,
    Found,
    cases,
    look_at_towers,
    table,
)
from scenenet.metrics.voxel_scores import Confusion
from scenenet.models.packaged import WIRES, packaged_model


def test_wires_at_a_pole_are_found_and_scored_by_distance(tmp_path):
    carrying, tension = cases(["tubular"], 1, 5)
    assert (carrying.tension, tension.tension, tension.seed) == (0, 1, 6)
    found = look_at_towers(carrying, packaged_model(WIRES), tmp_path)
    assert found.of == ("tubular", 1, POLES["density"], False)
    wires = [near.tp + near.fn for near in found.near]
    # Points end 14 m from the axis.
    assert min(wires[:4]) > 0 and wires[4] == 0
    total = sum(found.near, Confusion())
    assert total.recall > 0.8 and total.precision > 0.8
    assert total.tp + total.fp + total.fn + total.tn > 1000


def test_pylons_have_every_bundle_with_few_and_many_points():
    pylons = list(cases(["lattice"], 2, 40))
    assert [p.seed for p in pylons] == list(range(40, 52))
    assert {(p.bundle, p.density) for p in pylons} == {
        (bundle, pulses) for bundle in (1, 2, 4) for pulses, _ in DENSITIES
    }


def test_the_table_has_precision_recall_and_the_trivial_answer():
    near = (Confusion(3, 1, 2, 5), Confusion(), Confusion(), Confusion(), Confusion())
    found = Found(("window", 2, 12.0, True), near)
    *_, row = table([found, replace(found, of=("tubular", 1, 20.0, False))])
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    assert cells[:5] == ["tubular", "1", "20", "no", "0.75, 0.60"]
    assert cells[5] == "-, -"
    assert cells[-2:] == ["0.50", "0.45"]
