"""The data: pages drawn by poppler, photographed by a camera model in numpy that owes nothing to deltille.

    python photographs.py path/to/deltille FOLDER [--seed 1] [--scene NAME ...] [--board NAME ...]

writes `FOLDER/boards` (what deltille makes: PDF and description), `FOLDER/<board>/*.png` and `truth.json`: for each
photograph the visible corners with their true positions, and the covariance that no unbiased estimate falls below.
"""

import argparse
import concurrent.futures
import json
import math
import pathlib
import shutil
import subprocess
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent / "tests/independent"))

import cv2
import numpy as np

import photograph as pages
import protocol

# The smallest files of images with noise.
PACKED = [cv2.IMWRITE_PNG_COMPRESSION, 9, cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_RLE]


def bound(clean, noise, places, reach):
    """The least covariance of each corner (Cramér and Rao), px²: of the position of a known pattern in the pixels that are
    nearer to it than to any other corner. Levels, blur and the neighbouring corners are known to it."""
    gy, gx = np.gradient(clean.astype(float))
    variance = noise**2 + 1 / (12 * 255**2)
    found = []
    for (x, y), radius in zip(places, reach):
        left, right = int(max(0, x - radius)), int(x + radius) + 2
        top, bottom = int(max(0, y - radius)), int(y + radius) + 2
        rows, cols = np.mgrid[top : min(bottom, clean.shape[0]), left : min(right, clean.shape[1])]
        near = np.hypot(rows - y, cols - x) <= radius
        slope = np.stack([gx[rows[near], cols[near]], gy[rows[near], cols[near]]])
        information = slope @ slope.T / variance
        if np.linalg.cond(information) > 1e6:
            found.append(None)
            continue
        covariance = np.linalg.inv(information)
        found.append([float(f"{value:.4g}") for value in (covariance[0, 0], covariance[0, 1], covariance[1, 1])])
    return found


def cover(light, truth, part, rng):
    """A grey rectangle over part of the board; returns which corners remain visible."""
    low, high = truth.min(0), truth.max(0)
    side = (high - low) * math.sqrt(part)
    at = low + rng.uniform(0, 1, 2) * (high - low - side)
    x0, y0, x1, y1 = (int(value) for value in (*at, *(at + side)))
    light[y0:y1, x0:x1] = 0.3
    margin = 3
    inside = (truth > [x0 - margin, y0 - margin]).all(1) & (truth < [x1 + margin, y1 + margin]).all(1)
    return ~inside


