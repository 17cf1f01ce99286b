"""Does `deltille check` answer as often as it states? Simulates cameras, their calibrations, and new views.

    python still_calibrated.py path/to/deltille FOLDER [--calibrations 400] [--repeats 5] [--views 1-6] [--rig]
                               [--change none|focal|centre|distortion|bend|pose] [--size 1.0]
                               [--board 0.1] [--accuracy 0.1] [--other]

calibrates from 30 simulated views each time, and checks `repeats` sets of new views for each calibration. The board
differs from its description as `--board` says: stretched, bent and with displaced corners, each of standard deviation
`--board` mm. `--accuracy` is the value that deltille is given (by default the same); with `--other`, the new views show
another print. With `--rig`, a second camera sees the board at the same time.

Without a change, it counts the answers `changed`, of which the 95 % interval is printed (Clopper and Pearson 1934), and
fails if it lies above the stated rate.
With a change, each set of views is first checked unchanged; the camera (the second one of a rig) is then changed by
`size` times the change that this check states it would have found, in a random direction: along cx and cy, in k1, as
one of three bends, or of its pose. The answers that find and name it are counted. The projection, the noise and the
changes are computed here, without the library.
"""

import argparse
import collections
import json
import pathlib
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from scipy.stats import beta

ROWS, COLS, EDGE_MM = 8, 11, 20.0
# Stated rate of the answer `changed` for unchanged cameras.
FALSE_ALARM = 1e-3
WIDTH, HEIGHT = 1600, 1200
TRUTH = dict(f=1000.0, cx=803.0, cy=596.0, k=[-0.2, 0.06, 1e-4, -2e-4])
GRID = ["--grid", "checker", "--rows", str(ROWS), "--cols", str(COLS), "--edge", "20mm"]
KEYS = {
    "focal": "focal_length",
    "centre": "principal_point",
    "distortion": "distortion",
    "bend": "board",
    "pose": "pose",
}
# The second camera of a rig, from the first: a rotation vector and a translation.
BESIDE = (np.array([0.01, -0.15, 0.02]), np.array([-60.0, 2.0, 5.0]))


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


def poses(random, count, board, eyes, tilt=0.7):
    """Views in which every camera sees the whole board, turned by up to `tilt` radians about both of its axes."""
    found = []
    while len(found) < count:
        turn = random.uniform([-tilt, -tilt, -0.4], [tilt, tilt, 0.4]) + 1e-9
        place = random.uniform([-200, -150, 260], [200, 150, 550])
        seen = np.concatenate([project(TRUTH, seen_from(board, (turn, place), eye)) for eye in eyes])
        if (seen > 20).all() and (seen < [WIDTH - 20, HEIGHT - 20]).all():
            found.append((turn, place))
    return found


def seen_from(board, pose, eye=None):
    # Rows run upwards on the board and downwards in the image.
    points = (board - plan()[2].mean(0)) * [1, -1, -1] @ rotation(pose[0]).T + pose[1]
    return points if eye is None else points @ rotation(eye[0]).T + eye[1]


def write(folder, cameras, board, views, noises, noise_px):
    """Writes the detections of every camera (its parameters and its pose) into a folder of its own."""
    shutil.rmtree(folder, ignore_errors=True)
    rows, cols, _ = plan()
    cov = [noise_px**2, 0.0, noise_px**2]
    for number, (camera, eye) in enumerate(cameras):
        (folder / str(number)).mkdir(parents=True)
        for index, pose in enumerate(views):
            pixels = project(camera, seen_from(board, pose, eye)) + noise_px * noises[number, index]
            corners = [
                {"row": int(row), "col": int(col), "id": None, "x": x, "y": y, "cov": cov}
                for row, col, (x, y) in zip(rows, cols, pixels.tolist())
            ]
            grid = {"kind": "checker", "panel": None, "corners": corners, "tags": []}
            found = {"schema": "deltille/detection/1", "image": f"{index}.png", "width": WIDTH, "height": HEIGHT}
            (folder / f"{number}/{index:03}.json").write_text(json.dumps(found | {"grids": [grid]}))


def named(folder, cameras):
    """The arguments that name the detections of all cameras."""
    if len(cameras) == 1:
        return [folder / "0"]
    return [part for number in range(len(cameras)) for part in ("--camera", f"camera{number}={folder / str(number)}")]


def changed(random, camera, eye, board, views, kind, stated):
    """The camera, its pose and the board after a change of the stated size, in its unit."""
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
    elif kind == "pose":
        # A rotation and a translation; the RMS displacement of the corners is as stated.
        step = random.normal(0, 1, 6) * [1e-4, 1e-4, 1e-4, 0.05, 0.05, 0.05]
        moved = moved_by(eye, step)
        before, after = (
            np.concatenate([project(camera, seen_from(board, at, one)) for at in views]) for one in (eye, moved)
        )
        eye = moved_by(eye, step * stated / np.sqrt(((after - before) ** 2).sum(1).mean()))
    return camera, eye, board


