"""Stated uncertainties of poses and of undistorted positions: propagated.py PROGRAM FOLDER [RUNS].

cv2.projectPoints images a checkerboard with noise of 0.1 px, and `deltille calibrate` estimates the camera. cv2.solvePnP with this
camera then estimates poses of the board from exact corners, and with the true camera from corners with noise. The errors, and
those of the maps of `deltille undistort`, are compared with the stated standard deviations. A rig of two cameras estimates poses
with scipy.
"""

import json
import pathlib
import subprocess
import sys

import cv2
import numpy as np
from scipy.optimize import least_squares

program, folder = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])
runs = int(sys.argv[3]) if len(sys.argv) > 3 else 8
folder.mkdir(parents=True, exist_ok=True)

SIZE = (1280, 960)
K = np.array([[1100.0, 0, 640.3], [0, 1101.0, 478.8], [0, 0, 1]])
LENS = np.array([-0.11, 0.05, 0.0004, -0.0003, 0.0])
NOISE_PX, VIEWS = 0.1, 12
DISTANCES = [350.0, 900.0, 1500.0]
# Pose of the right camera of the rig.
RIGHT = (np.array([0.02, -0.1, 0.01]), np.array([-150.0, 3.0, 8.0]))


def run(*arguments):
    ran = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    assert ran.returncode == 0, (arguments, ran.stdout, ran.stderr)
    return ran.stdout


if not (folder / "board").exists():
    run("checkerboard", "--rows", 7, "--cols", 10, "--edge", "25mm", "--name", "board", "-o", folder / "board")
CORNERS = json.load(open(folder / "board/board.json"))["panels"][0]["corners"]
POINTS = np.array([corner["target_mm"] for corner in CORNERS], float)
CENTRE = POINTS.mean(axis=0)


def project(rotation, translation, camera=(K, LENS), points=POINTS):
    return cv2.projectPoints(points, rotation, translation, *camera)[0][:, 0]


def inside(pixels):
    return ((pixels > -0.5) & (pixels < np.array(SIZE) - 0.5)).all(axis=1)


def vector(matrix):
    return cv2.Rodrigues(np.asarray(matrix, float))[0][:, 0]


def matrix(rotation):
    return cv2.Rodrigues(np.asarray(rotation, float))[0]


def write(name, views, rng):
    """Writes detections with noise, and returns the pixels."""
    place = folder / name
    place.mkdir(exist_ok=True)
    for index, pixels in enumerate(views):
        seen = (pixels + rng.normal(0, NOISE_PX, pixels.shape)).tolist()
        found = [
            {"row": c["row"], "col": c["col"], "id": c["id"], "x": x, "y": y, "cov": [NOISE_PX**2, 0, NOISE_PX**2]}
            for c, (x, y) in zip(CORNERS, seen)
        ]
        grid = {"kind": "checker", "panel": 0, "corners": found, "tags": []}
        record = {"schema": "deltille/detection/1", "image": f"{index:03}.png", "width": SIZE[0], "height": SIZE[1]}
        json.dump({**record, "grids": [grid], "tone": None, "ink": None}, open(place / f"{index:03}.json", "w"))
    return np.concatenate(views)


def views(rng, cameras):
    """Poses at which all cameras see the whole board."""
    poses = []
    while len(poses) < VIEWS:
        rotation = matrix([np.pi, 0, 0]) @ matrix(rng.uniform(-1, 1, 3) * np.radians([35, 35, 60]))
        translation = -rotation @ CENTRE + [*rng.uniform(-90, 90, 2), rng.uniform(400, 700)]
        if all(inside(project(*seen_by(camera, rotation, translation))).all() for camera in cameras):
            poses.append((rotation, translation))
    return poses


def seen_by(camera, rotation, translation):
    """The pose in the frame of a camera with (rotation vector, translation) on the rig."""
    turn = matrix(camera[0])
    return vector(turn @ rotation), turn @ translation + camera[1]


def lens(found):
    value = {parameter["name"]: parameter["value"] for parameter in found["parameters"]}
    intrinsic = np.array([[value["fx"], 0, value["cx"]], [0, value["fy"], value["cy"]], [0, 0, 1]])
    return intrinsic, np.array([value.get(name, 0.0) for name in ("k1", "k2", "p1", "p2", "k3")])


