"""A rig from one bag: two cameras of unequal rates, with jitter and lost messages, in one command.

    rig_recording.py render <board.json> <folder> [--seed N] [--turned DEGREES]          # board.pdf beside it
    rig_recording.py check <deltille> <board.json> <folder> [--later FOLDER ...]

The page is drawn by poppler and filmed as in `from_video.py`. The left camera takes 12 images a second, the right one 6, each
up to 4 ms early or late; a tenth of the messages is lost; messages are recorded up to 30 ms after their time stamp. `rosbags`
writes them as MCAP, as SQLite and as a bag of ROS 1, and `ffmpeg` as two videos. `check` calibrates the rig with one command
from each, and compares the cameras and their relative pose with the truth. The results must be equal. Then `deltille check`
compares the rig with later recordings, in which the right camera may be turned.
"""

import argparse
import json
import math
import pathlib
import shutil
import subprocess

import cv2
import numpy as np
from from_video import Hand, frame, measured, pinhole_rays, turn
from photograph import Page
from recordings import ROS1, ROS2, raw, run
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2

SIZE = (640, 480)
CAMERAS = {
    "left": {"fx": 505.0, "fy": 505.6, "cx": 325.0, "cy": 236.0, "k1": -0.18, "k2": 0.06},
    "right": {"fx": 512.0, "fy": 512.4, "cx": 314.0, "cy": 243.0, "k1": -0.15, "k2": 0.04},
}
# Of the right camera: rotation and translation from the left one, mm.
RIGHT_FROM_LEFT = turn(1, math.radians(8)) @ turn(0, math.radians(1)), np.array([-42.0, 1.5, 2.0])
# Images a second; times in units of the hand, 1/30 s.
RATES = {"left": 12, "right": 6}
EXPOSURE, JITTER_S, LATE_S, LOST = 0.15, 0.004, 0.03, 0.1
START_NS = 1_700_000_000_000_000_000


