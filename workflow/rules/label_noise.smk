"""Label noise: all models on labels of which a known share is wrong (thesis 5.2.5)."""


rule label_noise:
    output:
        runs=f"{R}/label_noise/seed-{{noise_seed}}.csv",
        times=f"{R}/label_noise/times-seed-{{noise_seed}}.csv",
        provenance=f"{R}/label_noise/seed-{{noise_seed}}.provenance.json",
    log:
        f"{R}/logs/label_noise/seed-{{noise_seed}}.log",
    benchmark:
        f"{R}/benchmarks/label_noise/seed-{{noise_seed}}.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=3000,
        runtime=600,
    params:
        job=lambda w: job(
            "label_noise",
            {name: value for name, value in SETTINGS["label_noise"].items() if name != "seeds"},
            models=[model.model_dump(mode="json") for model in settings.label_noise_models()],
            voxels=SETTINGS["voxels"],
            seed=int(w.noise_seed),
        ),
    message:
        "Training with label noise, seed {wildcards.noise_seed}"
    script:
        "../scripts/label_noise.py"
