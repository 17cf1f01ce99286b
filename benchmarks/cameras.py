"""Calibrations of one camera from the same simulated corners, by deltille and its peers.

    python cameras.py FOLDER               # with FOLDER/boards of photographs.py; writes FOLDER/cameras.json

numpy makes the corners: a checkerboard in 20 views, with noise; also with a board that is bent by 0.3 mm, and with one corner
in a hundred displaced by about 2 px. In these cases, all calibrators estimate the true camera's model: focal lengths, principal
point, k1, k2, p1 and p2. A fourth camera is a fisheye of 176°, equidistant with four coefficients (Kannala and Brandt;
`cv2.fisheye`), with the board in all parts of the image. lensboy and mrcal have no such model, only splines, and are not compared
there. For each calibrator, over 20 seeds (5 of `calibrateCameraRO`, which takes seconds):

    projection   RMS difference from the true camera over the whole image, after the best rotation, px, and e²/σ² over the stated
                 variance of projections at infinity
    held out     RMS residual per axis of ten further views of a flat board, after the best pose of each, px; noise 0.05 px
    fx           RMS error of the focal length, px, and mean e²/σ² over the stated variance
    halves       mean squared difference of the focal lengths of the two halves of the views, over the sum of the stated variances
    CPU          time, s
    failed       number of seeds without a calibration, because of an error; they are not in the other figures
"""

import contextlib
import copy
import importlib
import io
import json
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from typing import Callable

import cv2
import numpy as np
import scipy.optimize

import measured
import protocol

SIZE = (1280, 960)
DISPLACED_PX = 1.5
EDGE_MM = 20.0  # as in protocol.BOARDS
# Of slow calibrators, the number of seeds.
FEW = {"OpenCV calibrateCameraRO": 5}
# Of views that are held out.
OTHER_SEEDS = 1000


def brown(rays, k1, k2, p1, p2):
    x, y = rays[:, 0] / rays[:, 2], rays[:, 1] / rays[:, 2]
    square = x * x + y * y
    radial = 1 + square * (k1 + square * k2)
    return np.c_[
        x * radial + 2 * p1 * x * y + p2 * (square + 2 * x * x), y * radial + p1 * (square + 2 * y * y) + 2 * p2 * x * y
    ]


def equidistant(rays, k1, k2, k3, k4):
    radius = np.hypot(rays[:, 0], rays[:, 1])
    angle = np.arctan2(radius, rays[:, 2])
    square = angle * angle
    distorted = angle * (1 + square * (k1 + square * (k2 + square * (k3 + square * k4))))
    return rays[:, :2] * (distorted / np.maximum(radius, 1e-300))[:, None]


@dataclass
class Camera:
    """A lens model with fx, fy, cx, cy and four coefficients; the stated standard deviation of fx or None; and a function of
    pixels for the stated variance of projections at infinity, px² per axis, or None."""

    lens: Callable
    values: np.ndarray
    fx_sd: float | None = None
    variance: Callable | None = None

    @property
    def fx(self):
        return self.values[0]

    def project(self, rays):
        return self.lens(rays, *self.values[4:]) * self.values[:2] + self.values[2:4]

    def rays(self, pixels):
        """Unit vectors, by a fixed-point iteration over the angles from the axis."""
        angles = np.zeros_like(pixels)
        for _ in range(60):
            size = np.linalg.norm(angles, axis=1)
            rays = np.c_[angles * np.sinc(size / math.pi)[:, None], np.cos(size)]
            angles += (pixels - self.project(rays)) / self.values[:2]
        return rays


