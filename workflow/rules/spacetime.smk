# New motions from old: footprints, the warped baseline, and synthesis by least energy.


rule footprints:
    input:
        unpack(lambda wildcards: synthesis_motions(SYNTHESES[wildcards.synthesis])),
    output:
        table=RESULTS / "footprints/{synthesis}.tsv",
        status=RESULTS / "footprints/{synthesis}.json",
        svg=RESULTS / "footprints/{synthesis}.svg",
        png=RESULTS / "footprints/{synthesis}.png",
    log:
        LOGS / "footprints/{synthesis}.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("body", "motion", "spacetime", "figures/footprints.py", "figures/style.py"),
        sheet=CONFIG["syntheses"],
        row=lambda wildcards: synthesis_text(wildcards.synthesis),
    script:
        "../scripts/footprints.py"


rule warp:
    input:
        unpack(lambda wildcards: synthesis_motions(SYNTHESES[wildcards.synthesis])),
        table=RESULTS / "footprints/{synthesis}.tsv",
        status=RESULTS / "footprints/{synthesis}.json",
    output:
        warped=MOTIONS / "warp/{synthesis}.npz",
        warped_sidecar=MOTIONS / "warp/{synthesis}.json",
        copied=MOTIONS / "warp/{synthesis}_copied.npz",
        copied_sidecar=MOTIONS / "warp/{synthesis}_copied.json",
        report=RESULTS / "syntheses/warp/{synthesis}.json",
    log:
        LOGS / "warp/{synthesis}.log",
    benchmark:
        BENCHMARKS / "warp/{synthesis}.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("body", "motion", "spacetime"),
        sheet=CONFIG["syntheses"],
        row=lambda wildcards: synthesis_text(wildcards.synthesis),
    script:
        "../scripts/warp.py"


rule initial_style:
    input:
        motion=MOTIONS / "captured/{clip}_physical.npz",
        code=RESULTS / "dynamics/library.json",
    output:
        style=RESULTS / "styles/initial/{clip}.json",
    log:
        LOGS / "styles/initial/{clip}.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("body", "motion", "dynamics", "spacetime"),
    script:
        "../scripts/initial_style.py"


rule synthesise:
    input:
        unpack(lambda wildcards: synthesis_motions(SYNTHESES[wildcards.synthesis])),
        table=RESULTS / "footprints/{synthesis}.tsv",
        status=RESULTS / "footprints/{synthesis}.json",
        style=lambda wildcards: style_of(SYNTHESES[wildcards.synthesis]),
        code=RESULTS / "dynamics/library.json",
        second_order=RESULTS / "dynamics/second_order.json",
    output:
        motion=MOTIONS / "nio/{synthesis}.npz",
        sidecar=MOTIONS / "nio/{synthesis}.json",
        report=RESULTS / "syntheses/nio/{synthesis}.json",
        diagnosis=RESULTS / "diagnosis/nio/{synthesis}.json",
    log:
        LOGS / "synthesise/{synthesis}.log",
    benchmark:
        BENCHMARKS / "synthesise/{synthesis}.tsv"
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1500,
    params:
        library=library("body", "motion", "dynamics", "spacetime"),
        sheet=CONFIG["syntheses"],
        row=lambda wildcards: synthesis_text(wildcards.synthesis),
    script:
        "../scripts/synthesise.py"


rule measure_synthesis:
    input:
        unpack(lambda wildcards: synthesis_motions(SYNTHESES[wildcards.synthesis])),
        table=RESULTS / "footprints/{synthesis}.tsv",
        status=RESULTS / "footprints/{synthesis}.json",
        nio=MOTIONS / "nio/{synthesis}.npz",
        warp=MOTIONS / "warp/{synthesis}.npz",
        copied=MOTIONS / "warp/{synthesis}_copied.npz",
        nio_report=RESULTS / "syntheses/nio/{synthesis}.json",
        warp_report=RESULTS / "syntheses/warp/{synthesis}.json",
        own=lambda wildcards: MOTIONS
        / "captured/{0.style_clip}.npz".format(SYNTHESES[wildcards.synthesis]),
        others=lambda wildcards: [
            MOTIONS / f"captured/{id}.npz" for id in SYNTHESES[wildcards.synthesis].others
        ],
    output:
        rows=RESULTS / "syntheses/{synthesis}.json",
    log:
        LOGS / "measure_synthesis/{synthesis}.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("body", "motion", "spacetime", "evaluation"),
        sheet=CONFIG["syntheses"],
        row=lambda wildcards: synthesis_text(wildcards.synthesis),
        config=CONFIG["name"],
    script:
        "../scripts/measure_synthesis.py"


rule syntheses_table:
    input:
        rows=[RESULTS / f"syntheses/{id}.json" for id in SYNTHESES],
    output:
        table=RESULTS / "tables/syntheses.csv",
    log:
        LOGS / "syntheses_table.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=500,
    params:
        library=library("evaluation"),
    script:
        "../scripts/syntheses_table.py"


rule ramp_gait_table:
    input:
        nio=[MOTIONS / f"nio/{id}.npz" for pair in RAMPS for id in pair],
        warp=[MOTIONS / f"warp/{id}.npz" for pair in RAMPS for id in pair],
        code=RESULTS / "dynamics/library.json",
    output:
        table=RESULTS / "tables/ramp_gait.csv",
    log:
        LOGS / "ramp_gait_table.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("body", "motion", "dynamics", "spacetime", "evaluation"),
        sheet=CONFIG["syntheses"],
        pairs=RAMPS,
        config=CONFIG["name"],
    script:
        "../scripts/ramp_gait_table.py"


rule figure_syntheses:
    input:
        motions=[MOTIONS / f"nio/{id}.npz" for id in ONE_OF_EACH_TASK],
    output:
        svg=RESULTS / "figures/syntheses.svg",
        png=RESULTS / "figures/syntheses.png",
    log:
        LOGS / "figures/syntheses.log",
    conda:
        "../envs/motionstyle.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        library=library("body", "motion", "evaluation", "figures"),
    script:
        "../scripts/figure_syntheses.py"


use rule figure_syntheses as figure_warps with:
    input:
        motions=[MOTIONS / f"warp/{id}.npz" for id in ONE_OF_EACH_TASK],
    output:
        svg=RESULTS / "figures/warps.svg",
        png=RESULTS / "figures/warps.png",
    log:
        LOGS / "figures/warps.log",
