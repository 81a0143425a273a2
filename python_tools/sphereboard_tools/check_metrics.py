"""Do NVIDIA's flip-evaluator, scikit-image and OpenImageIO say of pairs of pictures what our metrics say of them?

``cargo test --test metrics`` leaves the pairs. What each figure is held to, and how tightly:

* FLIP: flip-evaluator, NVIDIA's own build of FLIP. Its mathematics are those of the C++ that our crate ``nv-flip`` is built
  from, in another version and behind another interface: what is checked is everything around them (backgrounds, order, pixels
  per degree, encoding, the percentile).
* SSIM: our crate ``image-compare`` takes windows of 8 by 8 pixels side by side, and sums squares over a window where Wang et al.
  take their mean, so that their constant C2 counts 1/64 as much. That definition is repeated here in numpy;
  Wang's, by scikit-image with windows of 7 by 7 about every pixel (it takes odd ones only), must rank the pairs as ours does.
* CIEDE2000 of the mean colours, Hausdorff distance: scikit-image. Intersection over union, area: numpy.
* Root mean square of the samples: OpenImageIO.
"""

import json
import math
import sys
from pathlib import Path
from typing import Any

import flip_evaluator
import numpy as np
import OpenImageIO as oiio  # noqa: N813 (its own documentation's short name)
from numpy.typing import NDArray
from scipy.stats import spearmanr
from skimage import color
from skimage.metrics import hausdorff_distance, structural_similarity

from sphereboard_tools.check_depth import compared, read
from sphereboard_tools.images import BadInputError

Picture = NDArray[np.uint8]

TOLERANCE = 1e-5
"""Of figures that are sums of doubles or counts: other orders of adding up."""
FLIP_TOLERANCE = 1e-6
"""Of FLIP, 0 to 1: the same code, but compiled by another compiler; found equal to the last bit on x86-64."""
SSIM_TOLERANCE = 1e-4
"""Of SSIM, 0 to 1: lumas that lie between two whole numbers are rounded either way; off by 1e-5 at most."""
DELTA_E_TOLERANCE = 0.01
"""Of CIEDE2000: our crate ``palette`` converts in 32-bit floats, with a white point of four digits."""
LEAST_RANK_CORRELATION = 0.9
"""Between our SSIM and scikit-image's over all pairs and backgrounds: their definitions differ, see above."""
WINDOW_PX = 8


