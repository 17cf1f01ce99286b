"""From a video to the camera: a printed page, drawn by poppler, filmed by a hand-held camera with distortion.

    from_video.py render <board.json> <folder> [--seed N] [--exposure FRAMES] [--rest FRAMES] [--fisheye]
    from_video.py check <program> <board.json> <folder> [--random]

`render` needs board.pdf beside the description, and writes video.mp4 and truth.json.

The page passes through numpy and OpenCV only: the rays of every pixel from the inverse of the distortion, four samples a
pixel, several instants of the exposure, blur, noise, H.264 (`-crf 16`, yuv420p). The camera moves between poses with
tilts of up to 50° and rests for a third of a second at each, with the tremor of a hand. `check` calibrates with one command, and
compares the errors with their standard deviations; with `--random`, also the focal length with that of as many random frames
and of all frames.
"""

import argparse
import json
import math
import pathlib
import subprocess
import sys
import time

import cv2
import numpy as np

from photograph import PX_PER_MM, Page

WIDTH, HEIGHT = 1280, 720
CAMERA = {"fx": 1010.0, "fy": 1011.5, "cx": 650.0, "cy": 352.0, "k1": -0.18, "k2": 0.06}
FISHEYE = {"fx": 560.0, "fy": 561.0, "cx": 650.0, "cy": 352.0, "k1": -0.02, "k2": 0.004}
POSES, FRAMES_MOVING, RATE = 20, 20, 30
BLUR_PX, NOISE = 0.7, 1.5
FINE = 2


def turn(axis, angle):
    return cv2.Rodrigues(np.eye(3)[axis] * angle)[0]


def pinhole_rays(camera, is_fisheye=False, size=(WIDTH, HEIGHT)):
    """Rays of the samples in the image plane z = 1, without distortion; NaN where there are none."""
    step = (np.arange(FINE) + 0.5) / FINE - 0.5
    x = (np.arange(size[0])[:, None] + step).ravel()
    y = (np.arange(size[1])[:, None] + step).ravel()
    x, y = np.meshgrid((x - camera["cx"]) / camera["fx"], (y - camera["cy"]) / camera["fy"])
    if is_fisheye:
        distorted = np.hypot(x, y)
        angle = distorted.copy()
        for _ in range(30):
            angle = distorted / (1 + camera["k1"] * angle**2 + camera["k2"] * angle**4)
        stretch = np.where(angle < 1.5, np.tan(angle), np.nan) / np.maximum(distorted, 1e-9)
        return np.float32(x * stretch), np.float32(y * stretch)
    u, v = x.copy(), y.copy()
    for _ in range(30):
        r2 = u * u + v * v
        factor = 1 + camera["k1"] * r2 + camera["k2"] * r2 * r2
        u, v = x / factor, y / factor
    return np.float32(u), np.float32(v)


class Hand:
    """The pose of the page over time: still at random poses, smooth in between, with a tremor."""

    def __init__(self, page, camera, seed, rest, size=(WIDTH, HEIGHT)):
        rng = np.random.default_rng(seed)
        self.rest = rest
        corners = page.corners_mm
        self.centre = (corners.max(0) + corners.min(0)) / 2
        reach = np.linalg.norm(np.ptp(corners, axis=0)) / 2
        self.poses = []
        for index in range(POSES):
            tilt = math.radians(0 if index == 0 else rng.uniform(20, 50))
            azimuth, roll = 2 * math.pi * (index * 0.382 + rng.uniform(-0.1, 0.1)), rng.uniform(-0.4, 0.4)
            distance = reach * camera["fx"] / size[1] * rng.uniform(1.7, 2.6)
            aside = rng.uniform(-0.32, 0.32, 2) * size if index else np.zeros(2)
            place = [*(aside / camera["fx"] * distance), distance]
            self.poses.append(np.array([tilt * math.cos(azimuth), tilt * math.sin(azimuth), roll, *place]))
        self.tremor = rng.uniform(0, 2 * math.pi, (6, 3)), np.array([1.2e-3, 1.2e-3, 1.2e-3, 0.15, 0.15, 0.3])
        self.count = POSES * (FRAMES_MOVING + rest)

    def at(self, t):
        """Rotation and translation at a time in frames."""
        index, phase = divmod(t, FRAMES_MOVING + self.rest)
        index = int(index)
        way = np.clip((phase - self.rest) / FRAMES_MOVING, 0, 1)
        way = way * way * (3 - 2 * way)
        start, end = self.poses[index % POSES], self.poses[(index + 1) % POSES]
        phases, sizes = self.tremor
        shake = sizes * np.sin(phases + t * np.array([0.31, 0.47, 0.83])).sum(1)
        x, y, roll, *place = start + way * (end - start) + shake
        rotation = cv2.Rodrigues(np.array([x, y, 0.0]))[0] @ turn(2, roll)
        return rotation, np.array(place)