def tilted(distance, rng, corners):
    """A pose whose centre is at a distance, where a corner was detected, tilted by 30° about a random axis."""
    while True:
        pixel = corners[rng.integers(len(corners))]
        flat = cv2.undistortPoints(pixel[None, None], K, LENS)[0, 0]
        sight = np.array([*flat, 1]) / np.linalg.norm([*flat, 1])
        up = np.array([0, -1, 0]) + sight * sight[1]
        up /= np.linalg.norm(up)
        upright = np.stack([np.cross(up, -sight), up, -sight], axis=1)
        angle = rng.uniform(0, 2 * np.pi)
        rotation = matrix(upright @ [np.cos(angle), np.sin(angle), 0] * np.radians(30)) @ upright
        translation = distance * sight - rotation @ CENTRE
        if inside(project(vector(rotation), translation)).all():
            return rotation, translation, sight


def squares(found, rotation, translation, sight):
    """Squared errors of a pose: rotation (mean of three axes), centre across (mean of two directions) and along the line of sight."""
    turned, moved = found
    turn = vector(turned @ rotation.T)
    off = turned @ CENTRE + moved - rotation @ CENTRE - translation
    along = (off @ sight) ** 2
    return np.array([turn @ turn / 3, (off @ off - along) / 2, along])


def pnp(pixels, seen, camera, start):
    first, second = vector(start[0]), np.array(start[1], float)
    found = cv2.solvePnP(POINTS[seen], pixels[seen], *camera, first.copy(), second.copy(), True, cv2.SOLVEPNP_ITERATIVE)
    return matrix(found[1][:, 0]), found[2][:, 0]


def rig_pose(images, seen, cameras, start):
    """The pose that two cameras estimate together; each has its lens and its pose."""

    def residuals(x):
        at = [project(*seen_by(pose, matrix(x[:3]), x[3:]), of) for of, pose in cameras]
        return np.concatenate([(a - b)[ok].ravel() for a, b, ok in zip(at, images, seen)])

    x = least_squares(residuals, np.concatenate([vector(start[0]), start[1]]), x_scale=[1e-3] * 3 + [1.0] * 3, xtol=1e-12, ftol=1e-12).x
    return matrix(x[:3]), x[3:]


ZERO = (np.zeros(3), np.zeros(3))
errors, stated = {}, {}


def note(key, error, sd):
    errors.setdefault(key, []).append(error)
    stated.setdefault(key, []).append(np.square(sd))


def sd(record):
    return [record["rotation_rad"], record["across_mm"], record["along_mm"]]


