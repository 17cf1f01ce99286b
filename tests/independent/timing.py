"""Rolling shutters and clocks of a rig, from two videos of a page that a hand moves.

    timing.py render <board.json> <folder> [--seed N] [--readout MS] [--offset MS] [--drift PPM]
    timing.py check <deltille> <board.json> <rig.json> <folder> ...        # rig.json of `rig_recording.py check`
    timing.py calibrate <deltille> <board.json> <folder> ...

The page is drawn by poppler and filmed by numpy and OpenCV as in `from_video.py`, by the cameras of `rig_recording.py`. The left
camera has a global shutter and takes 30 images a second. The right one takes 25; its rows are exposed one after the other, in
bands of 8 rows, and its clock has an offset and a drift. `check` compares the answers of `deltille timing` with the truth, and
those from the left video alone. `calibrate` compares with the truth the camera from the right video alone, with and without
`--estimate-timing`, and with this option the rig from both videos.
"""

import argparse
import json
import pathlib
import subprocess

import cv2
import numpy as np
from from_video import BLUR_PX, FINE, NOISE, Hand, exposed, pinhole_rays
from photograph import Page
from rig_recording import CAMERAS, RIGHT_FROM_LEFT, SIZE

RATES = {"left": 30, "right": 25}
SECONDS = 10
# Between the first and the last image of the left camera.
MIDDLE = (SECONDS - 1 / RATES["left"]) / 2
BAND = 8


def image(page, rays, focal, hand, seconds, readout, rng, camera_from_hand):
    """An image whose middle row is exposed at this time."""
    (turn, step), bands = camera_from_hand, []
    for first in range(0, SIZE[1], BAND):
        row = (first + BAND / 2) / SIZE[1] - 0.5
        rotation, place = hand.at(30 * (seconds + readout * row))
        rotation, place = turn @ rotation, turn @ place + step
        part = slice(first * FINE, (first + BAND) * FINE)
        bands.append(exposed(page, [ray[part] for ray in rays], focal, rotation, place, hand.centre))
    light = cv2.GaussianBlur(np.concatenate(bands), (0, 0), BLUR_PX * FINE)
    light = cv2.resize(light, SIZE, interpolation=cv2.INTER_AREA)
    return np.clip(np.round(20 + 185 * light + rng.normal(0, NOISE, light.shape)), 0, 255).astype(np.uint8)


def render(board, folder, seed, truth):
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    page, rng = Page(board), np.random.default_rng(seed)
    hand = Hand(page, CAMERAS["left"], seed, 0, np.array(SIZE))
    for name, camera in CAMERAS.items():
        rays, pose = pinhole_rays(camera, size=SIZE), RIGHT_FROM_LEFT if name == "right" else (np.eye(3), np.zeros(3))
        readout, offset, drift = truth if name == "right" else (0, 0, 0)
        source = ["-f", "rawvideo", "-pix_fmt", "gray", "-s", f"{SIZE[0]}x{SIZE[1]}", "-r", RATES[name], "-i", "pipe:0"]
        command = ["ffmpeg", "-y", "-v", "error", *source, "-c:v", "ffv1", folder / f"{name}.avi"]
        with subprocess.Popen(list(map(str, command)), stdin=subprocess.PIPE) as ffmpeg:
            for index in range(SECONDS * RATES[name]):
                stamp = index / RATES[name]
                seconds = 0.1 + stamp + offset + drift * (stamp - MIDDLE)
                ffmpeg.stdin.write(image(page, rays, camera["fx"], hand, seconds, readout, rng, pose).tobytes())
            ffmpeg.stdin.close()
    (folder / "truth.json").write_text(json.dumps(truth))


def check(program, board, rig, folder):
    folder = pathlib.Path(folder)
    readout, offset, drift = json.loads((folder / "truth.json").read_text())
    cameras = [part for name in CAMERAS for part in ("--camera", f"{name}={folder / name}.avi")]
    command = [program, "timing", rig, *cameras, "--target", board, "-o", folder / "timing.json", "--force"]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    print(done.stdout, end="")
    left, right = json.loads((folder / "timing.json").read_text())["cameras"]
    pairs = [(left["readout_s"], 0), (right["readout_s"], readout), (right["offset_s"], offset), (right["drift"], drift)]
    for name, (found, truth) in zip(("left readout", "right readout", "offset", "drift"), pairs):
        error = found["value"] - truth
        print(f"{name}: {truth:.3g}, error {error:.3g}, {error / found['sd']:.1f} σ", flush=True)
        assert abs(error) < 4 * found["sd"], name
    assert not left["readout_s"]["significant"]