def exposed(page, rays, focal, rotation, place, centre):
    """The reflectance at the samples."""
    n = max(1, round(PX_PER_MM * place[2] / focal / FINE / 1.5))
    drawn = page.reduced_by(n)
    # From rays to positions on the page, in px of the reduced page.
    plane = np.linalg.inv(np.column_stack([rotation[:, 0], rotation[:, 1], place]))
    scale = PX_PER_MM / n
    to_page = np.array([[scale, 0, centre[0] * scale - 0.5], [0, scale, centre[1] * scale - 0.5], [0, 0, 1]]) @ plane
    u, v = rays
    x, y, w = (row[0] * u + row[1] * v + row[2] for row in np.float32(to_page))
    x, y = (np.where(w > 0, side / w, np.float32(-1e6)) for side in (x, y))
    return cv2.remap(drawn, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=0.35)


def frame(page, rays, focal, hand, t, exposure, rng, camera_from_hand=(np.eye(3), np.zeros(3))):
    (_, a), (_, b) = hand.at(t), hand.at(t + exposure)
    streak = focal * np.hypot(*(b[:2] / b[2] - a[:2] / a[2]))
    count = int(np.clip(math.ceil(streak), 1, 8))
    light = 0
    for k in range(count):
        rotation, place = hand.at(t + exposure * (k + 0.5) / count)
        rotation, place = camera_from_hand[0] @ rotation, camera_from_hand[0] @ place + camera_from_hand[1]
        light = light + exposed(page, rays, focal, rotation, place, hand.centre) / count
    light = cv2.GaussianBlur(light, (0, 0), BLUR_PX * FINE)
    light = cv2.resize(light, tuple(side // FINE for side in rays[0].shape[::-1]), interpolation=cv2.INTER_AREA)
    grey = 20 + 185 * light + rng.normal(0, NOISE, light.shape)
    return np.clip(np.round(grey), 0, 255).astype(np.uint8)


def render(board, folder, seed, exposure, rest, is_fisheye):
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    camera = FISHEYE if is_fisheye else CAMERA
    page, rays, rng = Page(board), pinhole_rays(camera, is_fisheye), np.random.default_rng(3)
    hand = Hand(page, camera, seed, rest)
    source = ["-f", "rawvideo", "-pix_fmt", "gray", "-s", f"{WIDTH}x{HEIGHT}", "-r", str(RATE), "-i", "pipe:0"]
    # Grey in full range stays so in yuv420p.
    coding = ["-c:v", "libx264", "-crf", "16", "-vf", "scale=in_range=full:out_range=full", "-pix_fmt", "yuv420p", "-color_range", "pc"]
    command = ["ffmpeg", "-y", "-v", "error", *source, *coding, str(folder / "video.mp4")]
    with subprocess.Popen(command, stdin=subprocess.PIPE) as ffmpeg:
        for t in range(hand.count):
            ffmpeg.stdin.write(frame(page, rays, camera["fx"], hand, t, exposure, rng).tobytes())
        ffmpeg.stdin.close()
    (folder / "truth.json").write_text(json.dumps({"frames": hand.count, "camera": camera}))


def measured(*command):
    """Runs a command, and returns its output, seconds and peak memory in MB."""
    start = time.time()
    done = subprocess.run(["/usr/bin/time", "-v", *map(str, command)], capture_output=True, text=True)
    assert done.returncode == 0, (command, done.stdout[-2000:], done.stderr[-2000:])
    peak = int(done.stderr.split("Maximum resident set size (kbytes): ")[1].split()[0]) / 1024
    return done, time.time() - start, peak


def parameters(path):
    return {one["name"]: one for one in json.loads(path.read_text())["parameters"]}


def focal_error(path, camera):
    """RMS error of the focal lengths, px."""
    found = parameters(path)
    return math.sqrt(np.mean([(found[name]["value"] - camera[name]) ** 2 for name in ("fx", "fy")]))


def check(program, board, folder, with_random):
    folder = pathlib.Path(folder)
    video, out = folder / "video.mp4", folder / "out"
    out.mkdir(exist_ok=True)
    truth = json.loads((folder / "truth.json").read_text())
    frames, camera = truth["frames"], truth["camera"]
    force = ["--target", board, "--board-accuracy", "0", "--force"]
    done, seconds, peak = measured(program, "calibrate", video, *force, "-o", out / "one.yaml")
    print(done.stdout, done.stderr.split("\tCommand")[0])
    print(f"one command: {seconds:.1f} s, {1000 * seconds / frames:.0f} ms a frame, peak memory {peak:.0f} MB")
    worst = 0
    for name, one in parameters(out / "one.json").items():
        sds = [one.get(key) for key in ("sd", "observed_sd")]
        # Of other models, only the projection has the same meaning.
        if not sds[0] or name in ("alpha", "beta"):
            continue
        error = one["value"] - camera.get(name, 0)
        sigmas = [error / sd if sd else math.nan for sd in sds]
        worst = max(worst, abs(sigmas[1]))
        print(f"{name}: error {error:.3g}, {sigmas[0]:.1f} σ from noise, {sigmas[1]:.1f} σ observed")
    if with_random:
        compare(program, board, folder, camera, force)
    assert worst < 3, worst


def compare(program, board, folder, camera, force):
    """Compares the selected frames with random ones and with all."""
    video, out = folder / "video.mp4", folder / "out"
    _, seconds, peak = measured(program, "detect", video, "--track", "--target", board, "-o", folder / "all", "--force")
    print(f"detect --track: {seconds:.1f} s, peak memory {peak:.0f} MB")
    every = [path for path in sorted((folder / "all").glob("*.json")) if json.loads(path.read_text())["grids"]]
    chosen = {view["name"] for view in json.loads((out / "one.json").read_text())["views"]}
    sets = {"selected": [path for path in every if path.stem in chosen], "all": every}
    rng = np.random.default_rng(1)
    for seed in range(10):
        sets[f"random {seed}"] = sorted(rng.choice(every, len(chosen), replace=False))
    errors = {}
    for name, paths in sets.items():
        found = out / f"{name.replace(' ', '-')}.yaml"
        _, seconds, _ = measured(program, "calibrate", *paths, *force, "--model", "radtan", "-o", found)
        errors[name] = focal_error(found.with_suffix(".json"), camera)
        print(f"{name}: {len(paths)} frames, {seconds:.1f} s, focal error {errors[name]:.3f} px", flush=True)
    random = [error for name, error in errors.items() if name.startswith("random")]
    print(f"random: RMS {math.sqrt(np.mean(np.square(random))):.3f} px")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    commands = parser.add_subparsers(dest="command", required=True)
    rendering, checking = commands.add_parser("render"), commands.add_parser("check")
    checking.add_argument("program")
    for one in (rendering, checking):
        one.add_argument("board")
        one.add_argument("folder")
    rendering.add_argument("--seed", type=int, default=5)
    rendering.add_argument("--exposure", type=float, default=0.3)
    rendering.add_argument("--rest", type=int, default=10)
    rendering.add_argument("--fisheye", action="store_true")
    checking.add_argument("--random", action="store_true")
    args = parser.parse_args()
    if args.command == "render":
        render(args.board, args.folder, args.seed, args.exposure, args.rest, args.fisheye)
    else:
        check(args.program, args.board, args.folder, args.random)
