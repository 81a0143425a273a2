"""The hsv method (She §3.1, fig. 7), once with OpenCV and once with scikit-image.

Hue range with both ends, opening, closing, largest 8-connected component (the first in raster order among equals), holes
filled. Pixels outside the picture count as set when eroding and as unset when dilating, as in OpenCV.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from skimage import color, measure, morphology, segmentation

from sphereboard_tools.images import Mask, Picture

# The hue of an 8-bit colour is a whole number of degrees or at least 1/255° away from one; floating point errs by 1e-4°.
ROUNDING_DEG = 1e-3


@dataclass(frozen=True)
class HsvParameters:
    """What the hsv method was told: hues in degrees (reds begin below 0), radii in pixels."""

    hue_low_deg: float
    hue_high_deg: float
    opening_px: int
    closing_px: int

    @property
    def ranges_deg(self) -> list[tuple[float, float]]:
        """The range on every turn of the circle that has hues from 0 to 360, widened by what floating point may err."""
        low, high = self.hue_low_deg - ROUNDING_DEG, self.hue_high_deg + ROUNDING_DEG
        return [(low + turn, high + turn) for turn in (-360, 0, 360) if low + turn <= 360 and high + turn >= 0]


def disc(radius_px: int) -> np.ndarray:
    """OpenCV's elliptic element of the given radius."""
    side = 2 * radius_px + 1
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)))


def opencv_crown(picture: Picture, parameters: HsvParameters) -> Mask:
    """Segment with OpenCV alone."""
    # Not scaled to 0..1: hue does not depend on it, and the epsilon in OpenCV's division would bend the hue of near-greys.
    hue = cv2.cvtColor(picture.astype(np.float32), cv2.COLOR_RGB2HSV)[..., 0]
    mask = np.bitwise_or.reduce([cv2.inRange(hue, *span) for span in parameters.ranges_deg])
    mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, disc(parameters.opening_px))
    mask = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, disc(parameters.closing_px))
    return opencv_filled(opencv_largest(mask))


def opencv_largest(mask: np.ndarray) -> np.ndarray:
    """Keep the largest component of an 8-bit mask."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    areas = stats[1:, cv2.CC_STAT_AREA]
    if areas.size == 0:
        return mask
    largest = np.flatnonzero(areas == areas.max()) + 1
    first = min(largest, key=lambda label: int(np.argmax(labels == label)))
    return np.asarray(labels == first, dtype=np.uint8) * 255


def opencv_filled(mask: np.ndarray) -> Mask:
    """Fill the holes of an 8-bit mask: what cannot be reached from outside in steps to the side, up or down."""
    outside = cv2.copyMakeBorder(mask, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0)
    cv2.floodFill(outside, None, (0, 0), 128, flags=4)
    return np.asarray(outside[1:-1, 1:-1] != 128)


def skimage_crown(picture: Picture, parameters: HsvParameters) -> Mask:
    """Segment with scikit-image alone; only the element's shape is OpenCV's."""
    hue = color.rgb2hsv(picture)[..., 0] * 360
    mask = np.logical_or.reduce([(hue >= low) & (hue <= high) for low, high in parameters.ranges_deg])
    mask = morphology.opening(mask, disc(parameters.opening_px), mode="ignore")
    mask = morphology.closing(mask, disc(parameters.closing_px), mode="ignore")
    labels = measure.label(mask, connectivity=2)
    if labels.max() > 0:
        mask = labels == np.argmax(np.bincount(labels.ravel())[1:]) + 1
    outside = segmentation.flood(np.pad(mask, 1), (0, 0), connectivity=1)
    return np.asarray(~outside[1:-1, 1:-1])
