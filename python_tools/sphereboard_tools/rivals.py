"""Segmentation by general methods that are told nothing but "the tree is in the middle".

Both work on a picture reduced to 256 pixels, keep the largest component and fill its holes, as the hsv method does.
"""

import warnings

import cv2
import numpy as np
from skimage import segmentation

from sphereboard_tools.hsv import opencv_filled, opencv_largest
from sphereboard_tools.images import Mask, Picture, reduced, resized

LONGEST_PX = 256
MARGIN = 0.02
"""What the rectangle leaves free on each side; tried 0.02 to 0.15 on the pairs, and this serves both methods best."""


def grabcut(picture: Picture) -> Mask:
    """OpenCV's GrabCut, five rounds from the centred rectangle."""
    small = reduced(picture, LONGEST_PX)
    rows, columns = small.shape[:2]
    rectangle = tuple(round(v) for v in (columns * MARGIN, rows * MARGIN, columns * (1 - 2 * MARGIN), rows * (1 - 2 * MARGIN)))
    labels = np.zeros((rows, columns), dtype=np.uint8)
    cv2.setRNGSeed(0)  # GrabCut's clustering draws random numbers
    try:
        cv2.grabCut(small, labels, rectangle, np.zeros((1, 65)), np.zeros((1, 65)), 5, cv2.GC_INIT_WITH_RECT)
    except cv2.error:  # one colour only: nothing to tell apart
        return np.zeros(picture.shape[:2], dtype=bool)
    return cleaned((labels == cv2.GC_FGD) | (labels == cv2.GC_PR_FGD), picture)


def random_walker(picture: Picture) -> Mask:
    """scikit-image's random walker: the middle of the rectangle is crown, the picture's border is not."""
    small = reduced(picture, LONGEST_PX)
    rows, columns = small.shape[:2]
    y, x = np.mgrid[0:rows, 0:columns]
    u, v = (x + 0.5) / columns - 0.5, (y + 0.5) / rows - 0.5
    labels = np.zeros((rows, columns), dtype=np.int32)
    labels[np.hypot(u, v) < (0.5 - MARGIN) / 2] = 1
    labels[np.maximum(abs(u), abs(v)) > 0.5 - MARGIN] = 2
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it advises on solvers
        found = segmentation.random_walker(small.astype(float) / 255, labels, beta=90, mode="bf", channel_axis=-1)
    return cleaned(found == 1, picture)


def cleaned(mask: Mask, picture: Picture) -> Mask:
    """Keep the largest component, fill its holes, scale to the picture's size."""
    return resized(opencv_filled(opencv_largest(mask.astype(np.uint8) * 255)), picture.shape[:2])
