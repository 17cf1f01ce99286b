"""Acceptance tests in millimetres, beside OpenCV and the truth.

    accept.py <deltille> <folder> [SEEDS]

A page drawn by poppler is photographed by numpy with two cameras, as in `rig_recording.py`. Rigs and single cameras are
calibrated from some photographs and accepted with others. Checked are: the known lengths are those of the page; most errors are
within their expanded uncertainty; each measured length is that of corners which OpenCV triangulates, or projects onto the plane
of the board; a page that is 0.4 % larger fails for a rig, conforms with its expansion, and conforms for one camera; photographs
of the calibration are not used; lengths from a table are measured instead.
"""

import json
import pathlib
import shutil
import subprocess
import sys

import cv2
import from_video
import numpy as np
from from_video import BLUR_PX, NOISE, Hand, exposed, pinhole_rays
from photograph import Page
from rig_recording import CAMERAS, RIGHT_FROM_LEFT, SIZE

VIEWS = {"calibration": 16, "acceptance": 8}
LARGER = 1.004
# Samples of a pixel along each axis: with two, aliasing moves corners by up to 0.03 px, several of their standard deviations.
FINE = from_video.FINE = 6
# Rays along the page.
np.seterr(divide="ignore")


def run(*command, code=0):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    assert done.returncode == code, f"{command}: {done.returncode}: {done.stderr}{done.stdout}"
    return done.stdout + done.stderr


def photographs(page, folder, seed, count, size=1.0):
    """Photographs of a page that is larger by a factor, by both cameras at the same time."""
    rng = np.random.default_rng(seed)
    hand = Hand(page, CAMERAS["left"], seed, 0, np.array(SIZE))
    for name, camera in CAMERAS.items():
        (folder / name).mkdir(parents=True, exist_ok=True)
        rays = pinhole_rays(camera, size=SIZE)
        for index in range(count):
            rotation, place = hand.at(20.0 * (index + 1))
            if name == "right":
                rotation, place = RIGHT_FROM_LEFT[0] @ rotation, RIGHT_FROM_LEFT[0] @ place + RIGHT_FROM_LEFT[1]
            # A larger page looks like one that is nearer.
            light = exposed(page, rays, camera["fx"], rotation, place / size, hand.centre)
            light = cv2.GaussianBlur(light, (0, 0), BLUR_PX * FINE)
            light = cv2.resize(light, SIZE, interpolation=cv2.INTER_AREA)
            grey = 20 + 185 * light + rng.normal(0, NOISE, light.shape)
            cv2.imwrite(str(folder / name / f"{index:02}.png"), np.clip(np.round(grey), 0, 255).astype(np.uint8))


def lens(camera):
    """The matrix and the coefficients of a calibrated camera."""
    value = {parameter["name"]: parameter["value"] for parameter in camera["parameters"]}
    matrix = np.array([[value["fx"], 0, value["cx"]], [0, value["fy"], value["cy"]], [0, 0, 1]])
    return matrix, np.array([value.get(name, 0.0) for name in ("k1", "k2", "p1", "p2", "k3")])


def detected(folder):
    """The corners of each image, by row and column."""
    images = {}
    for path in sorted(folder.glob("*.json")):
        grids = json.loads(path.read_text())["grids"]
        images[path.stem] = {(c["row"], c["col"]): (c["x"], c["y"]) for grid in grids for c in grid["corners"]}
    return images


def triangulated(rig, corners, frame, ends):
    """The length between two corners by OpenCV."""
    points, matrices = [], []
    for camera in rig["cameras"]:
        pixels = np.array([[corners[camera["name"]][frame][end]] for end in ends])
        points.append(cv2.undistortPoints(pixels, *lens(camera)).reshape(-1, 2).T)
        pose = camera["camera_from_rig"]
        rotation = np.array(pose["rotation"]).reshape(3, 3)
        matrices.append(np.column_stack([rotation, pose["translation_mm"]]))
    found = cv2.triangulatePoints(*matrices, *points)
    a, b = (found[:3] / found[3]).T
    return np.linalg.norm(a - b)


def in_plane(camera, corners, places, frame, ends):
    """The length between two corners in the plane of the board by OpenCV."""
    seen = corners[frame]
    pixels = np.array([[seen[end]] for end in seen])
    board = np.array([[*places[end], 0.0] for end in seen])
    matrix, distortion = lens(camera)
    _, turned, moved = cv2.solvePnP(board, pixels, matrix, distortion, flags=cv2.SOLVEPNP_ITERATIVE)
    rotation = cv2.Rodrigues(turned)[0]
    plane = np.linalg.inv(np.column_stack([rotation[:, 0], rotation[:, 1], moved]))
    rays = cv2.undistortPoints(np.array([[seen[end]] for end in ends]), matrix, distortion).reshape(-1, 2)
    a, b = ((at := plane @ [*ray, 1])[:2] / at[2] for ray in rays)
    return np.linalg.norm(a - b)


