"""The intact files that the trust suite damages, and the survey and model that it works with."""

from __future__ import annotations

import io
import struct
from pathlib import Path

import laspy
import lazrs
import numpy as np
from fixtures.scenes import make_pole_finder, make_scene

from scenenet.pointcloud import PointCloud, write_las

FORMATS = ("las", "laz", "copc", "npy", "pt", "json", "safetensors")
SUFFIX = {"copc": ".copc.laz"} | {f: f".{f}" for f in FORMATS if f != "copc"}
MODELS = ("json", "safetensors")

_ENTRY = struct.Struct("<4iQii")
"""A cell of the octree of a COPC file: level, x, y, z, position, bytes and points of its chunk."""


def write_survey(path: Path, *, poles: int = 1) -> None:
    """A line of poles 30 m apart on flat ground."""
    places = [(15.5 + 30 * i, 15.5) for i in range(poles)]
    write_las(path, make_scene(places, size=(30.0 * poles, 30.0)))


def write_pole_model(path: Path) -> None:
    """A SCENE-Net that finds the poles."""
    from scenenet.models.model_file import write_model

    write_model(path, *make_pole_finder())


def originals(kind: str) -> list[bytes]:
    """Contents of intact files of a format; two where a format has variants that differ."""
    return {
        "las": lambda: [_las(6, "las"), _las(3, "las")],
        "laz": lambda: [_las(6, "laz"), _las(3, "laz")],
        "copc": lambda: [_copc()],
        "npy": lambda: [_npy()],
        "pt": lambda: [_pt()],
        "json": lambda: [_json()],
        "safetensors": lambda: [_safetensors()],
    }[kind]()


def _cloud() -> PointCloud:
    return make_scene(size=(20.0, 20.0), poles=[(10.5, 10.5)])


def _header(point_format: int) -> laspy.LasHeader:
    cloud = _cloud()
    header = laspy.LasHeader(
        version="1.4" if point_format > 5 else "1.2", point_format=point_format
    )
    header.scales, header.offsets = np.full(3, 0.001), np.floor(cloud.xyz.min(axis=0))
    return header


def _points(header: laspy.LasHeader) -> laspy.LasData:
    cloud = _cloud()
    las = laspy.LasData(header)
    las.points = laspy.ScaleAwarePointRecord.zeros(len(cloud), header=header)
    las.xyz = cloud.xyz
    las.classification = cloud.classification
    las.return_number[:] = las.number_of_returns[:] = 1
    las.intensity = np.arange(len(cloud)) % 5000
    return las


def _las(point_format: int, suffix: str) -> bytes:
    """LAS 1.4 with layered points, a CRS and an extra dimension, or LAS 1.2 without these."""
    import pyproj

    header = _header(point_format)
    if point_format > 5:
        header.add_extra_dim(laspy.ExtraBytesParams("height", "f4"))
        header.add_crs(pyproj.CRS("EPSG:32629"))
    stream = io.BytesIO()
    _points(header).write(stream, do_compress=suffix == "laz")
    return stream.getvalue()


def _copc() -> bytes:
    """A COPC file of two levels: a root with every fourth point, and one cell below it."""
    header = _header(6)
    points = _points(header).points.array
    cells = [points[::4], np.delete(points, np.s_[::4])]
    laszip = lazrs.LazVlr.new_for_compression(6, 0, use_variable_size_chunks=True)
    info = laspy.VLR("copc", 1, "copc", bytes(160))
    header.vlrs.extend([info, laspy.VLR("laszip encoded", 22204, "", laszip.record_data())])
    header.point_count, header.are_points_compressed = len(points), True
    header.number_of_points_by_return[0] = len(points)
    stream = io.BytesIO()
    header.write_to(stream, ensure_same_size=False)
    start = stream.tell()
    compressor = lazrs.LasZipCompressor(stream, laszip)
    compressor.reserve_offset_to_chunk_table()
    for number, cell in enumerate(cells):
        if number:
            compressor.finish_current_chunk()
        compressor.compress_many(np.frombuffer(cell.tobytes(), np.uint8))
    compressor.done()
    data = bytearray(stream.getvalue())
    stream.seek(start)
    sizes = [size for _, size in lazrs.read_chunk_table(stream, laszip)]
    at = [start + 8, start + 8 + sizes[0]]
    keys = [(0, 0, 0, 0), (1, 0, 0, 0)]
    page = b"".join(
        _ENTRY.pack(*key, place, size, len(cell))
        for key, place, size, cell in zip(keys, at, sizes, cells, strict=True)
    )
    extended = len(data)
    data += struct.pack("<2x16sHQ32s", b"copc", 1000, len(page), b"") + page
    struct.pack_into("<QI", data, 235, extended, 1)
    middle, half = header.offsets + 10, 20.0
    place = struct.pack("<5d2Q2d", *middle, half, 1.0, extended + 60, len(page), 0.0, 0.0)
    data[375 + 54 : 375 + 54 + len(place)] = place
    return bytes(data)


def _npy() -> bytes:
    cloud = _cloud()
    stream = io.BytesIO()
    np.save(stream, np.column_stack([cloud.xyz, cloud.classification]))
    return stream.getvalue()


def _pt() -> bytes:
    import torch

    cloud = _cloud()
    sample = {
        "input_pcd": torch.from_numpy(cloud.xyz),
        "semantic_labels": torch.from_numpy(cloud.classification.astype(np.int64)),
        "type": "crop",
    }
    stream = io.BytesIO()
    torch.save(sample, stream)
    return stream.getvalue()


def _json() -> bytes:
    return _written(*make_pole_finder(), ".json")


def _safetensors() -> bytes:
    import torch

    from scenenet.models.cnn import CNN

    torch.manual_seed(0)
    _, card = make_pole_finder()
    return _written(CNN(3, (9, 5, 5)), card, ".safetensors")


def _written(model, card, suffix: str) -> bytes:
    import tempfile

    from scenenet.models.model_file import write_model

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"model{suffix}")
        write_model(path, model, card)
        return path.read_bytes()
