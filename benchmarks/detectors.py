"""The detectors that are compared, each with the settings that its authors recommend.

A detector is a class with the boards that it reads, its settings in words, and a call: an image as the file has it (grey or
BGR) to a list of corners. A corner is `(label, x, y, covariance)`: the label is `{"id": …}` where the board identifies corners,
or `{"row": …, "col": …}` in any frame of the lattice; pixel centres are whole numbers; the covariance is `[xx, xy, yy]` in px²
or None. Add a class to `ALL` to compare another one.
"""

import importlib.metadata
import json
import os
import pathlib
import subprocess
import tempfile

import numpy as np

# Corners of a tag by its own order, as positions in the grid: 0 lower left, 1 lower right, 2 upper right, 3 upper left.
CCW_FROM_LOWER_LEFT = [0, 1, 2, 3]
CW_FROM_LOWER_RIGHT = [1, 0, 3, 2]


def grey(image):
    import cv2

    return image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)


def of_board(corners):
    """Those of the board: not of other grids, which are far away in rows, and not without a label."""
    return [of for of in corners if of[0].get("id", 0) >= 0 and of[0].get("row", 0) < 1000]


class Detector:
    boards = ()
    package = None
    settings = ""

    def __init__(self, board, folder):
        """`folder` has the description of the board as deltille writes it, `<board>.json`."""
        self.board = board
        self.path = folder / f"{board}.json"
        self.spec = json.loads(self.path.read_text())["spec"]
        self.prepare()

    def prepare(self):
        pass

    @classmethod
    def version(cls):
        """The version of the package; raises PackageNotFoundError if it is not installed."""
        return importlib.metadata.version(cls.package) if cls.package else ""

    @classmethod
    def is_installed(cls):
        try:
            cls.version()
        except importlib.metadata.PackageNotFoundError:
            return False
        return True

    def tags_to_corners(self, tags, order, shift):
        """Corners of an AprilGrid from tags: pairs of an id and four positions in `order`."""
        columns = self.spec["tags"][0]
        corners = []
        for tag, places in tags:
            row, col = divmod(int(tag) - self.spec["first_id"], columns)
            if not 0 <= row < self.spec["tags"][1]:
                row = col = -1000
            for place, at in zip(order, places):
                up, right = place // 2, (place in (1, 2))
                index = (2 * row + up) * 2 * columns + 2 * col + right
                corners.append(({"id": index}, at[0] + shift, at[1] + shift, None))
        return corners


class Deltille(Detector):
    name, package = "deltille", "deltille"
    boards = ("deltille", "checkerboard", "charuco", "aprilgrid")
    settings = "defaults, with the description of the board"

    def prepare(self):
        import deltille

        self.detect = deltille.Detector(deltille.Target.load(self.path)).detect

    def __call__(self, image):
        found = self.detect(np.ascontiguousarray(image[..., ::-1]) if image.ndim == 3 else image)
        covariance = lambda of: [of[0, 0], of[0, 1], of[1, 1]]
        if self.board == "checkerboard":
            # Where a part of the board fits in several places, its corners have no ids. Corners of other grids are far away.
            grids = sorted(found.grids, key=len, reverse=True)
            return [
                ({"row": int(row) + 1000 * index, "col": int(col)}, x, y, covariance(cov))
                for index, grid in enumerate(grids)
                for row, col, (x, y), cov in zip(grid.rows, grid.cols, grid.pixels, grid.covariances)
            ]
        return [
            ({"id": -1 if grid.panel is None else int(number)}, x, y, covariance(cov))
            for grid in found.grids
            for number, (x, y), cov in zip(grid.ids, grid.pixels, grid.covariances)
        ]


class OpenCv(Detector):
    package = "opencv-contrib-python-headless"

    @classmethod
    def version(cls):
        # There are four packages with OpenCV.
        try:
            import cv2
        except ImportError as error:
            raise importlib.metadata.PackageNotFoundError(cls.package) from error
        return cv2.__version__


