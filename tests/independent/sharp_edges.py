"""Corners of sharp images whose edges run along rows and columns of pixels.

    python sharp_edges.py path/to/deltille FOLDER

Draws a checkerboard by averaging 16 × 16 points in each pixel, blurred by less than a pixel, turned by 0° to 6° and shifted by
fractions of a pixel. A model that ignores the square shape of pixels displaces such corners by up to 0.15 px, depending on their place
in the pixel. Prints RMS errors per axis and squared errors over the stated variances. Needs numpy and OpenCV.
"""

import json
import pathlib
import subprocess
import sys

import cv2
import numpy as np

ROWS, COLS, SQUARE_PX, POINTS = 7, 9, 14, 16
SHIFTS = [(0, 0), (0.25, 0.125), (0.375, 0.5), (0.125, 0.375), (0.3125, 0.4375)]
# Standard deviation of the blur (px), largest RMS error of edges along rows and columns, and of others.
BLURS = [(0.0, 0.010, 0.006), (0.15, 0.006, 0.005), (0.3, 0.006, 0.005), (0.7, 0.007, 0.007)]
TURNS_DEG = [0, 0.6, 6]
NOISE = 2.5


def board(turn, blur, shift):
    """The image without noise, and the true corners."""
    width, height = SQUARE_PX * (COLS + 3), SQUARE_PX * (ROWS + 3)
    x, y = (np.arange(side * POINTS) / POINTS + 0.5 / POINTS - 0.5 for side in (width, height))
    along = np.array([np.cos(turn), np.sin(turn)])
    middle = np.array([width, height]) / 2
    half = SQUARE_PX * np.array([COLS - 1, ROWS - 1]) / 2
    u = (x - middle[0]) * along[0] + (y - middle[1])[:, None] * along[1] + half[0] - shift[0]
    v = (y - middle[1])[:, None] * along[0] - (x - middle[0]) * along[1] + half[1] - shift[1]
    i, j = np.floor(u / SQUARE_PX), np.floor(v / SQUARE_PX)
    black = ((i + j) % 2 == 0) & (i >= -1) & (i < COLS) & (j >= -1) & (j < ROWS)
    fine = np.where(black, np.float32(30), np.float32(230))
    if blur:
        fine = cv2.GaussianBlur(fine, (0, 0), blur * POINTS)
    image = fine.reshape(height, POINTS, width, POINTS).mean((1, 3))
    row, col = np.divmod(np.arange(ROWS * COLS), COLS)
    flat = np.c_[col, row] * SQUARE_PX - half + shift
    return image, middle + flat[:, :1] * along + flat[:, 1:] * [-along[1], along[0]]


def compared(found, truth):
    """The error of each corner of a detection from the nearest true one, and its square over the variance."""
    for corner in (corner for grid in json.loads(found.read_text())["grids"] for corner in grid["corners"]):
        off = truth - [corner["x"], corner["y"]]
        off = off[np.hypot(*off.T).argmin()]
        xx, xy, yy = corner["cov"]
        yield off, off @ np.linalg.solve([[xx, xy], [xy, yy]], off) / 2


def main(deltille, folder):
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(5)
    print("| blur, px | " + " | ".join(f"{turn}°: RMS px, e²/σ²" for turn in TURNS_DEG) + " |\n" + "|---" * (1 + len(TURNS_DEG)) + "|")
    failed = []
    for blur, most_aligned, most in BLURS:
        cells = []
        for turn in TURNS_DEG:
            errors, shares = [], []
            for shift in SHIFTS:
                image, truth = board(np.radians(turn), blur, shift)
                path = folder / "board.png"
                cv2.imwrite(str(path), np.clip(np.round(image + rng.normal(0, NOISE, image.shape)), 0, 255).astype(np.uint8))
                options = ["--grid", "checker", "--rows", ROWS, "--cols", COLS, "--format", "json", "-o", folder, "--force"]
                command = [str(of) for of in (deltille, "detect", path, *options)]
                subprocess.run(command, check=True, capture_output=True)
                corners = list(compared(folder / "board.json", truth))
                assert len(corners) == ROWS * COLS, f"{blur} {turn} {shift}: {len(corners)} corners"
                errors += [off for off, _ in corners]
                shares += [share for _, share in corners]
            rms, share = np.sqrt(np.mean(np.square(errors))), np.mean(shares)
            cells.append(f"{rms:.4f}, {share:.2f}")
            if rms > (most if turn == TURNS_DEG[-1] else most_aligned) or share > 3:
                failed.append(f"blur {blur} px, {turn}°: {cells[-1]}")
        print(f"| {blur} | " + " | ".join(cells) + " |", flush=True)
    if failed:
        sys.exit("\n".join(failed))


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]))
