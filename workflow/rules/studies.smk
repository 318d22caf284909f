"""Studies: many small trainings in one job each (thesis 5.2.7, 5.3)."""


rule study:
    input:
        stores=CROP_STORES,
        manifests=CROP_MANIFESTS,
    output:
        runs=shown(
            f"{R}/studies/{{study}}/runs.csv",
            "study-runs",
            "studies",
            "Trainings",
            lambda w: {"study": w.study, "asks": title_of_study(w.study)},
        ),
        provenance=f"{R}/studies/{{study}}/provenance.json",
    log:
        f"{R}/logs/study/{{study}}.log",
    benchmark:
        f"{R}/benchmarks/study/{{study}}.tsv"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=600,
    params:
        job=lambda w: job(
            "study",
            settings.study_named(w.study).model_dump(mode="json"),
            model=model_settings(settings.study_named(w.study).model),
            voxels=SETTINGS["voxels"],
            split=SETTINGS["split"],
        ),
    message:
        "Study {wildcards.study}"
    script:
        "../scripts/study.py"
