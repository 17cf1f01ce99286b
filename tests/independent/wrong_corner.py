"""Simulation: a board that is measured while one of its corners is wrong, or while the lens model does not fit.

    python wrong_corner.py path/to/deltille FOLDER [--scene good|scattered|shifted|lens|both] [--size 0.05] [--views 21]
                           [--seeds 1-100] [--noise 0.05] [--model radtan]

A checkerboard of 10 × 11 corners, 20 mm apart, has independent printing errors of `--size` mm per coordinate. In a third
of the views, one corner is detected 1 to 5 px away from its position: in random directions (`scattered`), or in one
direction and by one distance (`shifted`). The lens of the scenes `lens` and `both` has a term in r⁸ that no polynomial
model contains; `both` has the corner of `scattered` too. `good` has neither.

OpenCV estimates the poses of ten further views from the measured board and camera. Prints, over all seeds: the RMS
residual of the further views, over all corners and at the wrong corner (in `lens`: at the corner with the largest); the
error of the measured wrong corner; and how often the command names the wrong corner, and others. Needs numpy and OpenCV.
"""

import argparse
import json
import pathlib
import shutil
from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np

import board_errors
from board_errors import COLS, EDGE_MM, HEIGHT, K1, K2, MARGIN_PX, P1, P2, ROWS, TRUTH, WIDTH, rotation, run

K4 = -0.03
TEST_VIEWS = 10


def project(points, k4):
    x, y = (points[:, :2] / points[:, 2:]).T
    r2 = x * x + y * y
    radial = 1 + r2 * (K1 + r2 * (K2 + r2 * r2 * k4))
    u = x * radial + 2 * P1 * x * y + P2 * (r2 + 2 * x * x)
    v = y * radial + P1 * (r2 + 2 * y * y) + 2 * P2 * x * y
    return np.stack([TRUTH["fx"] * u + TRUTH["cx"], TRUTH["fy"] * v + TRUTH["cy"]], 1)


def view(random, board, noise, k4):
    """The corners of a view that shows the whole board."""
    middle = np.array([(COLS - 1) / 2, (ROWS - 1) / 2, 0]) * EDGE_MM
    while True:
        turn = random.uniform([-0.7, -0.7, -0.5], [0.7, 0.7, 0.5]) + 1e-9
        place = random.uniform([-200, -150, 280], [200, 150, 600])
        pixels = project((board - middle) * [1, -1, -1] @ rotation(turn).T + place, k4)
        if (pixels > MARGIN_PX).all() and (pixels < [WIDTH - MARGIN_PX, HEIGHT - MARGIN_PX]).all():
            return pixels + random.normal(0, noise, pixels.shape)


def displacements(random, scene, views):
    """The displacement of the wrong corner in each view, px."""
    by = np.zeros((views, 2))
    if scene in ("good", "lens"):
        return by
    count = views // 3
    angle, size = random.uniform(0, 2 * np.pi, count), random.uniform(1, 5, count)
    if scene == "shifted":
        angle[:], size[:] = angle[0], size[0]
    by[random.permutation(views)[:count]] = (size * np.stack([np.cos(angle), np.sin(angle)])).T
    return by


def measured(path, plan):
    """The measured corners, mm, and the corners that have no measured position."""
    corners, missing = plan.copy(), set(range(len(plan)))
    for corner in json.loads(path.read_text())["panels"][0]["corners"]:
        index = corner["row"] * COLS + corner["col"]
        if "measured" in corner:
            corners[index] += corner["measured"]["offset_mm"]
            missing.discard(index)
    return corners, missing


