"""Simulation: standard deviations of a camera that is calibrated with a board that deviates from its description.

    python board_errors.py path/to/deltille FOLDER [--kind sheet|corners|both|none] [--size 0.05] [--views 20]
                           [--seeds 1-40] [--noise 0.1] [--measure] [--accuracy 0.05mm] [--repeats]

A checkerboard of 10 × 11 corners, 20 mm apart, has the same errors in every view: `sheet` is stretched, sheared and
bent at random, `corners` displaces each corner independently, with an RMS of `--size` mm per coordinate; `both`
combines them. Prints the errors of fx, fy, cx, cy in units of their standard deviations, both those from noise and the
observed ones, RMS over seeds; with --measure also the errors of the corner positions. With --repeats the camera is
calibrated a second time from other views of the same board, and `compare` must find it unchanged: prints the fraction
of repeats in which it reports a change, at 5 % and at its own significance level. Needs numpy.
"""

import argparse
import json
import pathlib
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np

ROWS, COLS, EDGE_MM = 10, 11, 20.0
WIDTH, HEIGHT = 1600, 1200
TRUTH = {"fx": 1000.0, "fy": 1001.0, "cx": 805.0, "cy": 596.0}
K1, K2, P1, P2 = -0.2, 0.06, 1e-4, -2e-4
MARGIN_PX = 10.0


def rotation(turn):
    """The matrix of a rotation vector (Rodrigues)."""
    angle = np.linalg.norm(turn)
    x, y, z = turn / angle
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def project(points):
    x, y = (points[:, :2] / points[:, 2:]).T
    r2 = x * x + y * y
    radial = 1 + r2 * (K1 + r2 * K2)
    u = x * radial + 2 * P1 * x * y + P2 * (r2 + 2 * x * x)
    v = y * radial + P1 * (r2 + 2 * y * y) + 2 * P2 * x * y
    return np.stack([TRUTH["fx"] * u + TRUTH["cx"], TRUTH["fy"] * v + TRUTH["cy"]], 1)


def errors(random, board, kind, size):
    """Offsets of all corners, mm."""
    offsets = np.zeros_like(board)
    x, y = (board - board.mean(0))[:, :2].T
    if kind in ("sheet", "both"):
        plane = [np.stack([x, -y], 1), np.stack([y, x], 1)]
        out = [x * x, x * y, y * y]
        for modes, part in ((plane, np.s_[:, :2]), (out, np.s_[:, 2])):
            field = sum(c * m / np.std(m) for c, m in zip(random.normal(size=len(modes)), modes))
            offsets[part] += size * field / np.sqrt(np.mean((field - field.mean(0)) ** 2))
    if kind in ("corners", "both"):
        offsets += random.normal(0, size, board.shape)
    return offsets


def view(random, board, noise):
    """The corners of a view that shows the whole board."""
    while True:
        turn = random.uniform([-0.7, -0.7, -0.5], [0.7, 0.7, 0.5]) + 1e-9
        place = random.uniform([-180, -130, 280], [180, 130, 600])
        # Rows run upwards on the board and downwards in the image, and its front faces the camera.
        middle = np.array([(COLS - 1) / 2, (ROWS - 1) / 2, 0]) * EDGE_MM
        pixels = project((board - middle) * [1, -1, -1] @ rotation(turn).T + place)
        if (pixels > MARGIN_PX).all() and (pixels < [WIDTH - MARGIN_PX, HEIGHT - MARGIN_PX]).all():
            return pixels + random.normal(0, noise, pixels.shape)


