"""Do fixed, equal and measured parameters give the estimate of other programs?

    python constraints.py path/to/deltille DETECTIONS TARGET FOLDER

calibrates one camera from a folder of detections of a board (`--robust none --weights equal`, radtan5) and compares, in
standard deviations of the parameters,

- no constraint, `--fix k3`, `--equal fx,fy`, and both with a fixed principal point, with `cv2.calibrateCamera` and its
  flags;
- two priors and equal focal lengths, with a least squares fit by `scipy`;
- the covariance in the .npz, .csv and .json with each other and with the standard deviations.

It needs opencv-python, numpy and scipy, and prints a row for each comparison. The exit code is 1 if an estimate differs by
more than 0.02 standard deviations, or a standard deviation by more than 2 %.
"""

import csv
import json
import pathlib
import subprocess
import sys

import cv2
import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

NAMES = ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"]


def read(detections, target):
    known = json.loads(target.read_text())["panels"][0]["corners"]
    places = {(of["row"], of["col"]): [*of["panel_mm"], 0.0] for of in known}
    points, pixels = [], []
    for path in sorted(detections.glob("*.json")):
        found = json.loads(path.read_text())
        corners = [corner for grid in found["grids"] for corner in grid["corners"]]
        points.append(np.array([places[of["row"], of["col"]] for of in corners], np.float32))
        pixels.append(np.array([[of["x"], of["y"]] for of in corners], np.float32))
    return points, pixels, (found["width"], found["height"])


def own(arguments, options):
    deltille, detections, target, folder = arguments
    command = [deltille, "calibrate", detections, "--target", target, "--model", "radtan5", "--robust", "none"]
    command += ["--weights", "equal", "--board-accuracy", "0", "--force", "-o", folder / "camera.yaml", *options]
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode not in (0, 1):
        sys.exit(done.stderr)
    found = json.loads((folder / "camera.json").read_text())
    return found["sigma"], {of["name"]: (of["value"], of["sd"]) for of in found["parameters"]}


def opencv(views, flags):
    points, pixels, size = views
    start = np.array([[size[0], 0, (size[0] - 1) / 2], [0, size[0], (size[1] - 1) / 2], [0, 0, 1.0]])
    flags |= cv2.CALIB_USE_INTRINSIC_GUESS
    ends = (3, 200, 1e-15)
    found = cv2.calibrateCameraExtended(points, pixels, size, start, np.zeros(5), flags=flags, criteria=ends)
    _, matrix, lens, rotations, shifts, sds, *_ = found
    values = [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *lens.ravel()[:5]]
    return dict(zip(NAMES, zip(values, sds.ravel()))), np.hstack([rotations, shifts])[:, :, 0]


