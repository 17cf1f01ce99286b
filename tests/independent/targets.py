"""Several targets in one image: targets.py PROGRAM FOLDER.

Pages rendered by cairo are combined into one image with numpy. The detections of all targets together are compared with
the positions on the pages and with the detections of each target alone.
"""

import json
import pathlib
import subprocess
import sys

import cv2
import numpy as np

from photograph import Page

program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
SIZE = 2000, 1400
REDUCED, PX_PER_MM = 12, 1200 / 25.4 / 12
BOARDS = {
    "front": "board --rows 8 --cols 9 --edge 18mm",
    "back": "board --rows 8 --cols 9 --edge 18mm --first-id 100",
    "other": "board --rows 6 --cols 7 --edge 24mm --family d36h11",
    "squares": "checkerboard --rows 7 --cols 8 --edge 20mm",
}


def run(*arguments):
    return subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)


def picture(rng):
    """An image of all boards, and the positions of their corners in it, by name."""
    image, truth = np.full(SIZE[::-1], 0.55, np.float32), {}
    for index, name in enumerate(BOARDS):
        page = Page(folder / f"{name}.json")
        sheet = page.reduced_by(REDUCED)
        height, width = sheet.shape
        corners = np.float32([[0, 0], [width, 0], [width, height], [0, height]])
        # Each board fills a quarter of the image, slightly rotated and tilted.
        middle = np.array([SIZE[0] * (0.27 + 0.46 * (index % 2)), SIZE[1] * (0.26 + 0.48 * (index // 2))])
        turn = cv2.getRotationMatrix2D((0, 0), rng.uniform(-12, 12), 620 / max(width, height))[:, :2]
        places = (corners - [width / 2, height / 2]) @ turn.T + middle + rng.uniform(-18, 18, (4, 2))
        to_picture = cv2.getPerspectiveTransform(corners, np.float32(places))
        drawn = cv2.warpPerspective(sheet, to_picture, SIZE, flags=cv2.INTER_AREA, borderValue=-1)
        inside = cv2.warpPerspective(np.ones_like(sheet), to_picture, SIZE, flags=cv2.INTER_NEAREST) > 0
        image[inside] = 0.05 + 0.6 * np.clip(drawn[inside], 0, 1)
        at = page.corners_mm * PX_PER_MM - 0.5
        truth[name] = dict(zip(page.keys, cv2.perspectiveTransform(at[None], to_picture)[0]))
    image = cv2.GaussianBlur(image, (0, 0), 0.8) + rng.normal(0, 0.005, image.shape)
    return np.uint8(np.clip(255 * image, 0, 255)), truth


def corners(found):
    """The corners of a detection by target, panel, row and column."""
    return {
        (grid.get("target"), grid["panel"], c["row"], c["col"]): (c["x"], c["y"])
        for grid in found["grids"]
        if grid["panel"] is not None
        for c in grid["corners"]
    }


def detected(image, names, into):
    targets = [part for name in names for part in ("--target", folder / f"{name}.json")]
    ran = run("detect", image, *targets, "-o", folder / into, "--ink", "none", "--tone", "linear")
    assert ran.returncode == 0, ran.stderr
    return corners(json.loads((folder / into / f"{image.stem}.json").read_text()))


for name, command in BOARDS.items():
    made = run(*command.split(), "--name", name, "--pdf", "-o", folder)
    assert made.returncode == 0, made.stderr
rng = np.random.default_rng(7)
worst, missing = 0.0, 0
for view in range(3):
    image, truth = picture(rng)
    path = folder / f"scene{view}.png"
    cv2.imwrite(str(path), image)
    together = detected(path, BOARDS, "together")
    apart = {}
    for name in BOARDS:
        of_one = detected(path, [name], name)
        assert all(target is None for target, *_ in of_one)
        apart.update({(name, *label): place for (_, *label), place in of_one.items()})
    assert together.keys() == apart.keys(), together.keys() ^ apart.keys()
    off = [np.hypot(*np.subtract(together[label], apart[label])) for label in apart]
    assert max(off) < 0.05, max(off)
    for (name, *label), place in together.items():
        worst = max(worst, np.hypot(*np.subtract(place, truth[name][tuple(label)])))
    missing += sum(map(len, truth.values())) - len(together)
assert worst < 0.3, worst
assert missing == 0, missing
alike = run("detect", path, "--target", folder / "front.json", "--target", folder / "front.json")
assert alike.returncode == 2 and "have the name front" in alike.stderr, alike.stderr
print(f"{len(BOARDS)} targets at once, {len(apart)} corners a picture: as each by itself, {worst:.3f} px from the pages")
