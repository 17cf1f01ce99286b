"""Does `deltille check` answer as often as it states? Simulates a camera, its calibrations, and new views.

    python still_calibrated.py path/to/deltille FOLDER [--calibrations 10] [--repeats 200] [--views 1-6]
                               [--change none|focal|centre|distortion|bend] [--size 1.0] [--only-changed]

calibrates from 30 simulated views each time, and checks `repeats` sets of new views for each calibration. The board
differs from its description as `--board` says: stretched, bent and with displaced corners, each of standard deviation
`--board` mm (0.1). Without a change, it counts the answers `changed`. With a change, each set of views is first checked
unchanged; the camera is then changed by `size` times the change that this check states it would have found, in a random
direction: along cx and cy, in k1, or as one of three bends; and the answers that find and name it are counted. The projection, the noise and
the changes are computed here, without the library.
"""

import argparse
import collections
import json
import pathlib
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor

import numpy as np

ROWS, COLS, EDGE_MM = 8, 11, 20.0
WIDTH, HEIGHT = 1600, 1200
TRUTH = dict(f=1000.0, cx=803.0, cy=596.0, k=[-0.2, 0.06, 1e-4, -2e-4])
GRID = ["--grid", "checker", "--rows", str(ROWS), "--cols", str(COLS), "--edge", "20mm"]
KEYS = {"focal": "focal_length", "centre": "principal_point", "distortion": "distortion", "bend": "board"}


def rotation(turn):
    """The rotation matrix of a rotation vector, in radians (Rodrigues)."""
    angle = np.linalg.norm(turn)
    x, y, z = turn / angle
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def project(camera, points):
    k1, k2, p1, p2 = camera["k"]
    x, y = (points[:, :2] / points[:, 2:]).T
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * k2)
    u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    v = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return np.stack([camera["f"] * u + camera["cx"], camera["f"] * v + camera["cy"]], 1)


def plan():
    rows, cols = (axis.ravel() for axis in np.mgrid[:ROWS, :COLS])
    return rows, cols, np.stack([cols, rows, 0 * rows], 1) * EDGE_MM


def shape(points, field):
    """A displacement of the sheet: stretch, shear or one of three bends, of RMS 1 without its mean."""
    x, y, _ = (points - points.mean(0)).T
    zero = 0 * x
    fields = [(x, -y, zero), (y, x, zero), (zero, zero, x * x), (zero, zero, x * y), (zero, zero, y * y)]
    moved = np.stack(fields[field], 1)
    moved = moved - moved.mean(0)
    axes = 2 if field < 2 else 1
    return moved / np.sqrt((moved**2).sum() / (axes * len(moved)))


def printed(random, size_mm):
    """The board as it is: every kind of error has the standard deviation size_mm."""
    points = plan()[2]
    sheets = sum(random.normal(0, size_mm / np.sqrt(3)) * shape(points, field) for field in range(5))
    return points + sheets + random.normal(0, size_mm, points.shape) if size_mm > 0 else points


def poses(random, count, board):
    """Views that show the whole board."""
    found = []
    while len(found) < count:
        turn = random.uniform([-0.7, -0.7, -0.4], [0.7, 0.7, 0.4]) + 1e-9
        place = random.uniform([-200, -150, 260], [200, 150, 550])
        pixels = project(TRUTH, seen_from(board, (turn, place)))
        if (pixels > 20).all() and (pixels < [WIDTH - 20, HEIGHT - 20]).all():
            found.append((turn, place))
    return found


def seen_from(board, pose):
    # Rows run upwards on the board and downwards in the image.
    return (board - plan()[2].mean(0)) * [1, -1, -1] @ rotation(pose[0]).T + pose[1]


def write(folder, camera, board, views, noises, noise_px):
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    rows, cols, _ = plan()
    cov = [noise_px**2, 0.0, noise_px**2]
    for index, (pose, noise) in enumerate(zip(views, noises)):
        pixels = project(camera, seen_from(board, pose)) + noise_px * noise
        corners = [
            {"row": int(row), "col": int(col), "id": None, "x": x, "y": y, "cov": cov}
            for row, col, (x, y) in zip(rows, cols, pixels.tolist())
        ]
        grid = {"kind": "checker", "panel": None, "corners": corners, "tags": []}
        found = {"schema": "deltille/detection/1", "image": f"{index}.png", "width": WIDTH, "height": HEIGHT}
        (folder / f"{index:03}.json").write_text(json.dumps(found | {"grids": [grid]}))


