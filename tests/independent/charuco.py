"""ChArUco boards, checked with OpenCV.

    python charuco.py path/to/deltille FOLDER

makes boards in FOLDER with both of OpenCV's patterns and several dictionaries. OpenCV's detector must find every corner
on the page with the id and the positions, in space and on the page, that the description states. OpenCV's own image of
the board must show the same pattern. In synthetic photographs, `deltille detect` must find the visible corners at least
with the precision of OpenCV, and in steep, small and blurred photographs the fraction and the precision of `HARD`, with
realistic covariances. Needs numpy, OpenCV 4.8 or later, pdftoppm and pdftocairo.
"""

import json
import pathlib
import subprocess
import sys

import cv2
import numpy as np

import exact
from photograph import Page, Scene, photograph

ARUCO = cv2.aruco
DPI = 300

BOARDS = {
    "usual": "--squares 8x6 --edge 30mm --marker 22mm --dictionary 5x5_100",
    "legacy": "--squares 8x6 --edge 30mm --marker 22mm --dictionary 5x5_100 --legacy",
    "odd": "--squares 7x5 --edge 25mm --dictionary 4x4_50 --first-id 7",
    "legacy-odd": "--squares 6x7 --edge 25mm --dictionary 6x6_250 --marker 15mm --legacy",
    "narrow": "--squares 7x5 --edge 30mm --marker 24mm --dictionary 4x4_50",
    "april": "--squares 5x4 --edge 40mm --dictionary apriltag_36h11 --marker 32mm",
    "many": "--squares 23x16 --edge 12mm --dictionary 7x7_1000 --marker 9mm --first-id 800",
}

# Boards that are also photographed, and their settings.
PHOTOGRAPHED = ["usual", "odd", "april"]
MIN_FOUND = 0.93
SCENES = [
    Scene(tilt_deg=0),
    Scene(tilt_deg=30, tone="srgb"),
    Scene(tilt_deg=60, tone="s-curve", noise=0.01, focal_px=1800.0),
]
# Photographs of boards with wide and with narrow margins around markers, the least part of the corners, and the largest
# RMS error, px.
HARD = {
    "usual": [
        ("65 degrees 4 px a module", exact.Shot(tilt_deg=65, cell_px=4), 0.95, 0.008),
        ("45 degrees 1.75 px a module", exact.Shot(tilt_deg=45, cell_px=1.75), 0.95, 0.02),
        ("1.5 px a module", exact.Shot(cell_px=1.5), 0.95, 0.02),
        ("blur of 2 px", exact.Shot(tilt_deg=45, cell_px=4, blur_px=2), 0.95, 0.015),
    ],
    "narrow": [
        ("sRGB", exact.Shot(tilt_deg=30, cell_px=5, tone="srgb"), 0.99, 0.008),
        ("2.5 px a module", exact.Shot(cell_px=2.5), 0.95, 0.012),
        ("1.75 px a module", exact.Shot(cell_px=1.75), 0.95, 0.02),
    ],
}
# Corners farther from their true position than this have a wrong label.
WRONG_PX = 2.0


