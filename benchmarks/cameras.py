"""Calibrations of one camera from the same simulated corners, by deltille and its peers.

    python cameras.py FOLDER               # with FOLDER/boards of photographs.py; writes FOLDER/cameras.json

numpy and `cv2.projectPoints` make the corners: a checkerboard in 20 views, with noise; also with a board that is bent by 0.3 mm,
and with one corner in a hundred displaced by about 2 px. For each calibrator, over 20 seeds (5 of
`calibrateCameraRO`, which takes seconds):

    projection   RMS difference from the true camera over the whole image, after the best rotation, px
    held out     RMS residual per axis of ten further views of a flat board, with poses by `cv2.solvePnP`, px; noise 0.05 px
    fx           RMS error of the focal length, px, and mean e²/σ² over the stated variance
    halves       mean squared difference of the focal lengths of the two halves of the views, over the sum of the stated variances
    CPU          time, s
"""

import contextlib
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

import cv2
import numpy as np

import protocol

SIZE = (1280, 960)
TRUTH = np.array([[900.0, 0, 652.3], [0, 901.5, 474.8], [0, 0, 1]])
LENS = np.array([-0.21, 0.07, 0.0006, -0.0004, -0.008])
CASES = {
    "flat board": {},
    "board bent by 0.3 mm": {"bent_mm": protocol.BENT_MM},
    "1 % of the corners displaced": {"displaced": 0.01},
}
DISPLACED_PX = 1.5
EDGE_MM = 20.0  # as in protocol.BOARDS
# Of slow calibrators, the number of seeds.
FEW = {"OpenCV calibrateCameraRO": 5}
# Of views that are held out.
OTHER_SEEDS = 1000


class Data:
    """Corners of a board in some views."""

    def __init__(self, corners, seed, bent_mm=0.0, displaced=0.0, views=protocol.CALIBRATION_VIEWS):
        rng = np.random.default_rng([protocol.SEED, seed])
        self.corners, self.edge_mm = corners, EDGE_MM
        points = np.array([corner["target_mm"] for corner in corners], float)
        self.points, middle = points, (points.max(0) + points.min(0)) / 2
        reach = np.linalg.norm(points - middle, axis=1).max()
        shape = points.copy()
        shape[:, 2] = bent_mm * (np.linalg.norm(points - middle, axis=1) / reach) ** 2
        self.views = []
        while len(self.views) < views:
            turn = cv2.Rodrigues(np.array([math.pi, 0, 0]))[0]
            turn = cv2.Rodrigues(rng.uniform(-0.6, 0.6, 3))[0] @ turn
            place = np.array([*rng.uniform(-90, 90, 2), rng.uniform(220, 420)]) - turn @ middle
            seen = cv2.projectPoints(shape, cv2.Rodrigues(turn)[0], place, TRUTH, LENS)[0].reshape(-1, 2)
            if (seen < 5).any() or (seen > np.array(SIZE) - 6).any():
                continue
            seen += rng.normal(0, protocol.CORNER_SD_PX, seen.shape)
            wrong = rng.random(len(seen)) < displaced
            seen[wrong] += rng.normal(0, DISPLACED_PX, (wrong.sum(), 2))
            self.views.append(seen)

    def half(self, which):
        other = object.__new__(Data)
        other.corners, other.points, other.views = self.corners, self.points, self.views[which::2]
        other.edge_mm = self.edge_mm
        return other


# Each returns the camera matrix, the distortion, and the stated standard deviation of fx or None.


def by_opencv(data):
    objects = [data.points.astype(np.float32)] * len(data.views)
    images = [view.astype(np.float32) for view in data.views]
    found = cv2.calibrateCameraExtended(objects, images, SIZE, None, None)
    return found[1], found[2].ravel(), float(found[5][0, 0])


def by_opencv_ro(data):
    objects = [data.points.astype(np.float32)] * len(data.views)
    images = [view.astype(np.float32) for view in data.views]
    fixed = max(corner["col"] for corner in data.corners)
    found = cv2.calibrateCameraROExtended(objects, images, SIZE, fixed, None, None)
    return found[1], found[2].ravel(), float(found[6][0, 0])


def by_lensboy(data):
    import lensboy

    ids = np.arange(len(data.points))
    frames = [lensboy.Frame(target_point_indices=ids, detected_points_in_image=view) for view in data.views]
    config = lensboy.OpenCVConfig(image_height=SIZE[1], image_width=SIZE[0])
    with contextlib.redirect_stdout(io.StringIO()):
        model = lensboy.calibrate_camera(data.points, frames, config).camera_model
    return np.array([[model.fx, 0, model.cx], [0, model.fy, model.cy], [0, 0, 1]]), np.array(model.distortion_coeffs), None


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
            "mrcal-calibrate-cameras", "--corners-cache", "corners.vnl", "--lensmodel", "LENSMODEL_OPENCV5", "--focal", "900",
            "--object-spacing", str(data.edge_mm), "--object-width-n", str(width), "--object-height-n", str(height),
            "--imagersize", str(SIZE[0]), str(SIZE[1]), "--jobs", "1", "--outdir", ".", "*.png",
        ]
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
        text = pathlib.Path(folder, "camera-0.cameramodel").read_text()
    values = re.search(r"'intrinsics':\s*\[([^\]]*)\]", text)[1]
    fx, fy, cx, cy, *lens = (float(value) for value in values.split(",") if value.strip())
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]), np.array(lens), None


