"""AprilGrids, checked with OpenCV and with Kalibr's formulas.

    python aprilgrid.py path/to/deltille FOLDER

makes grids in FOLDER and renders their pages with poppler. OpenCV's ArUco detector must find every tag with its id and
its corners. The corners that Kalibr computes from its target file must be those of the description. Exactly the dark
squares of Kalibr's drawing must be dark. In synthetic photographs of a grid, `deltille detect` must find the visible
corners at least with the precision of OpenCV, and in steep, small, blurred and colour photographs the fraction and the
precision of `HARD`, with realistic covariances. Needs numpy, OpenCV, PyYAML, pdftoppm and pdftocairo.
"""

import json
import pathlib
import sys

import cv2
import numpy as np
import yaml

import exact
from charuco import SCENES, WRONG_PX, run
from photograph import Page, photograph

ARUCO = cv2.aruco
DPI = 300

# Grids, and the family in OpenCV.
GRIDS = {
    "kalibr": ("--tags 6x6 --edge 24mm --gap 0.3", ARUCO.DICT_APRILTAG_36h11),
    "one-bit": ("--tags 5x4 --edge 30mm --gap 0.25 --tag-border 1 --first-id 100", ARUCO.DICT_APRILTAG_36h11),
    "small": ("--tags 3x2 --edge 50mm --gap 0.5 --family aprilTag25h9", ARUCO.DICT_APRILTAG_25h9),
}

# Photographs of Kalibr's grid, the least part of the corners, and the largest RMS error, px.
HARD = [
    ("45 degrees 4 px a bit", exact.Shot(tilt_deg=45, cell_px=4), 0.99, 0.008),
    ("65 degrees 4 px a bit", exact.Shot(tilt_deg=65, cell_px=4), 0.95, 0.012),
    ("45 degrees 2.5 px a bit", exact.Shot(tilt_deg=45, cell_px=2.5), 0.95, 0.012),
    ("65 degrees 3 px a bit", exact.Shot(tilt_deg=65, cell_px=3), 0.90, 0.02),
    ("blur of 2 px", exact.Shot(tilt_deg=30, cell_px=5, blur_px=2), 0.99, 0.02),
    ("colour", exact.Shot(tilt_deg=30, cell_px=4, tone="srgb", mosaic=True), 0.99, 0.02),
]


def kalibr_corners(grid):
    """GridCalibrationTargetAprilgrid::createGridPoints, mm: rows and columns of corners from the lower left."""
    size, spacing = 1000 * grid["tagSize"], grid["tagSpacing"]
    place = lambda index: index // 2 * (1 + spacing) * size + index % 2 * size
    rows, columns = 2 * grid["tagRows"], 2 * grid["tagCols"]
    return np.array([[place(c), place(r), 0.0] for r in range(rows) for c in range(columns)])


def check(deltille, folder, name, options, dictionary):
    run(deltille, "aprilgrid", *options.split(), "--name", name, "-o", folder)
    target = json.loads((folder / f"{name}.json").read_text())
    spec = target["spec"]
    (columns, rows), is_kalibrs = spec["tags"], (spec["family"], spec["border_bits"]) == ("aprilTag36h11", 2.0)
    grid = {
        "target_type": "aprilgrid", "tagCols": columns, "tagRows": rows, "tagSize": spec["tag_mm"] / 1000,
        "tagSpacing": spec["gap"], "codeOffset": spec["first_id"],
    }
    # Kalibr's file exists exactly if Kalibr supports the grid.
    described = folder / f"{name}.yaml"
    assert described.exists() == is_kalibrs
    if is_kalibrs:
        grid = yaml.safe_load(described.read_text())
    panel, sheet = target["panels"][0], target["sheets"][0]
    corners = sorted(panel["corners"], key=lambda corner: corner["id"])
    assert grid["target_type"] == "aprilgrid" and [corner["id"] for corner in corners] == list(range(len(corners)))
    points = kalibr_corners(grid)
    off = np.abs(points - [corner["target_mm"] for corner in corners]).max()
    assert off < 1e-6, f"{name}: {off} mm from Kalibr's corners"

    run("pdftoppm", "-r", DPI, "-gray", "-singlefile", "-png", folder / f"{name}.pdf", folder / name)
    image = cv2.imread(str(folder / f"{name}.png"), cv2.IMREAD_GRAYSCALE)
    placement = sheet["placements"][0]
    turn = np.exp(1j * placement["angle_rad"])

    def px(points_mm):
        """Pixels of positions in the frame of the panel."""
        page = (points_mm[:, 0] + 1j * points_mm[:, 1]) * turn + complex(*placement["origin_mm"])
        return np.c_[page.real, sheet["height_mm"] - page.imag] * DPI / 25.4 - 0.5

    found = by_opencv(image, grid, panel, dictionary)
    columns, first = grid["tagCols"], grid["codeOffset"]
    assert len(found) == len(corners), f"{name}: {len(found)} of {len(corners)} corners"
    off = [place - px(points[[index]])[0] for index, place in found.items()]
    worst = np.hypot(*np.transpose(off)).max() * 25.4 / DPI
    assert worst < 0.25, f"{name}: {worst} mm"

    # Kalibr's drawing: tags, and squares of spacing x size at the corners of each. OpenCV checks the cells.
    size, spacing = 1000 * grid["tagSize"], grid["tagSpacing"]
    side = 40
    low, high = -spacing * size, points.max(0)[:2] + spacing * size
    x, y = (np.arange(low, end, size / side) + size / side / 2 for end in high)
    place = np.array([(a, b) for b in y for a in x])
    near = lambda along: ((along + spacing * size) % ((1 + spacing) * size)) / size
    u, v = near(place[:, 0]), near(place[:, 1])
    in_small = (u < spacing) & (v < spacing)
    in_tag = (u > spacing) & (v > spacing)
    white = ~in_small & ~in_tag
    at = px(place).astype(np.float32)
    at = at.reshape(len(y), len(x), 2)
    seen = cv2.remap(image, at[..., 0], at[..., 1], cv2.INTER_LINEAR).ravel()
    # Clear of edges.
    clear = np.ones(len(place), bool)
    for part in (u, v):
        for edge in (0, spacing, 1 + spacing):
            clear &= np.abs(part - edge) > 0.03
    assert (seen[clear & in_small] < 64).all() and (seen[clear & white] > 192).all(), f"{name}: not as Kalibr draws it"
    print(f"{name}: OpenCV finds all {len(panel['tags'])} tags, corners within {worst:.3f} mm; corners are Kalibr's", flush=True)
    return target, grid


