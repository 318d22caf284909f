"""Clearances of a survey, from what its prediction keeps on disk to its files."""

from __future__ import annotations

import csv
import sqlite3
from dataclasses import replace
from pathlib import Path

import laspy
import numpy as np
import pytest
import shapely
from fixtures.true_line import true_line

from scenenet.clearance.section import Area
from scenenet.clearance.settings import ClearanceSettings
from scenenet.detection.ground import Ground
from scenenet.detection.head import NO_HEAD
from scenenet.detection.profile import Profile
from scenenet.detection.structure import Structure
from scenenet.line.frame import SpanFrame
from scenenet.line.records import AS_FLOWN, SurveyLine
from scenenet.pointcloud import PointCloud, write_las
from scenenet.pointcloud.class_schemes import EDP
from scenenet.prediction.area_points import JUMPER_M, AreaLookUp, WireVoxels
from scenenet.prediction.clearance_lists import write_clearance_layers, write_clearances_csv
from scenenet.prediction.found_clearances import find_clearances_in_survey
from scenenet.prediction.found_line import WireSearch
from scenenet.prediction.work.block_file import BlockFile, BlockWriter
from scenenet.prediction.work.lattice import groups
from scenenet.prediction.work.structures import Structures
from scenenet.prediction.work.tile_predictions import (
    PREDICTED_KINDS,
    TilePrediction,
    TilePredictions,
)
from scenenet.prediction.work.tiling import TileSpool
from scenenet.prediction.work.work_file import WorkFile, read_file
from scenenet.synthetic.codes import CONDUCTOR
from scenenet.synthetic.corridor import make_corridor
from scenenet.synthetic.settings import SyntheticSettings
from scenenet.synthetic.survey import make_survey

VOXEL_M = 0.5
FOOT_M = 0.3048
SETTINGS = ClearanceSettings(voltage=66)


@pytest.fixture(scope="module")
def survey(tmp_path_factory) -> tuple[laspy.LasData, TileSpool, SurveyLine]:
    """A synthetic survey, what is kept of it, and its true line."""
    folder = tmp_path_factory.mktemp("clearances")
    made = SyntheticSettings(
        towers=2, seed=7, kinds={"lattice_pole": 1.0}, density=15, section=0, margin=20.0,
        annotation_noise=0.0,
    )  # fmt: skip
    path = folder / "line.laz"
    make_survey(made, path, workers=1)
    read_file(path, path.name, folder / "work", VOXEL_M, 20_000, classes=True)
    work = WorkFile.open(folder / "work")
    return (
        laspy.read(path),
        TileSpool(work.lattice, [work.blocks]),
        true_line(make_corridor(made).conductors),
    )


@pytest.fixture(scope="module")
def wires(survey, tmp_path_factory) -> WireVoxels:
    """What a model of wires predicts that is right everywhere."""
    points, spool, _ = survey
    path = tmp_path_factory.mktemp("wires") / "predictions"
    on_wire = points.xyz[points.classification == CONDUCTOR]
    tiles, voxels = spool.lattice.locate(on_wire)
    found = {code: voxels[rows] for code, rows in groups(tiles)}
    with path.open("wb") as stream:
        blocks = BlockWriter(stream, PREDICTED_KINDS)
        for tile, (code, _) in zip(spool.tiles(), spool.places(), strict=True):
            probability = np.isin(tile.voxel, found.get(code, [])).astype(np.float32)
            shares = np.empty((len(tile.voxel), 0), np.float32)
            blocks.add(
                "predictions", code, TilePrediction(tile.voxel, probability, shares).records()
            )
        blocks.end({"geneos": []})
    return WireVoxels(WireSearch(spool, TilePredictions([BlockFile(path)]), 0.5))


@pytest.fixture(scope="module")
def found(survey, wires):
    _, spool, line = survey
    return find_clearances_in_survey(spool, line, Structures(()), wires, SETTINGS, EDP)


def test_class_codes_stay_with_their_points(survey):
    points, spool, _ = survey
    written = {
        (round(x * 1000), round(y * 1000), round(z * 1000)): code
        for (x, y, z), code in zip(points.xyz.tolist(), points.classification, strict=True)
    }
    read = 0
    for code, _ in spool.places():
        xyz, classes = spool.classified_points(code)
        np.testing.assert_array_equal(xyz, spool.points(code))
        assert classes.dtype == np.uint8
        keys = map(tuple, np.round(xyz * 1000).astype(int).tolist())
        assert [written[key] for key in keys] == classes.tolist()
        read += len(xyz)
    assert read == len(points.xyz)


