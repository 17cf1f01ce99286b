"""Patches of boards with position codes, rendered by cairo and resampled by numpy: is every label correct?

    dense.py <program> <folder> [patches]

Patches of about three by four tiles of a board of a thousand tiles, at random positions and rotations, with two pixels
per cell and a blur of one pixel: unchanged, and with other cells painted over those of three of ten tiles. Then whole
views of a board with position codes and of one without: are the corners equally precise?
"""

import json
import pathlib
import subprocess
import sys

import cv2
import numpy as np

from photograph import PX_PER_MM, Page

SUPERSAMPLING = 4
BLUR_PX = 1.0
NOISE = 0.01
# Edge of a tile in cell widths: three cells, and a border of 1.5 cells on three sides.
CELLS_ACROSS = 7.5


class Board:
    """A board, and the positions of its corners on the page."""

    def __init__(self, program, folder, name, *settings):
        subprocess.run(
            [program, "board", *settings, "--name", name, "-o", folder, "--force"],
            check=True, capture_output=True,
        )
        self.json = pathlib.Path(folder, f"{name}.json")
        self.page = Page(self.json)
        self.corners = dict(zip(((row, col) for _, row, col in self.page.keys), self.page.corners_mm))

    def view(self, rng, edge_px, size, hidden=0.0):
        """An image of this width and height at a random position on the board, and the corners in it, px; without a
        size, an image of the whole board."""
        scale = edge_px / self.page.edge_mm
        angle = rng.uniform(0, 2 * np.pi)
        turn = scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        places = self.page.corners_mm
        if size:
            middle = places[rng.integers(len(places))]
        else:
            middle = places.mean(0)
            size = np.ceil(2 * np.abs((places - middle) @ turn.T).max(0) + 3 * edge_px).astype(int)
        shift = np.array(size) / 2 - turn @ middle + rng.uniform(0, 1, 2)
        image = self.looked_at(turn, shift, size, scale)
        corners = {key: turn @ place + shift for key, place in self.corners.items()}
        if hidden:
            self.paint_over(image, corners, rng, hidden)
        image = cv2.GaussianBlur(image, (0, 0), BLUR_PX * SUPERSAMPLING)
        image = cv2.resize(image, [int(side) for side in size], interpolation=cv2.INTER_AREA)
        image = 0.1 + 0.6 * image + NOISE * rng.standard_normal(image.shape)
        return np.clip(np.rint(255 * image), 0, 255).astype(np.uint8), corners

    def looked_at(self, turn, shift, size, scale):
        """The page, sampled at many points of every pixel."""
        reduced = max(1, int(PX_PER_MM / (scale * SUPERSAMPLING)))
        source = self.page.reduced_by(reduced).astype(np.float32)
        mm = reduced / PX_PER_MM
        to_mm = np.array([[mm, 0, mm / 2], [0, mm, mm / 2], [0, 0, 1]])
        to_px = np.eye(3)
        to_px[:2, :2], to_px[:2, 2] = turn, shift
        middle = (SUPERSAMPLING - 1) / 2
        fine = np.array([[SUPERSAMPLING, 0, middle], [0, SUPERSAMPLING, middle], [0, 0, 1]])
        fine_size = [int(SUPERSAMPLING * side) for side in size]
        return cv2.warpPerspective(
            source, fine @ to_px @ to_mm, fine_size, flags=cv2.INTER_LINEAR, borderValue=1.0
        )

    def paint_over(self, image, corners, rng, part):
        """Replaces the cells of some tiles by other cells."""
        for (row, col), a in corners.items():
            ends = [corners.get(key) for key in ((row, col + 1), (row + 1, col))]
            if any(end is None for end in ends) or rng.random() > part:
                continue
            tile = np.array([a, *ends])
            cells = tile.mean(0) + (tile - tile.mean(0)) * 3.0 / CELLS_ACROSS
            fine = lambda points: np.rint(16 * (SUPERSAMPLING * np.asarray(points) + 1.5)).astype(np.int32)
            cv2.fillConvexPoly(image, fine(cells), 0.0, shift=4)
            for u in range(3):
                for v in range(3 - u):
                    if rng.random() < 0.5:
                        at = lambda x, y: cells[0] + (x * (cells[1] - cells[0]) + y * (cells[2] - cells[0])) / 3
                        cell = [at(u, v), at(u + 1, v), at(u, v + 1)]
                        cv2.fillConvexPoly(image, fine(cell), 1.0, shift=4)


