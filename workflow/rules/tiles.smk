"""Predictions of surveys of many tiles, tile by tile: read, predict, search, write.

A job knows its tile and the neighbours of that, so a new tile makes these again, and the list.
"""


rule voxel_size:
    input:
        model=champion_file(settings.predict.model),
    output:
        voxel_size=f"{R}/predict/voxel_size.json",
        provenance=f"{R}/predict/provenance.json",
    log:
        f"{R}/logs/voxel_size.log",
    benchmark:
        f"{R}/benchmarks/voxel_size.tsv"
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        job=job("voxel_size", {"voxel_size": PREDICT["voxel_size"]}),
    message:
        "Looking up the voxel size of the model that predicts"
    script:
        "../scripts/voxel_size.py"


rule read_tile:
    input:
        tile=lambda w: ancient(local(tile_of(w).path)),
        voxel_size=f"{R}/predict/voxel_size.json",
    output:
        work=f"{R}/predict/{{survey}}/work/{{tile}}.work",
    log:
        f"{R}/logs/read_tile/{{survey}}/{{tile}}.log",
    benchmark:
        f"{R}/benchmarks/read_tile/{{survey}}/{{tile}}.tsv"
    wildcard_constraints:
        survey=any_of(TILED),
    retries: 1
    group:
        together("read_tile")
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=megabytes(1000, 2),
        runtime=20,
    params:
        job=lambda w: job(
            "read_tile",
            {"chunk_points": PREDICT["chunk_points"]},
            name=tile_of(w).name,
            planned=tile_of(w).box,
            input={"tile": tile_of(w).known},
            **given_system(w.survey),
        ),
    message:
        "Reading tile {wildcards.tile} of {wildcards.survey}"
    script:
        "../scripts/read_tile.py"


if DENSITY:

    rule fullest_voxel:
        input:
            works=work_files("work"),
            model=champion_file(settings.predict.model),
        output:
            fullest=f"{R}/predict/{{survey}}/work/fullest.json",
        log:
            f"{R}/logs/fullest_voxel/{{survey}}.log",
        benchmark:
            f"{R}/benchmarks/fullest_voxel/{{survey}}.tsv"
        wildcard_constraints:
            survey=any_of(TILED),
        conda:
            "../envs/scenenet.yaml"
        threads: 1
        resources:
            mem_mb=2000,
            runtime=60,
        params:
            job=lambda w: job("fullest_voxel", {}, survey=PLANS[w.survey].survey.to_json()),
        message:
            "Counting the points in the fullest voxel of {wildcards.survey}"
        script:
            "../scripts/fullest_voxel.py"


rule predict_tile:
    input:
        work=f"{R}/predict/{{survey}}/work/{{tile}}.work",
        neighbours=lambda w: [
            f"{R}/predict/{w.survey}/work/{tile}.work" for tile in tile_of(w).neighbours
        ],
        model=champion_file(settings.predict.model),
        fullest=fullest_file,
    output:
        predictions=f"{R}/predict/{{survey}}/work/{{tile}}.predictions",
    log:
        f"{R}/logs/predict_tile/{{survey}}/{{tile}}.log",
    benchmark:
        f"{R}/benchmarks/predict_tile/{{survey}}/{{tile}}.tsv"
    wildcard_constraints:
        survey=any_of(TILED),
    retries: 1
    group:
        together("predict_tile")
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=megabytes(1500, 1),
        runtime=20,
    params:
        job=job("predict_tile", {}, within=NEIGHBOURS_M),
    message:
        "Predicting tile {wildcards.tile} of {wildcards.survey}"
    script:
        "../scripts/predict_tile.py"


