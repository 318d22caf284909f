"""Fixtures that more than one part of the tests uses."""

from __future__ import annotations

import importlib.util
import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

# Parallel workers must not compete for cores, so each has one thread. Libraries read
# this when they are loaded.
if "PYTEST_XDIST_WORKER" in os.environ:
    os.environ.setdefault("OMP_NUM_THREADS", "1")
# numba has threads of its own. While one of them waits for the others it would keep a core busy,
# which takes most of the time of a small loop where another process has that core. Scikit-learn
# shares the OpenMP of torch and these threads: its trees then take three times the processor time.
os.environ.setdefault("GOMP_SPINCOUNT", "0")
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

import hypothesis
import numpy as np
import pytest
from fixtures.scenes import PLACE, conductor_places, make_pole_finder, make_scene

from scenenet.pointcloud import PointCloud

# The tests start hundreds of processes, and each would compile the whole package again.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# The same examples each time, so that a test fails because of a change and not because of luck; no
# deadline, because the first example of some tests waits for a compiler.
hypothesis.settings.register_profile(
    "same-each-time", deadline=None, derandomize=True, max_examples=50
)
# To look further: pytest --hypothesis-profile=explore
hypothesis.settings.register_profile("explore", deadline=None, max_examples=2000)
hypothesis.settings.load_profile("same-each-time")

pytest_plugins = [
    *("fixtures.called", "fixtures.empty_store", "fixtures.noisy_lines", "fixtures.result_folder"),
]

ROOT = Path(__file__).resolve().parent.parent


LONGEST = (
    "tests/workflow/test_captions.py",
    *("tests/tracking/", "tests/cli/", "tests/trust/", "tests/experiments/"),
    "tests/workflow/",
    "tests/baselines/",
)
"""Tests to begin with, so that no worker is left with a long file at the end. The first one makes
the finished run of the workflow; the next ones keep the other worker busy meanwhile, because the
rest of the workflow's tests wait for it."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the longest tests first."""

    def rank(item: pytest.Item) -> int:
        return next((n for n, start in enumerate(LONGEST) if item.nodeid.startswith(start)), 9)

    items.sort(key=rank)


@pytest.hookimpl(optionalhook=True)  # pytest-xdist may be missing
def pytest_xdist_make_scheduler(config: pytest.Config, log):
    """Give each file to one worker, so that no fixture of a module is made twice."""
    from xdist.scheduler import LoadFileScheduling

    return LoadFileScheduling(config, log)


@pytest.fixture(scope="session")
def project_root() -> Path:
    return ROOT


@pytest.fixture(scope="module")
def pictures() -> Iterator[ModuleType]:
    """``tools/doc_pictures.py``, which opens pages in a browser, the same for the tests of a file;
    skips without Chromium."""
    spec = importlib.util.spec_from_file_location("pictures", ROOT / "tools" / "doc_pictures.py")
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    if module.chromium() is None:
        pytest.skip("no Chromium here; on Debian and Ubuntu: apt install chromium")
    with module.one_browser():
        yield module


