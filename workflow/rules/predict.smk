"""Predictions of surveys of one file: classified, with a list of their towers, and with the spans,
conductors and clearances of their lines if an observer of wires predicts as well."""


rule predict:
    input:
        survey=lambda w: source(w.survey),
        model=champion_file(settings.predict.model),
        observers=observer_files(),
        decisions=rejecting,
    output:
        **line_tables(),
        points=f"{R}/predict/{{survey}}/{{survey}}.laz",
        geopackage=f"{R}/predict/{{survey}}/{{survey}}.gpkg",
        geojson=in_report(
            f"{R}/predict/{{survey}}/{{survey}}.towers.geojson",
            "prediction-towers",
            "predictions",
            "Files",
            {"survey": "{survey}", "file": "Towers"},
        ),
        table=f"{R}/predict/{{survey}}/{{survey}}.towers.csv",
        summary=in_report(
            f"{R}/predict/{{survey}}/{{survey}}.summary.json",
            "prediction-summary",
            "predictions",
            "Files",
            {"survey": "{survey}", "file": "Summary"},
        ),
        page=f"{R}/predict/{{survey}}/{{survey}}.html",
        provenance=f"{R}/predict/{{survey}}/provenance.json",
    log:
        f"{R}/logs/predict/{{survey}}.log",
    benchmark:
        f"{R}/benchmarks/predict/{{survey}}.tsv"
    wildcard_constraints:
        survey=any_of(WHOLE),
    conda:
        "../envs/scenenet.yaml"
    threads: 2
    resources:
        mem_mb=4000,
        runtime=240,
    params:
        job=lambda w: job(
            "predict",
            PREDICT,
            detection=SETTINGS["detection"],
            input={"survey": source_print(w.survey)},
            **given_system(w.survey),
            **classes_of(w.survey),
            **rejects_of(w.survey),
        ),
    message:
        "Classifying {wildcards.survey}"
    script:
        "../scripts/predict.py"
