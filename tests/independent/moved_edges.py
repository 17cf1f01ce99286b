"""Checkerboards whose edges have moved, drawn by numpy: are all corners found, as precisely as without?

    moved_edges.py <program> <folder>

Blooming, bleeding ink and compression move every edge between black and white to one side, so that squares that meet
diagonally overlap or leave a gap. Each board is drawn with edges displaced by a fraction of a square (negative: black
has shrunk), at several sizes, levels of white and blurs. The corners themselves do not move.
"""

import itertools
import json
import math
import pathlib
import subprocess
import sys

import cv2
import numpy as np

erf = np.vectorize(math.erf)

ROWS, COLS = 6, 8
SHIFTS = (-0.15, -0.12, -0.09, -0.06, -0.03, 0.0, 0.03, 0.06, 0.09, 0.12)
# Sizes of the squares, px.
SQUARES = (16, 40, 80, 160)
# Samples per pixel of the profiles.
SAMPLES = 16
WHITES = (225, 255)
BLURS = (0.7, 1.5)
BLACK, NOISE = 30, 1.0
# Largest RMS error of boards with moved edges: relative to the others, or as a fraction of a square if the gap at a corner
# is so wide that corners are refined on a coarser level.
MOST, PART = 1.2, 1.25e-4


def profiles(count, square_px, shift, blur_px, start_px, size):
    """Blurred intervals along an axis, a value per pixel: even squares, odd ones, and where both overlap."""
    def interval(first, last):
        # The mean over each pixel of the integral of a Gaussian over the interval.
        at = np.arange(size * SAMPLES) / SAMPLES + 0.5 / SAMPLES - 0.5
        ends = [start_px + end * square_px for end in (first, last)]
        low, high = (0.5 * (1 + erf((at - end) / (blur_px * 2**0.5))) for end in ends)
        return (low - high).reshape(size, SAMPLES).mean(1)

    even, odd = (sum(interval(i - shift, i + 1 + shift) for i in range(k, count + 1, 2)) for k in (0, 1))
    both = sum((interval(i - shift, i + shift) for i in range(1, count + 1)), np.zeros(size)) if shift > 0 else np.zeros(size)
    return even, odd, both


def board(square_px, shift, white, blur_px, rng):
    """The image, and its corners, px. A sum of products of profiles along both axes, so the blur is exact."""
    width, height = (COLS + 3) * square_px, (ROWS + 3) * square_px
    start = square_px + rng.uniform(-0.5, 0.5, 2)
    across = profiles(COLS, square_px, shift, blur_px, start[0], width)
    down = profiles(ROWS, square_px, shift, blur_px, start[1], height)
    even, odd, both = (np.outer(v, u) for u, v in zip(across, down))
    image = white + (BLACK - white) * (even + odd - both) + rng.normal(0, NOISE, (height, width))
    col, row = np.meshgrid(np.arange(1, COLS + 1), np.arange(1, ROWS + 1))
    corners = np.stack([col, row], -1).reshape(-1, 2) * square_px + start
    return np.clip(np.rint(image), 0, 255).astype(np.uint8), corners


def main(program, folder):
    folder = pathlib.Path(folder)
    images = folder / "images"
    images.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(6)
    truth = {}
    for square_px, shift, white, blur_px in itertools.product(SQUARES, SHIFTS, WHITES, BLURS):
        name = f"{square_px}_{shift:+.2f}_{white}_{blur_px}"
        image, corners = board(square_px, shift, white, blur_px, rng)
        cv2.imwrite(str(images / f"{name}.png"), image)
        truth[name] = (square_px, shift, corners)
    subprocess.run(
        [program, "detect", images, "--grid", "checker", "--rows", str(ROWS), "--cols", str(COLS), "-o", folder / "found", "--force"],
        check=True, capture_output=True,
    )
    errors, lost = {}, []
    for name, (square_px, shift, corners) in truth.items():
        found = json.loads((folder / "found" / f"{name}.json").read_text())
        seen = np.array([[c["x"], c["y"]] for grid in found["grids"] for c in grid["corners"]]).reshape(-1, 2)
        away = np.linalg.norm(seen[:, None] - corners[None], axis=2)
        if len(seen) != len(corners) or away.min(1).max() > 0.5:
            lost.append(name)
            continue
        errors.setdefault((square_px, abs(shift) > 0.01), []).extend((away.min(1) ** 2 / 2).tolist())
        ink = found["ink"]
        assert abs(ink["edges"] - shift) < max(0.012, 3 * ink["edges_sd"]), (name, ink)
    assert not lost, f"not found: {lost}"
    for square_px in SQUARES:
        still, moved = (np.sqrt(np.mean(errors[square_px, is_moved])) for is_moved in (False, True))
        print(f"squares of {square_px} px: RMS per axis {still:.4f} px without and {moved:.4f} px with moved edges")
        assert moved < max(MOST * still, PART * square_px), square_px
    print(f"all {len(truth)} boards were found, with edges moved by {SHIFTS[0]:.0%} to {SHIFTS[-1]:.0%} of a square")


if __name__ == "__main__":
    main(*sys.argv[1:])