def test_points_with_the_class_of_noise_are_no_obstacles_without_a_scheme(survey, wires, tmp_path):
    points, _, line = survey
    wire = line.conductors[0]
    middle = wire.catenary.at_shares(np.array([0.5]))[0]
    flock = middle + np.random.default_rng(0).uniform(-0.4, 0.4, (30, 3)) - (0.0, 0.0, 1.5)

    def dangers(code: int, withheld: int = 0) -> int:
        """Places too near of points with a class, which height alone would call vegetation."""
        cloud = PointCloud(
            np.concatenate([points.xyz, flock]),
            np.append(np.asarray(points.classification), np.full(len(flock), code)).astype(
                np.uint8
            ),
        )
        path = tmp_path / f"{code}.laz"
        write_las(path, cloud)
        written = laspy.read(path)
        written.withheld[-len(flock) :] = withheld
        written.write(path)
        read_file(path, path.name, tmp_path / f"{code}", VOXEL_M, 20_000, classes=True)
        work = WorkFile.open(tmp_path / f"{code}")
        spool = TileSpool(work.lattice, [work.blocks])
        found = find_clearances_in_survey(spool, line, Structures(()), wires, SETTINGS)
        at = np.array([(p.x, p.y, p.z) for p in found.dangers]).reshape(-1, 3)
        return int((np.linalg.norm(at - flock.mean(axis=0), axis=1) < 0.8).sum())

    assert dangers(1) == 1
    assert dangers(7) == 0
    assert dangers(1, withheld=1) == 0


def test_points_of_wires_that_were_not_traced_are_no_obstacles(survey, wires):
    points, spool, line = survey
    traced = [wire for wire in line.conductors if wire.conductor_id != 2]
    poor = replace(line, conductors=tuple(traced))
    found = find_clearances_in_survey(spool, poor, Structures(()), wires, SETTINGS)
    on_wire = points.xyz[points.classification == CONDUCTOR]
    for place in found.places:
        near = np.linalg.norm(on_wire - (place.x, place.y, place.z), axis=1).min()
        assert near > 0.01


def test_points_in_voxels_of_wires_at_a_tower_are_no_obstacles(survey, wires):
    _, spool, line = survey
    span = next(s for s in line.spans if s.from_tower and s.to_tower)
    frame = SpanFrame.between(np.array(span.start), np.array(span.end))
    x, y = span.start
    profile = Profile(0.0, 0.0, 0.3, 0.3, 15.0, 1.0, 1.0)
    ground, along = Ground(0.0, np.zeros(2)), np.array([0.0, 1.0])
    tower = Structure(x, y, ground, 15.0, 0.5, along, profile, 1.0, NO_HEAD, ())

    def nearest_wire(structures: Structures) -> float:
        """m, planar distance from the tower of the nearest point in a voxel of a wire."""
        look_up = AreaLookUp(spool, structures, wires)
        found = look_up.obstacles(Area(frame, 0.0, span.length, 20.0))
        return float(np.hypot(*(found.xyz[found.wire][:, :2] - (x, y)).T).min())

    assert nearest_wire(Structures(())) < tower.reach + JUMPER_M
    assert nearest_wire(Structures(((1, tower),))) > tower.reach + JUMPER_M


def test_the_table_has_a_row_for_each_span_the_worst_first(found, survey, tmp_path):
    path = tmp_path / "line.clearances.csv"
    write_clearances_csv(path, found, (FOOT_M, FOOT_M, FOOT_M))
    rows = list(csv.DictReader(path.open()))
    assert len(rows) == len(survey[2].spans)
    assert [int(row["span_id"]) for row in rows] == [row.span_id for row in found.spans]
    assert {row["positions"] for row in rows} == {AS_FLOWN}
    for row, span in zip(rows, found.spans, strict=True):
        assert float(row["ground"]) * FOOT_M == pytest.approx(span.ground, abs=1e-3)
        assert row["building"] == "" and span.building is None


def test_layers_join_wires_and_what_is_near(found, tmp_path):
    path = tmp_path / "line.gpkg"
    assert write_clearance_layers(path, found, None, (1, 1, 1)) == [
        "clearances", "fall_trees", "clearance_profile"
    ]  # fmt: skip
    places = features(path, "clearances")
    assert len(places) == len(found.places) > len(found.dangers) > 0
    for (line, distance, limit, kinds), place in zip(places, found.places, strict=True):
        assert line.length == pytest.approx(place.horizontal, abs=1e-6)
        ends = shapely.get_coordinates(line, include_z=True)
        assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(distance)
        assert limit == place.limit and kinds == found.kinds
    with sqlite3.connect(path) as database:
        trees = database.execute("SELECT height, margin FROM fall_trees").fetchall()
        steps = database.execute("SELECT start, distance FROM clearance_profile").fetchall()
    assert trees == [(tree.height, tree.margin) for tree in found.trees]
    assert steps == [(step.start, step.distance) for step in found.profile]


def test_layers_without_a_voltage_have_no_limits(survey, wires, tmp_path):
    _, spool, line = survey
    one = SurveyLine(
        line.spans[:1], tuple(w for w in line.conductors if w.span_id == line.spans[0].span_id), ()
    )
    free = find_clearances_in_survey(spool, one, Structures(()), wires, ClearanceSettings(), EDP)
    path = tmp_path / "line.gpkg"
    write_clearance_layers(path, free, None, (1, 1, 1))
    assert {limit for _, _, limit, _ in features(path, "clearances")} == {None}


def features(path: Path, layer: str):
    """Geometry, distance, limit and kinds of the features of a layer."""
    from pyogrio.raw import read

    facts, _, geometry, values = read(path, layer=layer)
    named = dict(zip(facts["fields"], values, strict=True))
    limits = [None if np.isnan(limit) else limit for limit in named["limit"]]
    lines = shapely.from_wkb(geometry)
    return list(zip(lines, named["distance"], limits, named["kinds"], strict=True))
