"""Studies: many small trainings, divided into jobs by their seeds (thesis 5.2.7, 5.3)."""


rule study:
    input:
        stores=every("crops", "store"),
        manifests=every("crops", "manifest"),
    output:
        runs=f"{R}/study/{{study_job}}/runs.csv",
        times=f"{R}/study/{{study_job}}/times.csv",
        provenance=f"{R}/study/{{study_job}}/provenance.json",
    log:
        f"{R}/logs/study/{{study_job}}.log",
    benchmark:
        f"{R}/benchmarks/study/{{study_job}}.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=600,
    params:
        job=lambda w: job(
            "study",
            study_settings(STUDY_JOBS[w.study_job][0]) | {"seeds": STUDY_JOBS[w.study_job][1]},
            model=model_settings(settings.study_named(STUDY_JOBS[w.study_job][0]).model),
            voxels=SETTINGS["voxels"],
            split=SETTINGS["split"],
            crops=settings.study_crops,
        ),
    message:
        "Running trainings of the study {wildcards.study_job}"
    script:
        "../scripts/study.py"


rule join_study:
    input:
        runs=lambda w: of_study(w.study, "runs"),
        times=lambda w: of_study(w.study, "times"),
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
        f"{R}/logs/join_study/{{study}}.log",
    benchmark:
        f"{R}/benchmarks/join_study/{{study}}.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=500,
        runtime=5,
    params:
        job=job("join_runs", {}),
    message:
        "Joining the trainings of the study {wildcards.study}"
    script:
        "../scripts/join_runs.py"
