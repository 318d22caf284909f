"""A synthetic survey cut into tiles across the line, written while the corridor is generated."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from scenenet.synthetic.corridor import Corridor

Write = Callable[[np.ndarray, np.ndarray], None]
"""Takes the next points (N, 3) and their codes (N,)."""


def tile_names(tiles: int) -> list[str]:
    """Names of the files of a survey in so many tiles, along the line."""
    digits = len(str(tiles))
    return [f"tile-{number:0{digits}}.laz" for number in range(1, tiles + 1)]


@contextlib.contextmanager
def tiled_stream(
    folder: Path,
    corridor: Corridor,
    tiles: int,
    stream: Callable[[Path], contextlib.AbstractContextManager[Write]],
) -> Iterator[Write]:
    """Write a corridor to tiles of equal length along the straight line between its ends.

    Yields a function that takes the next stretch. A tile appears whole, once the stretches have
    passed it, so that only the tiles of the present stretch are open. The few points behind the
    last closed tile go to the next one.

    Args:
        folder: for the tiles, named by ``tile_names``.
        stream: opens a file to write.
    """
    first, last = _ends(corridor)
    origin = np.array([corridor.settings.easting, corridor.settings.northing])
    along, length = (last - first), float(np.linalg.norm(last - first))
    paths = [folder / name for name in tile_names(tiles)]
    open_files: dict[int, tuple[contextlib.ExitStack, Write]] = {}
    with contextlib.ExitStack() as files:

        def writer(tile: int) -> Write:
            if tile not in open_files:
                own = files.enter_context(contextlib.ExitStack())
                open_files[tile] = own, own.enter_context(stream(paths[tile]))
            return open_files[tile][1]

        closed = 0

        def write(xyz: np.ndarray, codes: np.ndarray) -> None:
            nonlocal closed
            share = (xyz[:, :2] - origin - first) @ along / length**2
            at = np.clip(np.floor(share * tiles).astype(int), closed, tiles - 1)
            for tile in np.unique(at).tolist():
                writer(tile)(xyz[at == tile], codes[at == tile])
            # The next stretch begins where this one ends, and reaches back by less than it is long.
            reached = int(np.percentile(at, 1))
            for tile in range(closed, reached):
                writer(tile)  # one without a point is a file too
                open_files.pop(tile)[0].close()
            closed = max(closed, reached)

        yield write
        for tile in range(closed, tiles):
            writer(tile)


def _ends(corridor: Corridor) -> tuple[np.ndarray, np.ndarray]:
    """(2,) m from the origin of the survey, where its points begin and end on the line."""
    strips = [strip for k in range(len(corridor)) if k in (0, len(corridor) - 1)
              for strip in corridor.line.strips(k)]  # fmt: skip
    first, last = (
        np.array([strip.x, strip.y]) + at * np.array([np.cos(strip.azimuth), np.sin(strip.azimuth)])
        for strip, at in ((strips[0], strips[0].low), (strips[-1], strips[-1].high))
    )
    return first, last