def deviations(record, truth):
    """Errors of the parameters in observed standard deviations."""
    found = {one["name"]: one for one in record["parameters"] if one.get("observed_sd")}
    return {name: (one["value"] - truth.get(name, 0)) / one["observed_sd"] for name, one in found.items()}


def calibrate(program, board, folder):
    folder = pathlib.Path(folder)
    readout, offset, drift = json.loads((folder / "truth.json").read_text())
    common = ["--target", board, "--board-accuracy", "0", "--model", "radtan", "--force"]

    def run(*command):
        done = subprocess.run([program, *map(str, command), *common], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        print(done.stderr.replace("\r", "\n").splitlines()[-1:], flush=True)

    def shown(what, off):
        worst = max(map(abs, off.values()))
        print(f"{what}: {', '.join(f'{name} {sigmas:.1f}' for name, sigmas in off.items())} σ", flush=True)
        return worst

    for name, option in (("without", []), ("with", ["--estimate-timing"])):
        run("calibrate", folder / "right.avi", *option, "-o", folder / f"{name}.yaml")
        record = json.loads((folder / f"{name}.json").read_text())
        errors = {one["name"]: one["value"] - CAMERAS["right"].get(one["name"], 0) for one in record["parameters"]}
        print(name, ", ".join(f"{key} {error:.3g}" for key, error in errors.items()), f"RMS {record['rms_px']:.4f} px")
        worst = shown(f"right camera, {name} --estimate-timing", deviations(record, CAMERAS["right"]))
        assert name == "without" or worst < 3.5
    cameras = [part for name in CAMERAS for part in ("--camera", f"{name}={folder / name}.avi")]
    run("rig", *cameras, "--estimate-timing", "-o", folder)
    record = json.loads((folder / "rig.json").read_text())
    for camera in record["cameras"]:
        assert shown(camera["name"], deviations(camera, CAMERAS[camera["name"]])) < 3.5
    pose = record["cameras"][1]["camera_from_rig"]
    turn, step = np.reshape(pose["rotation"], (3, 3)), np.array(pose["translation_mm"])
    angle = np.degrees(np.linalg.norm(cv2.Rodrigues(turn @ RIGHT_FROM_LEFT[0].T)[0]))
    print(f"relative pose: off by {angle:.4f}°, {step - RIGHT_FROM_LEFT[1]} mm; {pose}")
    timing = json.loads((folder / "rig-timing.json").read_text())["cameras"][1]
    for name, truth in (("readout_s", readout), ("offset_s", offset), ("drift", drift)):
        error = timing[name]["value"] - truth
        print(f"{name}: error {error:.3g}, {error / timing[name]['sd']:.1f} σ")
        assert abs(error) < 4 * timing[name]["sd"], name


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    commands = parser.add_subparsers(dest="command", required=True)
    rendering, checking = commands.add_parser("render"), commands.add_parser("check")
    rendering.add_argument("board")
    rendering.add_argument("folder")
    rendering.add_argument("--seed", type=int, default=1)
    rendering.add_argument("--readout", type=float, default=12)
    rendering.add_argument("--offset", type=float, default=8.4)
    rendering.add_argument("--drift", type=float, default=200)
    for one in ("program", "board", "rig"):
        checking.add_argument(one)
    checking.add_argument("folder", nargs="+")
    calibrating = commands.add_parser("calibrate")
    for one in ("program", "board"):
        calibrating.add_argument(one)
    calibrating.add_argument("folder", nargs="+")
    args = parser.parse_args()
    if args.command == "render":
        render(args.board, args.folder, args.seed, [args.readout * 1e-3, args.offset * 1e-3, args.drift * 1e-6])
    else:
        for folder in args.folder:
            if args.command == "check":
                check(args.program, args.board, args.rig, folder)
            else:
                calibrate(args.program, args.board, folder)
