"""The scoreboard's table has every row, and its page keeps its words."""

import csv
import json
from pathlib import Path

import pytest

from sphereboard_tools.images import BadInputError
from sphereboard_tools.scoreboard import MARK, run


def comparison(folder: Path, tree: str) -> Path:
    folder.mkdir()

    def row(method: str, level: str | None, height: float, flip: float) -> dict:
        cost = {"ms": 1.5, "triangles": 12, "texture_bytes": 4000, "geometry_bytes": 1000}
        return {"method": method, "level": level, "height_px": height, "error": {"flip": flip}, "cost": cost, "failed": None}

    slices = [row("slices", None, 128.0, 0.12345678), row("slices", None, 32.0, 0.05), row("slices", "far", 32.0, 0.07)]
    whole = {"disk_bytes": 777, "motion": {"flicker": 1.0, "orbit_jod": 8.25, "dolly_jod": None, "largest_at_px": None}}
    identity = {"program": "sphereboard 1", "adapter": "llvmpipe"}
    report = {
        "identity": identity,
        "source": tree,
        "methods": [{"rows": slices} | whole, {"rows": []}, {"rows": [row("billboard", None, 128.0, 0.3)]}],
    }
    (folder / "report.json").write_text(json.dumps(report), encoding="utf-8")
    return folder


def test_rows_of_all_trees_are_in_the_table_and_the_digest_behind_the_mark(tmp_path: Path):
    (tmp_path / "README.md").write_text(f"# Words\n\n{MARK}\nold\n", encoding="utf-8")
    assert run([comparison(tmp_path / "a", "oak"), comparison(tmp_path / "b", "birch")], tmp_path)
    with (tmp_path / "scoreboard.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 8
    assert rows[0] | {"tree": "oak", "method": "slices", "flip": "0.12346", "triangles": "12"} == rows[0]
    assert (rows[0]["disk_bytes"], rows[0]["orbit_jod"], rows[2]["orbit_jod"]) == ("777", "8.25", "")
    page = (tmp_path / "README.md").read_text(encoding="utf-8")
    assert page.startswith("# Words")
    assert "old" not in page
    assert "Made by sphereboard 1 on llvmpipe." in page
    assert "| slices | 0.123 | 0.050 | 8.2 | 1.50 | 5 | 12 |" in page
    assert "| billboard | 0.300 |  | – | 1.50 |" in page
    assert run([tmp_path / "a"], tmp_path)
    assert "birch" not in (tmp_path / "README.md").read_text(encoding="utf-8")


def test_what_is_no_report_is_named(tmp_path: Path):
    (tmp_path / "README.md").write_text(MARK, encoding="utf-8")
    with pytest.raises(BadInputError, match=r"report\.json is no report"):
        run([tmp_path], tmp_path)
