"""Studies: many small trainings in one job each (thesis 5.2.7, 5.3)."""


rule study:
    input:
        stores=every("crops", "store"),
        manifests=every("crops", "manifest"),
    output:
        runs=in_report(
            f"{R}/study/{{study}}/runs.csv",
            "study-runs",
            "studies",
            "Trainings",
            lambda w: {"study": w.study, "asks": title_of_study(w.study)},
        ),
        times=f"{R}/study/{{study}}/times.csv",
        provenance=f"{R}/study/{{study}}/provenance.json",
    log:
        f"{R}/logs/study/{{study}}.log",
    benchmark:
        f"{R}/benchmarks/study/{{study}}.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=600,
    params:
        job=lambda w: job(
            "study",
            study_settings(w.study),
            model=model_settings(settings.study_named(w.study).model),
            voxels=SETTINGS["voxels"],
            split=SETTINGS["split"],
        ),
    message:
        "Running the study {wildcards.study}"
    script:
        "../scripts/study.py"
