"""What is measured: boards, scenes, seeds and limits.

Changes of this file are committed before the run whose figures they concern, in a commit of their own.
"""

from dataclasses import dataclass

SEED = 1
# Photographs of each board in each scene.
VIEWS = 2
SIZE_PX = (928, 696)
FOCAL_PX = 900.0

# Boards on A4 in landscape: the command that makes each, and what else can read it.
BOARDS = {
    "deltille": "board --rows 10 --cols 11",
    "checkerboard": "checkerboard --rows 8 --cols 11 --edge 20mm",
    # With codes of 5 × 5 or 6 × 6 bits, calib-targets finds only a part of the corners, even on the page.
    "charuco": "charuco --squares 12x9 --edge 20mm --marker 15mm --dictionary 4x4_100",
    # One black bit around each code, as AprilTag 3 expects; Kalibr's own grids have two.
    "aprilgrid": "aprilgrid --tags 6x4 --edge 32mm --gap 0.3 --tag-border 1",
    # The same page without the small squares, whose corners touch the tags: AprilTag 3 needs separate tags.
    "tags": "aprilgrid --tags 6x4 --edge 32mm --gap 0.3 --tag-border 1",
}


@dataclass
class Scene:
    """A photograph. Light and noise are fractions of full scale; everything else is as in `photograph.Scene`."""

    fill: float = 0.75  # the part of the picture that the board fills, before the tilt
    tilt_deg: float = 30.0
    blur_px: float = 0.7
    motion_px: float = 0.0
    black: float = 0.05
    white: float = 0.60
    light_ratio: float = 1.0
    exposure: float = 1.0
    tone: str = "linear"
    noise: float = 0.005
    cover: float = 0.0  # the part of the board behind a grey rectangle
    colour: bool = False  # a Bayer sensor, planes interpolated by OpenCV's edge-aware method
    jpeg: int = 0  # quality


# One axis is changed at a time, most of them in two steps: usual and hard.
SCENES = {
    "usual": Scene(),
    "facing": Scene(tilt_deg=0),
    "tilt 60°": Scene(tilt_deg=60),
    "tilt 72°": Scene(tilt_deg=72),
    "distance ×2": Scene(fill=0.375),
    "distance ×4": Scene(fill=0.19),
    "blur 1.5 px": Scene(blur_px=1.5),
    "blur 3 px": Scene(blur_px=3.0),
    "motion 6 px": Scene(motion_px=6.0),
    "noise 2 %": Scene(noise=0.02),
    "noise 5 %": Scene(noise=0.05),
    "dark": Scene(exposure=0.15),
    "overexposed": Scene(exposure=3.0, tone="srgb"),
    "light 4 : 1": Scene(light_ratio=4.0, tone="srgb"),
    "s-curve": Scene(tone="s-curve"),
    "covered 30 %": Scene(cover=0.30),
    "colour": Scene(colour=True, tone="srgb"),
    "JPEG 60": Scene(tone="srgb", jpeg=60),
}

# A corner farther from its true position than this part of the distance to its nearest neighbour has a wrong label.
WRONG = 0.3
# Corners nearer to the border of the picture are not counted.
BORDER_PX = 4


def slug(name):
    """A name as a part of a file name."""
    return "".join(letter if letter.isalnum() else "-" for letter in name.lower()).strip("-")


# Calibrations from simulated corners.
CALIBRATIONS = 20
CALIBRATION_VIEWS = 20
CORNER_SD_PX = 0.05
BENT_MM = 0.3

# The fixture of chess-corners (its book, “Benchmarks and performance”): 45 × 45 px of an endless checkerboard of 30 and 230,
# averaged over 8 × 8 points in each pixel, with the corner at 6 × 6 fractions of a pixel from the middle. Condition: square (px),
# standard deviations of a discrete Gaussian (px) and of the noise (grey levels).
OFFSETS = 6
FIXTURES = {
    "clean, 8 px": (8, 0.0, 0.0),
    "clean, 5 px": (5, 0.0, 0.0),
    "blur 1.5 px": (8, 1.5, 0.0),
    "noise 5": (8, 0.0, 5.0),
    "noise 10": (8, 0.0, 10.0),
}
# Its own figures for the mean distance from the stated position, px, by refiner.
PUBLISHED = {
    "chess-corners Förstner": (0.061, 0.061, 0.266, 0.135, 0.201),
    "chess-corners saddle point": (0.114, 0.114, 0.047, 0.095, 0.126),
    "OpenCV cornerSubPix": (0.05, None, None, None, None),
}

# In these measures, deltille is ahead of every peer that reads the same board, over all scenes together. `tables.py --check`
# fails if a table that is committed says otherwise.
CLAIMS = {
    "found": ("checkerboard", "charuco", "aprilgrid"),
    "wrong": ("checkerboard", "charuco", "aprilgrid"),
    "rms_px": ("checkerboard", "charuco", "aprilgrid"),
    "over_bound": ("checkerboard", "charuco", "aprilgrid"),
    # Not of AprilGrids: the first run contradicted this claim (locus-tag 21 ms/Mpx, deltille 24).
    "ms_per_mpx": ("charuco",),
}
# Conditions of the fixture in which deltille's mean error is smaller than that of every peer.
FIXTURES_AHEAD = ("blur 1.5 px", "noise 5", "noise 10")
