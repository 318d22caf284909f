"""What a page holds at most, however large its survey is."""

from __future__ import annotations

from dataclasses import dataclass

MOST_BYTES = 20_000_000
"""Bytes of a page, at most."""

PICTURE_BYTES = 12_000_000
"""Bytes of the points in all pictures of a page. With more of them each has fewer points."""

TEXT_BYTES = 6_500_000
"""Bytes of what a page says of towers and spans, in lists, on the map and beside the pictures."""

TOWER_BYTES, SPAN_BYTES = 1600, 3500
"""Bytes of what it says of a tower and of a span."""

OWN_POINTS, OTHER_POINTS, SPAN_POINTS = 1200, 1800, 6000
"""Most points of a tower, of its surroundings, and around a span in a picture."""

POINT_BYTES = 8
"""Bytes of a point in the page: three numbers of two bytes as base64."""

MOST_FILES = 1000
"""Most files in the table and on the map of a page."""

MOST_PLACES = 20
"""Most places closer than the limit that a page shows of a span."""

MOST_MARKS = 5000
"""Most places closer than the limit, and most trees, on the map."""


@dataclass(frozen=True)
class PageBudget:
    """How much of a survey its page holds.

    Attributes:
        towers, spans: how many of them it lists.
        share: share of the points of a full picture that each picture has.
    """

    towers: int
    spans: int
    share: float

    @classmethod
    def of(cls, n_towers: int, n_spans: int) -> PageBudget:
        """Of a survey with so many towers and spans.

        Of both, the same share is listed, and each that is listed has a picture.
        """
        text = n_towers * TOWER_BYTES + n_spans * SPAN_BYTES
        listed = min(1.0, TEXT_BYTES / max(text, 1))
        towers, spans = int(listed * n_towers), int(listed * n_spans)
        points = towers * (OWN_POINTS + OTHER_POINTS) + spans * SPAN_POINTS
        share = min(1.0, PICTURE_BYTES / max(points * POINT_BYTES, 1))
        return cls(towers, spans, share)

    def points(self, full: int) -> int:
        """Most points of a picture that would have ``full``."""
        return max(1, int(self.share * full))
