"""Videos of a printed page, drawn by poppler and OpenCV: does tracking find what detection finds, and how fast is it?

    video.py <program> <board.json> <folder>            # board.pdf beside the description

The board turns and moves by up to 25 px a frame. In further videos it leaves the image, a cover passes in front of it, it
jumps by whole edges, and it is absent in four of seven frames. Errors are those of the true homography.
"""

import json
import math
import pathlib
import subprocess
import sys

import cv2
import numpy as np

from photograph import PX_PER_MM, Page, Scene, View, moved

FINE = 3
SIZE = (1600, 1200)
FRAMES = 60
SCENE = Scene(width=SIZE[0], height=SIZE[1], focal_px=1400, tilt_deg=20, blur_px=0.7, noise=0.006)
VIDEOS = ("moves", "motion blur", "leaves", "cover", "jumps", "absent")
# Largest distance from a corner of detection, in its standard deviations per axis.
MOST_SIGMAS = 3.0


def turn(axis, angle):
    return cv2.Rodrigues(np.eye(3)[axis] * angle)[0]


def frames(page, kind):
    """Images, and the true corners."""
    rng = np.random.default_rng(7)
    view = View(page, SCENE, np.random.default_rng(1))
    rotation, translation = view.rotation.copy(), view.translation.copy()
    last = None
    for t in range(FRAMES):
        z = translation[2] * (1.1 + 0.1 * math.sin(t / 20))
        way = np.array([110 * math.sin(t / 9), 75 * math.sin(t / 7 + 0.5)])
        if kind == "leaves":
            way = np.array([25.0 * min(t, FRAMES - t), 0])
        elif kind == "jumps":
            # One corner of the image takes the place of another.
            edge = view.project(page.corners_mm[:2])
            way = (edge[1] - edge[0]) * (t // 3 % 2)
        if kind != "jumps":
            view.rotation = turn(0, 0.2 * math.sin(t / 14)) @ turn(2, 0.3 * math.sin(t / 25)) @ rotation
        else:
            z = translation[2]
        view.translation = np.array([*(translation[:2] + way * z / SCENE.focal_px), z])
        truth = view.project(page.corners_mm)
        light = look(page, view)
        if kind == "motion blur" and last is not None:
            step = 0.3 * np.median(truth - last, 0)
            light = moved(light, float(np.hypot(*step)), math.atan2(step[1], step[0]))
        if kind == "cover":
            left = 25 * t - 200
            light[:, max(left, 0) : max(left + 300, 0)] = rng.uniform(0.2, 0.5, (SIZE[1], 1))
        if kind == "absent" and t % 7 > 2:
            light[:] = rng.normal(0.4, 0.1, light.shape)
        grey = light + rng.normal(0, SCENE.noise, light.shape)
        yield np.clip(np.round(255 * grey), 0, 255).astype(np.uint8), dict(zip(page.keys, truth))
        last = truth


def look(page, view):
    """The blurred reflectance at each pixel."""
    n = int(np.clip(round(PX_PER_MM / (view.px_per_mm * FINE)), 1, 24))
    on_page = np.array([[0, 0], [100, 0], [100, 100], [0, 100]], float)
    shown = (view.project(on_page) + 0.5) * FINE - 0.5
    rows = []
    for (x, y), (u, v) in zip(on_page * PX_PER_MM / n - 0.5, shown):
        rows += [[x, y, 1, 0, 0, 0, -u * x, -u * y, -u], [0, 0, 0, x, y, 1, -v * x, -v * y, -v]]
    homography = np.linalg.svd(np.array(rows))[2][-1].reshape(3, 3)
    size = tuple(FINE * side for side in SIZE)
    fine = cv2.warpPerspective(page.reduced_by(n), homography, size, flags=cv2.INTER_LINEAR, borderValue=0.37)
    fine = cv2.GaussianBlur(SCENE.black + (SCENE.white - SCENE.black) * fine, (0, 0), SCENE.blur_px * FINE)
    return cv2.resize(fine, SIZE, interpolation=cv2.INTER_AREA)


def detected(program, board, folder, out, *options):
    images = sorted(folder.glob("*.png"))
    command = [program, "detect", *images, "--target", board, "--ink", "none", "--timing", "-o", out, "--force", *options]
    subprocess.run(command, capture_output=True)
    return [json.loads((out / f"{image.stem}.json").read_text()) for image in images]


def corners(found):
    return {(grid["panel"], c["row"], c["col"]): c for grid in found["grids"] for c in grid["corners"]}


def main(program, board, folder):
    page, folder = Page(board), pathlib.Path(folder)
    for kind in VIDEOS:
        images = folder / kind.replace(" ", "-")
        images.mkdir(parents=True, exist_ok=True)
        truths = []
        for t, (image, truth) in enumerate(frames(page, kind)):
            cv2.imwrite(str(images / f"{t:03d}.png"), image, [cv2.IMWRITE_PNG_COMPRESSION, 1])
            truths.append(truth)
        alone = detected(program, board, images, folder / "alone", "-j", "1")
        video = detected(program, board, images, folder / "video", "--track")
        lost, new, wrong, sigmas, errors = 0, 0, 0, [], []
        for truth, one, other in zip(truths, map(corners, alone), map(corners, video)):
            lost, new = lost + len(one.keys() - other.keys()), new + len(other.keys() - one.keys())
            for key in other:
                place = np.array([other[key]["x"], other[key]["y"]])
                off = place - truth.get(key, np.full(2, np.nan))
                wrong += not np.hypot(*off) < 2
                errors.append(off)
                if key in one:
                    off = place - [one[key]["x"], one[key]["y"]]
                    sigmas.append(np.abs(off).max() / math.sqrt((one[key]["cov"][0] + one[key]["cov"][2]) / 2))
        stages = [found["timing_ms"] for found in video]
        followed = [sum(ms.values()) for ms in stages if not ms.keys() & {"coarse", "saddles"}]
        each = [sum(found["timing_ms"].values()) for found in alone]
        print(
            f"{kind}: {len(followed)} of {FRAMES} frames followed; of {len(errors)} corners {wrong} wrong, {lost} lost, "
            f"{new} found in addition; RMS {np.sqrt(np.mean(np.square(errors))):.4f} px; from detection: median "
            f"{np.median(sigmas):.3f}, 99 % within {np.percentile(sigmas, 99):.2f}, all within {max(sigmas):.2f} standard deviations; "
            f"{np.median(followed or [0]):.1f} ms followed, {np.mean([sum(ms.values()) for ms in stages]):.1f} ms on average, "
            f"{np.mean(each):.1f} ms one by one",
            flush=True,
        )
        assert not wrong and max(sigmas) < MOST_SIGMAS, kind


if __name__ == "__main__":
    main(*sys.argv[1:])
