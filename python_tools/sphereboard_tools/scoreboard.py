"""One table of several comparisons: a CSV of all their rows, and a digest between the words of the scoreboard's page."""

import csv
import json
from pathlib import Path
from typing import Any

from sphereboard_tools.images import BadInputError

MARK = "<!-- table -->"
"""The page's words end here, and the digest begins."""


def read_rows(folder: Path) -> tuple[str, list[dict[str, Any]]]:
    """Read what a comparison found: what it was made with, and a flat row for each method, level and height."""
    path = folder / "report.json"
    try:
        report = json.loads(path.read_text(encoding="utf-8"))
        tree = report["source"]
        rows = [
            {"tree": tree, "method": row["method"], "level": row["level"] or "", "height_px": row["height_px"]}
            | {name: value for part in ("error", "cost") for name, value in (row[part] or {}).items()}
            | ({} if row["level"] else whole(method))
            for method in report["methods"]
            for row in method["rows"]
            if not row.get("failed")
        ]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BadInputError(f"{path} is no report of a comparison: {error!r}") from error
    made = report.get("identity", {})
    return " on ".join(made[name] for name in ("program", "adapter") if name in made), rows


def whole(method: dict[str, Any]) -> dict[str, Any]:
    """Tell what is the same at all heights: what it took to build, its file, and how it looks in motion."""
    told = {name: method[name] for name in ("build_ms", "disk_bytes") if name in method}
    motion = {name: value for name, value in (method.get("motion") or {}).items() if value is not None}
    motion.pop("largest_at_px", None)
    return told | motion


def write_csv(rows: list[dict[str, Any]], path: Path) -> None:
    """Write all rows; numbers with five digits."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.DictWriter(file, names, lineterminator="\n")
        table.writeheader()
        for row in rows:
            table.writerow({name: f"{value:.5g}" if isinstance(value, float) else value for name, value in row.items()})


def digest(rows: list[dict[str, Any]]) -> str:
    """Write a table for people: by tree and method the FLIP at each height, how it looks in motion, and what the nearest costs."""
    lines = []
    own = [row for row in rows if not row["level"]]
    for tree in dict.fromkeys(row["tree"] for row in own):
        here = [row for row in own if row["tree"] == tree]
        heights = sorted({row["height_px"] for row in here}, reverse=True)
        flips = " | ".join(f"FLIP, {h:g} px" for h in heights)
        lines += [f"### {tree}", "", f"| method | {flips} | JOD round it | ms | KB | triangles |"]
        lines.append("|---|" + "---:|" * (len(heights) + 4))
        for method in dict.fromkeys(row["method"] for row in here):
            of = {row["height_px"]: row for row in here if row["method"] == method}
            flips = " | ".join(f"{of[h]['flip']:.3f}" if h in of else "" for h in heights)
            near = of[max(of)]
            kilobytes = (near.get("texture_bytes", 0) + near.get("geometry_bytes", 0)) / 1000
            jod = f"{near['orbit_jod']:.1f}" if "orbit_jod" in near else "–"
            lines.append(f"| {method} | {flips} | {jod} | {near.get('ms', 0):.2f} | {kilobytes:.0f} | {near.get('triangles', 0)} |")
        lines.append("")
    return "\n".join(lines)


def run(folders: list[Path], out: Path) -> bool:
    """Put several comparisons into the scoreboard's table and page."""
    read = [read_rows(folder) for folder in folders]
    rows = [row for _, own in read for row in own]
    page = out / "README.md"
    words = page.read_text(encoding="utf-8")
    if MARK not in words:
        raise BadInputError(f"{page} has no line {MARK}, behind which the table goes")
    write_csv(rows, out / "scoreboard.csv")
    note = (
        "Cost is that of the nearest height, of one tree; KB are of textures and geometry on the device. JOD is what ColorVideoVDP "
        "says of a walk round it, 96 pixels high, beside the true tree's film: 10 where nobody sees a difference. "
        f"Made by {', '.join(dict.fromkeys(made for made, _ in read if made)) or 'an unknown program'}."
    )
    page.write_text(f"{words.split(MARK, maxsplit=1)[0]}{MARK}\n{note}\n\n{digest(rows)}", encoding="utf-8")
    return True