def run(*command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    assert done.returncode == 0, f"{' '.join(map(str, command))}: {done.stdout}{done.stderr}"


def board_of(target):
    """OpenCV's board with the same parameters."""
    spec = target["spec"]
    dictionary = ARUCO.getPredefinedDictionary(getattr(ARUCO, spec["dictionary"]))
    count = spec["squares"][0] * spec["squares"][1] // 2
    ids = np.arange(spec["first_id"], spec["first_id"] + count)
    board = ARUCO.CharucoBoard(spec["squares"], spec["square_mm"], spec["marker_mm"], dictionary, ids)
    board.setLegacyPattern(spec["legacy"])
    return board


def detector_of(board):
    parameters = ARUCO.DetectorParameters()
    parameters.adaptiveThreshWinSizeMax = 63
    return ARUCO.CharucoDetector(board, ARUCO.CharucoParameters(), parameters)


def check_page(folder, name, target, board):
    """Checks the page as rendered by poppler."""
    run("pdftoppm", "-r", DPI, "-gray", "-singlefile", "-png", folder / f"{name}.pdf", folder / f"{name}-page")
    image = cv2.imread(str(folder / f"{name}-page.png"), cv2.IMREAD_GRAYSCALE)
    places, ids, _, markers = detector_of(board).detectBoard(image)
    panel = target["panels"][0]
    corners = {corner["id"]: corner for corner in panel["corners"]}
    assert ids is not None and sorted(ids.ravel()) == sorted(corners), f"{name}: {ids}"
    assert sorted(markers.ravel()) == sorted(tag["id"] for tag in panel["tags"]), f"{name}: {markers}"
    # The same ids, and the same positions in space.
    points = board.getChessboardCorners()
    stated = np.array([corners[index]["target_mm"] for index in range(len(corners))])
    assert np.abs(points - stated).max() < 1e-4, f"{name}: {points - stated}"
    truth = dict(zip([key[1:] for key in Page(folder / f"{name}.json").keys], Page(folder / f"{name}.json").corners_mm))
    off = [
        place * 25.4 / DPI + 12.7 / DPI - truth[corners[index]["row"], corners[index]["col"]]
        for place, index in zip(places.reshape(-1, 2), ids.ravel())
    ]
    worst = np.hypot(*np.transpose(off)).max()
    assert worst < 0.1, f"{name}: {worst} mm"
    return worst


def check_pattern(folder, name, target, board):
    """Compares OpenCV's own image of the board with the page: every pixel except those at edges."""
    image = cv2.imread(str(folder / f"{name}-page.png"), cv2.IMREAD_GRAYSCALE)
    side_px = 40
    columns, rows = target["spec"]["squares"]
    theirs = board.generateImage((columns * side_px, rows * side_px), marginSize=0, borderBits=1)
    panel, sheet = target["panels"][0], target["sheets"][0]
    placement, edge = sheet["placements"][0], panel["edge_mm"]
    turn = np.exp(1j * placement["angle_rad"])
    # Pixels of OpenCV's image, in the target frame, on the panel, and on the page.
    y, x = np.mgrid[0 : rows * side_px, 0 : columns * side_px]
    along = [(axis + 0.5) * edge / side_px for axis in (x, y)]
    shift = panel["pose"]["translation_mm"]
    on_panel = (along[0] - shift[0]) + 1j * (shift[1] - along[1])
    on_page = on_panel * turn + complex(*placement["origin_mm"])
    px = [on_page.real * DPI / 25.4 - 0.5, (sheet["height_mm"] - on_page.imag) * DPI / 25.4 - 0.5]
    ours = cv2.remap(image, px[0].astype(np.float32), px[1].astype(np.float32), cv2.INTER_LINEAR)
    wrong = (ours > 127) != (theirs > 127)
    # OpenCV draws markers in whole pixels.
    wrong = cv2.erode(wrong.astype(np.uint8), np.ones((5, 5)))
    assert not wrong.any(), f"{name}: {wrong.sum()} pixels differ from OpenCV's picture"


def photographs(deltille, folder, name, target, board):
    """Errors of both detectors, px, in synthetic photographs with known ground truth."""
    page, shots = Page(folder / f"{name}.json"), folder / f"{name}-shots"
    shots.mkdir(exist_ok=True)
    truths = {}
    for number, scene in enumerate(SCENES):
        image, truths[f"{number}"] = photograph(page, scene, number)
        cv2.imwrite(str(shots / f"{number}.png"), image)
    images = sorted(shots.glob("*.png"))
    run(deltille, "detect", *images, "--target", folder / f"{name}.json", "-o", shots)
    keys = {corner["id"]: (0, corner["row"], corner["col"]) for corner in target["panels"][0]["corners"]}
    errors = {"deltille": [], "OpenCV": []}
    due = 0
    for number, truth in truths.items():
        due += len(truth)
        detection = json.loads((shots / f"{number}.json").read_text())
        corners = [corner for grid in detection["grids"] if grid["panel"] == 0 for corner in grid["corners"]]
        errors["deltille"] += [
            np.hypot(*(np.array([corner["x"], corner["y"]]) - truth[keys[corner["id"]]])) for corner in corners
        ]
        image = cv2.imread(str(shots / f"{number}.png"), cv2.IMREAD_GRAYSCALE)
        places, ids, _, _ = detector_of(board).detectBoard(image)
        if ids is not None:
            errors["OpenCV"] += [
                np.hypot(*(place - truth[keys[index]])) for place, index in zip(places.reshape(-1, 2), ids.ravel())
            ]
    words = []
    rms = {}
    for who, found in errors.items():
        found = np.array(found)
        rms[who] = np.sqrt(np.mean(found**2) / 2) if len(found) else np.inf
        median = np.median(found) if len(found) else np.inf
        words.append(f"{who} {len(found)} of {due}, rms {rms[who]:.4f}, median {median:.4f} px")
        if who == "deltille":
            assert (found < WRONG_PX).all(), f"{name}: wrong labels, {found.max()} px"
            assert len(found) >= MIN_FOUND * due, f"{name}: {words}"
    assert rms["deltille"] <= rms["OpenCV"], f"{name}: {words}"
    return ", ".join(words)


def main(deltille, folder):
    folder.mkdir(parents=True, exist_ok=True)
    for name, options in BOARDS.items():
        run(deltille, "charuco", *options.split(), "--name", name, "-o", folder)
        target = json.loads((folder / f"{name}.json").read_text())
        board = board_of(target)
        worst = check_page(folder, name, target, board)
        check_pattern(folder, name, target, board)
        count = len(target["panels"][0]["corners"])
        print(f"{name}: OpenCV finds all {count} corners on the page, within {worst:.3f} mm", flush=True)
        if name in PHOTOGRAPHED:
            print(f"{name}: in photographs: {photographs(deltille, folder, name, target, board)}", flush=True)
        if name in HARD:
            drawn = exact.charuco(board)
            exact.hard_views(deltille, folder, name, folder / f"{name}.json", drawn, HARD[name])


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
