"""What ``snakemake --report`` shows of a result: caption, category and labels.

Nothing here decides on a result: a caption or a label that is changed reruns nothing.
"""

CAPTIONS = Path(workflow.basedir) / "workflow" / "report"

# Numbered, because the report sorts them by name; the order is that of the page.
CATEGORIES = {
    "page": "1 Page",
    "models": "2 Models",
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

# Stem of a table -> what it is called, and the section of the page that it belongs to.
TABLE_TITLES = {
    "models": ("Scores of each model", "models"),
    "seeds": ("Scores of each seed", "models"),
    "whole_towers": ("Voxels that reach tau, and whole towers", "models"),
    "tower_scores": ("Towers found", "models"),
    "times": ("Times", "models"),
    "parameters": ("Learned numbers in metres", "learned"),
    "certificate": ("What is certain about a model", "learned"),
    "certificate_turns": ("Answers when the scene is turned", "learned"),
    "thesis_and_ours": ("The thesis and ours", "models"),
    "cross_validation": ("Every crop a test crop once", "models"),
    "noise": ("Trained on wrong labels", "studies"),
    "classes": ("Points of each class", "data"),
    "towers": ("Labelled towers", "data"),
    "voxelisation": ("Voxelisation", "data"),
}


def shown(file, caption, section, group, labels):
    """An output that the report shows. Captions are looked for from the folder of the rules; a
    kind without one of its own gets that of its group."""
    own = caption if (CAPTIONS / f"{caption}.rst").exists() else group[:-1].lower()
    return report(
        file,
        caption=f"../report/{own}.rst",
        category=CATEGORIES.get(section, section.capitalize()),
        subcategory=group,
        labels=labels,
    )


def shown_model(file):
    return shown(file, "model", "models", "Files", {"model": "{model}"})


def shown_tables(files):
    return [shown_table(file) for file in files]


def shown_table(file):
    stem = Path(file).stem
    study = stem.removeprefix("study-")
    if stem in TABLE_TITLES:
        title, section = TABLE_TITLES[stem]
        return shown(file, f"table-{stem}", section, "Tables", {"table": title})
    if study in STUDIED:
        labels = {"study": study, "asks": title_of_study(study)}
        return shown(file, "table-study", "studies", "Tables", labels)
    return shown(file, "table", "models", "Tables", {"table": stem.replace("_", " ")})


def shown_pictures(planned):
    """As ``pictures``, for the output of a rule that draws what ``planned`` says."""
    return {
        "pictures": [
            shown(
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


def shown_picture(kind, section, labels):
    """As ``pictures``, for a rule that draws one picture of a survey or of a study."""
    wildcard = "study" if kind == "study" else "survey"
    name = f"{kind}-{{{wildcard}}}"
    return {
        "pictures": [
            shown(f"{R}/figures/{name}.png", f"figure-{kind}", section, "Figures", labels)
        ],
        "captions": [f"{R}/figures/{name}.json"],
    }


def title_of_study(study):
    return settings.study_named(study).title


def kind_of(drawing):
    """``training-scenenet`` and ``crop-best`` are of the kinds ``training`` and ``crop``."""
    endings = [*drawing.models, *CROP_RANKS]
    found = [name for name in endings if drawing.name.endswith(f"-{name}")]
    return drawing.name.removesuffix(f"-{max(found, key=len)}") if found else drawing.name
