"""What ``snakemake --report`` shows of a result: caption, category and labels.

Nothing here decides on a result: after a change of a caption or of a label nothing runs again.
"""

from scenenet.results.tables import table_titles

# Numbered, because the report sorts them by name; the order is that of the page.
CATEGORIES = {
    "page": "1 Page",
    "thesis": "2 Models",
    "models": "2 Models",
    "observers": "2 Models",
    "learned": "2 Models",
    "training": "2 Models",
    "crops": "2 Models",
    "predictions": "3 New surveys",
    "studies": "4 Studies",
    "data": "5 Data",
    "towers": "5 Data",
    "voxels": "5 Data",
    "record": "6 How it was made",
}

# Stem of a table -> its title, and the section of the page that it belongs to.
TABLE_TITLES = table_titles()


def in_report(file, caption, section, group, labels):
    """An output that the report shows.

    Args:
        file: the output.
        caption: stem of its text in workflow/report; that of its group is used if there is none.
        section: section of the page, or a function from wildcards to it.
        group: Page, Files, Tables, Figures or Trainings.
        labels: what the list of results says of it, or a function from wildcards to that.
    """
    own = caption if (WORKFLOW / "report" / f"{caption}.rst").exists() else group[:-1].lower()
    return report(
        file,
        caption=f"../report/{own}.rst",
        category=category_of(section),
        subcategory=group,
        labels=labels,
    )


def category_of(section):
    if callable(section):
        return lambda w: category_of(section(w))
    return CATEGORIES.get(section, section.capitalize())


def table_in_report(file):
    stem = Path(file).stem
    study = stem.removeprefix("study-")
    if stem in TABLE_TITLES:
        title, section = TABLE_TITLES[stem]
        return in_report(file, f"table-{stem}", section, "Tables", {"table": title})
    if study in VALUES["study"]:
        labels = {"study": study, "asks": title_of_study(study)}
        return in_report(file, "table-study", "studies", "Tables", labels)
    return in_report(file, "table", "models", "Tables", {"table": stem.replace("_", " ")})


def pictures_in_report(planned):
    """As ``pictures``, for the output of a rule that draws what ``planned`` says."""
    return {
        "pictures": [
            in_report(
                f"{R}/figures/{drawing.name}.png",
                f"figure-{kind_of(drawing)}",
                drawing.section,
                "Figures",
                {"figure": drawing.title},
            )
            for drawing in planned
        ],
        "captions": [f"{R}/figures/{drawing.name}.json" for drawing in planned],
    }


def picture_in_report(name, caption, section, labels):
    """As ``pictures``, for the output of a rule that draws one picture for each value of a
    wildcard."""
    picture = in_report(f"{R}/figures/{name}.png", caption, section, "Figures", labels)
    return {"pictures": [picture], "captions": [f"{R}/figures/{name}.json"]}


def title_of_study(study):
    return settings.study_named(study).title


def kind_of(drawing):
    """``training-scenenet`` and ``crop-best`` are of the kinds ``training`` and ``crop``."""
    endings = [*drawing.models, *CROP_RANKS]
    found = [name for name in endings if drawing.name.endswith(f"-{name}")]
    return drawing.name.removesuffix(f"-{max(found, key=len)}") if found else drawing.name
