"""Running the sphereboard program and reading what it wrote."""

import json
import subprocess
from dataclasses import dataclass
from pathlib import Path

from sphereboard_tools.hsv import HsvParameters
from sphereboard_tools.images import BadInputError, Mask, Picture, read_mask, read_picture

REPOSITORY = Path(__file__).parents[2]


@dataclass(frozen=True)
class Segmented:
    """Our segmentation of one photograph; ``crown`` is None when it was refused, ``pixels`` are the decoded photograph."""

    photo: Path
    pixels: Picture
    crown: Mask | None
    parameters: HsvParameters | None


def find_binary(path: Path | None) -> Path:
    """Find the program: as given, else the tests' build, else the release build."""
    candidates = [path] if path else [REPOSITORY / "target" / profile / "sphereboard" for profile in ("debug", "release")]
    for candidate in candidates:
        if candidate.is_file():
            return candidate.resolve()
    raise BadInputError(f"the sphereboard program is not at {candidates[0]}; build it with cargo build, or give --binary PATH")


def segment(binary: Path, photos: list[Path], folder: Path, options: list[str]) -> list[Segmented]:
    """Segment photographs of different stems into a folder, all in one run."""
    folder.mkdir(parents=True, exist_ok=True)
    for photo in photos:  # what an earlier run left would hide a refusal of this one
        for ending in (".mask.png", ".pixels.png", ".json"):
            (folder / f"{photo.stem}{ending}").unlink(missing_ok=True)
    command = [binary, "segment", *photos, "--out", folder, "--pixels", *options]
    run = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    if run.returncode not in (0, 1) or not any(folder.glob("*.json")):
        raise BadInputError(f"sphereboard segment ended with exit code {run.returncode} and says: {run.stderr.strip()}")
    return [read_result(photo, folder) for photo in photos]


def read_result(photo: Path, folder: Path) -> Segmented:
    """Read one photograph's files; those of a refused one are missing."""
    mask, pixels, report = (folder / f"{photo.stem}{ending}" for ending in (".mask.png", ".pixels.png", ".json"))
    crown = read_mask(mask) if mask.is_file() else None
    parameters = read_parameters(report) if crown is not None else None
    return Segmented(photo, read_picture(pixels if pixels.is_file() else photo), crown, parameters)


def read_parameters(report: Path) -> HsvParameters | None:
    """Read the effective parameters; None unless the method was hsv."""
    document = json.loads(report.read_text(encoding="utf-8"))
    values = document["parameters"]["segment"]
    if values["method"] != "hsv":
        return None
    low, high = document["hue_deg"]
    return HsvParameters(
        hue_low_deg=low,
        hue_high_deg=high,
        opening_px=values["opening_px"],
        closing_px=values["closing_px"],
    )