def changed(random, camera, board, kind, stated):
    """The camera and the board after a change of the stated size, in its unit."""
    camera = dict(camera)
    if kind == "focal":
        camera["f"] *= 1 + random.choice([-1, 1]) * stated / 100
    elif kind == "centre":
        angle = random.uniform(0, 2 * np.pi)
        camera["cx"] += stated * np.cos(angle)
        camera["cy"] += stated * np.sin(angle)
    elif kind == "bend":
        board = board + stated * shape(plan()[2], random.choice([2, 3, 4]))
    elif kind == "distortion":
        # k1; the RMS displacement over the image is as stated.
        axis = np.linspace(-0.7, 0.7, 25)
        x, y = (part.ravel() for part in np.meshgrid(axis, axis * 0.75))
        moved = (x * x + y * y) * np.stack([x, y]) * camera["f"]
        camera["k"] = list(camera["k"])
        camera["k"][0] += random.choice([-1, 1]) * stated / np.sqrt((moved**2).sum(0).mean())
    return camera, board


def check(deltille, camera, folder):
    out = folder.parent / f"{folder.name}.json"
    done = subprocess.run(
        [deltille, "check", camera, folder, *GRID, "-o", out, "--force"], capture_output=True, text=True
    )
    if done.returncode not in (0, 1, 3):
        raise SystemExit(done.stderr)
    return json.loads(out.read_text())


def of_calibration(args, index):
    random = np.random.default_rng([args.seed, index])
    board = printed(random, args.board)
    folder = args.folder / str(index)
    views = poses(random, 30, board)
    noises = random.normal(0, 1, (30, ROWS * COLS, 2))
    write(folder / "calibration", TRUTH, board, views, noises, args.noise)
    camera = folder / "camera.json"
    command = [args.deltille, "calibrate", folder / "calibration", *GRID, "--model", "radtan"]
    done = subprocess.run([*command, "-o", camera.with_suffix(".yaml"), "--force"], capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(done.stderr)
    low, high = map(int, args.views.split("-"))
    counts, stated = collections.Counter(), collections.defaultdict(list)
    for _ in range(args.repeats):
        count = int(random.integers(low, high + 1))
        views = poses(random, count, board)
        noises = random.normal(0, 1, (count, ROWS * COLS, 2))
        own = printed(random, args.board) if args.other else board
        write(folder / "check", TRUTH, own, views, noises, args.noise)
        found = check(args.deltille, camera, folder / "check")
        of = {test["quantity"]: test["detectable"] for test in found["tests"]}
        for key, value in of.items():
            stated[key, count].append(value)
        if args.change == "none":
            counts[found["answer"]] += 1
            continue
        key = KEYS[args.change]
        size = args.size * of[key]
        after, bent = changed(random, TRUTH, own, args.change, size)
        write(folder / "check", after, bent, views, noises, args.noise)
        found = check(args.deltille, camera, folder / "check")
        counts[found["answer"]] += 1
        if found["answer"] == "changed":
            named = [*found["changed"], *found["or"]]
            counts["named alone"] += found["changed"] == [key] and not found["or"]
            counts["named among"] += key in named
            counts["misnamed"] += key not in named
    return counts, stated


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("deltille")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--calibrations", type=int, default=10)
    parser.add_argument("--repeats", type=int, default=200)
    parser.add_argument("--views", default="1-6")
    parser.add_argument("--change", choices=["none", *KEYS], default="none")
    parser.add_argument("--size", type=float, default=1.0)
    parser.add_argument("--board", type=float, default=0.1)
    parser.add_argument("--noise", type=float, default=0.05)
    parser.add_argument("--other", action="store_true", help="check with another print of the board")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    with ThreadPoolExecutor(2) as pool:
        results = list(pool.map(lambda index: of_calibration(args, index), range(args.calibrations)))
    counts = sum((counts for counts, _ in results), collections.Counter())
    print(f"{args.change} {args.size}: {dict(counts)} of {args.calibrations * args.repeats}")
    low, high = map(int, args.views.split("-"))
    for key in ["focal_length", "principal_point", "distortion", "board"]:
        medians = [
            f"{np.median([value for _, stated in results for value in stated[key, count]]):.3f}"
            for count in range(low, high + 1)
        ]
        print(f"  {key}: would have been found, median for {args.views} views: {', '.join(medians)}")


if __name__ == "__main__":
    main()
