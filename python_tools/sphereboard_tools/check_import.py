"""Does Open3D count the triangles, and measure the box, that ``sphereboard inspect`` reports of a model file?"""

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import open3d
from numpy.typing import NDArray

from sphereboard_tools.images import BadInputError
from sphereboard_tools.ours import find_binary

TOLERANCE = 1e-5
"""Largest difference of a corner of the box, in parts of its diagonal: positions are single precision on both sides."""


@dataclass(frozen=True)
class Contents:
    """Triangles of a whole file, and the box around them: its smallest and its largest corner, metres."""

    triangles: int
    box: NDArray[np.float64]


def by_open3d(path: Path) -> Contents:
    """Read a file with Open3D."""
    meshes = [part.mesh for part in open3d.io.read_triangle_model(str(path)).meshes]
    if not meshes:
        raise BadInputError(f"Open3D finds no mesh in {path}")
    low = np.min([mesh.get_min_bound() for mesh in meshes], axis=0)
    high = np.max([mesh.get_max_bound() for mesh in meshes], axis=0)
    return Contents(sum(len(mesh.triangles) for mesh in meshes), np.array([low, high]))


def by_us(report: dict[str, Any]) -> Contents:
    """Take the same from one file's part of our report."""
    if not report["ok"]:
        raise BadInputError(report["error"])
    bounds = report["bounds_m"]
    return Contents(report["triangles"], np.array([bounds["min"], bounds["max"]], dtype=np.float64))


def inspect(binary: Path, files: list[Path]) -> list[dict[str, Any]]:
    """Have our program report on files."""
    command = [str(binary), "inspect", "--json", *map(str, files)]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    if run.returncode not in (0, 1):
        raise BadInputError(f"sphereboard inspect ended with exit code {run.returncode} and says: {run.stderr.strip()}")
    return json.loads(run.stdout)["files"]


def differences(ours: Contents, theirs: Contents) -> list[str]:
    """List in words where the two disagree."""
    faults = []
    if ours.triangles != theirs.triangles:
        faults.append(f"{ours.triangles} triangles, but Open3D counts {theirs.triangles}")
    diagonal = float(np.linalg.norm(theirs.box[1] - theirs.box[0]))
    if not np.allclose(ours.box, theirs.box, rtol=0, atol=TOLERANCE * diagonal):
        faults.append(f"a box of {ours.box.tolist()}, but Open3D measures {theirs.box.tolist()}")
    return faults


def run(files: list[Path], binary: Path | None) -> bool:
    """Check files, print what differs and a closing line; True when all is well."""
    good = 0
    for path, report in zip(files, inspect(find_binary(binary), files), strict=True):
        faults = differences(by_us(report), by_open3d(path))
        good += not faults
        for fault in faults:
            print(f"{path}: {fault}", file=sys.stderr)
    print(f"Open3D: {good} of {len(files)} model files have the triangles and the box that sphereboard inspect reports")
    return good == len(files)
