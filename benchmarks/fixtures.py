"""The fixture of another project's benchmark: one corner of an endless checkerboard, refined from the nearest pixel.

    python fixtures.py path/to/deltille FOLDER       # writes FOLDER/fixtures.json

The images are drawn from the description in the book of chess-corners, see protocol.py. They average points on a grid of 1/8 px,
so that an edge lies at a multiple of 1/8 px, not at the stated position: the mean distance between both is 0.0447 px, below which
no method can fall. Therefore errors are given from the positions that are drawn, and from those that are stated, as the book does.
chess-corners detects the corner before it refines it, which fails with squares of 5 px: its refinement alone is not available.
The bound is the mean distance of an unbiased estimate with the least covariance (Cramér and Rao), without prior knowledge of
anything but the pattern, in a circle up to the nearest corners; rounding to grey levels counts as noise.
"""

import itertools
import json
import pathlib
import subprocess
import sys
import tempfile

import cv2
import numpy as np

import photographs
import protocol

SIDE, CENTRE, POINTS = 45, 22, 8
# The best of all windows that no other corner touches.
BEST = "OpenCV cornerSubPix, best window"
# Positions of the points, px.
FINE = (np.arange(SIDE * POINTS) + 0.5) / POINTS - 0.5


def image(square, blur, noise, x, y, rng):
    cells = lambda at: np.floor((FINE - at) / square).astype(int)
    fine = np.where((cells(x) + cells(y)[:, None]) % 2, 230.0, 30.0)
    drawn = np.round(fine.reshape(SIDE, POINTS, SIDE, POINTS).mean((1, 3))).astype(np.uint8)
    if blur:
        width = 2 * int(np.ceil(3 * blur)) + 1
        drawn = cv2.GaussianBlur(drawn, (width, width), blur, borderType=cv2.BORDER_REPLICATE)
    if noise:
        drawn = np.clip(np.round(drawn + rng.normal(0, noise, drawn.shape)), 0, 255).astype(np.uint8)
    return drawn


def drawn_at(position):
    """The position between the points where the edges of a stated position are drawn."""
    return FINE[np.searchsorted(FINE, np.subtract(position, 1e-9))] - 0.5 / POINTS


def by_opencv(half):
    """In a window of 2·half + 1 px."""
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-3)
    return lambda picture, seed: cv2.cornerSubPix(picture, np.float32([[seed]]), (half, half), (-1, -1), criteria).ravel()


def by_chess_corners(refiner):
    import chess_corners

    config = chess_corners.DetectorConfig.chess()
    detector = chess_corners.Detector(config.with_chess(refiner=getattr(chess_corners.ChessRefiner, refiner)()))

    def refine(picture, seed):
        """The detected corner next to the seed: it detects before it refines."""
        return min(detector.detect(picture).xy, key=lambda at: np.hypot(*(at - seed)), default=None)

    return refine


def by_deltille(program, square):
    """In the largest window that no other corner touches."""

    def refine(picture, seed):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder)
            cv2.imwrite(str(path / "corner.png"), picture)
            (path / "seeds.csv").write_text(f"{seed[0]},{seed[1]}\n")
            command = [program, "refine", path / "corner.png", "--kind", "checker", "--seeds", path / "seeds.csv"]
            command += ["--window", 2 * square - 1]
            done = subprocess.run([str(of) for of in command], check=True, capture_output=True, text=True)
        return [float(of) for of in done.stdout.splitlines()[1].split(",")[:2]]

    return refine


def refiners(program, square):
    yield "deltille refine", by_deltille(program, square)
    yield "OpenCV cornerSubPix", by_opencv(5)
    for half in range(2, square):
        yield BEST, by_opencv(half)
    try:
        yield "chess-corners Förstner", by_chess_corners("forstner")
        yield "chess-corners saddle point", by_chess_corners("saddle_point")
        yield "chess-corners centre of mass", by_chess_corners("center_of_mass")
    except ImportError:
        print("not compared, because it is not installed: chess-corners")


def mean_bound(square, blur, noise):
    """Mean distance of an estimate with the least covariance in the middle of the fixture, px."""
    fine = image(square, 0, 0, CENTRE + 0.5, CENTRE + 0.5, None).astype(float)
    clean = cv2.GaussianBlur(fine, (0, 0), blur) if blur else fine
    place = np.array([[CENTRE + 0.5, CENTRE + 0.5]])
    [[xx, _, yy]] = photographs.bound(clean / 255, noise / 255, place, [square])
    return float(np.sqrt(np.pi / 2) * np.sqrt((xx + yy) / 2))


def main(program, folder):
    table = {}
    for condition, (square, blur, noise) in protocol.FIXTURES.items():
        rng = np.random.default_rng(protocol.SEED)
        steps = CENTRE + np.arange(protocol.OFFSETS) / protocol.OFFSETS
        places = list(itertools.product(steps, steps))
        pictures = [image(square, blur, noise, *at, rng) for at in places]
        table[condition] = {"bound": mean_bound(square, blur, noise)}
        for name, refine in refiners(program, square):
            found = [refine(picture, np.round(at)) for at, picture in zip(places, pictures)]
            # A corner farther than half a square is another one.
            is_near = lambda at, of: at is not None and np.hypot(*np.subtract(at, of)) < square / 2
            pairs = [pair for pair in zip(found, places) if is_near(*pair)]
            mean = lambda true: float(np.mean([np.hypot(*np.subtract(at, true(of))) for at, of in pairs])) if pairs else None
            row = {"found": len(pairs), "drawn": mean(drawn_at), "stated": mean(lambda at: at)}
            rank = lambda of: (of["found"], -(of["drawn"] or 0))
            if name not in table[condition] or rank(row) > rank(table[condition][name]):
                table[condition][name] = row
        for name, row in table[condition].items():
            print(condition, name, row, flush=True)
    (folder / "fixtures.json").write_text(json.dumps(table))


if __name__ == "__main__":
    main(*(pathlib.Path(path).resolve() for path in sys.argv[1:3]))