class OpenCvClassic(OpenCv):
    name, boards = "OpenCV findChessboardCorners", ("checkerboard",)
    settings = "adaptive threshold and normalisation, then cornerSubPix, window 5 × 5 (half size), 30 iterations, 0.001"

    def __call__(self, image):
        import cv2

        picture, size = grey(image), (self.spec["cols"], self.spec["rows"])
        found, corners = cv2.findChessboardCorners(picture, size)
        if not found:
            return []
        criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 30, 0.001)
        return numbered(cv2.cornerSubPix(picture, corners, (5, 5), (-1, -1), criteria), size)


class OpenCvSb(OpenCv):
    name, boards = "OpenCV findChessboardCornersSB", ("checkerboard",)
    settings = "CALIB_CB_NORMALIZE_IMAGE | CALIB_CB_ACCURACY"

    def __call__(self, image):
        import cv2

        size = (self.spec["cols"], self.spec["rows"])
        flags = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_ACCURACY
        found, corners = cv2.findChessboardCornersSB(grey(image), size, flags)
        return numbered(corners, size) if found else []


def numbered(corners, size):
    return [
        ({"row": index // size[0], "col": index % size[0]}, float(x), float(y), None)
        for index, (x, y) in enumerate(np.reshape(corners, (-1, 2)))
    ]


class OpenCvCharuco(OpenCv):
    name, boards = "OpenCV CharucoDetector", ("charuco",)
    settings = "defaults"

    def prepare(self):
        import cv2

        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, self.spec["dictionary"]))
        board = cv2.aruco.CharucoBoard(self.spec["squares"], self.spec["square_mm"], self.spec["marker_mm"], dictionary)
        board.setLegacyPattern(self.spec.get("legacy", False))
        self.detect = cv2.aruco.CharucoDetector(board)

    def __call__(self, image):
        corners, ids, _, _ = self.detect.detectBoard(grey(image))
        if ids is None:
            return []
        return [({"id": int(i)}, float(x), float(y), None) for i, (x, y) in zip(np.ravel(ids), np.reshape(corners, (-1, 2)))]


class OpenCvAprilTag(OpenCv):
    name, boards = "OpenCV ArucoDetector", ("aprilgrid", "tags")
    settings = "DICT_APRILTAG_36h11, CORNER_REFINE_SUBPIX, otherwise defaults"
    # Of the refinement, in bits: the default is 0.3.
    window = None

    def prepare(self):
        import cv2

        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        parameters.markerBorderBits = round(self.spec["border_bits"])
        if self.window is not None:
            parameters.relativeCornerRefinmentWinSize = self.window(self.spec)
        dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
        self.detect = cv2.aruco.ArucoDetector(dictionary, parameters)

    def __call__(self, image):
        places, ids, _ = self.detect.detectMarkers(grey(image))
        tags = [] if ids is None else zip(np.ravel(ids), (np.reshape(of, (4, 2)) for of in places))
        return self.tags_to_corners(tags, CW_FROM_LOWER_RIGHT, 0.0)


class OpenCvAprilTagWide(OpenCvAprilTag):
    """With the default window, many corners are not reached."""

    name = "OpenCV ArucoDetector, wide"
    settings = "the same, with windows as wide as the border of the tag"
    window = staticmethod(lambda spec: spec["border_bits"])


class CalibTargets(Detector):
    name, package = "calib-targets", "calib-targets"
    boards = ("checkerboard", "charuco")
    settings = "detect_…_best over the recommended sweep of settings; pixel centres at whole numbers"

    def prepare(self):
        import calib_targets as ct

        if self.board == "checkerboard":
            sweep = ct.ChessboardParams.sweep_default()
            self.detect = lambda picture: ct.detect_chessboard_best(picture, sweep)
            return
        if self.spec.get("legacy"):
            raise ValueError("does not read legacy patterns")
        columns, rows = self.spec["squares"]
        board = ct.CharucoBoardSpec(
            rows=rows, cols=columns, cell_size=self.spec["square_mm"], dictionary=self.spec["dictionary"],
            marker_size_rel=self.spec["marker_mm"] / self.spec["square_mm"], marker_layout=ct.MarkerLayout.OPENCV_CHARUCO,
        )
        sweep = ct.CharucoParams.sweep_for_board(board)
        self.detect = lambda picture: ct.detect_charuco_best(picture, sweep)

    def __call__(self, image):
        try:
            found = self.detect(grey(image))
        except RuntimeError:
            # Without a board, detect_charuco_best raises.
            return []
        corners = [] if found is None else found.corners
        if self.board == "charuco":
            return [({"id": of.id}, *of.position, None) for of in corners]
        return [({"row": of.grid.v, "col": of.grid.u}, *of.position, None) for of in corners]


