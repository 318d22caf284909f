"""Surveys: making synthetic ones, and checking all."""


rule synthesize:
    output:
        survey=made_for_crops(f"{R}/synthetic/{{synthetic}}.laz"),
        truth=made_for_crops(f"{R}/synthetic/{{synthetic}}.truth.laz"),
        towers=f"{R}/synthetic/{{synthetic}}.towers.geojson",
        provenance=f"{R}/synthetic/{{synthetic}}.provenance.json",
    log:
        f"{R}/logs/synthesize/{{synthetic}}.log",
    benchmark:
        f"{R}/benchmarks/synthesize/{{synthetic}}.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        job=lambda w: job(
            "synthesize",
            synthetic_settings(w.synthetic),
            name=w.synthetic,
            seed=synthetic_settings(w.synthetic)["seed"],
        ),
    message:
        "Making the synthetic survey {wildcards.synthetic}"
    script:
        "../scripts/synthesize.py"


rule check:
    input:
        survey=lambda w: source(w.survey),
    output:
        report=f"{R}/check/{{survey}}/report.json",
        classes=f"{R}/check/{{survey}}/classes.csv",
        provenance=f"{R}/check/{{survey}}/provenance.json",
    log:
        f"{R}/logs/check/{{survey}}.log",
    benchmark:
        f"{R}/benchmarks/check/{{survey}}.tsv"
    wildcard_constraints:
        survey=any_of([*OBSERVE, *WHOLE]),
    priority: 1
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    params:
        job=lambda w: job(
            "check",
            SETTINGS["check"],
            codes=SURVEYS[w.survey].codes,
            input={"survey": source_print(w.survey)},
            **given_system(w.survey),
        ),
    message:
        "Checking {wildcards.survey}"
    script:
        "../scripts/check.py"
