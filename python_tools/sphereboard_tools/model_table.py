"""What `sphereboard model --json` says of many photographs, as one table."""

import csv
import json
from pathlib import Path
from typing import Any

COLUMNS = (
    "photograph",
    "glb_bytes",
    "crowns",
    "polygons",
    "seam_before",
    "seam",
    "contrast_before",
    "contrast",
    "exemplar_delta_e",
)


def row(photo: dict[str, Any]) -> list[str]:
    """One model: sizes, and of several crowns the worst figures."""
    report = photo["report"]
    measures, crowns = report["measures"], report["counts"]["crowns"]
    polygons = sum(crown["triangles"] + crown["quads"] for crown in crowns)
    figures = (
        max(measures["seam_contrast_before"]),
        max(measures["seam_contrast"]),
        min(measures["texel_contrast_before"]),
        min(measures["texel_contrast"]),
        max(measures["exemplar_delta_e"]),
    )
    return [photo["stem"], str(report["glb_bytes"]), str(len(crowns)), str(polygons), *(f"{figure:.3f}" for figure in figures)]


def run(summary: Path, out: Path) -> bool:
    """Write the table; True when every photograph that was modelled is in it."""
    photos = [photo for photo in json.loads(summary.read_text(encoding="utf-8"))["photos"] if photo["ok"]]
    with out.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows(row(photo) for photo in photos)
    return bool(photos)
