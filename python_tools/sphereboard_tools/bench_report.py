"""What `make bench` measured, as a table: reads criterion's estimates, writes README.md and bench.csv of one run."""

import csv
import json
import os
import platform
import subprocess
from pathlib import Path
from typing import NamedTuple


class Row(NamedTuple):
    """One benchmark: the median of its samples and the 95 % interval of that median."""

    group: str
    name: str
    median_ms: float
    low_ms: float
    high_ms: float


RATIOS = (
    ("hsv ÷ OpenCV's hsv steps", ("segment-12mp", "hsv"), ("segment-12mp", "opencv-hsv"), "at most 1"),
    ("auto ÷ OpenCV's hsv steps", ("segment-12mp", "auto"), ("segment-12mp", "opencv-hsv"), "at most 4"),
    ("crate texture-synthesis ÷ ours", ("texture-512", "crate-texture-synthesis"), ("texture-512", "sphereboard"), "at least 50"),
)
"""What is compared, in one run: name, numerator, denominator, what was asked for."""


LIMITS_MS = (("model-12mp", "medium", 1500.0),)
"""What must stay below a time: group, name, milliseconds."""


def read(criterion: Path) -> list[Row]:
    """Read every benchmark of the newest run."""
    rows = []
    for path in sorted(criterion.glob("*/*/new/benchmark.json")):
        identity = json.loads(path.read_text(encoding="utf-8"))
        median = json.loads(path.with_name("estimates.json").read_text(encoding="utf-8"))["median"]
        interval = median["confidence_interval"]
        nanoseconds = (median["point_estimate"], interval["lower_bound"], interval["upper_bound"])
        rows.append(Row(identity["group_id"], identity["function_id"], *(value / 1e6 for value in nanoseconds)))
    return rows


def ratios(rows: list[Row]) -> list[str]:
    """Compare medians of one run with each other and with their limits, as Markdown rows."""
    medians = {(row.group, row.name): row.median_ms for row in rows}
    lines = [
        f"| {name} | {medians[above] / medians[below]:.2f} | {wanted} |"
        for name, above, below, wanted in RATIOS
        if above in medians and below in medians
    ]
    lines += [
        f"| {group}, {name} | {medians[group, name]:.0f} ms | under {limit:.0f} ms on 4 cores |"
        for group, name, limit in LIMITS_MS
        if (group, name) in medians
    ]
    return lines


def machine() -> str:
    """Say what it ran on."""
    cpu = next((line.split(":")[1].strip() for line in Path("/proc/cpuinfo").read_text().splitlines() if "model name" in line), "?")
    version = subprocess.run(["rustc", "--version"], capture_output=True, text=True, check=True).stdout.strip()
    commit = subprocess.run(["git", "describe", "--always", "--dirty"], capture_output=True, text=True, check=True).stdout.strip()
    return f"{cpu}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}, {version}; commit {commit}"


def run(criterion: Path, out: Path) -> bool:
    """Write the tables; False when there is nothing to write."""
    rows = read(criterion)
    if not rows:
        return False
    out.mkdir(parents=True, exist_ok=True)
    with (out / "bench.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(Row._fields)
        writer.writerows((*row[:2], *(f"{value:.3f}" for value in row[2:])) for row in rows)
    table = [f"| {row.group} | {row.name} | {row.median_ms:.1f} | {row.low_ms:.1f}–{row.high_ms:.1f} |" for row in rows]
    text = [
        "# Benchmarks",
        "",
        machine(),
        "",
        "`make bench`; medians of one run with the 95 % interval of the median. The 12 MP photograph is a shared one enlarged to",
        "3000×4000 and saved as JPEG. OpenCV runs from Python on the same decoded pixels and cores, timed by its own process.",
        "",
        "| group | benchmark | median, ms | interval, ms |",
        "| --- | --- | --- | --- |",
        *table,
        "",
        "| figure | measured | asked for |",
        "| --- | --- | --- |",
        *ratios(rows),
        "",
    ]
    (out / "README.md").write_text("\n".join(text), encoding="utf-8")
    print("\n".join(text))
    return True