def main(program, folder, seeds=2):
    folder = pathlib.Path(folder)
    shutil.rmtree(folder, ignore_errors=True)
    board = folder / "board.json"
    run(program, "board", "--rows", 8, "--cols", 9, "--name", "board", "--pdf", "-o", folder)
    page = Page(board)
    target = json.loads(board.read_text())
    places = {(c["row"], c["col"]): np.array(c["panel_mm"][:2]) for c in target["panels"][0]["corners"]}
    exact = ["--target", board, "--board-accuracy", 0]
    ratios = {"rig": [], "camera": []}
    for seed in range(int(seeds)):
        at = folder / str(seed)
        for number, (name, count) in enumerate(VIEWS.items()):
            photographs(page, at / name, 100 * seed + number, count)
        photographs(page, at / "larger", 100 * seed + 2, VIEWS["acceptance"], LARGER)
        options = {kind: [f"--camera={name}={at / kind / name}" for name in CAMERAS] for kind in [*VIEWS, "larger"]}
        rig, camera = at / "rig.json", at / "left.json"
        run(program, "rig", *options["calibration"], "--model", "radtan", *exact, "-o", at)
        run(program, "calibrate", at / "calibration/left", "--model", "radtan", *exact, "-o", at / "left.yaml")
        for kind in [*VIEWS, "larger"]:
            for name in CAMERAS:
                run(program, "detect", at / kind / name, "--target", board, "-o", at / "corners" / kind / name)
        corners = {name: detected(at / "corners/acceptance" / name) for name in CAMERAS}
        found = {}
        for kind, given in (("rig", options["acceptance"]), ("camera", [at / "acceptance/left"])):
            calibration = rig if kind == "rig" else camera
            out = at / f"{kind}-acceptance.json"
            run(program, "accept", calibration, *given, *exact, "-o", out, "--report", out.with_suffix(".html"))
            found[kind] = json.loads(out.read_text())
            calibrated = json.loads(calibration.read_text())
            for of in found[kind]["lengths"]:
                ends = [(of[end]["row"], of[end]["col"]) for end in ("from", "to")]
                known = np.linalg.norm(places[ends[0]] - places[ends[1]])
                assert abs(known - of["known_mm"]) < 1e-3, (known, of)
                if kind == "rig":
                    other = triangulated(calibrated, corners, of["frame"], ends)
                else:
                    other = in_plane(calibrated, corners["left"], places, of["frame"], ends)
                # The linear triangulation of OpenCV weighs the images otherwise.
                close = max(of["combined_mm"], 0.3 * abs(of["error_mm"]))
                assert abs(other - of["measured_mm"]) < close, (other, of)
                ratios[kind].append(of["error_mm"] / of["combined_mm"])
        # The largest errors decide about limits.
        worst = max(abs(of["error_mm"]) + of["expanded_mm"] for of in found["rig"]["lengths"])
        limit = ["--limit", f"{1.05 * worst:.4f}mm"]
        text = run(program, "accept", rig, *options["acceptance"], *exact, *limit)
        assert text.startswith("conforms"), text
        small = ["--limit", f"{0.5 * worst:.4f}mm"]
        assert "undecided" in run(program, "accept", rig, *options["acceptance"], *exact, *small, code=3)
        fails = run(program, "accept", rig, *options["larger"], *exact, "--limit", "0.2mm+L/2000", code=1)
        assert fails.startswith("does not conform"), fails
        warm = ["--temperature", "60±0.5", "--expansion", f"{(LARGER - 1) / 40 * 1e6}±1"]
        wide = ["--limit", f"{2 * worst + 0.2:.4f}mm"]
        run(program, "accept", rig, *options["larger"], *exact, *warm, *wide)
        alone = run(program, "accept", camera, at / "larger/left", *exact, "--limit", "0.5mm")
        assert alone.startswith("conforms"), alone
        again = run(program, "accept", rig, *options["calibration"], *exact, code=2)
        assert "were used for the calibration" in again, again
        table = at / "lengths.csv"
        (a, place_a), *_, (b, place_b) = places.items()
        length = np.linalg.norm(place_a - place_b)
        table.write_text(f"row_a,col_a,row_b,col_b,length_mm,sd_mm\n{a[0]},{a[1]},{b[0]},{b[1]},{length:.4f},0.001\n")
        out = at / "known.json"
        run(program, "accept", rig, *options["acceptance"], *exact, "--lengths", table, "-o", out)
        known = json.loads(out.read_text())
        assert 0 < len(known["lengths"]) <= known["frames"] and abs(known["lengths"][0]["target_mm"] - 0.001) < 1e-9
    for kind, all_ratios in ratios.items():
        squares = np.square(all_ratios)
        within = np.mean(np.abs(all_ratios) < 2)
        print(f"{kind}: {len(squares)} lengths, e²/u² {squares.mean():.2f}, {100 * within:.1f} % within 2 u")
        assert within > 0.88, kind


if __name__ == "__main__":
    main(*sys.argv[1:])
