#!/usr/bin/python3
"""Draws what is stable at the extremes, from the stability.json of tissue_sim_study --stability: for each model a picture
with Young's modulus against the time step, a panel for each Poisson's ratio, size and integrator. A cell is as dark as the
share of its time step that it is stable with, the worst of its dampings."""
import argparse
import json
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.colors import LogNorm
from matplotlib.patches import Rectangle

INTEGRATORS = (("explicit", "explicit"), ("vertex_block_descent", "vertex block descent"))
LEAST = 1e-4  # of the time step
BAD = "#d55e00"  # Okabe and Ito
NO_MATERIAL = "#dddddd"


def values(rows, key):
    return sorted({row[key] for row in rows})


def worst(rows):
    """The row that says least good of its cell."""
    order = {"neither": 0, "other_material": 1, "other_step": 2, "stable": 3}
    return min(rows, key=lambda row: (order[row["outcome"]], row["stable_with"]))


def draw_cell(axis, column, line, row, colours, norm):
    share = row["stable_with"] / row["time_step"]
    colour = {"neither": BAD, "other_material": NO_MATERIAL}.get(row["outcome"])
    hatch = "xxx" if row["outcome"] == "neither" else None
    axis.add_patch(Rectangle((column, line), 1, 1, facecolor=colour or colours(norm(min(1.0, max(LEAST, share)))),
                             edgecolor="white", linewidth=0.8, hatch=hatch))


def draw(model, rows, path):
    youngs, steps = values(rows, "young"), values(rows, "time_step")
    ratios, edges = values(rows, "poisson"), values(rows, "edge")
    colours, norm = plt.get_cmap("viridis"), LogNorm(LEAST, 1.0)
    columns = [(integrator, label, edge) for integrator, label in INTEGRATORS for edge in edges]
    figure, axes = plt.subplots(len(ratios), len(columns), figsize=(1.55 * len(columns) + 1.2, 1.5 * len(ratios) + 1.0),
                                sharex=True, sharey=True, squeeze=False)
    for line, ratio in enumerate(ratios):
        for column, (integrator, label, edge) in enumerate(columns):
            axis = axes[line][column]
            here = [row for row in rows
                    if (row["integrator"], row["edge"], row["poisson"]) == (integrator, edge, ratio)]
            for i, young in enumerate(youngs):
                for j, step in enumerate(steps):
                    of_cell = [row for row in here if (row["young"], row["time_step"]) == (young, step)]
                    if of_cell:
                        draw_cell(axis, i, j, worst(of_cell), colours, norm)
            axis.set_xlim(0, len(youngs))
            axis.set_ylim(0, len(steps))
            axis.set_xticks([i + 0.5 for i in range(len(youngs))], [f"{young / 1e3:g}" for young in youngs], fontsize=6.5)
            axis.set_yticks([i + 0.5 for i in range(len(steps))], [f"{1e3 * step:g}" for step in steps], fontsize=6.5)
            axis.tick_params(length=0)
            if line == 0:
                axis.set_title(f"{label},\nedges of {1e3 * edge:g} mm", fontsize=7.5)
            if column == 0:
                axis.set_ylabel(f"\u03bd = {ratio:g}\nstep, ms", fontsize=7.5)
            if line == len(ratios) - 1:
                axis.set_xlabel("E, kPa", fontsize=7.5)
    figure.tight_layout(rect=(0, 0, 0.9, 0.95))
    figure.suptitle(f"{model}: of the time step, what it is stable with (1: as it is; grey: material refused; "
                    "hatched: neither stable nor refused)", fontsize=8.5, x=0.02, ha="left")
    bar = figure.add_axes((0.92, 0.2, 0.015, 0.6))
    figure.colorbar(plt.cm.ScalarMappable(norm, colours), cax=bar).ax.tick_params(labelsize=7)
    figure.savefig(path, dpi=90, metadata={"Software": None})
    plt.close(figure)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("json", help="stability.json")
    parser.add_argument("--out", required=True, type=pathlib.Path, help="folder for the pictures (PNG)")
    arguments = parser.parse_args()
    with open(arguments.json) as file:
        rows = [row for row in json.load(file)["rows"] if not row["levels"]]
    for model in ("surface", "volume", "fem"):
        own = [row for row in rows if row["model"] == model]
        if own:
            draw(model, own, arguments.out / f"stability_{model}.png")


if __name__ == "__main__":
    main()
