"""The page with every table and figure, and all settings of the run."""


rule resolved_config:
    output:
        config=in_report(
            f"{R}/config.yaml",
            "settings",
            "record",
            "Files",
            {"file": "All settings"},
        ),
    log:
        f"{R}/logs/resolved_config.log",
    benchmark:
        f"{R}/benchmarks/resolved_config.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=500,
        runtime=5,
    params:
        job=job("resolved_config", SETTINGS),
    message:
        "Writing all settings of this run to a file"
    script:
        "../scripts/resolved_config.py"


rule report:
    input:
        crops=every("interactive_crop", "crops"),
        tables=[
            *every("dataset_tables", "tables"),
            *every("tables", "tables"),
            *every("tables", "comparisons"),
        ],
        pictures=every_picture("pictures"),
        captions=every_picture("captions"),
        scores=every("evaluate", "scores"),
        tunings=every("tune", "tuning"),
        models=every("tune", "model"),
        observers=[
            *every("tune_observer", "model"),
            *every("evaluate_observer", "scores"),
        ],
        certificates=every("certificate", "certificate"),
        checks=every("check", "report"),
        towers=every_prediction("geojson"),
        summaries=every_prediction("summary"),
        pages=every_prediction("page"),
        reviews=every("review", "record"),
        lines=[
            file
            for name in line_tables()
            if name != "conductors"
            for file in every_prediction(name)
        ],
        records=every_record(),
        thesis=ancient(own_file(settings.thesis)),
    output:
        report=in_report(
            f"{R}/report/index.html",
            "page",
            "page",
            "Files",
            {"file": "Report page"},
        ),
        provenance=f"{R}/report/provenance.json",
    log:
        f"{R}/logs/report.log",
    benchmark:
        f"{R}/benchmarks/report.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        job=job(
            "report",
            {},
            results=all_results(),
            input=THESIS,
            **({"failed": FAILED} if FAILED else {}),
        ),
    message:
        "Writing the report"
    script:
        "../scripts/report.py"
