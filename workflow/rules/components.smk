"""Who does the work: rules alone, models alone, and both (thesis 5.2.4)."""


rule components:
    input:
        models=trained_for_components,
        stores=every("voxels", "store"),
        manifests=every("voxels", "manifest"),
        crop_stores=every("crops", "store"),
        crops=every("crops", "manifest"),
        split=f"{R}/split/split.csv",
    output:
        runs=f"{R}/components/{{component}}/runs.csv",
        times=f"{R}/components/{{component}}/times.csv",
        provenance=f"{R}/components/{{component}}/provenance.json",
    log:
        f"{R}/logs/components/{{component}}.log",
    benchmark:
        f"{R}/benchmarks/components/{{component}}.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=600,
    params:
        job=lambda w: job(
            "components",
            {
                "leave_out": settings.cross_validation.leave_out,
                "neighbour": settings.split.neighbour,
                "detection": SETTINGS["detection"],
            },
            trained=w.component != WITHOUT_TRAINING,
            model=COMPONENTS[w.component],
            seeds=list(settings.seeds),
        ),
    message:
        "Taking apart {wildcards.component}"
    script:
        "../scripts/components.py"
