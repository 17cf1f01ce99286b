"""Make, verify and detect deltille calibration targets, and calibrate cameras with them.

Lengths are in millimetres and angles in radians. Pixel centres are at integer coordinates, y down. The frame of a board is
right-handed with x right, y up on the print, z towards the viewer; the frame of a camera has x right, y down, z forward.

>>> import deltille
>>> board = deltille.Board(10, 11, edge_mm=20)
>>> board.corners.shape
(110, 3)
"""

from ._core import (
    AprilGrid,
    Board,
    CalibratedCamera,
    Calibration,
    Camera,
    Charuco,
    Checkerboard,
    Circles,
    Comparison,
    Cube,
    Cuboid,
    DecodedTag,
    Detection,
    Detector,
    Diagnosis,
    Excluded,
    Family,
    Grid,
    Icosahedron,
    Located,
    Motion,
    NextView,
    Octahedron,
    Pose,
    Reason,
    Rig,
    Solid,
    Tag,
    Target,
    Tetrahedron,
    Truth,
    Verdict,
    View,
    __version__,
    calibrate,
    compare,
    compare_rigs,
    next_view,
    pose,
    render,
    rig,
    search_family,
)
from ._detections import opencv_points as _opencv_points
from ._detections import plot as _plot
from ._detections import repr_html as _repr_html
from ._detections import stereo_to_opencv, to_opencv
from .batch import Failure, detect_many, load_detections
from .errors import (
    ArgumentError,
    CalibrationError,
    CameraError,
    DetectionError,
    Error,
    FamilyError,
    FileError,
    FolderError,
    ImageError,
    MissingFileError,
    PermissionFileError,
    TargetError,
    VerifyError,
)

# Methods that need other packages are written in Python.
Detection.to_opencv = _opencv_points  # type: ignore[method-assign]
Detection.plot = _plot  # type: ignore[method-assign]
Detection._repr_html_ = _repr_html  # type: ignore[method-assign]

__all__ = [
    "AprilGrid",
    "ArgumentError",
    "Board",
    "CalibratedCamera",
    "Calibration",
    "CalibrationError",
    "Camera",
    "CameraError",
    "Charuco",
    "Checkerboard",
    "Circles",
    "Comparison",
    "Cube",
    "Cuboid",
    "DecodedTag",
    "Detection",
    "DetectionError",
    "Detector",
    "Diagnosis",
    "Error",
    "Excluded",
    "Failure",
    "Family",
    "FamilyError",
    "FileError",
    "FolderError",
    "Grid",
    "Icosahedron",
    "ImageError",
    "Located",
    "MissingFileError",
    "Motion",
    "NextView",
    "Octahedron",
    "PermissionFileError",
    "Pose",
    "Reason",
    "Rig",
    "Solid",
    "Tag",
    "Target",
    "TargetError",
    "Tetrahedron",
    "Truth",
    "Verdict",
    "VerifyError",
    "View",
    "__version__",
    "calibrate",
    "compare",
    "compare_rigs",
    "detect_many",
    "load_detections",
    "next_view",
    "pose",
    "render",
    "rig",
    "search_family",
    "stereo_to_opencv",
    "to_opencv",
]
