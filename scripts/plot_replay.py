#!/usr/bin/python3
"""Draws the depth and the force of a replay over time, from the file that tissue_sim_replay --json wrote."""
import argparse
import json
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("json", help="summary of a replay")
    parser.add_argument("--out", required=True, help="path without ending: .svg and .png are written")
    arguments = parser.parse_args()

    with open(arguments.json) as file:
        summary = json.load(file)
    rows = summary["rows"]
    if not rows:
        sys.exit(f"{arguments.json}: no rows: the replay used no pose; see its printed summary for what was dropped")
    seconds = [row["t"] - rows[0]["t"] for row in rows]
    curves = (("depth, mm", "tab:blue", [row["depth_m"] * 1e3 for row in rows]),
              ("force, N", "tab:red", [row["force_n"] for row in rows]),
              ("contacts", "tab:gray", [row["contacts"] for row in rows]))

    plt.rcParams["svg.hashsalt"] = "tissue_sim"  # the same picture for the same numbers, byte for byte
    figure, axes = plt.subplots(len(curves), 1, sharex=True, figsize=(8, 6),
                                gridspec_kw={"height_ratios": (3, 3, 1)})
    for axis, (label, color, values) in zip(axes, curves):
        axis.plot(seconds, values, color=color, linewidth=1.2)
        axis.fill_between(seconds, values, color=color, alpha=0.15, linewidth=0)
        axis.set_ylabel(label)
        axis.set_ylim(bottom=0)
        axis.grid(alpha=0.3)
        axis.margins(x=0)
    axes[-1].set_xlabel("simulated time since the first pose, s")
    axes[0].set_title(f"{summary['steps']} steps, {summary['ms_per_step_p50']:.2f} ms a step (median), "
                      f"{summary['real_time_factor']:.1f} times real time")
    figure.align_ylabels()
    figure.tight_layout()
    figure.savefig(arguments.out + ".svg", metadata={"Date": None})
    figure.savefig(arguments.out + ".png", dpi=110)


if __name__ == "__main__":
    main()
