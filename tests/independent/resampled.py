"""Corners of resampled and compressed images whose edges run along rows and columns of pixels.

    python resampled.py path/to/deltille FOLDER

Each row of pixels of such an image has its own error, which moves all corners on it and is hardly visible around any of
them. Draws a checkerboard from 8 × 8 points in each pixel, blurred by 0.7 px, turned by 0.2° to 20°, with noise of
0.5 %, and processes it with OpenCV. Prints RMS errors per axis and squared errors over the stated variances.
"""

import pathlib
import subprocess
import sys

import cv2
import numpy as np

from colours import NOISE, SRGB, eight_bits, interpolated
from sharp_edges import compared

ROWS, COLS, SQUARE_PX, POINTS = 8, 11, 34.3, 8
TURNS_DEG = [0.2, 4, 20]
SEEDS = 3
# Squared errors over the variances, means over the images. At 0.2° they are 2 to 100 for rows without errors of their own.
RATIOS = 0.1, 5.0


def light(turn, shift):
    """The image without noise, 0 to 1, and the true corners."""
    width, height = (int(SQUARE_PX * (count + 5)) // 8 * 8 for count in (COLS, ROWS))
    x, y = ((np.arange(side * POINTS, dtype=np.float32) + 0.5) / POINTS - 0.5 for side in (width, height))
    along = np.array([np.cos(turn), np.sin(turn)])
    middle = np.array([width, height]) / 2 + shift
    half = SQUARE_PX * np.array([COLS - 1, ROWS - 1]) / 2
    u = (x - middle[0]) * along[0] + (y - middle[1])[:, None] * along[1] + half[0]
    v = (y - middle[1])[:, None] * along[0] - (x - middle[0]) * along[1] + half[1]
    # +1 and −1 in turn, with edges as wide as a point, because steps would be seen at only 8 places in each pixel.
    wave = lambda at: np.where(at // SQUARE_PX % 2, -1, 1) * np.clip(2 * POINTS * np.abs(at - np.rint(at / SQUARE_PX) * SQUARE_PX), 0, 1)
    is_board = (np.abs(u / SQUARE_PX - (COLS - 1) / 2) < (COLS + 1) / 2) & (np.abs(v / SQUARE_PX - (ROWS - 1) / 2) < (ROWS + 1) / 2)
    fine = np.where(is_board, 0.4 - 0.35 * wave(u) * wave(v), 0.75).astype(np.float32)
    fine = cv2.GaussianBlur(fine, (0, 0), 0.7 * POINTS)
    row, col = np.divmod(np.arange(ROWS * COLS), COLS)
    flat = np.c_[col, row] * SQUARE_PX - half
    truth = middle + flat[:, :1] * along + flat[:, 1:] * [-along[1], along[0]]
    return fine.reshape(height, POINTS, width, POINTS).mean((1, 3)), truth


def scaled(image, truth, scale, method):
    """A resized image; OpenCV rounds its sides, but not the scale."""
    resized = cv2.resize(image.astype(np.float32), None, fx=scale, fy=scale, interpolation=method)
    return eight_bits(resized), (truth + 0.5) * scale - 0.5


def compressed(image, quality):
    return cv2.imdecode(cv2.imencode(".jpg", eight_bits(image), [cv2.IMWRITE_JPEG_QUALITY, quality])[1], 1)


def pictures(image, truth, rng):
    noisy = image + rng.normal(0, NOISE, image.shape)
    colours = lambda: interpolated(image.copy(), 1, cv2.COLOR_BayerBG2BGR_EA, 65535, rng)
    yield "plain", eight_bits(noisy), truth
    yield "reduced to 0.75, linear", *scaled(noisy, truth, 0.75, cv2.INTER_LINEAR)
    yield "reduced to 0.6, area", *scaled(noisy, truth, 0.6, cv2.INTER_AREA)
    yield "enlarged to 1.3, cubic", *scaled(noisy, truth, 1.3, cv2.INTER_CUBIC)
    yield "mosaic, JPEG 95", compressed(colours(), 95), truth
    yield "mosaic, sRGB, JPEG 85", compressed(SRGB(colours()), 85), truth


def main(deltille, folder):
    images, found = folder / "images", folder / "found"
    images.mkdir(parents=True, exist_ok=True)
    truths = {}
    for turn in TURNS_DEG:
        for seed in range(SEEDS):
            rng = np.random.default_rng([seed, int(10 * turn)])
            image, truth = light(np.radians(turn), rng.uniform(-1, 1, 2))
            for name, picture, at in pictures(image, truth, rng):
                path = images / f"{name}_{turn}_{seed}.png"
                cv2.imwrite(str(path), picture)
                truths[path.stem] = (name, turn), at
    command = [deltille, "detect", images, "--grid", "checker", "--rows", ROWS, "--cols", COLS, "-o", found, "--force"]
    subprocess.run([str(of) for of in command], check=True, capture_output=True)
    errors, ratios = {}, {}
    for stem, (key, truth) in truths.items():
        corners = list(compared(found / f"{stem}.json", truth))
        assert len(corners) == ROWS * COLS, f"{stem}: {len(corners)} corners"
        errors.setdefault(key, []).extend(off for off, _ in corners)
        ratios.setdefault(key, []).extend(ratio for _, ratio in corners)
    print("| image | " + " | ".join(f"{turn}°: RMS px, e²/σ²" for turn in TURNS_DEG) + " |\n" + "|---" * (1 + len(TURNS_DEG)) + "|")
    failed = []
    for name in dict.fromkeys(name for name, _ in errors):
        cells = [f"{np.sqrt(np.mean(np.square(errors[name, turn]))):.4f}, {np.mean(ratios[name, turn]):.2f}" for turn in TURNS_DEG]
        print(f"| {name} | " + " | ".join(cells) + " |")
        wrong = [turn for turn in TURNS_DEG if not RATIOS[0] < np.mean(ratios[name, turn]) < RATIOS[1]]
        failed += [f"{name}, {turn}°" for turn in wrong]
    if failed:
        sys.exit("covariances are wrong: " + "; ".join(failed))


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]))
