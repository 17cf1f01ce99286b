"""Grids of circles, checked with OpenCV.

    python circles.py path/to/deltille FOLDER

makes grids in FOLDER and renders their pages with poppler. OpenCV's findCirclesGrid must find all circles in the order
and at the positions that the description states. Needs numpy, OpenCV and pdftoppm.
"""

import json
import pathlib
import subprocess
import sys

import cv2
import numpy as np

DPI = 200

GRIDS = {
    "plain": "--circles 9x7 --spacing 25mm",
    "large": "--circles 7x10 --spacing 18mm --diameter 13mm",
    "asymmetric": "--circles 4x11 --asymmetric --spacing 20mm",
    "wide": "--circles 7x5 --asymmetric --spacing 18mm --diameter 13mm",
}


def run(*command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    assert done.returncode == 0, f"{' '.join(map(str, command))}: {done.stdout}{done.stderr}"


def object_points(spec):
    """The object points of OpenCV's calibration samples."""
    (columns, rows), step = spec["circles"], spec["spacing_mm"]
    x = (lambda i, j: 2 * j + i % 2) if spec["asymmetric"] else (lambda i, j: j)
    return np.array([[x(i, j) * step, i * step, 0.0] for i in range(rows) for j in range(columns)])


def check(deltille, folder, name, options):
    run(deltille, "circles", *options.split(), "--name", name, "-o", folder)
    target = json.loads((folder / f"{name}.json").read_text())
    spec, panel, sheet = target["spec"], target["panels"][0], target["sheets"][0]
    corners = sorted(panel["corners"], key=lambda corner: corner["id"])
    off = np.abs(object_points(spec) - [corner["target_mm"] for corner in corners]).max()
    assert off < 1e-6, f"{name}: {off} mm from OpenCV's object points"

    run("pdftoppm", "-r", DPI, "-gray", "-singlefile", "-png", folder / f"{name}.pdf", folder / name)
    image = cv2.imread(str(folder / f"{name}.png"), cv2.IMREAD_GRAYSCALE)
    placement = sheet["placements"][0]
    # Rotates the page so that the board is upright, as it was made.
    if abs(placement["angle_rad"]) > 0.1:
        image = cv2.rotate(image, cv2.ROTATE_90_CLOCKWISE)
    places = np.array([complex(*corner["panel_mm"]) for corner in corners])
    page = places * np.exp(1j * placement["angle_rad"]) + complex(*placement["origin_mm"])
    stated = np.c_[page.real, sheet["height_mm"] - page.imag]
    if abs(placement["angle_rad"]) > 0.1:
        stated = np.c_[sheet["height_mm"] - stated[:, 1], stated[:, 0]]
    kind = cv2.CALIB_CB_ASYMMETRIC_GRID if spec["asymmetric"] else cv2.CALIB_CB_SYMMETRIC_GRID
    # The default maximum area of circles is too small.
    parameters = cv2.SimpleBlobDetector.Params()
    parameters.maxArea = 1e6
    blobs = cv2.SimpleBlobDetector.create(parameters)
    found, centres = cv2.findCirclesGrid(image, spec["circles"], flags=kind, blobDetector=blobs)
    assert found, f"{name}: OpenCV finds no grid"
    off_mm = (centres.reshape(-1, 2) + 0.5) * 25.4 / DPI - stated
    worst = np.hypot(*off_mm.T).max()
    assert worst < 0.05, f"{name}: {worst} mm, or another order"
    print(f"{name}: OpenCV finds {len(centres)} circles in their order, within {worst:.3f} mm")


if __name__ == "__main__":
    folder = pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    for name, options in GRIDS.items():
        check(pathlib.Path(sys.argv[1]), folder, name, options)
