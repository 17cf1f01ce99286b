"""Detections of very many views, to measure how long a calibration takes: many_views.py FOLDER VIEWS
[ROWS COLS OFF_MM].

A board of 10 × 11 corners, 20 mm apart, in front of a camera of 1600 × 1200 px with weak distortion; with ROWS, COLS
and OFF_MM, a board of 220 mm with randomly displaced corners. The corner noise is 0.05 px. Time and memory are measured
with:

    /usr/bin/time -v deltille calibrate FOLDER --grid checker --rows 10 --cols 11 --edge 20mm --model radtan5 -o OUT
"""

import json
import pathlib
import sys

import numpy as np

ROWS, COLS, WIDTH_MM = 10, 11, 220.0
WIDTH, HEIGHT, FOCAL_PX = 1600, 1200, 1000.0
K1, K2, P1, P2, K3 = -0.2, 0.06, 1e-4, -2e-4, 0.0
NOISE_PX, MARGIN_PX = 0.05, 10.0


def rotation(turn):
    """The rotation matrix of a rotation vector, in radians (Rodrigues)."""
    angle = np.linalg.norm(turn)
    x, y, z = turn / angle
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def project(points):
    x, y = (points[:, :2] / points[:, 2:]).T
    r2 = x * x + y * y
    radial = 1 + r2 * (K1 + r2 * (K2 + r2 * K3))
    u = x * radial + 2 * P1 * x * y + P2 * (r2 + 2 * x * x)
    v = y * radial + P1 * (r2 + 2 * y * y) + 2 * P2 * x * y
    return np.stack([FOCAL_PX * u + (WIDTH - 1) / 2, FOCAL_PX * v + (HEIGHT - 1) / 2], 1)


def view(random, board):
    """The corners of a view that shows the whole board."""
    while True:
        turn = random.uniform([-0.7, -0.7, -0.5], [0.7, 0.7, 0.5]) + 1e-9
        place = random.uniform([-180, -130, 280], [180, 130, 600])
        # Rows run upwards on the board and downwards in the image.
        pixels = project((board - board.mean(0)) * [1, -1, -1] @ rotation(turn).T + place)
        if (pixels > MARGIN_PX).all() and (pixels < [WIDTH - MARGIN_PX, HEIGHT - MARGIN_PX]).all():
            return pixels + random.normal(0, NOISE_PX, pixels.shape)


def main(folder, views, rows=ROWS, cols=COLS, off_mm=0.0):
    folder.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(1)
    rows, cols = (axis.ravel() for axis in np.mgrid[:rows, :cols])
    board = np.stack([cols, rows, 0 * rows], 1) * (WIDTH_MM / (cols.max() + 1))
    if off_mm > 0:
        board += random.normal(0, off_mm, board.shape)
    variance = NOISE_PX**2
    for index in range(views):
        corners = [
            {"row": int(row), "col": int(col), "id": None, "x": x, "y": y, "cov": [variance, 0.0, variance]}
            for row, col, (x, y) in zip(rows, cols, view(random, board).tolist())
        ]
        grid = {"kind": "checker", "panel": None, "corners": corners, "tags": []}
        name = f"{index:05}"
        found = {"schema": "deltille/detection/1", "image": f"{name}.png", "width": WIDTH, "height": HEIGHT}
        (folder / f"{name}.json").write_text(json.dumps(found | {"grids": [grid]}))


main(pathlib.Path(sys.argv[1]), *map(int, sys.argv[2:5]), *map(float, sys.argv[5:]))
