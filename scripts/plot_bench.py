#!/usr/bin/python3
"""Draws what a step costs, from the JSON files of tissue_sim_bench: `paper` as bars of where the time of a step goes, in
the fast step and in the plain one, `scale` as the cost of a step against the size of the organ. Writes the rows of these,
`peers` and `limits` as the tables of doc/performance.md."""
import argparse
import json
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.ticker import FuncFormatter, NullFormatter

STAGES = (("detection", "detection", "#0072b2"), ("penetration", "depths at the border", "#56b4e9"),
          ("propagation", "depths inward", "#009e73"), ("response", "response and force", "#f0e442"),
          ("deformation", "elements and integration", "#e69f00"), ("health", "health check", "#7f7f7f"))  # Okabe and Ito
APPROACHES = ("contact_only", "without_restoration", "with_restoration")
SHORT = {"contact_only": "contact\nonly", "without_restoration": "without\nrestoration",
         "with_restoration": "with\nrestoration"}


def thousands(count):
    return f"{count:,}"


def bars(axis, rows, prefix, title):
    for place, row in enumerate(rows):
        bottom = 0.0
        for stage, label, colour in STAGES:
            height = row[f"{prefix}ms_{stage}"]
            axis.bar(place, height, 0.7, bottom, color=colour, label=label if place == 0 else None, zorder=3)
            bottom += height
        axis.annotate(f"{bottom:.3g}", (place, bottom), xytext=(0, 2), textcoords="offset points", ha="center",
                      va="bottom", fontsize=8)
    axis.set_xticks(range(len(rows)))
    axis.grid(alpha=0.25, axis="y", linewidth=0.6)
    axis.margins(y=0.1)
    axis.set_title(title, loc="left", fontsize=11)


def draw_paper(rows, path):
    """Above: the largest spheres, each approach; below: all pairs with restoration. Left: the fast step; right: plain."""
    last = max(row["test"] for row in rows)
    largest = sorted((row for row in rows if row["test"] == last), key=lambda row: APPROACHES.index(row["approach"]))
    restored = [row for row in rows if row["approach"] == "with_restoration"]
    figure, axes = plt.subplots(2, 2, figsize=(10, 7.2), gridspec_kw={"height_ratios": (1, 1.1)})
    for (upper, lower), prefix, name in zip(axes.T, ("", "plain_"), ("the step", "the plain version")):
        spheres = " × ".join(thousands(largest[0][f"{side}_triangles"]) for side in ("rigid", "deformable"))
        bars(upper, largest, prefix, f"{name}: {spheres} triangles")
        upper.set_xticklabels([SHORT[row["approach"]] for row in largest], fontsize=9)
        bars(lower, restored, prefix, f"{name}: with restoration")
        lower.set_xticklabels([f"{thousands(row['rigid_triangles'])}\n{thousands(row['deformable_triangles'])}"
                               for row in restored], fontsize=8)
        lower.set_xlabel("triangles of the rigid and of the deformable sphere")
    for axis in axes[:, 0]:
        axis.set_ylabel("ms a step with contact")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper center", ncol=len(STAGES), frameon=False, fontsize=9)
    figure.tight_layout(rect=(0, 0, 1, 0.95))
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


def draw_scale(rows, path):
    rows = sorted(rows, key=lambda row: row["organ_triangles"])
    size = [row["organ_triangles"] for row in rows]
    figure, (time, room) = plt.subplots(1, 2, figsize=(10, 4.4), gridspec_kw={"width_ratios": (1.4, 1)})
    for key, label, colour, mark in (("ms_per_step", "step, median", "#000000", "o"),
                                     ("ms_99th", "step, 99th percentile", "#7f7f7f", "v"),
                                     ("ms_deformation", "elements and integration", "#e69f00", "s"),
                                     ("ms_detection", "detection", "#0072b2", "^")):
        time.plot(size, [row[key] for row in rows], marker=mark, color=colour, label=label, zorder=3)
    time.axhline(1.0, color="#d55e00", linewidth=1.0, zorder=1)
    time.text(1.0, 1.0, "real time ", color="#d55e00", ha="right", va="bottom", fontsize=9,
              transform=time.get_yaxis_transform())
    time.set_ylabel("ms of one core for a step of 1 ms")
    room.plot(size, [row["active_vertices"] for row in rows], marker="o", color="#009e73", label="active vertices")
    room.plot(size, [row["memory_mb"] for row in rows], marker="s", color="#cc79a7", label="memory, MB")
    room.plot(size, [row["load_seconds"] for row in rows], marker="^", color="#56b4e9", label="building, s")
    plain = FuncFormatter(lambda value, _: f"{value:,g}")
    for axis in (time, room):
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.set_xlabel("triangles of the organ")
        for ticks in (axis.xaxis, axis.yaxis):
            ticks.set_major_formatter(plain)
            ticks.set_minor_formatter(NullFormatter())
        axis.grid(alpha=0.25, which="both", linewidth=0.6)
        free = (0.0, 0.35) if axis is time else (0.42, 0.14)
        axis.legend(frameon=False, fontsize=9, loc="center left", bbox_to_anchor=free)
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