def shoot(page, scene, seed):
    """An image (grey or BGR), and its true corners."""
    width, height = protocol.SIZE_PX
    shared = {k: getattr(scene, k) for k in ("tilt_deg", "blur_px", "black", "white", "light_ratio", "tone", "noise")}
    of_page = pages.Scene(width=width, height=height, focal_px=protocol.FOCAL_PX, fill=scene.fill, **shared)
    rng = np.random.default_rng(seed)
    view = pages.View(page, of_page, rng)
    truth = view.project(page.corners_mm)
    light = pages.look(page, view, of_page)
    if scene.light_ratio != 1:
        light = pages.lit(light, truth, scene.light_ratio, rng)
    visible = (truth > protocol.BORDER_PX).all(1) & (truth < [width - protocol.BORDER_PX, height - protocol.BORDER_PX]).all(1)
    if scene.cover:
        visible &= cover(light, truth, scene.cover, rng)
    if scene.motion_px:
        light = pages.moved(light, scene.motion_px, rng.uniform(0, np.pi))
    light = light * scene.exposure
    if scene.colour:
        image, clean = pages.coloured(light, scene.noise, scene.tone, rng), None
    else:
        clean = pages.tone_curve(scene.tone, light)
        image = clean + rng.normal(0, scene.noise, light.shape)
    image = np.clip(np.round(image * 255), 0, 255).astype(np.uint8)
    if scene.jpeg:
        image = cv2.imdecode(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, scene.jpeg])[1], cv2.IMREAD_UNCHANGED)
        clean = None
    apart = np.linalg.norm(truth[:, None] - truth[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    nearest = apart.min(1)
    bounds = bound(clean, scene.noise, truth, nearest / 2) if clean is not None else [None] * len(truth)
    corners = [
        {"label": label, "x": round(place[0], 6), "y": round(place[1], 6), "nearest_px": round(near, 2), "bound": least,
         "visible": bool(seen)}
        for label, place, near, least, seen in zip(page.labels, truth, nearest, bounds, visible)
    ]
    return image, corners


def make(folder, deltille, seed, scenes, boards):
    """Writes the boards and their photographs, instead of earlier ones."""
    made = folder / "boards"
    for board in boards:
        shutil.rmtree(folder / board, ignore_errors=True)
        command = [deltille, *protocol.BOARDS[board].split(), "--pdf", "--name", board, "-o", made, "--force"]
        subprocess.run([str(part) for part in command], check=True, capture_output=True)
    work = [(folder, board, scene, seed) for board in boards for scene in scenes]
    with concurrent.futures.ProcessPoolExecutor() as pool:
        parts = list(pool.map(one, *zip(*work)))
    for board in boards:
        truth = {name: of for (_, of_board, _, _), part in zip(work, parts) if of_board == board for name, of in part}
        width, height = protocol.SIZE_PX
        text = {"board": board, "command": protocol.BOARDS[board], "size_px": [width, height], "seed": seed, "photographs": truth}
        (folder / board / "truth.json").write_text(json.dumps(text))


class Tags(pages.Page):
    """The page of an AprilGrid without the small squares between its tags."""

    def drawn(self, ink_um):
        page = super().drawn(ink_um)
        places = {key[1:]: place for key, place in zip(self.keys, self.corners_mm)}
        rows, cols = (max(key[axis] for key in places) // 2 + 1 for axis in (0, 1))
        outline = lambda row, col: [places[2 * row + i, 2 * col + j] for i, j in ((0, 0), (0, 1), (1, 1), (1, 0))]
        filled = lambda outlines: cv2.fillPoly(np.zeros(page.shape, np.uint8), [whole(of) for of in outlines], 1)
        whole = lambda of: np.round(np.array(of) * pages.PX_PER_MM - 0.5).astype(np.int32)
        tags = cv2.dilate(filled([outline(row, col) for row in range(rows) for col in range(cols)]), np.ones((5, 5)))
        corners = np.array(list(places.values()))
        gap = np.linalg.norm(np.subtract(places[0, 2], places[0, 1]))
        low, high = corners.min(0) - 1.1 * gap, corners.max(0) + 1.1 * gap
        region = filled([[low, (high[0], low[1]), high, (low[0], high[1])]])
        return np.where((region == 1) & (tags == 0), np.float32(1), page)


def one(folder, board, scene, seed):
    """The photographs of a board in a scene, and their truth by name."""
    page = (Tags if board == "tags" else pages.Page)(folder / "boards" / f"{board}.json")
    target = json.loads((folder / "boards" / f"{board}.json").read_text())
    ids = {(c["row"], c["col"]): c["id"] for c in target["panels"][0]["corners"]}
    page.labels = [{"row": row, "col": col, "id": ids[row, col]} for _, row, col in page.keys]
    (folder / board).mkdir(exist_ok=True)
    found = []
    for number in range(protocol.VIEWS):
        name = f"{protocol.slug(scene)}-{number}"
        image, corners = shoot(page, protocol.SCENES[scene], [seed, number, *scene.encode()])
        cv2.imwrite(str(folder / board / f"{name}.png"), image, PACKED)
        found.append((name, {"scene": scene, "corners": corners}))
    return found


def arguments(parser):
    parser.add_argument("--seed", type=int, default=protocol.SEED)
    parser.add_argument("--scene", nargs="+", default=list(protocol.SCENES), choices=protocol.SCENES, metavar="NAME")
    parser.add_argument("--board", nargs="+", default=list(protocol.BOARDS), choices=protocol.BOARDS)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("deltille", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    arguments(parser)
    given = parser.parse_args()
    make(given.folder, given.deltille, given.seed, given.scene, given.board)