PINHOLE = Camera(brown, np.array([900.0, 901.5, 652.3, 474.8, -0.21, 0.07, 0.0006, -0.0004]))
# Of 176° along the diagonal, and below 90° from the axis in the whole image.
FISHEYE = Camera(equidistant, np.array([520.0, 520.8, 652.3, 474.8, -0.012, 0.006, -0.002, 0.0005]))
# The focal length with which a calibrator begins that needs one.
START_PX = {brown: 900.0, equidistant: 570.0}
CASES = {
    "flat board": {},
    "board bent by 0.3 mm": {"bent_mm": protocol.BENT_MM},
    "1 % of the corners displaced": {"displaced": 0.01},
    "fisheye of 176°, flat board": {"camera": FISHEYE},
}


def rotation(vector):
    return cv2.Rodrigues(np.asarray(vector, float))[0]


def towards(ray):
    """The rotation of the axis to a ray, about an axis in the image plane."""
    across = np.array([-ray[1], ray[0], 0])
    return rotation(across * math.atan2(np.linalg.norm(across), ray[2]) / max(np.linalg.norm(across), 1e-300))


def pose(camera, points, view):
    """The pose by `cv2.solvePnP`, as a rotation vector and a position; in a pinhole camera that faces the board, for any lens."""
    rays = camera.rays(view)
    turn = towards(rays.mean(0) / np.linalg.norm(rays.mean(0)))
    flat = rays @ turn
    _, vector, place = cv2.solvePnP(points, flat[:, :2] / flat[:, 2:], np.eye(3), None)
    return np.r_[cv2.Rodrigues(turn @ rotation(vector))[0].ravel(), turn @ place.ravel()]


class Data:
    """Corners of a board in some views."""

    def __init__(self, corners, seed, camera=PINHOLE, bent_mm=0.0, displaced=0.0, views=protocol.CALIBRATION_VIEWS):
        rng = np.random.default_rng([protocol.SEED, seed])
        focal = START_PX[camera.lens]
        self.start = Camera(camera.lens, np.array([focal, focal, (SIZE[0] - 1) / 2, (SIZE[1] - 1) / 2, 0, 0, 0, 0]))
        self.corners = corners
        points = np.array([corner["target_mm"] for corner in corners], float)
        self.points, middle = points, (points.max(0) + points.min(0)) / 2
        reach = np.linalg.norm(points - middle, axis=1).max()
        shape = points.copy()
        shape[:, 2] = bent_mm * (np.linalg.norm(points - middle, axis=1) / reach) ** 2
        self.views = []
        while len(self.views) < views:
            turn = rotation(rng.uniform(-0.6, 0.6, 3)) @ rotation([math.pi, 0, 0])
            if camera.lens is brown:
                place = np.array([*rng.uniform(-90, 90, 2), rng.uniform(220, 420)])
            else:
                ray = camera.rays(rng.uniform((0, 0), SIZE)[None])[0]
                turn, place = towards(ray) @ turn, ray * rng.uniform(150, 300)
            seen = camera.project((shape - middle) @ turn.T + place)
            if (seen < 5).any() or (seen > np.array(SIZE) - 6).any():
                continue
            seen += rng.normal(0, protocol.CORNER_SD_PX, seen.shape)
            wrong = rng.random(len(seen)) < displaced
            seen[wrong] += rng.normal(0, DISPLACED_PX, (wrong.sum(), 2))
            self.views.append(seen)

    def half(self, which):
        other = copy.copy(self)
        other.views = self.views[which::2]
        return other

    def for_opencv(self):
        """Arguments in the shape that `cv2.fisheye` needs: a row of points."""
        row = lambda points: points.astype(np.float32)[None]
        return [row(self.points)] * len(self.views), [row(view) for view in self.views], SIZE


# Each calibrator returns a camera.


def of_opencv(lens, matrix, coefficients, fx_sd=None):
    return Camera(lens, np.r_[matrix[0, 0], matrix[1, 1], matrix[:2, 2], coefficients.ravel()[:4]], fx_sd)


def by_opencv(data):
    found = cv2.calibrateCameraExtended(*data.for_opencv(), None, None, flags=cv2.CALIB_FIX_K3)
    return of_opencv(brown, found[1], found[2], float(found[5][0, 0]))