def over(picture: Picture, below: list[int]) -> Picture:
    """Lay a picture with straight alpha over one colour; mixed as the bytes are, and rounded."""
    alpha = picture[..., 3:].astype(int)
    return ((picture[..., :3] * alpha + np.array(below) * (255 - alpha) + 127) // 255).astype(np.uint8)


def flip(truth: Picture, test: Picture, pixels_per_degree: float) -> dict[str, float]:
    """FLIP by flip-evaluator: mean, and what 99 % of the pixels have at most."""
    pictures = [np.ascontiguousarray(picture, dtype=np.float32) / 255 for picture in (truth, test)]
    errors, _, _ = flip_evaluator.evaluate(*pictures, "LDR", applyMagma=False, parameters={"ppd": pixels_per_degree})
    return {"mean": float(np.mean(errors, dtype=float)), "p99": float(np.percentile(errors, 99, method="inverted_cdf"))}


def luma(picture: Picture) -> NDArray[np.float64]:
    """Weigh the bytes as BT.709 has it, rounded to whole numbers: what the Rust crate ``image`` does."""
    return np.rint(picture @ np.array([0.2126, 0.7152, 0.0722]))


def ssim_by_blocks(truth: Picture, test: Picture) -> float:
    """SSIM as ``image-compare`` defines it: windows side by side, those at the edges smaller and counting less, squares summed."""
    a, b = luma(truth), luma(test)
    c1, c2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    total = 0.0
    for top in range(0, a.shape[0], WINDOW_PX):
        for left in range(0, a.shape[1], WINDOW_PX):
            x, y = (part[top : top + WINDOW_PX, left : left + WINDOW_PX] for part in (a, b))
            dx, dy = x - x.mean(), y - y.mean()
            means = (2 * x.mean() * y.mean() + c1) / (x.mean() ** 2 + y.mean() ** 2 + c1)
            total += x.size * means * (2 * (dx * dy).sum() + c2) / ((dx * dx).sum() + (dy * dy).sum() + c2)
    return total / a.size


def mean_color(picture: Picture) -> NDArray[np.float64]:
    """Mean of what is there, weighted by alpha in linear light, as encoded sRGB from 0 to 1."""
    encoded = picture[..., :3] / 255
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    alpha = picture[..., 3:] / 255
    mean = (linear * alpha).sum((0, 1)) / alpha.sum()
    return np.where(mean <= 0.0031308, 12.92 * mean, 1.055 * mean ** (1 / 2.4) - 0.055)


def delta_e(truth: Picture, test: Picture) -> float:
    """CIEDE2000 between mean colours, by scikit-image."""
    return float(color.deltaE_ciede2000(*(color.rgb2lab(mean_color(picture)) for picture in (truth, test))))


def pair_faults(row: dict[str, Any], folder: Path) -> tuple[list[str], list[tuple[float, float]]]:
    """List in words where others' figures of a pair differ from ours; give our SSIM beside scikit-image's over each background."""
    paths = [folder / name for name in row["files"]]
    buffers = [read(path) for path in paths]
    truth, test = (np.asarray(buffer.get_pixels(oiio.UINT8)) for buffer in buffers)
    ours, faults, structures = row["ours"], [], []

    def hold(name: str, mine: float, theirs: float, tolerance: float) -> None:
        if not math.isclose(mine, theirs, rel_tol=tolerance, abs_tol=tolerance):
            faults.append(f"{paths[1]}: {name} {mine}, but it should be {theirs}")

    for number, below in enumerate(row["backgrounds"]):
        a, b = over(truth, below), over(test, below)
        theirs = flip(a, b, row["pixels_per_degree"])
        for name in ("mean", "p99"):
            hold(f"FLIP over {below}, {name}", ours["flip"][number][name], theirs[name], FLIP_TOLERANCE)
        hold(f"SSIM over {below}", ours["ssim"][number], ssim_by_blocks(a, b), SSIM_TOLERANCE)
        wang = structural_similarity(luma(a), luma(b), win_size=7, data_range=255, use_sample_covariance=False)
        structures.append((ours["ssim"][number], float(wang)))
    x, y = (picture[..., 3] >= 128 for picture in (truth, test))
    hold("intersection over union", ours["iou"], (x & y).sum() / (x | y).sum(), TOLERANCE)
    hold("Hausdorff distance", ours["hausdorff_px"], float(hausdorff_distance(x, y)), TOLERANCE)
    hold("area", ours["area"], y.sum() / x.sum() - 1, TOLERANCE)
    hold("CIEDE2000", ours["delta_e"], delta_e(truth, test), DELTA_E_TOLERANCE)
    hold("root mean square", ours["rms"], compared(*buffers, 0.0)["rms"], TOLERANCE)
    return faults, structures


def run(pairs: Path) -> bool:
    """Check the pairs that the Rust tests left; print what is wrong and a closing line; True when all is well."""
    rows = sorted(pairs.glob("*.json"))
    if len(rows) < 3:  # fewer have no order to compare
        raise BadInputError(f"there are {len(rows)} pairs in {pairs}; cargo test --test metrics writes more")
    faults: list[str] = []
    structures: list[tuple[float, float]] = []
    for row in rows:
        found, both = pair_faults(json.loads(row.read_text(encoding="utf-8")), pairs)
        faults += found
        structures += both
    ours, wang = zip(*structures, strict=True)
    correlation = float(spearmanr(ours, wang).statistic)
    if not correlation >= LEAST_RANK_CORRELATION:
        faults.append(f"our SSIM and scikit-image's rank pairs alike by {correlation:.3f}; {LEAST_RANK_CORRELATION} is expected")
    for fault in faults:
        print(fault, file=sys.stderr)
    print(f"FLIP, scikit-image, OpenImageIO: {len(rows)} pairs, {len(faults)} faults; SSIM ranks alike by {correlation:.3f}")
    return not faults
