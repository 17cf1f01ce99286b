"""The focal length estimated with a tone curve and an ink spread, over many seeds.

    python focal.py path/to/deltille FOLDER [SEEDS [TONE [INK_UM]]]

photographs a page rendered by cairo with a pinhole camera of known focal length, eight views per seed, calibrates from
the detections of `deltille detect`, and prints the error of the focal length in units of its standard deviation. The
tone `telephone` is the colour sensor with all processing of colours.py. Needs numpy, OpenCV and pdftocairo.
"""

import json
import pathlib
import sys

import cv2
import numpy as np

from check import TARGETS, run
from colours import interpolated, telephone
from photograph import Page, Scene, View, look, photograph

VIEWS = 8
FOCAL_PX = 600.0
TILTS_DEG = (0.0, 50.0)


def deviation(deltille, page, target, folder, seed, tone, ink_um):
    """The error of fx, in px and in standard deviations."""
    folder.mkdir(exist_ok=True)
    for view in range(VIEWS):
        tilt = float(np.random.default_rng([seed, view, 1]).uniform(*TILTS_DEG))
        if tone == "telephone":
            scene, rng = Scene(800, 600, FOCAL_PX, tilt_deg=tilt, ink_um=ink_um), np.random.default_rng([seed, view, 2])
            light = look(page, View(page, scene, rng), scene).astype(float)
            image = telephone(interpolated(light, 1, cv2.COLOR_BayerBG2BGR_EA, 65535, rng))
        else:
            scene = Scene(800, 600, FOCAL_PX, tilt_deg=tilt, tone=tone, ink_um=ink_um)
            image, _ = photograph(page, scene, [seed, view, 2])
        cv2.imwrite(str(folder / f"{view}.png"), image)
    images = sorted(folder.glob("*.png"))
    run(deltille, "detect", *images, "--target", target, "-o", folder / "corners")
    corners, camera = folder / "corners", folder / "camera"
    run(deltille, "calibrate", corners, "--target", target, "--model", "radtan", "-o", f"{camera}.yaml")
    found = json.loads(camera.with_suffix(".json").read_text())
    fx = next(p for p in found["parameters"] if p["name"] == "fx")
    return fx["value"] - FOCAL_PX, (fx["value"] - FOCAL_PX) / fx["sd"]


def main(deltille, folder, seeds=20, tone="srgb", ink_um=0.0):
    folder.mkdir(parents=True, exist_ok=True)
    run(deltille, *TARGETS["board"].split(), "--pdf", "--name", "board", "-o", folder)
    target = folder / "board.json"
    page = Page(target)
    found = []
    for seed in range(seeds):
        off = deviation(deltille, page, target, folder / f"{seed:02}", seed, tone, ink_um)
        found.append(off)
        print(f"seed {seed}: {off[0]:+.4f} px, {off[1]:+.2f} deviations", flush=True)
    px, deviations = np.array(found).T
    print(
        f"{seeds} seeds, {tone}, ink {ink_um:g} µm: rms {np.sqrt(np.mean(px**2)):.4f} px,"
        f" {np.sqrt(np.mean(deviations**2)):.2f} deviations, mean {np.mean(deviations):+.2f},"
        f" {np.sum(np.abs(deviations) <= 2)} within 2"
    )


if __name__ == "__main__":
    given = sys.argv[3:]
    kinds = (int, str, float)
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), *(k(v) for k, v in zip(kinds, given)))
