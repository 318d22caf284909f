"""From surveys to trained models, tower maps and a report; see docs/development/architecture.md for the way."""

from snakemake.utils import min_version

min_version("9.10")


configfile: "config/studies.yaml"
configfile: "config/config.yaml"


report: "workflow/report/workflow.rst"


include: "workflow/rules/common.smk"
include: "workflow/rules/surveys.smk"
include: "workflow/rules/dataset.smk"
include: "workflow/rules/models.smk"
include: "workflow/rules/predict.smk"
include: "workflow/rules/studies.smk"
include: "workflow/rules/contests.smk"
include: "workflow/rules/tracking.smk"
include: "workflow/rules/report.smk"


# What lies between the surveys and the results stands here as well: Snakemake makes a file that was
# deleted again only where it is asked for, or where something that reads it has to run.
rule all:
    default_target: True
    input:
        config=f"{R}/config.yaml",
        dataset=[*CROPS, *VOXELS],
        trainings=TRAININGS,
        tunings=TUNINGS,
        scores=SCORES,
        tables=[*TABLES, COMPARISON],
        studies=STUDIES,
        contests=CONTEST_RUNS,
        models=[champion_file(model.name) for model in settings.models],
        predictions=expand(f"{R}/predict/{{survey}}/{{survey}}.laz", survey=NEW),
        store=list(STORE.values()),
        runs=[
            f"{R}/mlflow/runs.json",
            f"{R}/mlflow/registry.json",
            *TRACKED_STUDIES,
            *TRACKED_CONTESTS,
        ],
        report=f"{R}/report/index.html",
    message:
        "All results are there"


onsuccess:
    print_scores()
