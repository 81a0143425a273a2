"""OpenCV's side of the bench ``segment-12mp``: the same steps on the same pixels, timed by this process's own clock."""

import sys
import time
from pathlib import Path

from sphereboard_tools.hsv import HsvParameters, opencv_crown
from sphereboard_tools.images import read_picture


def run(picture: Path, opening_px: int, closing_px: int) -> bool:
    """Read numbers of runs from standard input and answer each with the seconds that they took."""
    pixels = read_picture(picture)
    parameters = HsvParameters(hue_low_deg=90.0, hue_high_deg=150.0, opening_px=opening_px, closing_px=closing_px)
    for line in sys.stdin:
        started = time.perf_counter()
        for _ in range(int(line)):
            opencv_crown(pixels, parameters)
        print(time.perf_counter() - started, flush=True)
    return True
