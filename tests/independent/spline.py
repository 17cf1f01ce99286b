"""Checks the projection of a spline lens with SciPy's B-splines, and with mrcal if it is installed.

    spline.py <deltille> <folder>

The folder has board.json and corners/, as `.ci/run` makes them. Calibrates with splines of both degrees. The corners
projected with the written camera files must match the positions in the calibration.
"""

import json
import subprocess
import sys

import numpy
import yaml
from scipy.interpolate import BSpline

deltille, folder = sys.argv[1:]


def project(camera, points):
    """Pixels of points in the camera frame, n × 3, and a flag for points where the spline is determined."""
    grid = camera["spline"]
    degree, columns, rows = grid["degree"], grid["columns"], grid["rows"]
    h = 4 * numpy.tan(numpy.radians(grid["fov_x_deg"]) / 4) / (columns - degree)
    theta = numpy.arctan2(numpy.hypot(points[:, 0], points[:, 1]), points[:, 2])
    phi = numpy.arctan2(points[:, 1], points[:, 0])
    u = 2 * numpy.tan(theta / 2)[:, None] * numpy.stack([numpy.cos(phi), numpy.sin(phi)], axis=1)
    knots = numpy.reshape(camera["distortion"], (rows, columns, 2))
    # The B-spline of control point k is centred on k.
    middle = (degree + 1) / 2
    place = u / h + (numpy.array([columns, rows]) - 1) / 2
    along = BSpline(numpy.arange(columns + degree + 1) - middle, numpy.moveaxis(knots, 1, 0), degree)
    by_row = along(place[:, 0])
    bend = numpy.empty_like(u)
    for i, y in enumerate(place[:, 1]):
        bend[i] = BSpline(numpy.arange(rows + degree + 1) - middle, by_row[i], degree)(y)
    reach = h * (numpy.array([columns, rows]) - degree) / 2
    pixels = numpy.array(camera["focal_px"]) * (u + bend) + numpy.array(camera["centre_px"])
    return pixels, (numpy.abs(u) <= reach).all(axis=1)


board = json.load(open(f"{folder}/board.json"))
places = {(c["row"], c["col"]): c["target_mm"] for c in board["panels"][0]["corners"]}
for model in ("spline-3-10x8", "spline-2-9x9"):
    path = f"{folder}/{model}"
    command = [deltille, "calibrate", f"{folder}/corners", "--target", f"{folder}/board.json"]
    command += ["--model", model, "--format", "own,mrcal", "--residuals", "--force", "-o", f"{path}.yaml"]
    subprocess.run(command, check=True, capture_output=True)
    camera, found = yaml.safe_load(open(f"{path}.yaml")), json.load(open(f"{path}.json"))
    points, predicted = [], []
    for view in found["views"]:
        pose = view["camera_from_target"]
        turn = numpy.reshape(pose["rotation"], (3, 3))
        for corner in view["corners"]:
            at = numpy.array(places[corner["row"], corner["col"]])
            points.append(turn @ at + pose["translation_mm"])
            predicted.append([corner["x"] - corner["dx"], corner["y"] - corner["dy"]])
    points, predicted = numpy.array(points), numpy.array(predicted)
    pixels, within = project(camera, points)
    assert within.all()
    off = numpy.abs(pixels - predicted).max()
    assert off < 1e-9, off
    print(f"{model}: {len(points)} corners, SciPy differs by at most {off:.1e} px")
    try:
        import mrcal
    except ImportError:
        continue
    lens = mrcal.cameramodel(f"{path}.cameramodel").intrinsics()
    off = numpy.abs(mrcal.project(points, *lens) - predicted).max()
    assert off < 1e-9, off
    print(f"{model}: mrcal differs by at most {off:.1e} px")
