"""The clearances of the lines of a survey, from the points that its prediction keeps on disk."""

from __future__ import annotations

from scenenet.clearance.find_clearances import find_clearances
from scenenet.clearance.records import SurveyClearances
from scenenet.clearance.settings import ClearanceSettings
from scenenet.line.records import SurveyLine
from scenenet.pointcloud.class_schemes import ClassScheme
from scenenet.prediction.area_points import AreaLookUp, WireVoxels
from scenenet.prediction.work.structures import Structures
from scenenet.prediction.work.tiling import TileSpool


def find_clearances_in_survey(
    spool: TileSpool,
    line: SurveyLine,
    structures: Structures,
    wires: WireVoxels,
    settings: ClearanceSettings,
    scheme: ClassScheme | None = None,
    progress: str | None = None,
) -> SurveyClearances:
    """What is near the conductors of a survey. Memory is bounded by a section of a span.

    Args:
        spool: the points of all its files.
        line: its lines.
        structures: the shapes of its towers; their points are not obstacles.
        wires: where the model of wires found them. Points there are no obstacles if they are at a
            tower or run along the span: they are of jumpers, or of conductors that were not traced.
        scheme: of the class codes, which ``spool`` then keeps; None where the height above ground
            says what points are. Points with the class of noise are no obstacles in either case.
        progress: label of the progress on stderr; None shows no progress.

    Raises:
        InputError: the limits have none for the voltage.
    """
    points = AreaLookUp(spool, structures, wires)
    return find_clearances(line, points.obstacles, settings, scheme, progress)
