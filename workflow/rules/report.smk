"""Tables, figures, the page, and all settings of the run."""


rule resolved_config:
    output:
        config=shown(f"{R}/config.yaml", "settings", "record", "Files", {"file": "All settings"}),
    log:
        f"{R}/logs/resolved_config.log",
    benchmark:
        f"{R}/benchmarks/resolved_config.tsv"
    threads: 1
    resources:
        mem_mb=500,
        runtime=5,
    params:
        job=job("resolved_config", SETTINGS),
    message:
        "Writing down all settings of this run"
    script:
        "../scripts/resolved_config.py"


rule tables:
    input:
        checks=CLASS_COUNTS,
        towers=expand(f"{R}/towers/{{survey}}/towers.csv", survey=TRAIN),
        grids=f"{R}/times/grids.csv",
        split=f"{R}/split/split.csv",
        trainings=TRAININGS,
        resources=RESOURCES,
        tunings=TUNINGS,
        scores=SCORES,
        studies=STUDIES,
        contests=CONTEST_RUNS,
        black_box=[*BOOSTED_TREES, BLACK_BOX_TIMES],
        certificates=CERTIFICATES,
        times=TIMES,
        thesis=ancient(settings.thesis),
    output:
        tables=shown_tables(TABLES),
        comparison=shown_table(COMPARISON),
        provenance=f"{R}/tables/provenance.json",
    log:
        f"{R}/logs/tables.log",
    benchmark:
        f"{R}/benchmarks/tables.tsv"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        job=job("tables", {}, results=gathered(studies=STUDIED, contests=CONTESTS), input=THESIS),
    message:
        "Writing the tables"
    script:
        "../scripts/tables.py"


rule figures:
    input:
        stores=CROP_STORES,
        manifests=CROP_MANIFESTS,
        trainings=TRAININGS,
        tunings=TUNINGS,
        scores=SCORES,
        thesis=ancient(settings.thesis),
    output:
        **shown_pictures(_planned),
        provenance=f"{R}/figures/provenance.json",
    log:
        f"{R}/logs/figures.log",
    benchmark:
        f"{R}/benchmarks/figures.tsv"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=30,
    params:
        job=job(
            "figures",
            {},
            results=gathered(predicts=settings.predict.model),
            pictures=FIGURES,
            sources={},
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
        **shown_picture("labels", "data", {"figure": "{survey}, coloured by its labels"}),
        provenance=f"{R}/figures/labels-{{survey}}.provenance.json",
    log:
        f"{R}/logs/survey_map/{{survey}}.log",
    benchmark:
        f"{R}/benchmarks/survey_map/{{survey}}.tsv"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=30,
    params:
        job=lambda w: job(
            "figures",
            {},
            results=gathered(models=[], surveys=[w.survey]),
            pictures=[f"labels-{w.survey}"],
            sources={w.survey: [SURVEYS[w.survey].path, SURVEYS[w.survey].codes]},
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
    output:
        **shown_picture("clusters", "towers", {"figure": "Towers of {survey} told apart"}),
        provenance=f"{R}/figures/clusters-{{survey}}.provenance.json",
    log:
        f"{R}/logs/tower_map/{{survey}}.log",
    benchmark:
        f"{R}/benchmarks/tower_map/{{survey}}.tsv"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=30,
    params:
        job=lambda w: job(
            "figures",
            SETTINGS["towers"],
            results=gathered(models=[], surveys=[w.survey]),
            pictures=[f"clusters-{w.survey}"],
            sources={w.survey: [SURVEYS[w.survey].path, SURVEYS[w.survey].codes]},
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
        **shown_picture("prediction", "predictions", {"figure": "{survey} classified"}),
        provenance=f"{R}/figures/prediction-{{survey}}.provenance.json",
    log:
        f"{R}/logs/prediction_map/{{survey}}.log",
    benchmark:
        f"{R}/benchmarks/prediction_map/{{survey}}.tsv"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=30,
    params:
        job=lambda w: job(
            "figures",
            {},
            results=gathered(models=[], surveys=[], predicted=[w.survey]),
            pictures=[f"prediction-{w.survey}"],
            sources={},
        ),
    message:
        "Drawing the prediction of {wildcards.survey}"
    script:
        "../scripts/figures.py"


rule study_figure:
    input:
        runs=f"{R}/studies/{{study}}/runs.csv",
        thesis=ancient(settings.thesis),
    output:
        **shown_picture(
            "study", "studies", lambda w: {"study": w.study, "asks": title_of_study(w.study)}
        ),
        provenance=f"{R}/figures/study-{{study}}.provenance.json",
    log:
        f"{R}/logs/study_figure/{{study}}.log",
    benchmark:
        f"{R}/benchmarks/study_figure/{{study}}.tsv"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        job=lambda w: job(
            "figures",
            {},
            results=gathered(models=[], surveys=[], studies=[w.study]),
            pictures=[f"study-{w.study}"],
            sources={},
            input=THESIS,
        ),
    message:
        "Drawing the study {wildcards.study}"
    script:
        "../scripts/figures.py"


rule scene:
    input:
        stores=CROP_STORES,
        manifests=CROP_MANIFESTS,
        scores=each_seed_of(settings.predict.model),
    output:
        scene=f"{R}/scenes/{{rank}}.json",
        provenance=f"{R}/scenes/{{rank}}.provenance.json",
    log:
        f"{R}/logs/scene/{{rank}}.log",
    benchmark:
        f"{R}/benchmarks/scene/{{rank}}.tsv"
    wildcard_constraints:
        rank=any_of(CROP_RANKS),
    threads: 1
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        job=lambda w: job(
            "scene",
            SETTINGS["detection"],
            results=gathered(models=[settings.model_named(settings.predict.model)]),
            model=settings.predict.model,
            rank=w.rank,
        ),
    message:
        "Making the {wildcards.rank} test crop ready to be turned"
    script:
        "../scripts/scene.py"


rule report:
    input:
        scenes=SCENES,
        tables=[*TABLES, COMPARISON],
        pictures=[file for names in pictures(ALL_PICTURES).values() for file in names],
        scores=SCORES,
        tunings=TUNINGS,
        certificates=CERTIFICATES,
        checks=expand(f"{R}/check/{{survey}}/report.json", survey=CHECKED),
        predictions=expand(
            f"{R}/predict/{{survey}}/{{survey}}.{{part}}",
            survey=NEW,
            part=["towers.geojson", "summary.json"],
        ),
        records=RECORDS,
        thesis=ancient(settings.thesis),
    output:
        report=shown(f"{R}/report/index.html", "page", "page", "Files", {"file": "The page, whole"}),
        provenance=f"{R}/report/provenance.json",
    log:
        f"{R}/logs/report.log",
    benchmark:
        f"{R}/benchmarks/report.tsv"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        job=job(
            "report",
            {},
            results=gathered(
                surveys=TRAIN,
                predicted=NEW,
                studies=STUDIED,
                contests=CONTESTS,
                predicts=settings.predict.model,
            ),
            input=THESIS,
        ),
    message:
        "Writing the report"
    script:
        "../scripts/report.py"
