"""From a video to the camera: a printed page, drawn by poppler, filmed by a hand-held camera with distortion.

    from_video.py render <board.json> <folder>             # board.pdf beside it; writes video.mp4 and truth.json
    from_video.py check <program> <board.json> <folder>

The page passes through numpy and OpenCV only: the rays of every pixel from the inverse of the distortion, four samples a
pixel, several instants of the exposure, blur, noise, H.264 (`-crf 16`, yuv420p). The camera moves between poses with
tilts of up to 50° and rests for a third of a second at each, with the tremor of a hand. `check` calibrates with one command, and
compares the focal length with that of as many random frames and of all frames, and the errors with their standard deviations.
"""

import json
import math
import pathlib
import resource
import subprocess
import sys
import time

import cv2
import numpy as np

from photograph import PX_PER_MM, Page

WIDTH, HEIGHT = 1280, 720
CAMERA = {"fx": 1010.0, "fy": 1011.5, "cx": 650.0, "cy": 352.0, "k1": -0.18, "k2": 0.06}
POSES, FRAMES_MOVING, FRAMES_STILL, RATE = 16, 20, 10, 30
# Fractions of the time between two frames, and px.
EXPOSURE, BLUR_PX, NOISE = 0.3, 0.7, 1.5
FINE = 2


def turn(axis, angle):
    return cv2.Rodrigues(np.eye(3)[axis] * angle)[0]


def pinhole_rays():
    """Rays of the samples in the image plane z = 1, without distortion."""
    step = (np.arange(FINE) + 0.5) / FINE - 0.5
    x = (np.arange(WIDTH)[:, None] + step).ravel()
    y = (np.arange(HEIGHT)[:, None] + step).ravel()
    x, y = np.meshgrid((x - CAMERA["cx"]) / CAMERA["fx"], (y - CAMERA["cy"]) / CAMERA["fy"])
    u, v = x.copy(), y.copy()
    for _ in range(30):
        r2 = u * u + v * v
        factor = 1 + CAMERA["k1"] * r2 + CAMERA["k2"] * r2 * r2
        u, v = x / factor, y / factor
    return u, v


class Hand:
    """The pose of the page over time: still at random poses, smooth in between, with a tremor."""

    def __init__(self, page, seed=5):
        rng = np.random.default_rng(seed)
        corners = page.corners_mm
        self.centre = (corners.max(0) + corners.min(0)) / 2
        reach = np.linalg.norm(np.ptp(corners, axis=0)) / 2
        self.poses = []
        for index in range(POSES):
            tilt = math.radians(0 if index == 0 else rng.uniform(20, 50))
            azimuth, roll = 2 * math.pi * (index * 0.382 + rng.uniform(-0.1, 0.1)), rng.uniform(-0.4, 0.4)
            distance = reach * CAMERA["fx"] / HEIGHT * rng.uniform(1.7, 2.6)
            aside = rng.uniform(-0.32, 0.32, 2) * [WIDTH, HEIGHT] if index else np.zeros(2)
            place = [*(aside / CAMERA["fx"] * distance), distance]
            self.poses.append(np.array([tilt * math.cos(azimuth), tilt * math.sin(azimuth), roll, *place]))
        self.tremor = rng.uniform(0, 2 * math.pi, (6, 3)), np.array([1.2e-3, 1.2e-3, 1.2e-3, 0.15, 0.15, 0.3])
        self.count = POSES * (FRAMES_MOVING + FRAMES_STILL)

    def at(self, t):
        """Rotation and translation at a time in frames."""
        index, phase = divmod(t, FRAMES_MOVING + FRAMES_STILL)
        index = int(index)
        way = np.clip((phase - FRAMES_STILL) / FRAMES_MOVING, 0, 1)
        way = way * way * (3 - 2 * way)
        start, end = self.poses[index % POSES], self.poses[(index + 1) % POSES]
        phases, sizes = self.tremor
        shake = sizes * np.sin(phases + t * np.array([0.31, 0.47, 0.83])).sum(1)
        x, y, roll, *place = start + way * (end - start) + shake
        rotation = cv2.Rodrigues(np.array([x, y, 0.0]))[0] @ turn(2, roll)
        return rotation, np.array(place)


def exposed(page, rays, rotation, place, centre):
    """The reflectance at the samples."""
    n = max(1, round(PX_PER_MM * place[2] / CAMERA["fx"] / FINE / 1.5))
    drawn = page.reduced_by(n)
    # From rays to positions on the page, in px of the reduced page.
    plane = np.linalg.inv(np.column_stack([rotation[:, 0], rotation[:, 1], place]))
    scale = PX_PER_MM / n
    to_page = np.array([[scale, 0, centre[0] * scale - 0.5], [0, scale, centre[1] * scale - 0.5], [0, 0, 1]]) @ plane
    u, v = rays
    x, y, w = (row[0] * u + row[1] * v + row[2] for row in to_page)
    x, y = (x / w).astype(np.float32), (y / w).astype(np.float32)
    return cv2.remap(drawn, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=0.35)