def calibrated(args, random, folder, corners_mm):
    """The camera from new views of a board with these corners, mm."""
    (folder / "corners").mkdir(parents=True)
    cov = [args.noise**2, 0.0, args.noise**2]
    for index in range(args.views):
        pixels = view(random, corners_mm, args.noise).tolist()
        corners = [
            {"row": index // COLS, "col": index % COLS, "id": None, "x": x, "y": y, "cov": cov}
            for index, (x, y) in enumerate(pixels)
        ]
        grid = {"kind": "checker", "panel": None, "corners": corners, "tags": []}
        found = {"schema": "deltille/detection/1", "image": f"{index}.png", "width": WIDTH, "height": HEIGHT}
        (folder / "corners" / f"{index:03}.json").write_text(json.dumps(found | {"grids": [grid]}))
    command = [args.deltille, "calibrate", folder / "corners", "--grid", "checker", "--rows", ROWS, "--cols", COLS]
    command += ["--edge", "20mm", "--model", "radtan", "-o", folder / "camera.yaml"]
    command += ["--measure-target"] * args.measure
    command += ["--board-accuracy", args.accuracy] if args.accuracy else []
    run(command)
    return folder / "camera.json"


def run(command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode not in (0, 1):
        sys.exit(done.stderr)


def simulate(args, seed):
    folder = args.folder / f"{seed}"
    shutil.rmtree(folder, ignore_errors=True)
    random = np.random.default_rng(seed)
    rows, cols = (axis.ravel() for axis in np.mgrid[:ROWS, :COLS])
    plan = np.stack([cols, rows, 0 * rows], 1) * EDGE_MM
    offsets = errors(random, plan, args.kind, args.size)
    camera = calibrated(args, random, folder / "first", plan + offsets)
    found = {p["name"]: p for p in json.loads(camera.read_text())["parameters"]}
    off = [
        [(found[name]["value"] - value) / found[name].get(sd, np.nan) for name, value in TRUTH.items()]
        for sd in ("sd", "observed_sd")
    ]
    mapped = of_map(camera.with_name("camera-measured.json"), plan, offsets) if args.measure else np.nan
    repeated = [np.nan] * 3
    if args.repeats:
        again = calibrated(args, random, folder / "second", plan + offsets)
        run([args.deltille, "compare", camera, again, "-o", folder / "compared.json"])
        compared = json.loads((folder / "compared.json").read_text())["cameras"][0]
        repeated = [compared[name] for name in ("rms_px", "expected_px", "p_value")]
    shutil.rmtree(folder)
    return np.array(off), mapped, repeated


def of_map(path, plan, offsets):
    """Mean squared error of measured corners, in units of the standard deviation of a coordinate."""
    x, y = (plan - plan.mean(0))[:, :2].T
    one, zero = np.ones_like(x), np.zeros_like(x)
    # Translations, rotations and a scale are not observable.
    plane = [np.r_[one, zero], np.r_[zero, one], np.r_[-y, x], np.r_[x, y]]
    truth = offsets.copy()
    left = lambda modes, values: values - np.stack(modes, 1) @ np.linalg.lstsq(np.stack(modes, 1), values, rcond=None)[0]
    truth[:, :2] = left(plane, offsets[:, :2].T.ravel()).reshape(2, -1).T
    truth[:, 2] = left([one, x, y], offsets[:, 2])
    squares = []
    for corner in json.loads(path.read_text())["panels"][0]["corners"]:
        if "measured" not in corner:
            continue
        place = corner["measured"]
        xx, xy, xz, yy, yz, zz = place["covariance_mm2"]
        covariance = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        off = np.array(place["offset_mm"]) - truth[corner["row"] * COLS + corner["col"]]
        squares.append(off @ np.linalg.solve(covariance, off) / 3)
    return np.mean(squares)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("deltille")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--kind", choices=["sheet", "corners", "both", "none"], default="both")
    parser.add_argument("--size", type=float, default=0.05)
    parser.add_argument("--views", type=int, default=20)
    parser.add_argument("--seeds", default="1-40")
    parser.add_argument("--noise", type=float, default=0.1)
    parser.add_argument("--measure", action="store_true")
    parser.add_argument("--accuracy")
    parser.add_argument("--repeats", action="store_true")
    args = parser.parse_args()
    low, high = map(int, args.seeds.split("-"))
    with ThreadPoolExecutor(2) as pool:
        off, mapped, repeated = zip(*pool.map(lambda seed: simulate(args, seed), range(low, high + 1)))
    noise, observed = np.sqrt(np.mean(np.square(off), 0))
    told = lambda values: ", ".join(f"{name} {value:.2f}" for name, value in zip(TRUTH, values))
    print(f"{args.kind} {args.size} mm, {args.views} views, {len(off)} seeds, {'measured' if args.measure else 'plain'}")
    print(f"  of noise: {told(noise)}; observed: {told(observed)}", end="")
    print(f"; corners {np.sqrt(np.mean(mapped)):.2f}" if args.measure else "")
    if args.repeats:
        found, expected, chance = np.array(repeated).T
        ratio = np.sqrt(np.mean(found**2) / np.mean(expected**2))
        changed = [int((chance < level).sum()) for level in (0.05, 0.001)]
        print(f"  repeats: found / expected {ratio:.2f}, changed at 5 % {changed[0]}, at the tool's own level {changed[1]}")


if __name__ == "__main__":
    main()