class AprilTag3(Detector):
    boards = ("aprilgrid", "tags")
    settings = "tag36h11, quad_decimate 1, refine_edges; pixel centres at one half, subtracted"

    def detector(self, module):
        if self.spec["border_bits"] != 1:
            raise ValueError("reads borders of one bit only")
        return module.Detector(families="tag36h11", nthreads=1, quad_decimate=1.0, refine_edges=1)

    def __call__(self, image):
        tags = [(of.tag_id, of.corners) for of in self.detect.detect(grey(image))]
        return self.tags_to_corners(tags, CCW_FROM_LOWER_LEFT, -0.5)


class PupilAprilTags(AprilTag3):
    name, package = "pupil-apriltags", "pupil-apriltags"

    def prepare(self):
        import pupil_apriltags

        self.detect = self.detector(pupil_apriltags)


class PyAprilTags(AprilTag3):
    name, package = "AprilTag 3 (pyapriltags)", "pyapriltags"

    def prepare(self):
        import pyapriltags

        self.detect = self.detector(pyapriltags)


class Locus(Detector):
    name, package, boards = "locus-tag", "locus-tag", ("aprilgrid", "tags")
    settings = "profile `grid` for calibration boards, AprilTag36h11, one thread; pixel centres at one half, subtracted"

    def prepare(self):
        import locus

        self.detect = locus.Detector(profile="grid", families=[locus.TagFamily.AprilTag36h11], threads=1)

    def __call__(self, image):
        found = self.detect.detect(grey(image))
        return self.tags_to_corners(zip(found.ids, found.corners), CW_FROM_LOWER_RIGHT, -0.5)


class Reference(Detector):
    """The detector of Ha et al., built by the user: a program that is called as `PROGRAM board.json image.png FOLDER` and writes a
    list of corners, FOLDER/*.orpc (docs/formats.md)."""

    name, boards = "detector of Ha et al.", ("deltille", "checkerboard")
    settings = "as the given program runs it; CPU time includes the start of the program"

    def prepare(self):
        corners = json.loads(self.path.read_text())["panels"][0]["corners"]
        self.columns = 1 + max(corner["col"] for corner in corners)
        self.ids = {(corner["row"], corner["col"]): corner["id"] for corner in corners}

    @classmethod
    def version(cls):
        if "REFERENCE_DETECTOR" not in os.environ:
            raise importlib.metadata.PackageNotFoundError("run.py --reference")
        return ""

    def __call__(self, image):
        import cv2

        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder)
            cv2.imwrite(str(path / "image.png"), grey(image))
            command = [os.environ["REFERENCE_DETECTOR"], self.path, path / "image.png", path]
            subprocess.run([str(of) for of in command], check=True, capture_output=True)
            lines = next(path.glob("*.orpc")).read_text().splitlines()
        corners = []
        for _, point, ordered, x, y in (line.split(",") for line in lines if line.count(",") == 4):
            row, col = divmod(int(point), self.columns)
            known = self.ids.get((row, col), -1) if ordered == "1" else -1
            label = {"row": row, "col": col} if self.board == "checkerboard" else {"id": known}
            corners.append((label, float(x), float(y), None))
        return corners


ALL = [
    Deltille, Reference, OpenCvClassic, OpenCvSb, OpenCvCharuco, OpenCvAprilTag, OpenCvAprilTagWide, CalibTargets, PupilAprilTags, PyAprilTags, Locus,
]
