"""Reading pictures and masks, finding photographs, comparing masks."""

import os
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]
Picture = NDArray[np.uint8]

SUFFIXES = {".jpg", ".jpeg", ".png", ".webp", ".tif", ".tiff", ".bmp"}
"""Endings of the files that sphereboard decodes."""

MASK_ENDINGS = ("_mask", "_crown", "_gaps")
"""Endings of the stems of masks, which lie beside their photographs and are not photographs."""


class BadInputError(Exception):
    """What was given cannot be checked; the message says what was expected and what to do next."""


def read_picture(path: Path) -> Picture:
    """Read a picture as 8-bit RGB."""
    picture = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if picture is None:
        raise BadInputError(f"{path} is not a picture that OpenCV reads; give a PNG or JPEG file")
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), dtype=np.uint8)


def read_mask(path: Path) -> Mask:
    """Read a mask: the pixels that are at least half bright."""
    picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if picture is None:
        raise BadInputError(f"{path} is not a mask that OpenCV reads; give a grey PNG file")
    return np.asarray(picture >= 128)


def photographs(folder: Path) -> list[Path]:
    """List the photographs in a folder by name, without the masks beside them."""
    files = (p for p in folder.iterdir() if p.suffix.lower() in SUFFIXES and not p.stem.endswith(MASK_ENDINGS))
    return sorted(files)


def shared_folder() -> Path | None:
    """Find the shared photographs' folder: SPHEREBOARD_SHARED, else ../shared beside the checkout; None when absent."""
    folder = Path(os.environ.get("SPHEREBOARD_SHARED") or Path(__file__).parents[3] / "shared")
    return folder if folder.is_dir() else None


def iou(a: Mask, b: Mask) -> float:
    """Intersection over union of two masks of one size; 1 when both are empty."""
    if a.shape != b.shape:
        raise BadInputError(f"masks of one size are needed, but these have {a.shape[::-1]} and {b.shape[::-1]} pixels")
    either = int(np.count_nonzero(a | b))
    return int(np.count_nonzero(a & b)) / either if either else 1.0


def resized(mask: Mask, shape: tuple[int, int]) -> Mask:
    """Scale a mask to (rows, columns), nearest pixel."""
    return np.asarray(cv2.resize(mask.astype(np.uint8), shape[::-1], interpolation=cv2.INTER_NEAREST) > 0)


def reduced(picture: Picture, longest_px: int) -> Picture:
    """Scale a picture down so that its longest side is at most ``longest_px``."""
    scale = longest_px / max(picture.shape[:2])
    if scale >= 1:
        return picture
    size = tuple(max(1, round(side * scale)) for side in picture.shape[1::-1])
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