def by_deltille(target, **more):
    import deltille

    def calibrate(data):
        variance = protocol.CORNER_SD_PX**2
        found = []
        for index, view in enumerate(data.views):
            corners = [
                {"row": corner["row"], "col": corner["col"], "id": corner["id"], "x": x, "y": y, "cov": [variance, 0, variance]}
                for corner, (x, y) in zip(data.corners, view.tolist())
            ]
            grid = {"kind": "checker", "panel": 0, "corners": corners, "tags": []}
            text = {"schema": "deltille/detection/1", "image": f"{index:02}", "width": SIZE[0], "height": SIZE[1], "grids": [grid]}
            found.append(deltille.Detection.from_json(json.dumps(text)))
        camera = deltille.calibrate(found, target, "radtan5", assume_target=True, board_accuracy_mm=0, **more)
        values = dict(zip(camera.camera.parameter_names, camera.camera.parameters))
        lens = [values.get(name, 0.0) for name in ("k1", "k2", "p1", "p2", "k3")]
        matrix = np.array([[values["fx"], 0, values["cx"]], [0, values["fy"], values["cy"]], [0, 0, 1]])
        return matrix, np.array(lens), float(camera.observed_sd[0])

    return calibrate


def cpu_s():
    """CPU time of this process and of those that it has started, s."""
    of = os.times()
    return of.user + of.system + of.children_user + of.children_system


def projection_error(matrix, lens):
    """RMS difference from the true camera over the image, after the rotation that fits best, px."""
    x, y = np.meshgrid(np.linspace(0, SIZE[0] - 1, 21), np.linspace(0, SIZE[1] - 1, 16))
    pixels = np.c_[x.ravel(), y.ravel()]
    flat = cv2.undistortPoints(pixels[:, None], TRUTH, LENS, criteria=(3, 200, 1e-13)).reshape(-1, 2)
    rays = np.c_[flat, np.ones(len(pixels))]
    turn = np.zeros(3)
    for _ in range(5):
        seen, jacobian = cv2.projectPoints(rays, turn, np.zeros(3), matrix, lens)
        off = (pixels - seen.reshape(-1, 2)).ravel()
        turn = turn + np.linalg.lstsq(jacobian[:, :3], off, rcond=None)[0]
    seen = cv2.projectPoints(rays, turn, np.zeros(3), matrix, lens)[0].reshape(-1, 2)
    return float(np.sqrt(np.mean((seen - pixels) ** 2)))


def held_out(matrix, lens, data):
    """RMS residual of views with estimated poses, px per axis."""
    squares = []
    for view in data.views:
        _, turn, place = cv2.solvePnP(data.points, view, matrix, lens, flags=cv2.SOLVEPNP_ITERATIVE)
        turn, place = cv2.solvePnPRefineLM(data.points, view, matrix, lens, turn, place)
        squares.append((cv2.projectPoints(data.points, turn, place, matrix, lens)[0].reshape(-1, 2) - view) ** 2)
    return float(np.sqrt(np.mean(squares)))


def main(folder):
    path = folder / "boards/checkerboard.json"
    corners = json.loads(path.read_text())["panels"][0]["corners"]
    calibrators = {"OpenCV calibrateCamera": by_opencv, "OpenCV calibrateCameraRO": by_opencv_ro}
    try:
        import lensboy  # noqa: F401

        calibrators["lensboy"] = by_lensboy
    except ImportError:
        print("not compared, because it is not installed: lensboy")
    if shutil.which("mrcal-calibrate-cameras"):
        calibrators["mrcal-calibrate-cameras"] = by_mrcal
    else:
        print("not compared, because it is not installed: mrcal (a package of Debian)")
    import deltille

    target = deltille.Target.load(path)
    calibrators |= {"deltille": by_deltille(target), "deltille, board_shape": by_deltille(target, board_shape=True)}
    table = {}
    for case, options in CASES.items():
        of_case = {name: [] for name in calibrators}
        for seed in range(protocol.CALIBRATIONS):
            data = Data(corners, seed, **options)
            others = Data(corners, OTHER_SEEDS + seed, views=10)
            for name, calibrate in calibrators.items():
                if seed >= FEW.get(name, protocol.CALIBRATIONS):
                    continue
                begin = cpu_s()
                matrix, lens, sd = calibrate(data)
                seconds = cpu_s() - begin
                halves = [calibrate(data.half(which)) for which in (0, 1)]
                of_case[name].append({
                    "projection": projection_error(matrix, lens),
                    "held_out": held_out(matrix, lens, others),
                    "fx": matrix[0, 0] - TRUTH[0, 0],
                    "share": None if sd is None else ((matrix[0, 0] - TRUTH[0, 0]) / sd) ** 2,
                    "halves": None if sd is None else
                        (halves[0][0][0, 0] - halves[1][0][0, 0]) ** 2 / (halves[0][2] ** 2 + halves[1][2] ** 2),
                    "cpu_s": seconds,
                })
        mean = lambda rows, key: None if rows[0][key] is None else float(np.mean([row[key] for row in rows]))
        rms = lambda rows, key: float(np.sqrt(np.mean([row[key] ** 2 for row in rows])))
        table[case] = {
            name: {
                "projection_px": rms(rows, "projection"), "held_out_px": rms(rows, "held_out"), "fx_px": rms(rows, "fx"), "over_stated": mean(rows, "share"),
                "halves": mean(rows, "halves"), "cpu_s": float(np.median([row["cpu_s"] for row in rows])),
            }
            for name, rows in of_case.items()
        }
        for name, of in table[case].items():
            print(case, name, of, flush=True)
    (folder / "cameras.json").write_text(json.dumps(table))


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
