"""Photographs of tagged boards whose pixels are integrated exactly, for small tags and steep views.

    image, truth = Shot(tilt_deg=65, cell_px=4).of(aprilgrid(6, 6, 0.3), seed=3)

Every dark square and every white cell of a tag is a quadrilateral in the image. The area of every pixel that it covers is
added up along its sides, at three times the resolution, then blurred and averaged over pixels. Nothing is sampled, so
the positions of corners are exact, and an image takes half a second. Pages are drawn without deltille.
"""

import json
import math
import subprocess
from dataclasses import dataclass

import cv2
import numpy as np

from photograph import demosaiced, tone_curve

ARUCO = cv2.aruco
FINE = 3
# Range of the mean of squared errors over stated variances.
LEAST_SHARE, MOST_SHARE = 0.5, 2.5


def squares(corners, side):
    """Corners of squares, given their first corners and sides."""
    return np.asarray(corners, float)[:, None] + np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * side


def bits_of(dictionary, index):
    return ARUCO.Dictionary.getBitsFromByteList(dictionary.bytesList[index : index + 1], dictionary.markerSize)


class Board:
    """Dark and white quadrilaterals, in cells of a tag with y down; corners by id."""

    def __init__(self):
        self.dark, self.white, self.corners = [], [], {}

    def add_tag(self, at, bits, border):
        self.dark.append(squares([at], len(bits) + 2 * border))
        cells = np.argwhere(bits)[:, ::-1] + border + np.array(at)
        self.white.append(squares(cells, 1))


def aprilgrid(columns=6, rows=6, gap=0.3, border=2, dictionary=ARUCO.DICT_APRILTAG_36h11):
    """Kalibr's grid: rows of tags from the lower left; OpenCV has its tags rotated by 180°."""
    board, dictionary = Board(), ARUCO.getPredefinedDictionary(dictionary)
    tag = len(bits_of(dictionary, 0)) + 2 * border
    step = tag * (1 + gap)
    for row in range(rows):
        for col in range(columns):
            at = np.array([col * step, (rows - 1 - row) * step])
            board.add_tag(at, bits_of(dictionary, row * columns + col)[::-1, ::-1], border)
            for up in (0, 1):
                for right in (0, 1):
                    index = (2 * row + up) * 2 * columns + 2 * col + right
                    board.corners[index] = at + [right * tag, (1 - up) * tag]
    small = [[col * step - gap * tag, row * step - gap * tag] for row in range(rows + 1) for col in range(columns + 1)]
    board.dark.append(squares(small, gap * tag))
    return board


def charuco(theirs):
    """OpenCV's board."""
    board, known = Board(), theirs.getDictionary()
    square = (known.markerSize + 2) / theirs.getMarkerLength() * theirs.getSquareLength()
    scale = square / theirs.getSquareLength()
    tagged = set()
    for index, points in zip(theirs.getIds().ravel(), theirs.getObjPoints()):
        at = np.array(points)[0, :2] * scale
        tagged.add(tuple(np.floor(at / square + 1e-6).astype(int)))
        board.add_tag(at, bits_of(known, index), 1)
    columns, rows = theirs.getChessboardSize()
    dark = [(c * square, r * square) for c in range(columns) for r in range(rows) if (c, r) not in tagged]
    board.dark.append(squares(dark, square))
    board.corners = dict(enumerate(theirs.getChessboardCorners()[:, :2] * scale))
    return board


def covered(polygons, height, width):
    """The area of each pixel that quadrilaterals cover; pixel k reaches from k to k + 1."""
    polygons = np.asarray(polygons, float)
    turn = np.roll(polygons, -1, 1) - polygons
    sign = np.sign((turn[:, 0, 0] * turn[:, 1, 1] - turn[:, 0, 1] * turn[:, 1, 0]))
    first, last = polygons.reshape(-1, 2), np.roll(polygons, -1, 1).reshape(-1, 2)
    weight = np.repeat(sign, 4)

    def split(first, last, weight, axis):
        """Cuts segments at whole coordinates."""
        low, high = np.minimum(first[:, axis], last[:, axis]), np.maximum(first[:, axis], last[:, axis])
        start = np.floor(low)
        count = np.maximum(np.ceil(high) - start, 1).astype(int)
        which = np.repeat(np.arange(len(first)), count)
        step = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
        a, b = first[which], last[which]
        length = b[:, axis] - a[:, axis]
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = [(start[which] + step + k - a[:, axis]) / length for k in (0, 1)]
        down = length < 0
        t0 = np.where(length == 0, 0, np.where(down, ends[1], ends[0])).clip(0, 1)[:, None]
        t1 = np.where(length == 0, 1, np.where(down, ends[0], ends[1])).clip(0, 1)[:, None]
        return a + (b - a) * t0, a + (b - a) * t1, weight[which]

    for axis in (1, 0):
        first, last, weight = split(first, last, weight, axis)
    middle, rise = (first + last) / 2, (first - last)[:, 1] * weight
    col, row = np.floor(middle).astype(int).T
    right = np.where(col < 0, 0, middle[:, 0] - col)
    col = col.clip(0)
    ok = (row >= 0) & (row < height) & (col < width)
    col, row, rise, right = col[ok], row[ok], rise[ok], right[ok]
    sums = np.zeros(height * (width + 1))
    at = row * (width + 1) + col
    sums += np.bincount(at, rise * (1 - right), len(sums)) + np.bincount(at + 1, rise * right, len(sums))
    return np.cumsum(sums.reshape(height, width + 1), 1)[:, :width]