def moved_by(eye, step):
    turned = rotation(step[:3]) @ rotation(eye[0])
    angle = np.arccos((np.trace(turned) - 1) / 2)
    axis = np.array([turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]])
    return angle * axis / (2 * np.sin(angle)), eye[1] + step[3:]


def run(command, codes):
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode not in codes:
        raise SystemExit(done.stderr)


def of_calibration(args, index):
    random = np.random.default_rng([args.seed, index])
    board = printed(random, args.board)
    folder = args.folder / str(index)
    eyes = [None, BESIDE] if args.rig else [None]
    cameras = [(TRUTH, eye) for eye in eyes]
    accuracy = args.board if args.accuracy is None else args.accuracy
    accuracy = [*GRID, "--board-accuracy", f"{accuracy}mm", "--force"]

    def noise(count):
        return random.normal(0, 1, (len(eyes), count, ROWS * COLS, 2))

    def check(views):
        out = folder / "check.json"
        inputs = named(views, cameras)
        run([args.deltille, "check", calibration, *inputs, *accuracy, "-o", out], (0, 1, 3))
        return json.loads(out.read_text())

    views = poses(random, 30, board, eyes)
    write(folder / "calibration", cameras, board, views, noise(30), args.noise)
    inputs = [*named(folder / "calibration", cameras), "--model", "radtan", *accuracy]
    if args.rig:
        calibration = folder / "rig.json"
        run([args.deltille, "rig", *inputs, "-o", folder], (0,))
    else:
        calibration = folder / "camera.json"
        run([args.deltille, "calibrate", *inputs, "-o", folder / "camera.yaml"], (0,))
    low, high = map(int, args.views.split("-"))
    last = "camera1" if args.rig else ""
    counts, stated = collections.Counter(), collections.defaultdict(list)
    for _ in range(args.repeats):
        count = int(random.integers(low, high + 1))
        views = poses(random, count, board, eyes, args.tilt)
        noises = noise(count)
        own = printed(random, args.board) if args.other else board
        write(folder / "check", cameras, own, views, noises, args.noise)
        found = check(folder / "check")
        of = {(test["quantity"], test.get("camera", "")): test["detectable"] for test in found["tests"]}
        for key in KEYS.values():
            stated[key, count] += [of[name] for name in of if name in ((key, last), (key, ""))]
        if args.change == "none":
            counts[found["answer"]] += 1
            if found["answer"] == "changed":
                both = [*found["changed"], *found["or"]]
                counts["board named"] += any(one["quantity"] == "board" for one in both)
            continue
        key = KEYS[args.change]
        name = (key, "" if key == "board" else last)
        camera, eye, bent = changed(random, *cameras[-1], own, views, args.change, args.size * of[name])
        write(folder / "check", [*cameras[:-1], (camera, eye)], bent, views, noises, args.noise)
        found = check(folder / "check")
        counts[found["answer"]] += 1
        if found["answer"] == "changed":
            first = [(one["quantity"], one.get("camera", "")) for one in found["changed"]]
            either = [(one["quantity"], one.get("camera", "")) for one in found["or"]]
            counts["named alone"] += first == [name] and not either
            counts["named among"] += name in first + either
            counts["misnamed"] += name not in first + either
    shutil.rmtree(folder)
    return counts, stated


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("deltille")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--calibrations", type=int, default=400)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--rig", action="store_true", help="two cameras")
    parser.add_argument("--accuracy", type=float, help="standard deviation of the board that deltille assumes, mm")
    parser.add_argument("--views", default="1-6")
    parser.add_argument("--change", choices=["none", *KEYS], default="none")
    parser.add_argument("--size", type=float, default=1.0)
    parser.add_argument("--board", type=float, default=0.1)
    parser.add_argument("--noise", type=float, default=0.05)
    parser.add_argument("--other", action="store_true", help="check with another print of the board")
    parser.add_argument("--tilt", type=float, default=0.7, help="largest tilt of the checked views, radians")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    with ThreadPoolExecutor(2) as pool:
        results = list(pool.map(lambda index: of_calibration(args, index), range(args.calibrations)))
    counts = sum((counts for counts, _ in results), collections.Counter())
    all_ = args.calibrations * args.repeats
    found = counts["changed"]
    low, high = (beta.ppf([0.025, 0.975], [found, found + 1], [all_ - found + 1, all_ - found])).tolist()
    low, high = 0.0 if found == 0 else low, 1.0 if found == all_ else high
    print(f"{args.change} {args.size}: {dict(counts)} of {all_}; changed: {100 * low:.2f} to {100 * high:.2f} %")
    if args.change == "none" and low > FALSE_ALARM:
        raise SystemExit(f"more false alarms than stated, {100 * FALSE_ALARM} %")
    low, high = map(int, args.views.split("-"))
    for key in KEYS.values():
        medians = [[v for _, stated in results for v in stated[key, count]] for count in range(low, high + 1)]
        if any(medians):
            medians = ", ".join(f"{np.median(of):.3f}" if of else "none" for of in medians)
            print(f"  {key}: would have been found, median for {args.views} views: {medians}")


if __name__ == "__main__":
    main()
