"""Compares undistorted and rectified images with OpenCV: undistort.py PROGRAM FOLDER.

The folder has board.json, camera.yaml, camera.json and photos of a calibrated camera. Maps are compared with those of
OpenCV, corners of undistorted photos with straight lines fitted by numpy, and rectified images of a simulated pair with
cv2.stereoRectify and, through their disparities, with the board.
"""

import json
import pathlib
import subprocess
import sys

import cv2
import numpy as np

program, folder = sys.argv[1], pathlib.Path(sys.argv[2])


def run(*arguments, code=0):
    ran = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    assert ran.returncode == code, (arguments, ran.stdout, ran.stderr)
    return ran


def lens(found):
    value = {p["name"]: p["value"] for p in found["parameters"]}
    matrix = np.array([[value["fx"], 0, value["cx"]], [0, value["fy"], value["cy"]], [0, 0, 1]])
    return matrix, np.array([value.get(k, 0.0) for k in ("k1", "k2", "p1", "p2", "k3")])


def off_plane(path):
    """RMS distance of corners from a homography, px per coordinate, as for an ideal pinhole camera."""
    seen = [c for grid in json.loads(path.read_text())["grids"] for c in grid["corners"]]
    at = {(c["row"], c["col"]): c["target_mm"][:2] for c in board["panels"][0]["corners"]}
    plan = np.float64([at[c["row"], c["col"]] for c in seen])
    place = np.float64([[c["x"], c["y"]] for c in seen])
    homography = cv2.findHomography(plan, place)[0]
    return np.sqrt(np.mean((cv2.perspectiveTransform(plan[None], homography)[0] - place) ** 2))


board = json.loads((folder / "board.json").read_text())
made = folder / "undistorted"
for field in ("inside", "whole", "70deg", "900px"):
    run("undistort", "--camera", folder / "camera.yaml", "--maps", "--field", field, "-o", made)
    view = json.loads((made / "camera-undistorted.json").read_text())
    size = view["width"], view["height"]
    storage = cv2.FileStorage(str(made / "camera-undistorted-opencv.yaml"), cv2.FILE_STORAGE_READ)
    new = storage.getNode("camera_matrix").mat()
    assert abs(new[0, 0] - view["focal_px"]) < 1e-9
    matrix, distortion = lens(json.loads((folder / "camera.json").read_text()))
    truth = cv2.initUndistortRectifyMap(matrix, distortion, np.eye(3), new, size, cv2.CV_32FC1)
    maps = [np.load(made / f"camera-undistorted-map-{axis}.npy") for axis in "xy"]
    inside = maps[0] >= 0
    assert abs(inside.mean() - view["valid_fraction"]) < 1e-9
    if field == "inside":
        assert inside.all()
    off = max(np.abs(ours - theirs)[inside].max() for ours, theirs in zip(maps, truth))
    assert off < 1e-3, off
    x, y, width, height = view["valid_px"]
    assert inside[y : y + height, x : x + width].all()

run("undistort", "--camera", folder / "camera.yaml", folder / "photos", "-o", made)
before, after = [], []
run("detect", made / "*.png", "--target", folder / "board.json", "-o", made / "corners")
for path in sorted((made / "corners").glob("*.json")):
    after.append(off_plane(path))
    before.append(off_plane(folder / "corners" / path.name.replace("-undistorted", "")))
