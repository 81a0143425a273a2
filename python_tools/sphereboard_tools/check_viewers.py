"""Do other programs show of a baked tree what we show? Silhouettes from the front of every method's every level, compared.

``bake_methods`` writes the files, our pictures of them and ``shots.json``, which says how each is looked at; three.js and Blender
then draw NAME.three.png and NAME.blender.png beside NAME.ours.png; ``compare`` judges them.
"""

import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from sphereboard_tools.images import BadInputError, Mask, iou
from sphereboard_tools.ours import find_binary

SIDE_PX = 768
FOV_DEG = math.degrees(0.4711)
DISTANCE_HEIGHTS = 2.6
LEAST_IOU = 0.85
"""Twigs of a pixel and the rims of leaves differ between programs; a card without its cut-outs comes to less than 0.75."""

GROWN = "grown"


def bake_methods(binary: Path | None, preset: str, out: Path) -> bool:
    """Bake every method that takes a grown tree, all its levels and each one alone, and draw what we see of each."""
    program = find_binary(binary)
    out.mkdir(parents=True, exist_ok=True)
    shots: list[dict[str, Any]] = []
    for method in json.loads(ask(program, "methods", "--json"))["methods"]:
        if GROWN not in method["sources"]:
            continue
        report = bake(program, preset, method["id"], "all", out)
        names = [Path(report["out"]).stem]
        if len(report["levels"]) > 1:
            levels = range(len(report["levels"]))
            names += [Path(bake(program, preset, method["id"], str(level), out)["out"]).stem for level in levels]
        for name in names:
            shots.append(draw(program, name, out))
    (out / "shots.json").write_text(json.dumps({"shots": shots}, indent=2), encoding="utf-8")
    print(f"{len(shots)} files of {preset} baked into {out}")
    return bool(shots)


def bake(program: Path, preset: str, method: str, levels: str, out: Path) -> dict[str, Any]:
    """Bake one file; what the program says of it."""
    path = out / (f"{method}.glb" if levels == "all" else f"{method}-{levels}.glb")
    return json.loads(ask(program, "bake", preset, "--method", method, "--levels", levels, "--out", str(path), "--json"))


def draw(program: Path, name: str, out: Path) -> dict[str, Any]:
    """Draw a file ourselves, from the front, near enough for its finest level."""
    low, high = bounds(out / f"{name}.glb")
    size = [top - bottom for bottom, top in zip(low, high, strict=True)]
    distance = DISTANCE_HEIGHTS * max(size[0], size[1]) + size[2] / 2
    picture = out / f"{name}.ours.png"
    options = (
        f"--azimuth-deg 0 --elevation-deg 0 --stage unshaped --background alpha --growth none --size {SIDE_PX}x{SIDE_PX}".split()
    )
    where = ["--distance-m", str(distance), "--adapter", "software", "--out", str(picture)]
    ask(program, "render", str(out / f"{name}.glb"), *options, *where)
    target = [(bottom + top) / 2 for bottom, top in zip(low, high, strict=True)]
    return {"name": name, "size_px": [SIDE_PX, SIDE_PX], "target": target, "distance_m": distance, "fov_deg": FOV_DEG}


def bounds(path: Path) -> tuple[list[float], list[float]]:
    """Read the tree's box from what the file says of itself."""
    data = path.read_bytes()
    length = int.from_bytes(data[12:16], "little")
    low, high = json.loads(data[20 : 20 + length])["extras"]["sphereboard"]["bounds"]
    return low, high


def ask(program: Path, *arguments: str) -> str:
    """Run the program; what it prints."""
    run = subprocess.run([str(program), *arguments], capture_output=True, text=True, check=False)
    if run.returncode != 0:
        raise BadInputError(
            f"sphereboard {' '.join(arguments)} ended with exit code {run.returncode} and says: {run.stderr.strip()}"
        )
    return run.stdout


def silhouette(path: Path) -> Mask:
    """Read which pixels of a picture with alpha show anything."""
    picture = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if picture is None or picture.ndim != 3 or picture.shape[2] != 4:
        raise BadInputError(f"{path} is missing or has no alpha channel; draw it first")
    return np.asarray(picture[..., 3] >= 128)


def filled(mask: Mask) -> Mask:
    """Close gaps of a pixel or two, which the sampling of each program decides."""
    return np.asarray(cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8)) > 0)


def compare(folder: Path, program: str) -> bool:
    """Compare our silhouettes with another program's; True when all are alike."""
    good = 0
    shots = json.loads((folder / "shots.json").read_text(encoding="utf-8"))["shots"]
    for shot in shots:
        ours, theirs = (filled(silhouette(folder / f"{shot['name']}.{who}.png")) for who in ("ours", program))
        alike = iou(ours, theirs)
        ok = ours.any() and math.isfinite(alike) and alike >= LEAST_IOU
        good += ok
        if not ok:
            print(
                f"{folder / shot['name']}: silhouettes of ours and {program} share {alike:.3f}, but {LEAST_IOU} is needed",
                file=sys.stderr,
            )
        else:
            print(f"{shot['name']}: IoU {alike:.3f}")
    print(f"{program}: {good} of {len(shots)} baked files look as ours do; look at {folder}/*.{program}.png")
    return good == len(shots) > 0