@pytest.fixture(scope="session")
def real_data() -> Path:
    """Folder of real recordings, which are not part of the project; skips without them."""
    folder = Path(os.environ.get("SCENENET_REAL_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip("no real recordings here: set SCENENET_REAL_DATA to a folder that has them")
    return folder


@pytest.fixture(scope="session")
def scene() -> Callable[..., PointCloud]:
    """A function that makes a small scene: poles and a tree on flat ground, EDP codes."""

    return make_scene


@pytest.fixture(scope="session")
def pole_finder():
    """A SCENE-Net with numbers set by hand, and its card."""
    return make_pole_finder()


@pytest.fixture(scope="session")
def real_samples(real_data: Path):
    """The real TS40K crops at 64^3, by name."""
    from scenenet.dataset.voxels import VoxelGrid, voxelise
    from scenenet.pointcloud import read

    samples = {}
    for path in sorted((real_data / "ts40k").glob("*.npy")):
        cloud = read(path, "edp")
        samples[path.stem] = voxelise(cloud, VoxelGrid.cube(cloud.xyz, 64), path.stem)
    return samples


class Lattice:
    """Centres of occupied voxels of 1 m, placed by hand around ``PLACE``; ground from 0 to 1 m."""

    place = PLACE

    @staticmethod
    def voxels(places: np.ndarray) -> np.ndarray:
        """The distinct voxels of positions (M, 3) m relative to ``PLACE``."""
        return np.unique(np.floor(places), axis=0) + 0.5 + PLACE

    @classmethod
    def ground(cls, half: float = 30.0, slope: float = 0.0) -> np.ndarray:
        """A square of ground that rises by ``slope`` m per metre towards the east."""
        x, y = (side.ravel() for side in np.meshgrid(*[np.arange(-half, half)] * 2))
        return cls.voxels(np.column_stack([x, y, slope * x]))

    @classmethod
    def column(cls, x: float, y: float, low: float, high: float) -> np.ndarray:
        """Voxels above one another, from ``low`` up to below ``high`` m."""
        z = np.arange(low, high)
        return cls.voxels(np.column_stack([np.full(len(z), x), np.full(len(z), y), z]))

    @classmethod
    def conductors(
        cls,
        bearing: float,
        height: float,
        x: float = 0.0,
        y: float = 0.0,
        end: float = 28.0,
        beside: tuple[float, ...] = (-1.5, 0.0, 1.5),
    ) -> np.ndarray:
        """Conductors from (x, y) towards a bearing in degrees, falling by 1 m on the way."""
        return cls.voxels(conductor_places(bearing, height, x, y, end, beside))

    @staticmethod
    def together(*parts: np.ndarray) -> np.ndarray:
        return np.unique(np.concatenate(parts), axis=0)


@pytest.fixture(scope="session")
def lattice() -> type[Lattice]:
    return Lattice


@pytest.fixture
def nothing_provided(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """No kernels and measurements from outside the package but those that the test provides."""
    from scenenet.core.provided_code import KERNELS, MEASUREMENTS, _provided

    for kind in (KERNELS, MEASUREMENTS):
        monkeypatch.setenv(kind.variable, "")
    _provided.cache_clear()
    yield
    _provided.cache_clear()


@dataclass(frozen=True)
class DatasetFiles:
    """The files of a survey before training: paths of the survey, manifests and split."""

    survey: Path
    crops: Path
    voxels: Path
    split: Path


@pytest.fixture(scope="session")
def dataset_files(scene, tmp_path_factory: pytest.TempPathFactory) -> DatasetFiles:
    """A survey of six poles 60 m apart, cut, voxelised at 1 m and split 2 / 1 / 3."""
    import pandas as pd

    from scenenet.dataset.crops import CropSettings, cut_crops
    from scenenet.dataset.labelled_towers import TowerSettings, survey_towers
    from scenenet.dataset.voxel_cache import build
    from scenenet.dataset.voxels import VoxelSettings
    from scenenet.pointcloud import write_las

    folder = tmp_path_factory.mktemp("dataset")
    files = DatasetFiles(*(folder / n for n in ("s.laz", "crops.json", "voxels.json", "split.csv")))
    poles = [(20.5 + 60 * i, 20.5) for i in range(6)]
    write_las(files.survey, scene(poles, size=(345.0, 40.0), tree=(30.0, 30.0)))
    towers = survey_towers(files.survey, "edp", TowerSettings(min_points=100)).towers
    store = folder / "crops.zarr.zip"
    cut_crops("s", files.survey, "edp", towers, CropSettings(), store, files.crops)
    settings = VoxelSettings(fit="metric", voxel_size=1.0)
    build(files.crops, settings, folder / "voxels.zarr.zip", files.voxels)
    parts = ["train", "train", "validation", "test", "test", "test"]
    crops = [f"s-{number:04d}" for number in towers["tower"]]
    pd.DataFrame({"survey": "s", "crop": crops, "part": parts}).to_csv(files.split, index=False)
    return files