def residuals(views, corners, camera):
    """Residuals of the further views, px, by view, corner and axis, with poses by OpenCV."""
    value = {p["name"]: p["value"] for p in camera["parameters"]}
    matrix = np.array([[value["fx"], 0, value["cx"]], [0, value["fy"], value["cy"]], [0, 0, 1]])
    lens = np.array([value.get(name, 0.0) for name in ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")])
    off = []
    for pixels in views:
        _, turn, place = cv2.solvePnP(corners, pixels, matrix, lens)
        turn, place = cv2.solvePnPRefineLM(corners, pixels, matrix, lens, turn, place)
        off.append(pixels - cv2.projectPoints(corners, turn, place, matrix, lens)[0][:, 0])
    return np.array(off)


def simulate(args, seed):
    folder = args.folder / f"{args.scene}-{seed}"
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "corners").mkdir(parents=True)
    random = np.random.default_rng(seed)
    k4 = K4 if args.scene in ("lens", "both") else 0.0
    rows, cols = (axis.ravel() for axis in np.mgrid[:ROWS, :COLS])
    plan = np.stack([cols, rows, 0 * rows], 1) * EDGE_MM
    truth = plan + board_errors.errors(random, plan, "corners", args.size)
    wrong = int(random.integers(len(plan)))
    cov = [args.noise**2, 0.0, args.noise**2]
    for index, by in enumerate(displacements(random, args.scene, args.views)):
        pixels = view(random, truth, args.noise, k4)
        pixels[wrong] += by
        corners = [
            {"row": i // COLS, "col": i % COLS, "id": None, "x": x, "y": y, "cov": cov}
            for i, (x, y) in enumerate(pixels.tolist())
        ]
        grid = {"kind": "checker", "panel": None, "corners": corners, "tags": []}
        found = {"schema": "deltille/detection/1", "image": f"{index}.png", "width": WIDTH, "height": HEIGHT}
        (folder / "corners" / f"{index:03}.json").write_text(json.dumps(found | {"grids": [grid]}))
    command = [args.deltille, "calibrate", folder / "corners", "--grid", "checker", "--rows", ROWS, "--cols", COLS]
    command += ["--edge", "20mm", "--model", args.model, "--measure-target", "-o", folder / "camera.yaml"]
    run(command)
    camera = json.loads((folder / "camera.json").read_text())
    board, missing = measured(folder / "camera-measured.json", plan)
    further = [view(random, truth, args.noise, k4) for _ in range(TEST_VIEWS)]
    squares = np.square(residuals(further, board, camera)).mean((0, 2))
    named = {f["row"] * COLS + f["col"] for f in camera.get("findings", []) if f["kind"] in ("corner", "offset")}
    shutil.rmtree(folder)
    worst = wrong if args.scene not in ("good", "lens") else int(squares.argmax())
    error_mm = np.nan if worst in missing else np.linalg.norm(fitted(board, truth)[worst] - truth[worst])
    return squares.mean(), squares[worst], error_mm, wrong in named, len(named - {wrong}), len(missing)


def fitted(board, truth):
    """The board moved and scaled onto the true one; neither pose nor scale is observable."""
    a, b = board - board.mean(0), truth - truth.mean(0)
    u, s, v = np.linalg.svd(a.T @ b)
    signs = np.array([1, 1, np.sign(np.linalg.det(u @ v))])
    return a @ (u * signs @ v) * ((s * signs).sum() / (a * a).sum()) + truth.mean(0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("deltille")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--scene", choices=["good", "scattered", "shifted", "lens", "both"], default="scattered")
    parser.add_argument("--size", type=float, default=0.05)
    parser.add_argument("--views", type=int, default=21)
    parser.add_argument("--seeds", default="1-100")
    parser.add_argument("--noise", type=float, default=0.05)
    parser.add_argument("--model", default="radtan")
    args = parser.parse_args()
    low, high = map(int, args.seeds.split("-"))
    with ThreadPoolExecutor(2) as pool:
        found = np.array(list(pool.map(lambda seed: simulate(args, seed), range(low, high + 1))), dtype=float)
    squares, of_worst, error_mm, named, others, missing = found.T
    print(f"{args.scene}, {args.model}, {args.size} mm, {args.views} views, {len(found)} seeds")
    print(f"  further views: RMS {np.sqrt(squares.mean()):.4f} px, at the corner {np.sqrt(of_worst.mean()):.4f} px", end="")
    print(f" (at most {np.sqrt(of_worst.max()):.4f})")
    print(f"  error of the corner: RMS {np.sqrt(np.nanmean(error_mm**2)):.4f} mm; {int(missing.sum())} not measured")
    print(f"  wrong corner named in {int(named.sum())}; others in {int((others > 0).sum())} ({int(others.sum())} corners)")


if __name__ == "__main__":
    main()
