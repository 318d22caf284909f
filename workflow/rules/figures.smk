"""Figures: of the data set and the models, of surveys, studies and experiments, and crops in 3D."""


rule figures:
    input:
        stores=every("crops", "store"),
        manifests=every("crops", "manifest"),
        trainings=every("train", "history"),
        records=every("train", "provenance"),
        tunings=every("tune", "tuning"),
        models=every("tune", "model"),
        scores=every("evaluate", "scores"),
        thesis=ancient(own_file(settings.thesis)),
    output:
        **pictures_in_report(dataset_figures()),
        provenance=f"{R}/figures/provenance.json",
    log:
        f"{R}/logs/figures.log",
    benchmark:
        f"{R}/benchmarks/figures.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=30,
    params:
        job=job(
            "figures",
            {},
            results=results_of(predicts=settings.predict.model),
            pictures=[drawing.name for drawing in dataset_figures()],
            input=THESIS,
        ),
    message:
        "Drawing the figures"
    script:
        "../scripts/figures.py"


rule survey_map:
    input:
        survey=lambda w: source(w.survey),
    output:
        **picture_in_report(
            "labels-{survey}",
            "figure-labels",
            "data",
            {"figure": "{survey}, coloured by its labels"},
        ),
        provenance=f"{R}/figures/labels-{{survey}}.provenance.json",
    log:
        f"{R}/logs/survey_map/{{survey}}.log",
    benchmark:
        f"{R}/benchmarks/survey_map/{{survey}}.tsv"
    wildcard_constraints:
        survey=any_of(filter(has_map, OBSERVE)),
    priority: 1
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=30,
    params:
        job=lambda w: job(
            "figures",
            {},
            results=results_of(models=[], surveys=[w.survey]),
            pictures=[f"labels-{w.survey}"],
            source=[w.survey, SURVEYS[w.survey].codes],
            input={"survey": source_print(w.survey)},
        ),
    message:
        "Drawing the labels of {wildcards.survey}"
    script:
        "../scripts/figures.py"


rule tower_map:
    input:
        survey=lambda w: source(w.survey),
        towers=f"{R}/towers/{{survey}}/towers.csv",
        towers_record=f"{R}/towers/{{survey}}/provenance.json",
    output:
        **picture_in_report(
            "clusters-{survey}",
            "figure-clusters",
            "towers",
            {"figure": "Labelled towers of {survey}"},
        ),
        provenance=f"{R}/figures/clusters-{{survey}}.provenance.json",
    log:
        f"{R}/logs/tower_map/{{survey}}.log",
    benchmark:
        f"{R}/benchmarks/tower_map/{{survey}}.tsv"
    wildcard_constraints:
        survey=any_of(filter(has_map, TRAIN)),
    priority: 1
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=30,
    params:
        job=lambda w: job(
            "figures",
            SETTINGS["towers"],
            results=results_of(models=[], surveys=[w.survey]),
            pictures=[f"clusters-{w.survey}"],
            source=[w.survey, SURVEYS[w.survey].codes],
            input={"survey": source_print(w.survey)},
        ),
    message:
        "Drawing the labelled towers of {wildcards.survey}"
    script:
        "../scripts/figures.py"


rule prediction_map:
    input:
        survey=f"{R}/predict/{{survey}}/{{survey}}.laz",
        towers=f"{R}/predict/{{survey}}/{{survey}}.towers.geojson",
        summary=f"{R}/predict/{{survey}}/{{survey}}.summary.json",
    output:
        **picture_in_report(
            "prediction-{survey}",
            "figure-prediction",
            "predictions",
            {"figure": "{survey} classified"},
        ),
        provenance=f"{R}/figures/prediction-{{survey}}.provenance.json",
    log:
        f"{R}/logs/prediction_map/{{survey}}.log",
    benchmark:
        f"{R}/benchmarks/prediction_map/{{survey}}.tsv"
    wildcard_constraints:
        survey=any_of(WHOLE),
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=30,
    params:
        job=lambda w: job(
            "figures",
            {},
            results=results_of(models=[], surveys=[], predicted=[w.survey]),
            pictures=[f"prediction-{w.survey}"],
        ),
    message:
        "Drawing the prediction of {wildcards.survey}"
    script:
        "../scripts/figures.py"


rule study_figure:
    input:
        runs=f"{R}/study/{{study}}/runs.csv",
        thesis=ancient(own_file(settings.thesis)),
    output:
        **picture_in_report(
            "study-{study}",
            "figure-study",
            "studies",
            lambda w: {"study": w.study, "asks": title_of_study(w.study)},
        ),
        provenance=f"{R}/figures/study-{{study}}.provenance.json",
    log:
        f"{R}/logs/study_figure/{{study}}.log",
    benchmark:
        f"{R}/benchmarks/study_figure/{{study}}.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        job=lambda w: job(
            "figures",
            {},
            results=results_of(models=[], surveys=[], studies=[w.study]),
            pictures=[f"study-{w.study}"],
            input=THESIS,
        ),
    message:
        "Drawing the study {wildcards.study}"
    script:
        "../scripts/figures.py"


rule experiment_figure:
    input:
        runs=f"{R}/{{experiment}}/runs.csv",
    output:
        **picture_in_report(
            "{experiment}",
            "figure-experiment",
            "studies",
            lambda w: {"figure": TABLE_TITLES[w.experiment][0]},
        ),
        provenance=f"{R}/figures/{{experiment}}.provenance.json",
    log:
        f"{R}/logs/experiment_figure/{{experiment}}.log",
    benchmark:
        f"{R}/benchmarks/experiment_figure/{{experiment}}.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        job=lambda w: job(
            "figures",
            {},
            results=results_of(models=[], surveys=[], experiments=[w.experiment]),
            pictures=[w.experiment],
        ),
    message:
        "Drawing the experiment {wildcards.experiment}"
    script:
        "../scripts/figures.py"


rule interactive_crop:
    input:
        stores=every("crops", "store"),
        manifests=every("crops", "manifest"),
        scores=each_seed_of(settings.predict.model),
    output:
        crops=[f"{R}/interactive_crop/{rank}.json" for rank in CROP_RANKS],
        provenance=f"{R}/interactive_crop/provenance.json",
    log:
        f"{R}/logs/interactive_crop.log",
    benchmark:
        f"{R}/benchmarks/interactive_crop.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        job=job(
            "interactive_crop",
            SETTINGS["detection"],
            results=results_of(models=[settings.model_named(settings.predict.model)]),
            model=settings.predict.model,
            ranks=list(CROP_RANKS),
        ),
    message:
        "Exporting test crops for the 3D view"
    script:
        "../scripts/interactive_crop.py"