assert len(after) > 5 and max(after) < 0.05 and np.median(before) > 5 * np.median(after), (before, after)
picture = cv2.imread(str(folder / "photos" / "0.png"), cv2.IMREAD_GRAYSCALE)
colours = np.dstack([picture, 255 - picture, picture // 2]).astype(np.uint16) * 257
cv2.imwrite(str(folder / "deep.png"), colours)
run("undistort", "--camera", folder / "camera.yaml", folder / "deep.png", "-o", folder / "deep")
deep = cv2.imread(str(folder / "deep" / "deep-undistorted.png"), cv2.IMREAD_UNCHANGED)
assert deep.dtype == np.uint16 and deep.shape == colours.shape

# A pair: the second camera is 90 mm to the right and slightly rotated.
rng = np.random.default_rng(3)
turn, shift = cv2.Rodrigues(np.array([0.02, -0.06, 0.03]))[0], np.array([-90.0, 4.0, 6.0])
for index in range(12):
    rotation = cv2.Rodrigues(np.array([np.pi, 0, 0]))[0] @ cv2.Rodrigues(rng.uniform(-0.5, 0.5, 3))[0]
    middle = np.mean([c["target_mm"] for c in board["panels"][0]["corners"]], 0)
    place = np.array([45.0, 0, 330]) + rng.uniform(-25, 25, 3) - rotation @ middle
    for name, (r, t) in {"left": (rotation, place), "right": (turn @ rotation, turn @ place + shift)}.items():
        pose = ",".join(map(str, [*cv2.Rodrigues(r)[0][:, 0], *t]))
        (folder / name).mkdir(exist_ok=True)
        run("render", folder / "board.json", "--camera", folder / "camera.yaml", f"--pose={pose}",
            "-o", folder / name / f"{index:02}.png")
cameras = []
for name in ("left", "right"):
    run("detect", folder / name / "*.png", "--target", folder / "board.json", "-o", folder / "seen" / name)
    cameras += ["--camera", f"{name}={folder}/seen/{name}"]
rig = run("rig", *cameras, "--target", folder / "board.json", "-o", folder / "rig", "--format", "kalibr")
chain = (folder / "rig" / "camchain.yaml").read_text()
assert "cam_overlaps: [1]" in chain and "rostopic: /cam1/image_raw" in chain, chain
pair = folder / "pair"
run("rectify", folder / "rig" / "rig.json", "--pair", "left,right", "--first", folder / "left", "--second",
    folder / "right", "--maps", "-o", pair)
found = json.loads((folder / "rig" / "rig.json").read_text())
(left, left_lens), (right, right_lens) = map(lens, found["cameras"])
motion = found["cameras"][1]["camera_from_rig"]
rotation, translation = np.reshape(motion["rotation"], (3, 3)), np.array(motion["translation_mm"])
size = found["cameras"][0]["width"], found["cameras"][0]["height"]
r1, r2, p1, p2, *_ = cv2.stereoRectify(left, left_lens, right, right_lens, size, rotation, translation[:, None])
storage = cv2.FileStorage(str(pair / "left-right-opencv.yaml"), cv2.FILE_STORAGE_READ)
ours = {name: storage.getNode(name).mat() for name in ("R1", "R2", "P1", "P2", "Q")}
baseline = ours["P2"][0, 3] / ours["P2"][0, 0]
assert abs(baseline + np.linalg.norm(translation)) < 1e-9
# The same relative rotation; the rotation of the pair about the baseline is arbitrary.
assert np.allclose(ours["R2"] @ rotation @ ours["R1"].T, np.eye(3), atol=1e-12)
assert np.allclose(r2 @ rotation @ r1.T, np.eye(3), atol=1e-9)
for name, (matrix, distortion), r, p in (
    ("left", (left, left_lens), ours["R1"], ours["P1"]), ("right", (right, right_lens), ours["R2"], ours["P2"])
):
    truth = cv2.initUndistortRectifyMap(matrix, distortion, r, p[:, :3], size, cv2.CV_32FC1)
    for axis, theirs in zip("xy", truth):
        assert np.abs(np.load(pair / f"{name}-rectified-map-{axis}.npy") - theirs).max() < 1e-3
    run("detect", pair / name / "*.png", "--target", folder / "board.json", "-o", pair / "seen" / name)
rows, edges = [], []
for path in sorted((pair / "seen" / "left").glob("*.json")):
    corners = [
        {(c["row"], c["col"]): (c["x"], c["y"]) for grid in json.loads(p.read_text())["grids"] for c in grid["corners"]}
        for p in (path, pair / "seen" / "right" / path.name)
    ]
    space = {}
    for label in corners[0].keys() & corners[1].keys():
        (x, y), (x2, y2) = corners[0][label], corners[1][label]
        rows.append(y - y2)
        at = ours["Q"] @ [x, y, x - x2, 1]
        space[label] = at[:3] / at[3]
    edges += [np.linalg.norm(space[r, c + 1] - space[r, c]) for r, c in space if (r, c + 1) in space]
assert len(rows) > 500 and np.sqrt(np.mean(np.square(rows))) < 0.1, np.sqrt(np.mean(np.square(rows)))
edge = board["panels"][0]["edge_mm"]
assert abs(np.median(edges) / edge - 1) < 2e-3, np.median(edges)
print(f"maps as OpenCV's; undistorted corners {np.max(after):.3f} px from a plane seen by a pinhole (before "
      f"{np.median(before):.2f}); rectified corners {np.sqrt(np.mean(np.square(rows))):.3f} px beside a common row, edges "
      f"{np.median(edges):.3f} of {edge} mm")