def ms(value):
    return f"{value:.3f}"


def count(value):
    return f"{value:,.0f}"


def ratio(value):
    return f"{value:.1f}" if value < 100 else f"{value:.0f}"


# Of each bench: which rows, and of each column its head, key and how it is written.
TABLES = {
    "paper": (lambda row: True, (
        ("test", "test", count), ("rigid", "rigid_triangles", count), ("deformable", "deformable_triangles", count),
        ("approach", "approach", lambda word: word.replace("_", " ")), ("ours", "ms_per_step", ms),
        ("paper", "paper_ms", ratio), ("ratio", "paper_ratio", ratio), ("plain", "plain_ms", ms),
        ("ratio", "plain_ratio", ratio), ("detection", "ms_detection", ms), ("border depths", "ms_penetration", ms),
        ("inward", "ms_propagation", ms), ("response", "ms_response", ms), ("deformation", "ms_deformation", ms),
        ("health", "ms_health", ms), ("contacts", "contacts", count))),
    "peers": (lambda row: "ratio" in row, (
        ("case", "case", str), ("peer", "peer", str), ("settings", "peer_settings", str), ("ours_ms", "ours_ms", ms),
        ("peer_ms", "peer_ms", ms), ("ratio", "ratio", ratio), ("our contacts", "our_contacts", count),
        ("the peer's", "peer_contacts", count))),
    "scale": (lambda row: True, (
        ("organ_triangles", "organ_triangles", count), ("active_vertices", "active_vertices", count),
        ("ms_per_step", "ms_per_step", ms), ("99th percentile", "ms_99th", ms), ("ms_detection", "ms_detection", ms),
        ("ms_deformation", "ms_deformation", ms), ("substeps", "substeps", count),
        ("force, N", "force_n", lambda force: f"{force:.4f}"), ("building, s", "load_seconds", ratio),
        ("memory_mb", "memory_mb", count))),
    "limits": (lambda row: True, (
        ("deformable", "deformable_triangles", count), ("MB", "bytes", lambda b: f"{1e-6 * b:.2f}"),
        ("GB/s", "bytes_per_second", lambda b: ratio(1e-9 * b)), ("ms", "ms_of_bytes", lambda t: f"{t:.4f}"),
        ("million operations", "operations", lambda n: f"{1e-6 * n:.2f}"),
        ("Gop/s", "operations_per_second", lambda n: ratio(1e-9 * n)), ("ms", "ms_of_operations", lambda t: f"{t:.4f}"),
        ("measured ms", "ms_deformation", ms), ("times the limit", "times_the_limit", ratio))),
}


def table(bench):
    wanted, columns = TABLES[bench["bench"]]
    lines = ["| " + " | ".join(head for head, _, _ in columns) + " |", "|" + "---|" * len(columns)]
    for row in filter(wanted, bench["rows"]):
        lines.append("| " + " | ".join(write(row[key]).replace("<", "&lt;") for _, key, write in columns) + " |")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("json", nargs="+", help="of tissue_sim_bench paper, peers, scale or limits")
    parser.add_argument("--out", required=True, type=pathlib.Path,
                        help="folder for the pictures (SVG) and the tables (performance_<bench>.md)")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    plt.rcParams["svg.hashsalt"] = "tissue_sim"  # the same picture for the same numbers, byte for byte
    draw = {"paper": draw_paper, "scale": draw_scale}
    for name in arguments.json:
        with open(name) as file:
            bench = json.load(file)
        what = bench["bench"]
        if what not in TABLES:
            parser.error(f"{name}: is of tissue_sim_bench {what}, allowed is one of {', '.join(TABLES)}")
        (arguments.out / f"performance_{what}.md").write_text(table(bench))
        if what in draw:
            draw[what](bench["rows"], arguments.out / f"performance_{what}.svg")


if __name__ == "__main__":
    main()