checkpoint find_towers:
    input:
        works=work_files("work"),
        predictions=work_files("predictions"),
        model=champion_file(settings.predict.model),
    output:
        towers=f"{R}/predict/{{survey}}/work/towers.json",
        near=directory(f"{R}/predict/{{survey}}/near"),
    log:
        f"{R}/logs/find_towers/{{survey}}.log",
    benchmark:
        f"{R}/benchmarks/find_towers/{{survey}}.tsv"
    wildcard_constraints:
        survey=any_of(TILED),
    conda:
        "../envs/scenenet.yaml"
    threads: 2
    resources:
        mem_mb=megabytes(3000, 0.1),
        runtime=480,
    params:
        job=lambda w: job(
            "find_towers", SETTINGS["detection"], survey=PLANS[w.survey].survey.to_json()
        ),
    message:
        "Finding the towers of {wildcards.survey}"
    script:
        "../scripts/find_towers.py"


# The towers that reach into a tile are a small file, which Snakemake compares by its content. It is
# no output of a rule, but within one: else each tile would be written again whenever towers are found.
rule write_tile:
    input:
        tile=lambda w: ancient(local(tile_of(w).path)),
        work=f"{R}/predict/{{survey}}/work/{{tile}}.work",
        predictions=f"{R}/predict/{{survey}}/work/{{tile}}.predictions",
        near=near_tile,
    output:
        points=f"{R}/predict/{{survey}}/{{survey}}/{{tile}}.laz",
        record=f"{R}/predict/{{survey}}/work/{{tile}}.written.json",
    log:
        f"{R}/logs/write_tile/{{survey}}/{{tile}}.log",
    benchmark:
        f"{R}/benchmarks/write_tile/{{survey}}/{{tile}}.tsv"
    wildcard_constraints:
        survey=any_of(TILED),
    retries: 1
    group:
        together("write_tile")
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=megabytes(1000, 2),
        runtime=20,
    params:
        job=lambda w: job(
            "write_tile",
            PREDICT,
            input={"tile": tile_of(w).known},
            **given_system(w.survey),
        ),
    message:
        "Writing tile {wildcards.tile} of {wildcards.survey}"
    script:
        "../scripts/write_tile.py"


rule survey_lists:
    input:
        works=work_files("work"),
        predictions=work_files("predictions"),
        towers=f"{R}/predict/{{survey}}/work/towers.json",
        points=lambda w: [
            f"{R}/predict/{w.survey}/{w.survey}/{t}.laz" for t in written_tiles(w.survey)
        ],
        written=lambda w: [
            f"{R}/predict/{w.survey}/work/{tile}.written.json" for tile in written_tiles(w.survey)
        ],
        model=champion_file(settings.predict.model),
    output:
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
        status=f"{R}/predict/{{survey}}/{{survey}}/status.csv",
        provenance=f"{R}/predict/{{survey}}/provenance.json",
    log:
        f"{R}/logs/survey_lists/{{survey}}.log",
    benchmark:
        f"{R}/benchmarks/survey_lists/{{survey}}.tsv"
    wildcard_constraints:
        survey=any_of(TILED),
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=megabytes(2000, 0.1),
        runtime=120,
    params:
        job=lambda w: job(
            "survey_lists",
            PREDICT,
            detection=SETTINGS["detection"],
            survey=PLANS[w.survey].survey.to_json(),
            input={"survey": [tile.known for tile in PLANS[w.survey].tiles.values()]},
        ),
    message:
        "Writing the lists of {wildcards.survey}"
    script:
        "../scripts/survey_lists.py"


# It fails at the end where a tile is not predicted, so that the call of snakemake fails. Nothing
# depends on it: the report is complete, with these tiles in it.
rule survey_complete:
    input:
        summary=f"{R}/predict/{{survey}}/{{survey}}.summary.json",
        status=f"{R}/predict/{{survey}}/{{survey}}/status.csv",
    output:
        complete=f"{R}/predict/{{survey}}/complete.json",
    log:
        f"{R}/logs/survey_complete/{{survey}}.log",
    benchmark:
        f"{R}/benchmarks/survey_complete/{{survey}}.tsv"
    wildcard_constraints:
        survey=any_of(TILED),
    priority: -1
    conda:
        "../envs/scenenet.yaml"
    threads: 1
    resources:
        mem_mb=500,
        runtime=5,
    params:
        job=job("survey_complete", {}),
    message:
        "Looking whether all tiles of {wildcards.survey} are predicted"
    script:
        "../scripts/survey_complete.py"