def detect(program, board, folder, images):
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.iterdir():
        old.unlink()
    for index, image in enumerate(images):
        cv2.imwrite(str(folder / f"{index}.png"), image)
    # Exit code 1 means that an image shows no board.
    command = [program, "detect", folder, "--target", board.json, "--force", "-o", folder]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode in (0, 1), done.stderr
    return [json.loads((folder / f"{index}.json").read_text()) for index in range(len(images))]


def labelled(detection, corners):
    """Distances of labelled corners from their true positions, px."""
    found = [corner for grid in detection["grids"] for corner in grid["corners"] if corner["id"] is not None]
    places = [corners[corner["row"], corner["col"]] for corner in found]
    return [np.hypot(c["x"] - x, c["y"] - y) for c, (x, y) in zip(found, places)]


def patches(program, folder, count):
    rng = np.random.default_rng(11)
    board = Board(program, folder, "dense", "--dense", "--rows", "36", "--cols", "36", "--edge", "5mm")
    for cell_px in (2.0, 3.0):
        edge_px = cell_px * CELLS_ACROSS
        size = (int(5.7 * edge_px), int(5.5 * edge_px * np.sqrt(0.75)))
        for hidden in (0.0, 0.3):
            views = [board.view(rng, edge_px, size, hidden) for _ in range(count)]
            found = detect(program, board, f"{folder}/patches", [image for image, _ in views])
            off = [labelled(detection, corners) for detection, (_, corners) in zip(found, views)]
            told = [distances for distances in off if distances]
            wrong = sum(max(distances) > edge_px / 2 for distances in told)
            corners = np.median([len(distances) for distances in told]) if told else 0
            print(
                f"{cell_px:g} px a cell, {100 * hidden:.0f} % of tiles painted over: {len(told)} of {count} patches "
                f"are labelled, by {corners:g} corners; {wrong} wrong"
            )
            assert wrong == 0
            least = 0.9 if hidden == 0.0 else 0.6
            assert len(told) >= least * count


def precision(program, folder):
    sizes = ["--rows", "12", "--cols", "14", "--edge", "12mm"]
    boards = {
        "with position codes": Board(program, folder, "codes", "--dense", *sizes),
        "without": Board(program, folder, "plain", "--untagged", *sizes),
    }
    for edge_px in (15.0, 20.0, 30.0):
        errors = {}
        for name, board in boards.items():
            rng = np.random.default_rng(12)
            views = [board.view(rng, edge_px, None) for _ in range(8)]
            found = detect(program, board, f"{folder}/views", [image for image, _ in views])
            off = [labelled(detection, corners) for detection, (_, corners) in zip(found, views)]
            assert all(len(distances) == 12 * 14 for distances in off), (name, edge_px)
            errors[name] = np.sqrt(np.mean(np.square(np.concatenate(off)) / 2))
        words = ", ".join(f"{error:.4f} px {name}" for name, error in errors.items())
        print(f"tiles of {edge_px:g} px: {words}")
        # On small tiles, cells reduce the number of pixels around a corner.
        allowed = 1.5 if edge_px < 20 else 1.1
        assert errors["with position codes"] < allowed * errors["without"]


def main():
    program, folder = sys.argv[1:3]
    count = int(sys.argv[3]) if len(sys.argv) > 3 else 40
    pathlib.Path(folder).mkdir(parents=True, exist_ok=True)
    patches(program, folder, count)
    precision(program, folder)


if __name__ == "__main__":
    main()
