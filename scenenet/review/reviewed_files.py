"""A reviewed tower list as files, in the formats of the tower list of a prediction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scenenet.line.records import CONDUCTOR_COLUMNS
from scenenet.pointcloud.class_schemes import ClassScheme
from scenenet.prediction import line_lists
from scenenet.prediction.styles import STYLES
from scenenet.prediction.tower_lists import (
    add_styles,
    arrays,
    write_csv,
    write_geojson,
    write_layer,
    write_tower_layer,
)
from scenenet.review.conductors import ConductorReview, ReviewedConductor
from scenenet.review.found_list import REVIEWED, FoundList
from scenenet.review.labels.labelled_survey import LabelFiles, write_labels
from scenenet.review.merge import Review
from scenenet.review.record import RecordedFiles
from scenenet.review.reviewed_tower import REVIEW_COLUMNS

REJECTED = "rejected"
"""Layer with the towers that were rejected, and what follows the name of the survey in its file."""


@dataclass(frozen=True)
class Labelling:
    """How a review becomes labels.

    Attributes:
        files: to write.
        scheme: of the class codes.
        accept_rest: whether towers without a decision are labelled too.
    """

    files: LabelFiles
    scheme: ClassScheme
    accept_rest: bool


@dataclass(frozen=True)
class ReviewedFiles:
    """The files of a review.

    Attributes:
        table, geojson, geopackage: the towers that were not rejected; the GeoPackage has the
            others in a layer ``REJECTED``, and the conductors of the line in two more.
        rejected: the others (CSV).
        record: the result as JSON.
        labelling: of the survey; None for no labels.
    """

    table: Path
    geojson: Path
    geopackage: Path
    rejected: Path
    record: Path
    labelling: Labelling | None = None

    @classmethod
    def of(cls, found: FoundList, folder: Path, labelling: Labelling | None) -> ReviewedFiles:
        """The files for a tower list in a folder."""
        table, geojson, package, record = (
            folder / f"{found.name}{REVIEWED}{ending}"
            for ending in (".csv", ".geojson", ".gpkg", ".json")
        )
        rejected = folder / f"{found.name}.{REJECTED}.csv"
        return cls(table, geojson, package, rejected, record, labelling)

    @property
    def recorded(self) -> RecordedFiles:
        """All of them, with their record."""
        lists = [self.table, self.geojson, self.geopackage, self.rejected]
        labels = [] if self.labelling is None else list(self.labelling.files.files.values())
        return RecordedFiles(self.record, [*lists, *labels])


def write_review(
    review: Review, found: FoundList, decisions: Sequence[Path], files: ReviewedFiles
) -> dict[str, Any]:
    """Write a reviewed list, and the survey with its labels.

    Args:
        decisions: the review files, for the record.

    Returns:
        the result as plain values, as in the record.

    Raises:
        InputError: the points cannot be labelled.
        OutputError: a file cannot be written.
    """
    result: dict[str, Any] = {
        "found": str(found.path),
        "decisions": [str(path) for path in decisions],
        "counts": review.counts(),
        "conductors": None if review.conductors is None else review.conductors.counts(),
        "unmatched": list(review.unmatched),
        "undecided_rows": review.undecided,
        "warnings": list(review.warnings),
        "labels": None,
    }
    with files.recorded.writing(result) as partial:
        if files.labelling is not None:
            labelling = files.labelling
            labelled = write_labels(
                review, found, labelling.files, partial, labelling.scheme,
                accept_rest=labelling.accept_rest,
            )  # fmt: skip
            review = labelled.review
            result["labels"] = {
                "files": [str(path) for path in labelling.files.files.values()],
                "codes": labelling.scheme.name,
                "tower_points": labelled.tower_points,
                "without_body": list(labelled.unmeasured),
            }
        _write_lists(review, found, files, partial)
    return result


def _write_lists(
    review: Review, found: FoundList, files: ReviewedFiles, partial: Mapping[Path, Path]
) -> None:
    columns = {**found.columns, **REVIEW_COLUMNS}
    kept, rejected = review.kept, review.decided("rejected")
    write_csv(partial[files.table], kept, columns)
    write_csv(partial[files.rejected], rejected, columns)
    write_geojson(partial[files.geojson], kept, found.crs, found.unit_sizes)
    package = partial[files.geopackage]
    write_tower_layer(package, "towers", kept, columns, found.crs)
    write_tower_layer(package, REJECTED, rejected, columns, found.crs)
    layers = ["towers"]
    if review.conductors is not None:
        layers += _write_conductors(review.conductors, found, package)
    add_styles(package, layers, STYLES)


def _write_conductors(review: ConductorReview, found: FoundList, package: Path) -> list[str]:
    """Add the layers of the conductors that were not rejected, and of the others; their names."""
    import shapely

    columns = {c.name: c.type for c in CONDUCTOR_COLUMNS} | REVIEW_COLUMNS
    parts: dict[str, list[ReviewedConductor]] = {
        line_lists.CONDUCTORS: review.decided("accepted", "not reviewed"),
        line_lists.REJECTED: review.decided("rejected"),
    }
    for name, rows in parts.items():
        values = {c: [row.to_row().get(c) for row in rows] for c in columns}
        along = [shapely.LineString(row.listed.xyz) for row in rows]
        write_layer(package, name, "LineString Z", along, arrays(values, columns), found.crs)
    return list(parts)
