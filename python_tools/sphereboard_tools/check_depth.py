"""Does OpenImageIO read our depth pictures, and does its comparison of two pictures give the figures that ours gives?"""

import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio  # noqa: N813 (its own documentation's short name)
from numpy.typing import NDArray

from sphereboard_tools.images import BadInputError
from sphereboard_tools.ours import find_binary

TOLERANCE = 1e-5
"""Largest relative difference of one figure: OpenImageIO adds up in another order."""


def read(path: Path) -> oiio.ImageBuf:
    """Read a picture as it is stored: PNG has straight alpha, which OpenImageIO multiplies in unless told."""
    stored = oiio.ImageSpec()
    stored.attribute("oiio:UnassociatedAlpha", 1)
    buffer = oiio.ImageBuf(str(path), 0, 0, stored)
    if not buffer.read():
        raise BadInputError(f"OpenImageIO does not read {path}: {buffer.geterror()}")
    return buffer


def read_depth(path: Path) -> NDArray[np.float32]:
    """Read a depth picture: one channel Z of 32-bit floats."""
    buffer = read(path)
    spec = buffer.spec()
    if spec.channelnames != ("Z",) or spec.format != oiio.FLOAT:
        raise BadInputError(
            f"{path} has the channels {spec.channelnames} of type {spec.format}; one channel Z of floats was expected"
        )
    return np.asarray(buffer.get_pixels(oiio.FLOAT))[:, :, 0]


def compared(a: oiio.ImageBuf, b: oiio.ImageBuf, threshold: float) -> dict[str, float]:
    """Compare two pictures as ``idiff -fail threshold`` does."""
    found = oiio.ImageBufAlgo.compare(a, b, threshold, threshold)
    return {"mean": found.meanerror, "rms": found.rms_error, "max": found.maxerror, "over": found.nfail}


def pair_faults(row: dict[str, Any], folder: Path) -> list[str]:
    """List in words where OpenImageIO's figures of two files differ from ours, and where a depth is off by more than it may be."""
    paths = [folder / name for name in row["files"]]
    theirs = compared(*map(read, paths), row["threshold"])
    faults = [
        f"{paths[0]} and {paths[1]}: {name} {row['ours'][name]}, but OpenImageIO says {value}"
        for name, value in theirs.items()
        if not math.isclose(row["ours"][name], value, rel_tol=TOLERANCE, abs_tol=1e-9)
    ]
    if row["largest_relative"] is not None:
        ours, truth = map(read_depth, paths)
        there = np.isfinite(truth)
        if not np.array_equal(there, np.isfinite(ours)) or not there.any():
            faults.append(f"{paths[0]}: something is where nothing should be, or the other way round")
        else:
            largest = float(np.max(np.abs(ours[there] / truth[there] - 1)))
            if largest > row["largest_relative"]:
                faults.append(f"{paths[0]}: off by {largest:.1e} of the depth, where {row['largest_relative']:.0e} is allowed")
    return faults


def render_faults(binary: Path, model: Path, folder: Path) -> list[str]:
    """Draw a model and its depth; list in words what is wrong with the depth."""
    folder.mkdir(parents=True, exist_ok=True)
    picture, depth = folder / f"{model.stem}.png", folder / f"{model.stem}.exr"
    options = ["--size", "320x240", "--stage", "unshaped", "--background", "alpha", "--adapter", "software", "--distance-m", "40"]
    command = [binary, "render", model, "--out", picture, "--depth", depth, *options]
    run = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    if run.returncode != 0:
        raise BadInputError(f"sphereboard render ended with exit code {run.returncode} and says: {run.stderr.strip()}")
    distances = read_depth(depth)
    alpha = np.asarray(read(picture).get_pixels(oiio.UINT8))[:, :, 3]
    there = np.isfinite(distances)
    faults = []
    if distances.shape != (240, 320) or alpha.shape != distances.shape:
        faults.append(f"{depth}: {distances.shape} pixels, and the picture {alpha.shape}")
    elif not there.any() or not np.array_equal(there, alpha > 0):
        faults.append(f"{depth}: depth is not where the picture is")
    elif not (20 < distances[there].min() < 40 < distances[there].max() < 60):
        faults.append(f"{depth}: {distances[there].min()} to {distances[there].max()} m, though the tree stands 40 m away")
    return faults


def run(model: Path, pairs: Path, out: Path, binary: Path | None) -> bool:
    """Check a render and the pairs that the Rust tests left; print what is wrong and a closing line; True when all is well."""
    rows = sorted(pairs.glob("*.json"))
    if not rows:
        raise BadInputError(f"there are no pairs in {pairs}; cargo test --test depth writes them")
    faults = render_faults(find_binary(binary), model, out)
    for row in rows:
        faults += pair_faults(json.loads(row.read_text(encoding="utf-8")), pairs)
    for fault in faults:
        print(fault, file=sys.stderr)
    print(f"OpenImageIO: a render's depth and {len(rows)} pairs of pictures, {len(faults)} faults")
    return not faults