def fitted(views, priors, sigma, start):
    """The parameters with one focal length and priors, by least squares; `start` are parameters and poses."""
    points, pixels, _ = views
    names = [name for name in NAMES if name != "fy"]

    def residuals(x):
        of = dict(zip(names, x))
        rows = [[(of[name] - value) / sd] for name, (value, sd) in priors.items()]
        for place, pixel, pose in zip(points, pixels, x[len(names) :].reshape(-1, 6)):
            at = Rotation.from_rotvec(pose[:3]).apply(place.astype(float)) + pose[3:]
            a, b = at[:, 0] / at[:, 2], at[:, 1] / at[:, 2]
            r = a * a + b * b
            grown = 1 + of["k1"] * r + of["k2"] * r**2 + of["k3"] * r**3
            u = a * grown + 2 * of["p1"] * a * b + of["p2"] * (r + 2 * a * a)
            v = b * grown + of["p1"] * (r + 2 * b * b) + 2 * of["p2"] * a * b
            rows += [(of["fx"] * u + of["cx"] - pixel[:, 0]) / sigma, (of["fx"] * v + of["cy"] - pixel[:, 1]) / sigma]
        return np.concatenate(rows)

    first = np.concatenate([[start[0][name][0] for name in names], start[1].ravel()])
    found = least_squares(residuals, first, x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    sds = np.sqrt(np.diag(np.linalg.inv(found.jac.T @ found.jac)))
    return dict(zip(names, zip(found.x, sds)))


def compare(title, ours, theirs):
    found = [(ours[name], theirs[name]) for name in theirs if ours[name][1] is not None]
    off = max(abs(a[0] - b[0]) / a[1] for a, b in found)
    ratio = max(abs(a[1] / b[1] - 1) for a, b in found)
    print(f"{title}: values differ by {off:.4f} σ, standard deviations by {100 * ratio:.2f} %")
    return off < 0.02 and ratio < 0.02


def covariances(arguments, options, ours):
    files = [arguments[3] / f"covariance.{end}" for end in ("npz", "json", "csv")]
    for path in files:
        own(arguments, [*options, "--covariance", path])
    arrays, texts = np.load(files[0]), json.loads(files[1].read_text())
    rows = list(csv.DictReader(files[2].open()))
    n = len(arrays["names"])
    same = list(arrays["names"]) == texts["names"] and list(arrays["units"]) == texts["units"]
    for name in ("noise", "observed"):
        listed = np.array([float(row[name] or "nan") for row in rows]).reshape(n, n)
        written = np.array(texts[name], float)
        same &= np.array_equal(arrays[name], written, equal_nan=True) and np.array_equal(written, listed, equal_nan=True)
    sds = {name.split(".", 1)[1]: sd for name, sd in zip(texts["names"], np.sqrt(np.diag(arrays["noise"])))}
    same &= all(sd is None or abs(sds[name] / sd - 1) < 1e-9 for name, (_, sd) in ours.items() if name in sds)
    # Poses of views, about the axes of the camera, have the standard deviations that the result states.
    camera = json.loads((arguments[3] / "camera.json").read_text())
    for view in camera["views"]:
        pose = view["camera_from_target"]
        stated = np.array(pose["rotation_sd_rad"] + pose["translation_sd_mm"])
        listed = [sds[f"{view['name']}.{axis}"] for axis in ("rx", "ry", "rz", "tx", "ty", "tz")]
        same &= np.allclose(listed, stated, rtol=1e-6)
    # A joint covariance of all unknowns is positive definite.
    scale = np.sqrt(np.diag(arrays["noise"]))
    same &= np.linalg.eigvalsh(arrays["noise"] / np.outer(scale, scale))[0] > -1e-9
    print(f"covariance of {n} unknowns in three formats: {'equal' if same else 'different'}")
    return same


def main():
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    arguments = [pathlib.Path(argument).resolve() for argument in sys.argv[1:]]
    views = read(*arguments[1:3])
    arguments[3].mkdir(parents=True, exist_ok=True)
    ratio, point = cv2.CALIB_FIX_ASPECT_RATIO, cv2.CALIB_FIX_PRINCIPAL_POINT
    cases = [
        ("no constraint", [], 0),
        ("--fix k3", ["--fix", "k3"], cv2.CALIB_FIX_K3),
        ("--equal fx,fy", ["--equal", "fx,fy"], ratio),
        ("--equal fx,fy --fix k3,cx,cy", ["--equal", "fx,fy", "--fix", "k3,cx,cy"], ratio | cv2.CALIB_FIX_K3 | point),
    ]
    good = True
    for title, options, flags in cases:
        _, ours = own(arguments, options)
        theirs = opencv(views, flags)[0]
        if flags & ratio:
            # OpenCV has no standard deviation for one of the two focal lengths.
            del theirs["fx" if theirs["fx"][1] == 0 else "fy"]
        good &= compare(title, ours, theirs)
    start = opencv(views, ratio)
    centre, sd = start[0]["cx"]
    slope, of_slope = start[0]["k1"]
    priors = {"cx": (centre + sd, sd), "k1": (slope - 0.5 * of_slope, 0.5 * of_slope)}
    options = ["--equal", "fx,fy", *(f"--prior={name}={value}+-{sd}" for name, (value, sd) in priors.items())]
    sigma, ours = own(arguments, options)
    good &= compare("two priors", ours, fitted(views, priors, sigma, start))
    good &= covariances(arguments, options, ours)
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
