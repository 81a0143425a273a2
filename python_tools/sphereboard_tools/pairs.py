"""The photographs whose masks people drew: PAIRS.csv and what it names."""

import csv
from dataclasses import dataclass
from pathlib import Path

from sphereboard_tools.images import BadInputError, Mask, iou, read_mask


@dataclass(frozen=True)
class Pair:
    """A photograph, its masks (at least one), and whether it shows one tree with a green crown, so that it counts."""

    photo: Path
    masks: tuple[Path, ...]
    quality: str
    counts: bool

    def score(self, mask: Mask) -> float:
        """IoU with the crown's mask or the whole tree's, whichever is nearer."""
        return max(iou(mask, read_mask(path)) for path in self.masks)


def read_pairs(folder: Path) -> list[Pair]:
    """Read PAIRS.csv of a folder."""
    table = folder / "PAIRS.csv"
    if not table.is_file():
        raise BadInputError(f"{table} is missing; give a folder with photographs, masks and their table")
    with table.open(newline="", encoding="utf-8") as file:
        return [
            Pair(
                photo=folder / row["image"],
                masks=tuple(folder / row[key] for key in ("mask_crown", "mask_tree") if row[key]),
                quality=row["quality"],
                counts=row["single_tree"] == "yes" and row["green_crown"] == "yes",
            )
            for row in csv.DictReader(file)
        ]
