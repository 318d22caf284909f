"""Settings of the experiment that takes the method apart."""

from __future__ import annotations

from pydantic import Field

from scenenet.core.settings import Settings

WITHOUT, WITH, ITS_OWN = "without rules", "with rules", "its own"
"""Values of the column `rules`: the voxels at or above tau as they are; the answer of ``scenenet
predict``; an answer without probabilities, to which the rules do not apply."""

NOTHING = "nothing"
"""Name of the trivial answer that there is no tower."""
RULES_ALONE = "rules alone"
"""Name of the source in which every occupied voxel is a candidate."""
RANDOM = "random parameters"
"""Name of an untrained model, with tau chosen as for a trained one."""
PUBLISHED = "published weights"
"""Name of the model of ``scenenet.models.published_weights``."""
SHAPE_PRIORS = "shape priors"
"""Name of the method of ``scenenet.baselines.shape_priors``."""
HIGH_M = 3.0
"""m above the ground; every point above it is a trivial answer."""
HIGH = f"points above {HIGH_M:g} m"
"""Name of that answer."""


class ComponentsSettings(Settings):
    """What the rules, the model and its training are worth, each without the others."""

    run: bool = Field(
        False,
        description="score rules alone, random and published parameters, trivial answers and a "
        "method without training beside every model, with and without rules: on the crops that "
        "cross_validation.leave_out leaves out, or else on the test part",
    )