def by_opencv(image, grid, panel, dictionary):
    """Corners that OpenCV finds, by id. Its AprilTags are those of Kalibr rotated by 180°, so its corners, clockwise
    from the upper left, begin here at the lower right."""
    parameters = ARUCO.DetectorParameters()
    parameters.markerBorderBits = round(panel["border_bits"])
    parameters.cornerRefinementMethod = ARUCO.CORNER_REFINE_SUBPIX
    parameters.adaptiveThreshWinSizeMax = 63
    detector = ARUCO.ArucoDetector(ARUCO.getPredefinedDictionary(dictionary), parameters)
    tags, ids, _ = detector.detectMarkers(image)
    found, columns = {}, grid["tagCols"]
    known = range(grid["codeOffset"], grid["codeOffset"] + columns * grid["tagRows"])
    for tag, index in zip(tags, [] if ids is None else ids.ravel()):
        assert index in known, index
        row, column = (2 * int(part) for part in divmod(index - grid["codeOffset"], columns))
        around = [(row, column + 1), (row, column), (row + 1, column), (row + 1, column + 1)]
        found.update({r * 2 * columns + c: place for (r, c), place in zip(around, tag[0])})
    return found


def photographs(deltille, folder, name, target, grid, dictionary):
    """Errors of both detectors, px, in synthetic photographs with known ground truth."""
    page, shots = Page(folder / f"{name}.json"), folder / f"{name}-shots"
    shots.mkdir(exist_ok=True)
    panel = target["panels"][0]
    keys = {corner["id"]: (0, corner["row"], corner["col"]) for corner in panel["corners"]}
    errors, due = {"deltille": [], "OpenCV": []}, 0
    for number, scene in enumerate(SCENES):
        image, truth = photograph(page, scene, number)
        path = shots / f"{number}.png"
        cv2.imwrite(str(path), image)
        due += len(truth)
        run(deltille, "detect", path, "--target", folder / f"{name}.json", "-o", shots)
        detection = json.loads((shots / f"{number}.json").read_text())
        ours = {
            corner["id"]: np.array([corner["x"], corner["y"]])
            for found in detection["grids"] if found["panel"] == 0
            for corner in found["corners"]
        }
        for who, found in (("deltille", ours), ("OpenCV", by_opencv(image, grid, panel, dictionary))):
            errors[who] += [np.hypot(*(place - truth[keys[index]])) for index, place in found.items()]
    rms = {who: np.sqrt(np.mean(np.square(found)) / 2) for who, found in errors.items()}
    words = ", ".join(
        f"{who} {len(found)} of {due}, rms {rms[who]:.4f}, median {np.median(found):.4f} px" for who, found in errors.items()
    )
    assert max(errors["deltille"]) < WRONG_PX and len(errors["deltille"]) >= 0.95 * due, words
    assert rms["deltille"] <= rms["OpenCV"], words
    print(f"{name}: in photographs: {words}", flush=True)


if __name__ == "__main__":
    folder = pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    deltille = pathlib.Path(sys.argv[1])
    for number, (name, (options, dictionary)) in enumerate(GRIDS.items()):
        target, grid = check(deltille, folder, name, options, dictionary)
        if number == 0:
            photographs(deltille, folder, name, target, grid, dictionary)
            exact.hard_views(deltille, folder, name, folder / f"{name}.json", exact.aprilgrid(), HARD)
