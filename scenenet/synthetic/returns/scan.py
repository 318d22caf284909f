"""The scanner: returns from ground, vegetation and roofs.

Pulses are sent in scan lines from the helicopter down through the crowns. A pulse returns from
foliage, a few times at most, from a roof or wall, which ends it, or from the ground and its cover.
So there are fewer points, or none, behind a crown or a house.
"""

from __future__ import annotations

import numpy as np

from scenenet.synthetic.returns.flight import Flight
from scenenet.synthetic.returns.pulse import CEILING_CELL_M, FOLIAGE, FOLIATED, MOST_RETURNS, STEP_M
from scenenet.synthetic.returns.records import (
    CoverGrids,
    Frame,
    Grid,
    Returns,
    ScanLines,
    Scene,
)
from scenenet.synthetic.scene.ground_cover import Cover
from scenenet.synthetic.scene.random_fields import Raster, field_seed
from scenenet.synthetic.scene.strip import Strip
from scenenet.synthetic.scene.vegetation import Canopy
from scenenet.synthetic.settings import SyntheticSettings

BLOCK_PULSES = 100_000
"""Pulses per call of the compiled loops, so that memory does not grow with the length of a span."""


class Scanner:
    """The scanner of one survey."""

    def __init__(self, settings: SyntheticSettings) -> None:
        from scipy.ndimage import gaussian_filter

        self._settings = settings
        rng = np.random.default_rng(field_seed(settings.seed, "foliage"))
        block = gaussian_filter(rng.standard_normal((FOLIAGE,) * 3), (1.1, 1.6, 1.6), mode="wrap")
        self._foliage = block > np.quantile(block, 1 - FOLIATED)
        per_metre = -np.log(np.clip(settings.penetration, 1e-3, 0.999)) / 5.0
        self._hit = 1 - np.exp(-per_metre * STEP_M / FOLIATED)

    def scan(
        self,
        strip: Strip,
        flight: Flight,
        terrain: Raster,
        canopy: Canopy,
        solid: Raster,
        cover: Cover,
        key: int,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Points (N, 3) and class codes (N,) of one strip.

        Args:
            strip: the ground to scan.
            flight: the flight of this section.
            terrain: elevation of the ground, m.
            canopy: the vegetation there.
            solid: height of roofs above the ground, m; 0 without a roof. Same cells as the canopy.
            cover: cover of the ground.
            key: number of the strip, for its random numbers.
        """
        from scenenet.synthetic.returns.sweep import sweep

        # How far a pulse can move across on its way down past the tallest object.
        tallest = np.maximum(canopy.top.values, solid.values)
        lean = (strip.half_width + abs(flight.offset)) / flight.height
        reach = lean * float(tallest.max())
        scene = self._scene(
            flight, terrain, canopy, solid, cover, _ceiling(tallest, canopy.top, reach)
        )
        frame = Frame(
            strip.x, strip.y, float(np.cos(strip.azimuth)), float(np.sin(strip.azimuth)),
            strip.low, strip.high, strip.k0, strip.k1, strip.half_width,
        )  # fmt: skip
        marked = np.zeros((3, *terrain.values.shape), np.bool_)
        aside = abs(flight.skew) * strip.half_width
        lines = int((strip.last - strip.first + 2 * aside) / flight.line_step) + 2
        points, codes = [], []
        for number, (start, end) in enumerate(flight.passes):
            # Pulses that reach the ground outside the strip may pass a crown inside it.
            start, end = start - reach, end + reach
            pulses = int((end - start) / flight.pulse_step) + 1
            per_block = max(1, BLOCK_PULSES // pulses)
            scan_lines = ScanLines(
                strip.first - aside, start, flight.line_step, flight.pulse_step, flight.skew,
                flight.sway, flight.offset, flight.height,
            )  # fmt: skip
            seed = np.uint64(field_seed(self._settings.seed, f"pulses {key} {number}"))
            for first in range(0, lines, per_block):
                last = min(first + per_block, lines)
                most = (last - first) * pulses * (MOST_RETURNS + 1)
                out = Returns(np.empty((most, 3)), np.empty(most, np.uint8), marked)
                n = sweep(first, last, pulses, seed, frame, scan_lines, scene, out)
                points.append(out.xyz[:n].copy())
                codes.append(out.code[:n].copy())
        return np.concatenate(points), np.concatenate(codes)

    def _scene(
        self,
        flight: Flight,
        terrain: Raster,
        canopy: Canopy,
        solid: Raster,
        cover: Cover,
        ceiling: Grid,
    ) -> Scene:
        x, y = canopy.top.nodes()
        ground = terrain.bilinear(x.ravel(), y.ravel()).reshape(x.shape)
        top = np.where(canopy.top.values > 0, ground + canopy.top.values, -np.inf)
        bottom = ground + canopy.bottom.values
        roof = np.where(solid.values > 0, ground + solid.values, -np.inf)
        # Adjacent in memory: a pulse reads all four of a cell.
        columns = np.stack(
            [top, bottom, roof, canopy.leaves.values],
            axis=-1,
            dtype=np.float32,
            casting="same_kind",
        )
        grass = cover.grass
        return Scene(
            ground=Grid(terrain.values, terrain.i, terrain.j, terrain.step),
            crowns=Grid(columns, canopy.top.i, canopy.top.j, canopy.top.step),
            ceiling=ceiling,
            cover=CoverGrids(
                grass.values, cover.tallness.values, cover.rise.values, cover.water.values,
                grass.i, grass.j, grass.step,
            ),
            foliage=self._foliage,
            hit=float(self._hit),
            depths=flight.depths,
            noise=self._settings.ranging_noise,
            lower_ground=self._settings.lower_ground,
            key_points=self._settings.key_points,
        )  # fmt: skip


def _ceiling(tallest: np.ndarray, raster: Raster, reach: float) -> Grid:
    """Greatest height above the ground within ``reach`` of each cell of ``CEILING_CELL_M``."""
    from scipy.ndimage import maximum_filter

    per = round(CEILING_CELL_M / raster.step)
    i0, j0 = raster.i // per, raster.j // per
    rows = (raster.j + tallest.shape[0] - 1) // per - j0 + 1
    columns = (raster.i + tallest.shape[1] - 1) // per - i0 + 1
    full = np.zeros((rows * per, columns * per))
    r, c = raster.j - j0 * per, raster.i - i0 * per
    full[r : r + tallest.shape[0], c : c + tallest.shape[1]] = tallest
    ceiling = full.reshape(rows, per, columns, per).max(axis=(1, 3))
    # Include the cells around: a pulse enters from the side.
    size = 2 * int(np.ceil(reach / CEILING_CELL_M)) + 1
    return Grid(maximum_filter(ceiling, size), i0, j0, CEILING_CELL_M)
