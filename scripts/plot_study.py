#!/usr/bin/python3
"""Draws what accuracy costs, from the study.json of tissue_sim_study: for each case the time of a simulated millisecond
against the error in displacement, in force and in motion, with the front that no other setting beats."""
import argparse
import json
import pathlib
import textwrap

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullFormatter

ERRORS = (("displacement", "displacement_error", "error in displacement at rest, % of the surface's"),
          ("force", "force_error", "error in force, %"),
          ("transient", "transient_error", "error in displacement while being pressed, %"))
RECORDING = {"displacement_error": "error in displacement at the greatest force, %",
             "force_error": "error in force along the recording, % of its peak"}
TITLES = {"sphere_into_block": "Ball of 6 mm, 2 mm into a block", "probe_into_organ": "Probe, 10 mm into the liver",
          "demo_recording": "The demonstration's recording"}
COLOURS = {"contact_only": "#7f7f7f", "surface": "#e69f00", "volume": "#009e73", "fem": "#0072b2"}  # Okabe and Ito
MARKERS = {"explicit": "o", "vertex_block_descent": "s"}
SHORT = {"explicit": "explicit", "vertex_block_descent": "descent"}
LEAST = 1e-3  # less is no error that anybody would pay for
MOST = 5.0


def front(points):
    """Of (time, error, row): those with no other both faster and better."""
    best, result = float("inf"), []
    for point in sorted(points, key=lambda p: p[:2]):
        if point[1] < best:
            best = point[1]
            result.append(point)
    return result


def name(row):
    words = [f"{row['model']}, {row['mesh']}"]
    if row["model"] != "contact_only":
        words.append(f"{SHORT[row['integrator']]}, {1e3 * row['time_step']:g}\u00a0ms")
    if row["depth"] == "paper":
        words.append("depth of the paper")
    if not row["restoration"]:
        words.append("no restoration")
    return ", ".join(words)


def shown(row, key):
    error, time = row[key], row["ms_per_ms"]
    return row["stable"] and error is not None and time and LEAST <= error <= MOST


def draw(case, rows, key, label, path):
    points = [(row["ms_per_ms"], row[key], row) for row in rows if shown(row, key)]
    if not points:
        return
    figure, (axis, notes) = plt.subplots(1, 2, figsize=(10, 5.2), gridspec_kw={"width_ratios": (1.75, 1)})
    for time, error, row in points:
        usual = row["depth"] == "exact" and row["restoration"]
        colour = COLOURS[row["model"]]
        axis.plot(time, 100 * error, marker=MARKERS[row["integrator"]] if usual else "x", markersize=7, color=colour,
                  markerfacecolor="white" if row["embedded"] else colour, markeredgewidth=1.4,
                  linestyle="none", zorder=3)
    best = front(points) if key != "transient_error" else []  # each model by itself: nothing beats another
    if best:
        axis.step([p[0] for p in best], [100 * p[1] for p in best], where="post", color="black", linewidth=1.0,
                  linestyle=":", zorder=2)
    axis.axvline(1.0, color="#d55e00", linewidth=1.0, zorder=1)
    axis.set_xscale("log")
    axis.set_yscale("log")
    low, high = axis.get_ylim()
    axis.set_ylim(low / 1.25, high * 1.25)
    plain = FuncFormatter(lambda value, _: f"{value:g}")
    for ticks in (axis.xaxis, axis.yaxis):
        ticks.set_major_formatter(plain)
        ticks.set_minor_formatter(NullFormatter())
    if axis.get_ylim()[1] < 30 * axis.get_ylim()[0]:
        axis.yaxis.set_minor_formatter(FuncFormatter(lambda v, _: f"{v:g}" if f"{v:e}"[0] in "25" else ""))
    axis.text(1.0, 1.01, "real time", color="#d55e00", ha="center", va="bottom", fontsize=9,
              transform=axis.get_xaxis_transform())
    for number, (time, error, _) in enumerate(best, 1):
        axis.annotate(str(number), (time, 100 * error), xytext=(-5, -5), textcoords="offset points", ha="right",
                      va="top", fontsize=10, fontweight="bold", zorder=4,
                      bbox={"boxstyle": "circle,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.7})
    axis.grid(alpha=0.25, which="both", linewidth=0.6)
    axis.set_xlabel("ms of one core for a simulated ms")
    axis.set_ylabel(label)
    axis.set_title(TITLES.get(case, case), loc="left", pad=18)

    marks = [Line2D([], [], color=COLOURS[model], marker="o", linestyle="none", label=model)
             for model in COLOURS if any(p[2]["model"] == model for p in points)]
    marks += [Line2D([], [], color="black", marker="o", linestyle="none", label="explicit"),
              Line2D([], [], color="black", marker="s", linestyle="none", label="vertex block descent")]
    if any(p[2]["embedded"] for p in points):
        marks.append(Line2D([], [], color="black", marker="o", markerfacecolor="white", linestyle="none",
                            label="surface carried by a coarser solid"))
    if any(p[2]["depth"] == "paper" or not p[2]["restoration"] for p in points):
        marks.append(Line2D([], [], color="black", marker="x", linestyle="none",
                            label="paper's depth, or no restoration"))
    notes.axis("off")
    legend = notes.legend(handles=marks, loc="upper left", bbox_to_anchor=(-0.1, 1.02), frameon=False, fontsize=9)
    figure.tight_layout()
    figure.canvas.draw()
    bottom = notes.transAxes.inverted().transform(legend.get_window_extent())[0][1]
    lines = ["Beaten by none:" if best else "Against ten times finer substeps\nof the same model on the same mesh."]
    for number, (_, _, row) in enumerate(best, 1):
        lines.append(textwrap.fill(f"{number}  {name(row)}", 46, subsequent_indent="    "))
    notes.text(-0.06, bottom - 0.03, "\n".join(lines), va="top", fontsize=8.5, linespacing=1.35,
               transform=notes.transAxes)
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("json", help="study.json")
    parser.add_argument("--out", required=True, type=pathlib.Path, help="folder for the pictures (SVG)")
    arguments = parser.parse_args()
    with open(arguments.json) as file:
        rows = json.load(file)["rows"]
    plt.rcParams["svg.hashsalt"] = "tissue_sim"  # the same picture for the same numbers, byte for byte
    for case in dict.fromkeys(row["case"] for row in rows):
        own = [row for row in rows if row["case"] == case]
        for suffix, key, label in ERRORS:
            if case == "demo_recording":
                label = RECORDING.get(key, label)
            draw(case, own, key, label, arguments.out / f"accuracy_{case}_{suffix}.svg")


if __name__ == "__main__":
    main()