def frame(page, rays, hand, t, rng):
    centre = np.array([[0.0, 0.0, 0.0]])
    seen = lambda at: (lambda r, p: (r @ centre.T).T[0] + p)(*hand.at(at))
    a, b = seen(t), seen(t + EXPOSURE)
    streak = CAMERA["fx"] * np.hypot(*(b[:2] / b[2] - a[:2] / a[2]))
    count = int(np.clip(math.ceil(streak), 1, 8))
    light = 0
    for k in range(count):
        rotation, place = hand.at(t + EXPOSURE * (k + 0.5) / count)
        light = light + exposed(page, rays, rotation, place, hand.centre) / count
    light = cv2.GaussianBlur(light, (0, 0), BLUR_PX * FINE)
    light = cv2.resize(light, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
    grey = 20 + 185 * light + rng.normal(0, NOISE, light.shape)
    return np.clip(np.round(grey), 0, 255).astype(np.uint8)


def render(board, folder):
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    page, rays, rng = Page(board), pinhole_rays(), np.random.default_rng(3)
    hand = Hand(page)
    source = ["-f", "rawvideo", "-pix_fmt", "gray", "-s", f"{WIDTH}x{HEIGHT}", "-r", str(RATE), "-i", "pipe:0"]
    # Grey in full range stays so in yuv420p.
    coding = ["-c:v", "libx264", "-crf", "16", "-vf", "scale=in_range=full:out_range=full", "-pix_fmt", "yuv420p", "-color_range", "pc"]
    command = ["ffmpeg", "-y", "-v", "error", *source, *coding, str(folder / "video.mp4")]
    with subprocess.Popen(command, stdin=subprocess.PIPE) as ffmpeg:
        for t in range(hand.count):
            ffmpeg.stdin.write(frame(page, rays, hand, t, rng).tobytes())
            if t % 40 == 0:
                cv2.imwrite(str(folder / f"look-{t:03d}.png"), frame(page, rays, hand, t, rng))
                print(t, "of", hand.count, flush=True)
        ffmpeg.stdin.close()
    (folder / "truth.json").write_text(json.dumps(CAMERA))


def measured(*command):
    """Runs a command, and returns its output, seconds and peak memory in MB."""
    start = time.time()
    done = subprocess.run(["/usr/bin/time", "-v", *map(str, command)], capture_output=True, text=True)
    assert done.returncode == 0, (command, done.stdout[-2000:], done.stderr[-2000:])
    peak = int(done.stderr.split("Maximum resident set size (kbytes): ")[1].split()[0]) / 1024
    return done, time.time() - start, peak


def parameters(path):
    return {one["name"]: one for one in json.loads(path.read_text())["parameters"]}


def focal_error(path):
    """RMS error of the focal lengths, px."""
    found = parameters(path)
    return math.sqrt(np.mean([(found[name]["value"] - CAMERA[name]) ** 2 for name in ("fx", "fy")]))


def check(program, board, folder):
    folder = pathlib.Path(folder)
    video, out = folder / "video.mp4", folder / "out"
    out.mkdir(exist_ok=True)
    force = ["--target", board, "--board-accuracy", "0", "--force"]
    done, seconds, peak = measured(program, "calibrate", video, *force, "-o", out / "one.yaml")
    frames = POSES * (FRAMES_MOVING + FRAMES_STILL)
    print(done.stdout, done.stderr.split("\tCommand")[0])
    print(f"one command: {seconds:.1f} s, {1000 * seconds / frames:.0f} ms a frame, peak memory {peak:.0f} MB")
    worst = 0
    for name, one in parameters(out / "one.json").items():
        sds = [one.get(key) for key in ("sd", "observed_sd")]
        if not sds[0]:
            continue
        error = one["value"] - CAMERA.get(name, 0)
        sigmas = [error / sd if sd else math.nan for sd in sds]
        worst = max(worst, abs(sigmas[1]))
        print(f"{name}: error {error:.3g}, {sigmas[0]:.1f} σ from noise, {sigmas[1]:.1f} σ observed")

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
        camera = out / f"{name.replace(' ', '-')}.yaml"
        _, seconds, _ = measured(program, "calibrate", *paths, *force, "--model", "radtan", "-o", camera)
        errors[name] = focal_error(camera.with_suffix(".json"))
        print(f"{name}: {len(paths)} frames, {seconds:.1f} s, focal error {errors[name]:.3f} px", flush=True)
    random = [error for name, error in errors.items() if name.startswith("random")]
    print(f"random: RMS {math.sqrt(np.mean(np.square(random))):.3f} px")
    assert worst < 3, worst


if __name__ == "__main__":
    {"render": render, "check": check}[sys.argv[1]](*sys.argv[2:])
