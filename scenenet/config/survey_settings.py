"""Settings of surveys that need no row in the sheet, and of those that the workflow makes."""

from __future__ import annotations

from pydantic import Field

from scenenet.core.settings import NAME, PathText, Settings
from scenenet.pointcloud.class_schemes import Codes
from scenenet.synthetic.settings import SyntheticSettings


class NewSurveys(Settings):
    """The inbox: surveys that are only classified and need no row in the survey sheet."""

    folder: PathText | None = Field(
        "surveys", description="folder whose LAS and LAZ files are classified; null for no inbox"
    )
    codes: Codes = Field("asprs", description="class scheme of these files, if they have labels")
    reviews: PathText | None = Field(
        "reviews",
        description="folder with what people decided about the towers of new surveys: SURVEY.csv "
        "or SURVEY.gpkg, or several files SURVEY.anything.csv; null for none",
    )


class SyntheticSurvey(SyntheticSettings):
    """A synthetic survey, made as RESULTS_DIR/synthetic/NAME.laz; .las if it is temporary."""

    name: str = Field(pattern=NAME, description="name of its file")


class Synthetic(Settings):
    """Synthetic surveys that the workflow can make; the survey sheet says which are used."""

    surveys: tuple[SyntheticSurvey, ...] = Field(
        (), description="synthetic surveys that the workflow can make"
    )
    temporary: bool = Field(
        False,
        description="delete the files of the synthetic surveys once their crops are cut; they are "
        "made again when a stage has to read them",
    )
