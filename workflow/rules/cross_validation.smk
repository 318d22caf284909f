"""Cross-validation: all models on the same crops, each crop left out once (thesis 5.2.4)."""


rule cross_validation:
    input:
        stores=every("voxels", "store"),
        manifests=every("voxels", "manifest"),
        crop_stores=every("crops", "store"),
        crops=every("crops", "manifest"),
    output:
        runs=f"{R}/cross_validation/{{contender}}/runs.csv",
        times=f"{R}/cross_validation/{{contender}}/times.csv",
        provenance=f"{R}/cross_validation/{{contender}}/provenance.json",
    log:
        f"{R}/logs/cross_validation/{{contender}}.log",
    benchmark:
        f"{R}/benchmarks/cross_validation/{{contender}}.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=600,
    params:
        job=lambda w: job(
            "cross_validation",
            {
                "leave_out": settings.cross_validation.leave_out,
                "neighbour": settings.split.neighbour,
                "detection": SETTINGS["detection"],
            },
            model=CROSS_VALIDATED[w.contender],
            seeds=list(settings.seeds),
        ),
    message:
        "Cross-validating {wildcards.contender}"
    script:
        "../scripts/cross_validation.py"