for seed in range(runs):
    rng = np.random.default_rng(seed)
    corners = write("one", [project(vector(r), t) for r, t in views(rng, [ZERO])], rng)
    command = ["calibrate", folder / "one", "--target", folder / "board/board.json", "--model", "radtan", "--force"]
    command += ["--board-accuracy", "0", "--uncertainty-at", ",".join(f"{d}mm" for d in DISTANCES)]
    run(*command, "-o", folder / "camera.yaml")
    found = json.load(open(folder / "camera.json"))
    estimated = lens(found)
    assert [of["distance_mm"] for of in found["pose_uncertainty"]] == DISTANCES
    for of in found["pose_uncertainty"]:
        for _ in range(24):
            rotation, translation, sight = tilted(of["distance_mm"], rng, corners)
            pixels = project(vector(rotation), translation)
            seen = inside(pixels)
            pose = pnp(pixels, seen, estimated, (rotation, translation))
            key = f"one camera, {of['distance_mm']:.0f} mm"
            note(f"{key}, calibration", squares(pose, rotation, translation, sight), sd(of["calibration"]))
            noisy = pixels + rng.normal(0, NOISE_PX, pixels.shape)
            pose = pnp(noisy, seen, (K, LENS), (rotation, translation))
            error = squares(pose, rotation, translation, sight)
            note(f"{key}, noise", error, NOISE_PX * np.array(sd(of["per_px"])))

    # Maps: the view shows at v the direction in which the true camera sees the pixel of the map, up to a rotation of the camera.
    run("undistort", "--camera", folder / "camera.json", "--maps", "--force", "-o", folder / "view")
    view = json.load(open(folder / "view/camera-undistorted.json"))
    maps = [np.load(folder / f"view/camera-undistorted-map-{axis}.npy") for axis in "xy"]
    rows, columns = np.mgrid[0 : view["height"] : 40, 0 : view["width"] : 40]
    source = np.stack([m[rows, columns] for m in maps], axis=-1).reshape(-1, 1, 2).astype(float)
    # The image is divided into 10 × 8 blocks; those without corners are left out.
    block = np.array(SIZE) / (10, 7.5)
    seen = {tuple(of) for of in ((corners + 0.5) // block).astype(int)}
    ok = (source >= 0).all(axis=(1, 2)) & [tuple(of) in seen for of in ((source[:, 0] + 0.5) // block).astype(int)]
    true = cv2.undistortPoints(source[ok], K, LENS)[:, 0]
    flat = (np.stack([columns, rows], axis=-1).reshape(-1, 2)[ok] - view["centre_px"]) / view["focal_px"]
    true, flat = (np.column_stack([of, np.ones(len(of))]) for of in (true, flat))

    def off(turn):
        turned = true @ matrix(turn).T
        return view["focal_px"] * (turned[:, :2] / turned[:, 2:] - flat[:, :2])

    turn = least_squares(lambda turn: off(turn).ravel(), np.zeros(3), x_scale=1e-3).x
    note("undistorted positions", np.array([np.mean(off(turn) ** 2)]), [view["position_sd_px"]])

    poses = views(rng, [ZERO, RIGHT])
    cameras = {"left": ZERO, "right": RIGHT}
    corners = {name: write(name, [project(*seen_by(of, r, t)) for r, t in poses], rng) for name, of in cameras.items()}
    command = ["rig", "--camera", f"left={folder / 'left'}", "--camera", f"right={folder / 'right'}", "--model", "radtan", "--force"]
    command += ["--board-accuracy", "0", "--uncertainty-at", "600mm", "--target", folder / "board/board.json"]
    run(*command, "-o", folder / "rig")
    found = json.load(open(folder / "rig/rig.json"))
    of = found["pose_uncertainty"][0]
    assert of["camera"] == "left" and of["distance_mm"] == 600
    motions = [camera["camera_from_rig"] for camera in found["cameras"]]
    motions = [(vector(np.reshape(m["rotation"], (3, 3))), np.array(m["translation_mm"])) for m in motions]
    estimated = list(zip(map(lens, found["cameras"]), motions))
    for _ in range(16):
        rotation, translation, sight = tilted(600.0, rng, corners["left"])
        images = [project(*seen_by(camera, rotation, translation)) for camera in (ZERO, RIGHT)]
        seen = [inside(pixels) for pixels in images]
        pose = rig_pose(images, seen, estimated, (rotation, translation))
        note("rig, 600 mm, calibration", squares(pose, rotation, translation, sight), sd(of["calibration"]))
        noisy = [pixels + rng.normal(0, NOISE_PX, pixels.shape) for pixels in images]
        pose = rig_pose(noisy, seen, [((K, LENS), ZERO), ((K, LENS), RIGHT)], (rotation, translation))
        note("rig, 600 mm, noise", squares(pose, rotation, translation, sight), NOISE_PX * np.array(sd(of["per_px"])))

print("squared error over stated variance (rotation, across, along), and RMS errors (°, mm, mm)")
for key, all_errors in errors.items():
    error, variance = np.mean(all_errors, axis=0), np.mean(stated[key], axis=0)
    rms = np.sqrt(error)
    rms[0] = np.degrees(rms[0]) if len(rms) == 3 else rms[0]
    ratio = error / variance
    print(f"{key}: {', '.join(f'{r:.2f}' for r in ratio)}; {', '.join(f'{r:.4f}' for r in rms)}")
    # A calibration's error is one draw for all poses.
    wide = 1 + 5 * np.sqrt(2 / (runs if "noise" not in key else 16 * runs))
    assert (ratio < wide).all() and (ratio > 1 / wide).all(), (key, ratio, wide)