def by_opencv_ro(data):
    objects, images, size = data.for_opencv()
    fixed = max(corner["col"] for corner in data.corners)
    found = cv2.calibrateCameraROExtended(objects, images, size, fixed, None, None, flags=cv2.CALIB_FIX_K3)
    return of_opencv(brown, found[1], found[2], float(found[6][0, 0]))


def by_opencv_fisheye(data):
    flags = cv2.CALIB_RECOMPUTE_EXTRINSIC | cv2.CALIB_FIX_SKEW
    found = cv2.fisheye.calibrate(*data.for_opencv(), None, None, flags=flags)
    return of_opencv(equidistant, found[1], found[2])


def by_lensboy(data):
    import lensboy

    ids = np.arange(len(data.points))
    frames = [lensboy.Frame(target_point_indices=ids, detected_points_in_image=view) for view in data.views]
    without_k3 = np.arange(14) < 4
    config = lensboy.OpenCVConfig(*SIZE[::-1], included_distortion_coefficients=without_k3)
    with contextlib.redirect_stdout(io.StringIO()):
        model = lensboy.calibrate_camera(data.points, frames, config).camera_model
    return Camera(brown, np.array([model.fx, model.fy, model.cx, model.cy, *model.distortion_coeffs[:4]]))


def by_mrcal(data):
    """The program of mrcal, with its estimate of the board's warp and its rejection of outliers."""
    width, height = (1 + max(corner[key] for corner in data.corners) for key in ("col", "row"))
    order = sorted(range(len(data.corners)), key=lambda index: (data.corners[index]["row"], data.corners[index]["col"]))
    with tempfile.TemporaryDirectory() as folder:
        lines = ["# filename x y level"]
        for index, view in enumerate(data.views):
            lines += [f"{index:02}.png {view[at][0]:.6f} {view[at][1]:.6f} 0" for at in order]
        pathlib.Path(folder, "corners.vnl").write_text("\n".join(lines) + "\n")
        command = [
            "mrcal-calibrate-cameras", "--corners-cache", "corners.vnl", "--lensmodel", "LENSMODEL_OPENCV4", "--focal",
            str(data.start.fx), "--object-spacing", str(EDGE_MM), "--object-width-n", str(width),
            "--object-height-n", str(height), "--imagersize", str(SIZE[0]), str(SIZE[1]), "--jobs", "1", "--outdir", ".", "*.png",
        ]
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
        text = pathlib.Path(folder, "camera-0.cameramodel").read_text()
    found = re.search(r"'intrinsics':\s*\[([^\]]*)\]", text)[1]
    values = np.array([float(value) for value in found.split(",") if value.strip()])
    return Camera(brown, values, variance=lambda pixels: variance_of_mrcal(text, pixels))


def variance_of_mrcal(model, pixels):
    """By the Python for which Debian has mrcal, that of its programs."""
    code = """
import mrcal, numpy, sys
model, pixels = mrcal.cameramodel("a.cameramodel"), numpy.load("pixels.npy")
rays = mrcal.unproject(pixels, *model.intrinsics(), normalize=True)
numpy.save("variance.npy", mrcal.projection_uncertainty(rays, model, atinfinity=True, what="rms-stdev") ** 2)
"""
    first = pathlib.Path(shutil.which("mrcal-calibrate-cameras")).read_text().splitlines()[0]
    with tempfile.TemporaryDirectory() as folder:
        pathlib.Path(folder, "a.cameramodel").write_text(model)
        np.save(f"{folder}/pixels.npy", pixels)
        subprocess.run([*first[2:].split(), "-c", code], cwd=folder, check=True, capture_output=True)
        return np.load(f"{folder}/variance.npy")