def render(board, folder, seed, turned):
    folder = pathlib.Path(folder)
    page, rng = Page(board), np.random.default_rng(seed)
    hand = Hand(page, CAMERAS["left"], seed, 10, np.array(SIZE))
    for name, camera in CAMERAS.items():
        out = folder / "frames" / name
        out.mkdir(parents=True, exist_ok=True)
        rays, pose = pinhole_rays(camera, size=SIZE), (np.eye(3), np.zeros(3))
        if name == "right":
            turn_by = turn(1, math.radians(turned))
            pose = turn_by @ RIGHT_FROM_LEFT[0], turn_by @ RIGHT_FROM_LEFT[1]
        for index in range(hand.count * RATES[name] // 30):
            seconds = index / RATES[name] + rng.uniform(-1, 1) * JITTER_S + JITTER_S
            image = frame(page, rays, camera["fx"], hand, 30 * seconds, EXPOSURE, rng, pose)
            if rng.uniform() > LOST:
                cv2.imwrite(str(out / f"{round(seconds * 1e9)}.png"), image)


def messages(folder, store):
    """Times of the recording, topics and messages, in the order of recording."""
    rng = np.random.default_rng(1)
    for name in CAMERAS:
        for index, path in enumerate(sorted((folder / "frames" / name).glob("*.png"), key=lambda path: int(path.stem))):
            stamp = START_NS + int(path.stem)
            image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
            yield stamp + int(rng.uniform(0, LATE_S) * 1e9), f"/{name}/image_raw", raw(store, index, image, "mono8", time_ns=stamp)


def recordings(folder):
    """The inputs of `deltille rig`."""
    topics = [part for name in CAMERAS for part in ("--topic", f"/{name}/image_raw")]
    for end, store in (("mcap", ROS2), ("db3", ROS2), ("bag", ROS1)):
        path = folder / f"run.{end}" if end == "bag" else folder / f"run-{end}"
        shutil.rmtree(path, ignore_errors=True)
        path.unlink(missing_ok=True)
        storage = StoragePlugin.MCAP if end == "mcap" else StoragePlugin.SQLITE3
        with Writer1(path) if end == "bag" else Writer2(path, version=9, storage_plugin=storage) as writer:
            connections = {}
            for time_ns, topic, message in sorted(messages(folder, store), key=lambda one: one[0]):
                kind = message.__msgtype__
                if topic not in connections:
                    connections[topic] = writer.add_connection(topic, kind, typestore=store)
                data = store.serialize_ros1(message, kind) if store is ROS1 else store.serialize_cdr(message, kind)
                writer.write(connections[topic], time_ns, data)
        yield end, [path, *topics]
    # Videos of variable frame rate, without loss.
    cameras = []
    for name in CAMERAS:
        paths = sorted((folder / "frames" / name).glob("*.png"), key=lambda path: int(path.stem))
        times = [int(path.stem) / 1e9 for path in paths]
        steps = [later - earlier for earlier, later in zip(times, [*times[1:], times[-1] + 0.1])]
        lines = "".join(f"file '{path.resolve()}'\nduration {step:.6f}\n" for path, step in zip(paths, steps))
        (folder / f"{name}.txt").write_text(lines)
        run("ffmpeg", "-y", "-v", "error", "-f", "concat", "-safe", 0, "-i", folder / f"{name}.txt", "-fps_mode", "vfr",
            "-c:v", "ffv1", "-pix_fmt", "gray", folder / f"{name}.mkv")
        cameras += ["--camera", f"{name}={folder / name}.mkv"]
    yield "mkv", cameras


def off(found):
    """The errors in standard deviations, with their names."""
    for camera in found["cameras"]:
        truth = CAMERAS[camera["name"]]
        for one in camera["parameters"]:
            if sd := one.get("observed_sd") or one.get("sd"):
                yield f"{camera['name']} {one['name']}", one["value"] - truth.get(one["name"], 0), sd
        if camera["name"] == "right":
            pose, (rotation, translation) = camera["camera_from_rig"], RIGHT_FROM_LEFT
            turned = cv2.Rodrigues(np.reshape(pose["rotation"], (3, 3)) @ rotation.T)[0].ravel()
            moved = np.array(pose["translation_mm"]) - translation
            sd = camera.get("observed_pose_sd") or pose["rotation_sd_rad"] + pose["translation_sd_mm"]
            for name, error, sd in zip(("rx", "ry", "rz", "tx", "ty", "tz"), [*turned, *moved], sd):
                yield name, error, sd


def check(program, board, folder, later):
    folder = pathlib.Path(folder)
    results = {}
    for name, inputs in recordings(folder):
        out = folder / "out" / name
        force = ["--target", board, "--board-accuracy", "0", "--force", "-o", out]
        done, seconds, peak = measured(program, "rig", *inputs, *force)
        errors = list(off(json.loads((out / "rig.json").read_text())))
        worst = max(abs(error / sd) for _, error, sd in errors)
        print(done.stderr.split("\tCommand")[0], done.stdout)
        print(*(f"{what}: {error:.4g}, {error / sd:.1f} σ" for what, error, sd in errors), sep="\n")
        print(f"{name}: {seconds:.1f} s, peak memory {peak:.0f} MB; all within {worst:.1f} σ", flush=True)
        assert worst < 3, worst
        results[name] = [error for _, error, _ in errors]
    for name, errors in results.items():
        # The stamps of videos are rounded, which has no effect on the sets.
        assert errors == results["mcap"], name
    for other in map(pathlib.Path, later):
        _, inputs = next(recordings(other))
        command = [program, "check", folder / "out/mcap/rig.json", *inputs, "--target", board, "--board-accuracy", "0"]
        done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
        print(f"{other}: exit code {done.returncode}\n{done.stdout}{done.stderr}", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    commands = parser.add_subparsers(dest="command", required=True)
    rendering, checking = commands.add_parser("render"), commands.add_parser("check")
    checking.add_argument("program")
    for one in (rendering, checking):
        one.add_argument("board")
        one.add_argument("folder")
    rendering.add_argument("--seed", type=int, default=1)
    rendering.add_argument("--turned", type=float, default=0)
    checking.add_argument("--later", nargs="*", default=[])
    args = parser.parse_args()
    if args.command == "render":
        render(args.board, args.folder, args.seed, args.turned)
    else:
        check(args.program, args.board, args.folder, args.later)