@dataclass
class Shot:
    """Settings of a photograph; light and noise are fractions of full scale."""

    width: int = 1024
    height: int = 800
    focal_px: float = 1200.0
    tilt_deg: float = 0.0
    cell_px: float = 4.0  # of a cell of a tag in the middle, before the tilt
    blur_px: float = 0.7
    black: float = 0.08
    white: float = 0.75
    noise: float = 0.005
    tone: str = "linear"
    mosaic: bool = False
    lamp: object = None  # light on the board at positions x, y in the image, relative; a function of these and a generator

    def of(self, board, seed):
        """An 8-bit image, and the corners in it by id."""
        rng = np.random.default_rng(seed)
        ids = sorted(board.corners)
        places = np.array([board.corners[index] for index in ids])
        centre = (places.max(0) + places.min(0)) / 2
        turn = lambda axis, angle: cv2.Rodrigues(np.eye(3)[axis] * angle)[0]
        azimuth, roll = rng.uniform(0, 2 * math.pi), rng.uniform(-math.pi, math.pi)
        rotation = turn(2, roll) @ turn(2, azimuth) @ turn(0, math.radians(self.tilt_deg)) @ turn(2, -azimuth)
        distance = self.focal_px / self.cell_px
        aside = rng.uniform(-1, 1, 2) * 3

        def project(points):
            flat = np.concatenate([points - centre, np.zeros((*points.shape[:-1], 1))], -1)
            at = flat @ rotation.T + [0, 0, distance]
            return self.focal_px * at[..., :2] / at[..., 2:] + [self.width / 2, self.height / 2] + aside

        size = [self.height * FINE, self.width * FINE]
        dark, white = (covered(FINE * project(np.concatenate(part)), *size) for part in (board.dark, board.white))
        light = self.white + (self.black - self.white) * (dark - white)
        if self.lamp:
            x, y = ((np.arange(side) + 0.5) / FINE - 0.5 for side in (size[1], size[0]))
            light *= self.lamp(x, y[:, None], rng)
        if self.blur_px:
            light = cv2.GaussianBlur(light, (0, 0), self.blur_px * FINE, borderType=cv2.BORDER_REPLICATE)
        light = light.reshape(self.height, FINE, self.width, FINE).mean((1, 3))
        if self.mosaic:
            grey = demosaiced(light, self.noise, self.tone, rng)
        else:
            grey = tone_curve(self.tone, light) + rng.normal(0, self.noise, light.shape)
        image = np.clip(np.rint(grey * 255), 0, 255).astype(np.uint8)
        seen = project(places) - 0.5
        inside = (seen > 3).all(1) & (seen < [self.width - 4, self.height - 4]).all(1)
        return image, {index: place for index, place, ok in zip(ids, seen, inside) if ok}


@dataclass
class Seen:
    """Corners found in some photographs: squared errors per axis, and the same over the stated variances."""

    due: int = 0
    squares: list = None
    shares: list = None

    def __str__(self):
        return (
            f"{len(self.squares)} of {self.due} corners, rms {self.rms():.4f} px, "
            f"squared error over stated variance {np.mean(self.shares):.2f}"
        )

    def found(self):
        return len(self.squares) / self.due

    def rms(self):
        return math.sqrt(np.mean(self.squares))


# Corners farther from their true position than this have a wrong label, px.
WRONG_PX = 2.0


def examine(deltille, folder, target, board, shot, count):
    """Corners that deltille finds in this number of photographs of a board; all must have a covariance."""
    folder.mkdir(parents=True, exist_ok=True)
    truths = {}
    for number in range(count):
        image, truths[str(number)] = shot.of(board, number)
        cv2.imwrite(str(folder / f"{number}.png"), image)
    command = [deltille, "detect", *sorted(folder.glob("*.png")), "--target", target, "-o", folder, "--force"]
    subprocess.run([str(part) for part in command], check=True, capture_output=True)
    seen = Seen(squares=[], shares=[])
    for number, truth in truths.items():
        seen.due += len(truth)
        detection = json.loads((folder / f"{number}.json").read_text())
        for corner in (corner for grid in detection["grids"] if grid["panel"] == 0 for corner in grid["corners"]):
            error = np.array([corner["x"], corner["y"]]) - truth[corner["id"]]
            assert np.hypot(*error) < WRONG_PX, f"{folder.name}, photograph {number}: {corner}"
            xx, _, yy = corner["cov"]
            seen.squares.append(np.mean(error**2))
            seen.shares.append(np.mean(error**2 / [xx, yy]))
    return seen


def hard_views(deltille, folder, name, target, board, views):
    """Checks views: a title, a shot, and the least part of corners and the largest RMS error that are accepted."""
    for title, shot, least, most in views:
        seen = examine(deltille, folder / f"{name}-{title.replace(' ', '-')}", target, board, shot, 3)
        print(f"{name}: {title}: {seen}", flush=True)
        assert seen.found() >= least and seen.rms() <= most, (title, str(seen))
        assert LEAST_SHARE <= np.mean(seen.shares) <= MOST_SHARE, (title, str(seen))