def by_pycolmap(data):
    """COLMAP's bundle adjustment with constant points. In its pixel coordinates, the middle of the first pixel is 0.5."""
    import pycolmap

    pycolmap.logging.minloglevel = pycolmap.logging.FATAL.value
    model = {brown: "OPENCV", equidistant: "OPENCV_FISHEYE"}[data.start.lens]
    middle = np.array([0, 0, 0.5, 0.5, 0, 0, 0, 0])
    scene = pycolmap.Reconstruction()
    scene.add_camera_with_trivial_rig(
        pycolmap.Camera(model=model, width=SIZE[0], height=SIZE[1], params=data.start.values + middle, camera_id=1)
    )
    config = pycolmap.BundleAdjustmentConfig()
    for index, view in enumerate(data.views, 1):
        start = pose(data.start, data.points, view)
        image = pycolmap.Image(name=str(index), keypoints=view + 0.5, camera_id=1, image_id=index)
        scene.add_image_with_trivial_frame(image, pycolmap.Rigid3d(pycolmap.Rotation3d(rotation(start[:3])), start[3:]))
        config.add_image(index)
    for index, point in enumerate(data.points):
        track = pycolmap.Track([pycolmap.TrackElement(image, index) for image in range(1, 1 + len(data.views))])
        config.add_constant_point(scene.add_point3D(point, track))
    options = pycolmap.BundleAdjustmentOptions(refine_principal_point=True, print_summary=False)
    options.ceres.solver_options.num_threads = 1
    options.ceres.solver_options.max_num_iterations = 300
    adjuster = pycolmap.create_default_ceres_bundle_adjuster(options, config, scene)
    adjuster.solve()
    covariance = pycolmap.estimate_ba_covariance(pycolmap.BACovarianceOptions(), scene, adjuster)
    variance = covariance.get_other_params_cov(scene.cameras[1].params)[0, 0]
    camera = Camera(data.start.lens, scene.cameras[1].params - middle)
    poses = [scene.images[index].cam_from_world() for index in range(1, 1 + len(data.views))]
    off = np.array([camera.project(at * data.points) - view for at, view in zip(poses, data.views)])
    freedom = off.size - len(camera.values) - 6 * len(poses)
    camera.fx_sd = math.sqrt(variance * (off**2).sum() / freedom)
    return camera


def by_deltille(target, **more):
    import deltille

    def calibrate(data):
        model = {brown: "radtan", equidistant: "kannala-brandt"}[data.start.lens]
        variance = protocol.CORNER_SD_PX**2
        found = []
        for index, view in enumerate(data.views):
            corners = [
                {"row": corner["row"], "col": corner["col"], "id": corner["id"], "x": x, "y": y, "cov": [variance, 0, variance]}
                for corner, (x, y) in zip(data.corners, view.tolist())
            ]
            grid = {"kind": "checker", "panel": 0, "corners": corners, "tags": []}
            text = {"schema": "deltille/detection/1", "image": f"{index:02}", "width": SIZE[0], "height": SIZE[1]}
            found.append(deltille.Detection.from_json(json.dumps(text | {"grids": [grid]})))
        found = deltille.calibrate(found, target, model, assume_target=True, board_accuracy_mm=0, **more)
        variance = lambda pixels: np.trace(found.projection_covariance(pixels, source="observed"), axis1=1, axis2=2) / 2
        return Camera(data.start.lens, found.camera.parameters[:8], float(found.observed_sd[0]), variance)

    return calibrate


# Positions all over the image.
PIXELS = np.stack(np.meshgrid(np.linspace(0, SIZE[0] - 1, 21), np.linspace(0, SIZE[1] - 1, 16)), axis=-1).reshape(-1, 2)


def projection_error(camera, truth):
    """RMS difference from the true camera over the image, after the rotation that fits best, px per axis."""
    rays = truth.rays(PIXELS)
    off = lambda turn: (camera.project(rays @ rotation(turn).T) - PIXELS).ravel()
    return float(np.sqrt(np.mean(scipy.optimize.least_squares(off, np.zeros(3)).fun ** 2)))


