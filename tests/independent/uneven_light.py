"""Corners of boards in uneven light: the edge of a shadow, and light that flickers while rows are read.

    python uneven_light.py path/to/deltille FOLDER [views]

Draws an AprilGrid and a ChArUco board with exact pixel integration, tilted by 30°, and multiplies the light before the blur
of the lens: by a shadow of 30 % with a blurred edge in a random direction, or by a sine along the columns. Prints RMS
errors per axis and squared errors over the stated variances.
"""

import json
import pathlib
import sys

import numpy as np
from scipy.special import ndtr

import exact
from charuco import board_of, run

SHADOW, FLICKER = 0.3, 0.1


def shadow(sigma):
    def lamp(x, y, rng):
        angle = rng.uniform(0, 2 * np.pi)
        across = (x - 512) * np.cos(angle) + (y - 400) * np.sin(angle) + rng.uniform(-100, 100)
        return SHADOW + (1 - SHADOW) * ndtr(across / sigma)

    return lamp


def flicker(period):
    return lambda x, y, rng: 1 + FLICKER * np.sin(2 * np.pi * y / period + rng.uniform(0, 2 * np.pi)) + 0 * x


# A title, the light, and the largest RMS error, px, and squared error over the variance, at a blur of 0.7 and of 2 px.
LIGHTS = [
    ("even", None, (0.006, 0.02), (1.5, 2)),
    ("shadow, edge of 16 px", shadow(16), (0.03, 0.07), (1.7, 5)),
    ("flicker over 120 px", flicker(120), (0.008, 0.035), (1.5, 4)),
    ("flicker over 60 px", flicker(60), (0.012, 0.06), (2.2, 5)),
    ("flicker over 30 px", flicker(30), (0.04, 0.15), (5, 10)),
]


if __name__ == "__main__":
    deltille, folder = map(pathlib.Path, sys.argv[1:3])
    views = int(sys.argv[3]) if len(sys.argv) > 3 else 4
    folder.mkdir(parents=True, exist_ok=True)
    options = {
        "AprilGrid": "aprilgrid --tags 6x6 --edge 24mm --gap 0.3",
        "ChArUco": "charuco --squares 8x6 --edge 30mm --marker 22mm --dictionary 5x5_100",
    }
    for name, option in options.items():
        run(deltille, *option.split(), "--name", name, "-o", folder, "--force")
        target = folder / f"{name}.json"
        board = exact.charuco(board_of(json.loads(target.read_text()))) if name == "ChArUco" else exact.aprilgrid()
        for title, lamp, errors, shares in LIGHTS:
            for blur_px, error, share in zip((0.7, 2.0), errors, shares):
                shot = exact.Shot(tilt_deg=30, cell_px=4, blur_px=blur_px, lamp=lamp)
                case = f"{name}, {title}, blur of {blur_px} px"
                seen = exact.examine(deltille, folder / case, target, board, shot, views)
                print(f"{case}: {seen}", flush=True)
                assert seen.found() > 0.95 and seen.rms() < error and np.mean(seen.shares) < share, case
