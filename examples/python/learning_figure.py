"""Figure of a board that `spts score --left-out` has written: `python3 learning_figure.py board.json figure.png [M]`.

Left, IoU against M with 95 % intervals over objects; right, a bar an object at M (20). Only scores on objects that the
decoder has not learned from. Needs matplotlib.
"""

import json
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

PLAIN = {
    "nn_lmmse": "non-negative LMMSE, prior from real images of other objects",
    "nn_lasso": "non-negative lasso, dictionary of real images of other objects",
    "learned": "learned from the data set alone",
    "ridge": "ridge regression, no prior",
}
MARKERS = "osD^v"


def main():
    board, out = json.load(open(sys.argv[1])), sys.argv[2]
    at = int(sys.argv[3]) if len(sys.argv) > 3 else 20
    rows = [r for r in board["rows"] if r["left_out"]]
    decoders = list(dict.fromkeys(r["decoder"] for r in rows))
    objects = sorted({o["object"] for o in board["objects"]})
    figure, (curves, bars) = plt.subplots(1, 2, figsize=(11, 4.2), width_ratios=[1, 1.3], layout="constrained")
    width = 0.8 / len(decoders)
    for k, decoder in enumerate(decoders):
        own = sorted((r["m"], r["iou"], *r["iou_ci"]) for r in rows if r["decoder"] == decoder)
        m, iou, low, high = zip(*own)
        label = PLAIN.get(decoder, decoder)
        curves.fill_between(m, low, high, alpha=0.25, color=f"C{k}", linewidth=0)
        curves.plot(m, iou, marker=MARKERS[k % len(MARKERS)], color=f"C{k}", label=label)
        found = {o["object"]: o["iou"] for o in board["objects"] if o["left_out"] and o["decoder"] == decoder and o["m"] == at}
        places = [i + (k - (len(decoders) - 1) / 2) * width for i in range(len(objects))]
        bars.bar(places, [found.get(name, 0) for name in objects], width, color=f"C{k}", label=label)
    curves.set(xlabel="measurements M", ylabel="intersection over union", ylim=(0, 1), title="all objects, on the real skin")
    bars.set(ylabel="intersection over union", ylim=(0, 1), title=f"object by object, M = {at}")
    bars.set_xticks(range(len(objects)), objects)
    for axes in (curves, bars):
        axes.grid(axis="y", alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
    figure.legend(*curves.get_legend_handles_labels(), loc="outside lower center", ncols=2, frameon=False)
    figure.savefig(out, dpi=110)


if __name__ == "__main__":
    main()