def held_out(camera, data):
    """RMS residual of views with estimated poses, px per axis."""
    squares = []
    for view in data.views:
        off = lambda at: (camera.project(data.points @ rotation(at[:3]).T + at[3:]) - view).ravel()
        best = scipy.optimize.least_squares(off, pose(camera, data.points, view), x_scale="jac")
        squares.append(best.fun**2)
    return float(np.sqrt(np.mean(squares)))


def main(folder):
    cv2.setNumThreads(1)
    path = folder / "boards/checkerboard.json"
    corners = json.loads(path.read_text())["panels"][0]["corners"]
    import deltille

    target = deltille.Target.load(path)
    pinhole = {"OpenCV calibrateCamera": by_opencv, "OpenCV calibrateCameraRO": by_opencv_ro}
    fisheye = {"OpenCV fisheye.calibrate": by_opencv_fisheye}
    for name, lists, calibrate in (("lensboy", [pinhole], by_lensboy), ("pycolmap", [pinhole, fisheye], by_pycolmap)):
        try:
            importlib.import_module(name)
        except ImportError:
            print("not compared, because it is not installed:", name)
            continue
        for of in lists:
            of[name] = calibrate
    if shutil.which("mrcal-calibrate-cameras"):
        pinhole["mrcal-calibrate-cameras"] = by_mrcal
    else:
        print("not compared, because it is not installed: mrcal (a package of Debian)")
    pinhole |= {"deltille": by_deltille(target), "deltille, board_shape": by_deltille(target, board_shape=True)}
    fisheye["deltille"] = by_deltille(target)
    table = {}
    for case, options in CASES.items():
        truth = options.get("camera", PINHOLE)
        calibrators = pinhole if truth is PINHOLE else fisheye
        of_case = {name: [] for name in calibrators}
        failed = dict.fromkeys(calibrators, 0)
        for seed in range(protocol.CALIBRATIONS):
            data = Data(corners, seed, **options)
            others = Data(corners, OTHER_SEEDS + seed, truth, views=10)
            for name, calibrate in calibrators.items():
                if seed >= FEW.get(name, protocol.CALIBRATIONS):
                    continue
                try:
                    begin = measured.cpu_s()
                    camera = calibrate(data)
                    seconds = measured.cpu_s() - begin
                    halves = [] if camera.fx_sd is None else [calibrate(data.half(which)) for which in (0, 1)]
                except (cv2.error, deltille.CalibrationError, subprocess.CalledProcessError):
                    failed[name] += 1
                    continue
                off = camera.fx - truth.fx
                row = {
                    "projection": projection_error(camera, truth), "held_out": held_out(camera, others),
                    "fx": off, "cpu_s": seconds,
                }
                if camera.variance is not None:
                    row["projection_share"] = row["projection"] ** 2 / float(np.mean(camera.variance(PIXELS)))
                if halves:
                    row["share"] = (off / camera.fx_sd) ** 2
                    row["halves"] = (halves[0].fx - halves[1].fx) ** 2 / (halves[0].fx_sd ** 2 + halves[1].fx_sd ** 2)
                of_case[name].append(row)
        table[case] = {}
        for name, rows in of_case.items():
            column = lambda key: np.array([row[key] for row in rows if key in row])
            of = lambda average, key: float(average(column(key))) if len(column(key)) else None
            rms = lambda of: np.sqrt(np.mean(of**2))
            table[case][name] = {
                "projection_px": of(rms, "projection"), "projection_share": of(np.mean, "projection_share"),
                "held_out_px": of(rms, "held_out"), "fx_px": of(rms, "fx"),
                "over_stated": of(np.mean, "share"), "halves": of(np.mean, "halves"), "cpu_s": of(np.median, "cpu_s"),
            } | ({"failed": failed[name]} if failed[name] else {})
            print(case, name, table[case][name], flush=True)
    (folder / "cameras.json").write_text(json.dumps(table))


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
