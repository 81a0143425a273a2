"""The check of metrics must notice a wrong figure, so wrong figures are planted here."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from sphereboard_tools import check_metrics
from sphereboard_tools.images import BadInputError

BACKGROUNDS = [[226, 234, 242], [24, 28, 24]]


def tree(seed: int) -> np.ndarray:
    """Make a mottled square crown with straight alpha."""
    picture = np.zeros((40, 44, 4), dtype=np.uint8)
    picture[8:30, 10:34, :3] = np.random.default_rng(seed).integers(40, 140, (22, 24, 3))
    picture[8:30, 10:34, 3] = 255
    return picture


def pair(folder: Path, name: str, test: np.ndarray, **wrong: object) -> None:
    """Write a pair, the first always the same, with the figures that the check itself finds, but for those given."""
    truth = tree(0)
    files = [f"{name}.truth.png", f"{name}.test.png"]
    for file, picture in zip(files, (truth, test), strict=True):
        assert cv2.imwrite(str(folder / file), cv2.cvtColor(picture, cv2.COLOR_RGBA2BGRA))
    flat = [[check_metrics.over(picture, below) for picture in (truth, test)] for below in BACKGROUNDS]
    a, b = (picture[..., 3] >= 128 for picture in (truth, test))
    ours = {
        "flip": [check_metrics.flip(*both, 67.0) for both in flat],
        "ssim": [check_metrics.ssim_by_blocks(*both) for both in flat],
        "iou": float((a & b).sum() / (a | b).sum()),
        "hausdorff_px": 0.0,
        "area": float(b.sum() / a.sum() - 1),
        "delta_e": check_metrics.delta_e(truth, test),
        "rms": float(np.sqrt(np.mean((truth / 255 - test / 255) ** 2))),
    }
    row = {"files": files, "pixels_per_degree": 67.0, "backgrounds": BACKGROUNDS, "ours": {**ours, **wrong}}
    (folder / f"{name}.json").write_text(json.dumps(row), encoding="utf-8")


def test_right_figures_pass_and_each_wrong_one_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    for seed in range(3):
        noise = np.random.default_rng(9).integers(0, 1 + 12 * seed, (40, 44, 4)).astype(np.uint8)
        noise[..., 3] = 0
        pair(tmp_path, f"pair_{seed}", tree(0) + noise)
    assert check_metrics.run(tmp_path)
    capsys.readouterr()
    wrong = {"ssim": [0.5, 0.5], "iou": 0.9, "hausdorff_px": 3.0, "area": 0.1, "delta_e": 1.0, "rms": 0.5}
    wrong["flip"] = [{"mean": 0.001, "p99": 0.5}] * 2
    for name, value in wrong.items():
        pair(tmp_path, "pair_0", tree(0), **{name: value})
        assert not check_metrics.run(tmp_path)
        assert "pair_0.test.png" in capsys.readouterr().err


def test_known_figures():
    black, white = np.zeros((16, 16, 3), np.uint8), np.full((16, 16, 3), 255, np.uint8)
    assert check_metrics.flip(black, white, 67.0)["mean"] == pytest.approx(1, abs=0.05)
    assert check_metrics.ssim_by_blocks(black, black) == 1
    assert check_metrics.over(np.array([[[200, 100, 0, 128]]], np.uint8), [255, 255, 255])[0, 0].tolist() == [227, 177, 127]


def test_too_few_pairs_are_refused(tmp_path: Path):
    with pytest.raises(BadInputError, match="0 pairs"):
        check_metrics.run(tmp_path)
