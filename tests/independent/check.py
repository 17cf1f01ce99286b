"""Detection in photographs of printed pages, rendered independently of deltille.

    python check.py path/to/deltille FOLDER [N]

makes targets in FOLDER, photographs them, and compares the detections of `deltille detect` with the true corners. With
N, uses every Nth scene. Needs numpy, OpenCV and pdftocairo.
"""

import json
import pathlib
import subprocess
import sys
from dataclasses import dataclass

import cv2
import numpy as np

from photograph import Page, Scene, photograph

# Ink is found to a fiftieth of a pixel at the usual 3 px/mm.
INK_UM = 6.0

# Corners farther from their true position than this fraction of an edge have a wrong label.
WRONG = 0.3


@dataclass
class Check:
    """A scene and its expected result. Views with different seed names differ in pose and noise."""

    target: str
    scene: Scene
    views: int = 2
    least_found: float = 1.0
    most_rms_px: float = 0.008
    options: str = ""
    labelled: bool = True


TILTS = [0.0, 45.0, 65.0]
TONES = ["linear", "srgb", "2.6", "s-curve"]
CHECKS = [
    *(Check("board", Scene(tilt_deg=tilt, tone=tone), views=1) for tilt in TILTS for tone in TONES),
    *(Check("checker", Scene(tone=tone)) for tone in ("linear", "srgb")),
    Check("board", Scene(tone="srgb", mosaic=True, light_ratio=3.0), most_rms_px=0.02),
    *(
        Check("board", Scene(tilt_deg=tilt, tone=tone, ink_um=ink), views=1)
        for tilt, tone, ink in ((0, "linear", 60), (45, "srgb", 60), (45, "linear", -60), (65, "srgb", 60))
    ),
    Check("board", Scene(tilt_deg=45, ink_um=200.0), views=1, most_rms_px=0.015),
    Check("checker", Scene(tilt_deg=45, ink_um=60.0)),
    Check("board", Scene(blur_px=3.0), least_found=0.95, most_rms_px=0.1),
    Check("board", Scene(motion_px=10.0), least_found=0.95, most_rms_px=0.15),
    Check("board", Scene(edge_px=16.0), least_found=0.95, most_rms_px=0.04),
    *(
        check
        for target in ("board", "checker", "near")
        for check in (
            Check(target, Scene(mirrored=True), labelled=False),
            Check(target, Scene(mirrored=True), options="--allow-mirrored"),
        )
    ),
]

TARGETS = {
    "board": "board --rows 10 --cols 11",
    "checker": "checkerboard --rows 8 --cols 11 --edge 20mm --tags aprilTag36h11",
    # A family so dense that nearly every mirrored code is near another.
    "near": "board --rows 8 --cols 9 --family d16h5",
}


def run(*command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode not in (0, 1):
        sys.exit(f"{' '.join(map(str, command))}: {done.stderr.strip()}")
    return done


def judge(check, truths, folder):
    """Faults of the detections in a folder, and figures to print."""
    found, due, wrong, errors, normalised, inks = 0, 0, 0, [], [], []
    for name, truth in truths.items():
        due += len(truth)
        places = list(truth.values())
        edge_px = np.sort([np.hypot(*(a - b)) for a in places for b in places])[len(places) + 1]
        detection = json.loads((folder / f"{name}.json").read_text())
        if "ink" in detection and check.scene.ink_um:
            inks.append(detection["ink"]["um"])
        for grid in detection["grids"]:
            for corner in grid["corners"] if grid["panel"] is not None else []:
                place = truth.get((grid["panel"], corner["row"], corner["col"]))
                error = np.array([corner["x"], corner["y"]]) - (np.inf if place is None else place)
                if np.hypot(*error) > WRONG * edge_px:
                    wrong += 1
                    continue
                found += 1
                errors.append(error)
                if corner["cov"]:
                    xx, xy, yy = corner["cov"]
                    normalised.append(error @ np.linalg.solve([[xx, xy], [xy, yy]], error) / 2)
    rms = float(np.sqrt(np.mean(np.square(errors)))) if errors else float("nan")
    figures = f"{found} of {due} corners, {wrong} wrong, rms {rms:.4f} px"
    if normalised:
        figures += f", error squared over covariance {np.mean(normalised):.2f}"
    if inks:
        figures += f", ink {np.mean(inks):.1f} µm"
    faults = wrong > 0 or any(abs(ink - check.scene.ink_um) > INK_UM for ink in inks)
    if check.labelled:
        faults |= found < check.least_found * due or not rms <= check.most_rms_px
    else:
        faults |= found > 0
    return faults, figures


def main(deltille, folder, every):
    folder.mkdir(parents=True, exist_ok=True)
    pages = {}
    for name, command in TARGETS.items():
        run(deltille, *command.split(), "--pdf", "--name", name, "-o", folder)
        pages[name] = Page(folder / f"{name}.json")
    failed = 0
    for number, check in list(enumerate(CHECKS))[::every]:
        shots, truths = folder / f"{number:02}", {}
        shots.mkdir(exist_ok=True)
        for view in range(check.views):
            image, truths[f"{view}"] = photograph(pages[check.target], check.scene, [number, view])
            cv2.imwrite(str(shots / f"{view}.png"), image)
        images = sorted(shots.glob("*.png"))
        target = folder / f"{check.target}.json"
        run(deltille, "detect", *images, "--target", target, "-o", shots, *check.options.split())
        faults, figures = judge(check, truths, shots)
        failed += faults
        unusual = {k: v for k, v in vars(check.scene).items() if v != getattr(Scene, k)}
        words = ", ".join(f"{k} {v}" for k, v in unusual.items()) or "usual"
        note = "FAILED: " if faults else ""
        print(f"{note}{check.target}: {words}{' ' + check.options if check.options else ''}: {figures}")
    sys.exit(f"{failed} scenes failed" if failed else 0)


if __name__ == "__main__":
    every = int(sys.argv[3]) if len(sys.argv) > 3 else 1
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), every)
