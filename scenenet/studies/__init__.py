"""The studies of thesis 5.2.7 and 5.3: many small trainings that differ in one thing.

- ``settings``: what a study varies.
- ``run``: its trainings, one after the other, and their scores.
- ``summary``: mean and spread over seeds, the thesis' numbers beside.
- ``findings``: what came out, in a sentence or two.
"""

from __future__ import annotations

from scenenet.studies.settings import StudySettings, Variant

__all__ = ["StudySettings", "Variant"]
