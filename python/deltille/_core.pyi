from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, final

import numpy
from numpy.typing import ArrayLike, NDArray

from .batch import Failure
from .typing import (
    AnyPath,
    BoardShape,
    Bools,
    CameraFormat,
    CameraModel,
    Candidate,
    DetectionFormat,
    Floats,
    Ints,
    Loss,
    Orientation,
    Quantity,
    RigFormat,
    Source,
    TargetFormat,
    TargetIdentity,
    Tiling,
    Weights,
    Words,
)

__all__ = [
    "Acceptance",
    "AprilGrid",
    "Board",
    "CalibratedCamera",
    "Calibration",
    "Camera",
    "CameraTiming",
    "Charuco",
    "Check",
    "Checkerboard",
    "Circles",
    "Comparison",
    "Cube",
    "Cuboid",
    "DecodedTag",
    "Detection",
    "Detector",
    "Diagnosis",
    "Excluded",
    "Family",
    "Frame",
    "FrameIterator",
    "Frames",
    "Grid",
    "HandEye",
    "Icosahedron",
    "JointCovariance",
    "Located",
    "Motion",
    "NextView",
    "Octahedron",
    "Pose",
    "QuantityTest",
    "Reason",
    "Rig",
    "Solid",
    "Suspect",
    "Tag",
    "Target",
    "Tetrahedron",
    "Timing",
    "Tracker",
    "Truth",
    "Verdict",
    "View",
    "__version__",
    "_calibration",
    "_detection",
    "_detector",
    "_grid",
    "_located",
    "_part",
    "_rig",
    "_run",
    "_tables",
    "_target",
    "accept",
    "calibrate",
    "check",
    "compare",
    "compare_rigs",
    "frames",
    "hand_eye",
    "next_view",
    "pose",
    "render",
    "rig",
    "search_family",
    "timing",
]

__version__: str

class Target:
    @staticmethod
    def load(path: AnyPath, *, family: Family | AnyPath | None = None) -> Target: ...
    @staticmethod
    def from_json(text: str, *, family: Family | AnyPath | None = None) -> Target: ...
    def to_json(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def identity(self) -> TargetIdentity: ...
    @property
    def corners(self) -> Floats: ...
    @property
    def corner_ids(self) -> Ints: ...
    @property
    def corner_rows(self) -> Ints: ...
    @property
    def corner_cols(self) -> Ints: ...
    @property
    def corner_panels(self) -> Ints: ...
    @property
    def tags(self) -> list[Tag]: ...
    @property
    def tag_ids(self) -> Ints: ...
    @property
    def tag_centres(self) -> Floats: ...
    @property
    def panels(self) -> list[int]: ...
    @property
    def family(self) -> Family | None: ...
    @property
    def is_measured(self) -> bool: ...
    @property
    def page_count(self) -> int: ...
    def pdf(self) -> bytes: ...
    def svg(self, page: int = 0) -> str: ...
    def files(
        self,
        format: TargetFormat,
        *,
        dpi: float = 300.0,
        texture_dpi: float | None = None,
        texture_px: int | None = None,
        textures: int | None = None,
        plate_mm: float | None = None,
        inlay_mm: float | None = None,
        kerf_mm: float | None = None,
    ) -> dict[str, bytes]: ...
    def save(
        self,
        folder: AnyPath,
        formats: TargetFormat | Sequence[TargetFormat] | None = None,
        *,
        dpi: float = 300.0,
        texture_dpi: float | None = None,
        texture_px: int | None = None,
        textures: int | None = None,
        plate_mm: float | None = None,
        inlay_mm: float | None = None,
        kerf_mm: float | None = None,
        overwrite: bool = False,
    ) -> list[Path]: ...
    def check_beside(self, other: Target) -> None: ...
    def verify(self, artifact: AnyPath | bytes | None = None, *, name: str | None = None) -> Verdict: ...
    def dsc(self, dialect: Literal["fork", "original"] = "fork") -> str: ...
    def _repr_html_(self) -> str: ...
    def __len__(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@final
class Board(Target):
    def __new__(
        cls,
        rows: int,
        cols: int,
        *,
        edge_mm: float | None = None,
        family: Family | AnyPath | None = None,
        tags: bool = True,
        tag_spacing: int | None = None,
        tag_border: float | None = None,
        hole_mm: float | None = None,
        first_id: int = 0,
        boards: int = 1,
        board_id: int = 0,
        inverted: bool = False,
        poster: bool = False,
        packed: bool = False,
        two_sided_mm: float | None = None,
        tag_ids: bool = False,
        paper: str | None = None,
        orientation: Orientation = "auto",
        margin_mm: float | None = None,
        note: str | None = None,
        logo: AnyPath | None = None,
        logo_height_mm: float | None = None,
        guide_page: bool = False,
        mirrored: bool = False,
        white: str | None = None,
        contour: str | None = None,
        name: str = "board",
    ) -> Board: ...

@final
class Checkerboard(Target):
    def __new__(
        cls,
        rows: int,
        cols: int,
        *,
        edge_mm: float | None = None,
        family: Family | AnyPath | None = None,
        tags_in: Literal["black", "white"] = "black",
        tag_spacing: int | None = None,
        tag_border: float | None = None,
        first_id: int = 0,
        boards: int = 1,
        board_id: int = 0,
        inverted: bool = False,
        poster: bool = False,
        packed: bool = False,
        two_sided_mm: float | None = None,
        tag_ids: bool = False,
        paper: str | None = None,
        orientation: Orientation = "auto",
        margin_mm: float | None = None,
        note: str | None = None,
        logo: AnyPath | None = None,
        logo_height_mm: float | None = None,
        guide_page: bool = False,
        mirrored: bool = False,
        white: str | None = None,
        contour: str | None = None,
        name: str = "checkerboard",
    ) -> Checkerboard: ...

@final
class Charuco(Target):
    def __new__(
        cls,
        squares: tuple[int, int],
        *,
        square_mm: float = 30.0,
        marker_mm: float | None = None,
        dictionary: str = "5x5_100",
        first_id: int = 0,
        legacy: bool = False,
        board_id: int = 0,
        paper: str | None = None,
        orientation: Orientation = "auto",
        margin_mm: float | None = None,
        note: str | None = None,
        logo: AnyPath | None = None,
        logo_height_mm: float | None = None,
        guide_page: bool = False,
        mirrored: bool = False,
        white: str | None = None,
        contour: str | None = None,
        name: str = "charuco",
    ) -> Charuco: ...

@final
class AprilGrid(Target):
    def __new__(
        cls,
        tags: tuple[int, int],
        *,
        tag_mm: float = 25.0,
        gap: float = 0.3,
        family: Family | AnyPath | None = None,
        first_id: int = 0,
        tag_border: float = 2.0,
        board_id: int = 0,
        paper: str | None = None,
        orientation: Orientation = "auto",
        margin_mm: float | None = None,
        note: str | None = None,
        logo: AnyPath | None = None,
        logo_height_mm: float | None = None,
        guide_page: bool = False,
        mirrored: bool = False,
        white: str | None = None,
        contour: str | None = None,
        name: str = "aprilgrid",
    ) -> AprilGrid: ...

@final
class Circles(Target):
    def __new__(
        cls,
        circles: tuple[int, int],
        *,
        asymmetric: bool = False,
        spacing_mm: float = 20.0,
        diameter_mm: float | None = None,
        board_id: int = 0,
        paper: str | None = None,
        orientation: Orientation = "auto",
        margin_mm: float | None = None,
        note: str | None = None,
        logo: AnyPath | None = None,
        logo_height_mm: float | None = None,
        guide_page: bool = False,
        mirrored: bool = False,
        white: str | None = None,
        contour: str | None = None,
        name: str = "circles",
    ) -> Circles: ...

@final
class Tetrahedron(Target):
    def __new__(
        cls,
        *,
        edge_mm: float | None = None,
        tiles: int | None = None,
        face_margin_mm: float | None = None,
        family: Family | AnyPath | None = None,
        tags: bool = True,
        tag_spacing: int | None = None,
        tag_border: float | None = None,
        hole_mm: float | None = None,
        first_id: int = 0,
        board_id: int = 0,
        inverted: bool = False,
        skeleton: bool = False,
        panel_thickness_mm: float | None = None,
        wall_mm: float | None = None,
        rib_mm: float | None = None,
        per_face: bool = False,
        allow_seams: bool = False,
        tag_ids: bool = False,
        guide_page: bool = False,
        paper: str | None = None,
        orientation: Orientation = "auto",
        margin_mm: float | None = None,
        note: str | None = None,
        logo: AnyPath | None = None,
        logo_height_mm: float | None = None,
        name: str | None = None,
    ) -> Tetrahedron: ...

@final
class Octahedron(Target):
    def __new__(
        cls,
        *,
        edge_mm: float | None = None,
        tiles: int | None = None,
        face_margin_mm: float | None = None,
        family: Family | AnyPath | None = None,
        tags: bool = True,
        tag_spacing: int | None = None,
        tag_border: float | None = None,
        hole_mm: float | None = None,
        first_id: int = 0,
        board_id: int = 0,
        inverted: bool = False,
        skeleton: bool = False,
        panel_thickness_mm: float | None = None,
        wall_mm: float | None = None,
        rib_mm: float | None = None,
        per_face: bool = False,
        allow_seams: bool = False,
        tag_ids: bool = False,
        guide_page: bool = False,
        paper: str | None = None,
        orientation: Orientation = "auto",
        margin_mm: float | None = None,
        note: str | None = None,
        logo: AnyPath | None = None,
        logo_height_mm: float | None = None,
        name: str | None = None,
    ) -> Octahedron: ...

@final
class Icosahedron(Target):
    def __new__(
        cls,
        *,
        edge_mm: float | None = None,
        tiles: int | None = None,
        face_margin_mm: float | None = None,
        family: Family | AnyPath | None = None,
        tags: bool = True,
        tag_spacing: int | None = None,
        tag_border: float | None = None,
        hole_mm: float | None = None,
        first_id: int = 0,
        board_id: int = 0,
        inverted: bool = False,
        skeleton: bool = False,
        panel_thickness_mm: float | None = None,
        wall_mm: float | None = None,
        rib_mm: float | None = None,
        per_face: bool = False,
        allow_seams: bool = False,
        tag_ids: bool = False,
        guide_page: bool = False,
        paper: str | None = None,
        orientation: Orientation = "auto",
        margin_mm: float | None = None,
        note: str | None = None,
        logo: AnyPath | None = None,
        logo_height_mm: float | None = None,
        name: str | None = None,
    ) -> Icosahedron: ...

@final
class Cube(Target):
    def __new__(
        cls,
        *,
        edge_mm: float | None = None,
        tiles: int | None = None,
        face_margin_mm: float | None = None,
        family: Family | AnyPath | None = None,
        tags: bool = True,
        tag_spacing: int | None = None,
        tag_border: float | None = None,
        hole_mm: float | None = None,
        first_id: int = 0,
        board_id: int = 0,
        inverted: bool = False,
        skeleton: bool = False,
        panel_thickness_mm: float | None = None,
        wall_mm: float | None = None,
        rib_mm: float | None = None,
        per_face: bool = False,
        allow_seams: bool = False,
        tag_ids: bool = False,
        guide_page: bool = False,
        paper: str | None = None,
        orientation: Orientation = "auto",
        margin_mm: float | None = None,
        note: str | None = None,
        logo: AnyPath | None = None,
        logo_height_mm: float | None = None,
        name: str | None = None,
    ) -> Cube: ...

@final
class Cuboid(Target):
    def __new__(
        cls,
        size_mm: Sequence[float],
        *,
        edge_mm: float | None = None,
        tiles: int | None = None,
        face_margin_mm: float | None = None,
        family: Family | AnyPath | None = None,
        tags: bool = True,
        tag_spacing: int | None = None,
        tag_border: float | None = None,
        hole_mm: float | None = None,
        first_id: int = 0,
        board_id: int = 0,
        inverted: bool = False,
        skeleton: bool = False,
        panel_thickness_mm: float | None = None,
        wall_mm: float | None = None,
        rib_mm: float | None = None,
        per_face: bool = False,
        allow_seams: bool = False,
        tag_ids: bool = False,
        guide_page: bool = False,
        paper: str | None = None,
        orientation: Orientation = "auto",
        margin_mm: float | None = None,
        note: str | None = None,
        logo: AnyPath | None = None,
        logo_height_mm: float | None = None,
        name: str | None = None,
    ) -> Cuboid: ...

@final
class Solid(Target):
    def __new__(
        cls,
        mesh: AnyPath,
        *,
        scale: float = 1.0,
        allow_skew: bool = False,
        square_family: Family | AnyPath | None = None,
        first_square_id: int | None = None,
        edge_mm: float | None = None,
        tiles: int | None = None,
        face_margin_mm: float | None = None,
        family: Family | AnyPath | None = None,
        tags: bool = True,
        tag_spacing: int | None = None,
        tag_border: float | None = None,
        hole_mm: float | None = None,
        first_id: int = 0,
        board_id: int = 0,
        inverted: bool = False,
        skeleton: bool = False,
        panel_thickness_mm: float | None = None,
        wall_mm: float | None = None,
        rib_mm: float | None = None,
        per_face: bool = False,
        allow_seams: bool = False,
        tag_ids: bool = False,
        guide_page: bool = False,
        paper: str | None = None,
        orientation: Orientation = "auto",
        margin_mm: float | None = None,
        note: str | None = None,
        logo: AnyPath | None = None,
        logo_height_mm: float | None = None,
        name: str | None = None,
    ) -> Solid: ...

@final
class Tag:
    @property
    def id(self) -> int: ...
    @property
    def panel(self) -> int: ...
    @property
    def row(self) -> int: ...
    @property
    def col(self) -> int: ...
    @property
    def centre(self) -> list[float]: ...
    @staticmethod
    def _from_json(text: str) -> Tag: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@final
class Verdict:
    @property
    def passed(self) -> bool: ...
    @property
    def artifact(self) -> str: ...
    @property
    def findings(self) -> list[str]: ...
    def to_json(self) -> str: ...
    def __bool__(self) -> bool: ...

@final
class Family:
    @staticmethod
    def load(name_or_path: AnyPath) -> Family: ...
    @staticmethod
    def from_json(text: str) -> Family: ...
    @staticmethod
    def shipped() -> list[str]: ...
    def to_json(self) -> str: ...
    def save(self, path: AnyPath, *, overwrite: bool = False) -> Path: ...
    @property
    def name(self) -> str: ...
    @property
    def bits(self) -> int: ...
    @property
    def distance(self) -> int: ...
    @property
    def correctable(self) -> int: ...
    @property
    def kind(self) -> Tiling: ...
    @property
    def fingerprint(self) -> str: ...
    @property
    def codes(self) -> Words: ...
    def distances(self) -> tuple[Ints, Ints]: ...
    def false_positive_rates(self) -> Floats: ...
    def natural_false_positive_rates(self) -> Floats | None: ...
    def recommended_correction(self, accepted: float = 1e-4) -> int | None: ...
    def decode(
        self, words: Words | Sequence[int], max_errors: int | None = None
    ) -> tuple[Ints, Ints, Ints]: ...
    def __len__(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

def search_family(
    name: str,
    *,
    seconds: float = 60.0,
    work: int | None = None,
    seed: int = 0,
    from_scratch: bool = False,
    callback: Callable[[float, int], object] | None = None,
) -> Family: ...
@final
class Reason:
    @property
    def kind(self) -> str: ...
    @property
    def sentence(self) -> str: ...
    @property
    def grid(self) -> int | None: ...
    @property
    def figures(self) -> dict[str, float]: ...
    @property
    def fits(self) -> dict[str, Any] | None: ...
    @staticmethod
    def _from_json(text: str) -> Reason: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@final
class DecodedTag:
    @property
    def id(self) -> int: ...
    @property
    def family(self) -> str: ...
    @property
    def panel(self) -> int | None: ...
    @property
    def row(self) -> int: ...
    @property
    def col(self) -> int: ...
    @property
    def errors(self) -> int: ...
    @staticmethod
    def _from_json(text: str) -> DecodedTag: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@final
class Grid:
    @property
    def pixels(self) -> Floats: ...
    @property
    def object_points(self) -> Floats: ...
    @property
    def ids(self) -> Ints: ...
    @property
    def rows(self) -> Ints: ...
    @property
    def cols(self) -> Ints: ...
    @property
    def covariances(self) -> Floats: ...
    @property
    def tags(self) -> list[DecodedTag]: ...
    @property
    def mirrored(self) -> bool: ...
    @property
    def panel(self) -> int | None: ...
    @property
    def target(self) -> str | None: ...
    @property
    def kind(self) -> Tiling: ...
    def __len__(self) -> int: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@final
class Detection:
    @staticmethod
    def load(
        path: AnyPath, *, target: Target | Sequence[Target] | None = None, assume_target: bool = False
    ) -> Detection: ...
    @staticmethod
    def from_json(
        text: str, *, target: Target | Sequence[Target] | None = None, assume_target: bool = False
    ) -> Detection: ...
    def to_json(self) -> str: ...
    def save(
        self, path: AnyPath, format: DetectionFormat = "json", *, overwrite: bool = False
    ) -> Path: ...
    @property
    def image(self) -> str: ...
    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...
    @property
    def error(self) -> None: ...
    @property
    def targets(self) -> list[Target]: ...
    @property
    def grids(self) -> list[Grid]: ...
    @property
    def pixels(self) -> Floats: ...
    @property
    def object_points(self) -> Floats: ...
    @property
    def ids(self) -> Ints: ...
    @property
    def rows(self) -> Ints: ...
    @property
    def cols(self) -> Ints: ...
    @property
    def panels(self) -> Ints: ...
    @property
    def grid_indices(self) -> Ints: ...
    @property
    def covariances(self) -> Floats: ...
    @property
    def tags(self) -> list[DecodedTag]: ...
    @property
    def mirrored(self) -> bool: ...
    @property
    def why(self) -> Reason | None: ...
    @property
    def reasons(self) -> list[Reason]: ...
    @property
    def tone(self) -> dict[str, Any] | None: ...
    @property
    def ink(self) -> dict[str, Any] | None: ...
    @property
    def target_identities(self) -> list[TargetIdentity]: ...
    @property
    def time(self) -> float | None: ...
    @property
    def time_ns(self) -> int | None: ...
    @property
    def exif_orientation(self) -> int | None: ...
    @property
    def camera(self) -> dict[str, Any] | None: ...
    @property
    def damage(self) -> str | None: ...
    def to_opencv(self) -> tuple[NDArray[numpy.float32], NDArray[numpy.float32]]: ...
    def plot(self, image: NDArray[Any] | None = None, ax: Any = None, *, ids: bool = False) -> Any: ...
    def _repr_html_(self) -> str: ...
    def __len__(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@final
class Detector:
    def __new__(
        cls,
        target: Target | Sequence[Target] | None = None,
        *,
        grid: Tiling | None = None,
        rows: int | None = None,
        cols: int | None = None,
        tone: Literal["auto", "linear", "srgb"] | float | None = None,
        ink: Literal["auto", "none"] | float | None = None,
        allow_mirrored: bool = False,
        max_errors: int | None = None,
        refine: Literal["model", "polynomial"] = "model",
        max_pixels: int = 150_000_000,
    ) -> Detector: ...
    def detect(self, image: NDArray[Any] | Frame, *, name: str = "") -> Detection: ...
    def detect_file(self, path: AnyPath, *, accept_damaged: bool = False) -> Detection: ...
    def detect_bytes(self, data: bytes, *, name: str = "", accept_damaged: bool = False) -> Detection: ...
    def with_ink_of(self, detections: Sequence[Detection]) -> Detector | None: ...
    @property
    def targets(self) -> list[Target]: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@final
class Tracker:
    def __new__(cls, detector: Detector) -> Tracker: ...
    def detect(self, image: NDArray[Any] | Frame, *, name: str = "") -> Detection: ...
    @property
    def has_followed(self) -> bool: ...
    def reset(self) -> None: ...

@final
class Frame:
    @property
    def name(self) -> str: ...
    @property
    def time(self) -> float | None: ...
    @property
    def time_ns(self) -> int | None: ...
    @property
    def image(self) -> NDArray[Any]: ...

@final
class FrameIterator:
    def __iter__(self) -> FrameIterator: ...
    def __next__(self) -> Frame: ...

@final
class Frames:
    def __iter__(self) -> FrameIterator: ...

def frames(
    path: AnyPath,
    *,
    topic: str | None = None,
    every: int = 1,
    start: int = 0,
    stop: int | None = None,
    max_pixels: int = 150_000_000,
    accept_damaged: bool = False,
) -> Frames: ...

@final
class Pose:
    def __new__(cls, rvec: ArrayLike | None = None, tvec: ArrayLike | None = None) -> Pose: ...
    @staticmethod
    def looking_at(
        eye: ArrayLike,
        at: ArrayLike,
        up: ArrayLike | None = None,
    ) -> Pose: ...
    @staticmethod
    def from_matrix(matrix: ArrayLike) -> Pose: ...
    @property
    def matrix(self) -> Floats: ...
    @property
    def rotation(self) -> Floats: ...
    @property
    def rvec(self) -> Floats: ...
    @property
    def tvec(self) -> Floats: ...
    @property
    def origin(self) -> Floats: ...
    def inverse(self) -> Pose: ...
    def apply(self, points: ArrayLike) -> Floats: ...
    @staticmethod
    def _of(
        quaternion: tuple[float, float, float, float], translation: tuple[float, float, float]
    ) -> Pose: ...
    def __matmul__(self, first: Pose, /) -> Pose: ...
    def __rmatmul__(self, second: Pose, /) -> Pose: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@final
class Camera:
    def __new__(
        cls,
        width: int,
        height: int,
        focal_px: ArrayLike,
        centre_px: ArrayLike | None = None,
        *,
        model: CameraModel = "pinhole",
        distortion: ArrayLike | None = None,
    ) -> Camera: ...
    @staticmethod
    def load(path: AnyPath) -> Camera: ...
    @staticmethod
    def from_yaml(text: str) -> Camera: ...
    def to_yaml(self) -> str: ...
    def save(self, path: AnyPath, format: CameraFormat = "own", *, overwrite: bool = False) -> Path: ...
    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...
    @property
    def model(self) -> str: ...
    @property
    def parameter_names(self) -> list[str]: ...
    @property
    def parameters(self) -> Floats: ...
    @property
    def matrix(self) -> Floats: ...
    @property
    def distortion(self) -> Floats: ...
    def project(self, points: ArrayLike) -> Floats: ...
    def unproject(self, pixels: ArrayLike) -> Floats: ...
    def rays(self, pixels: ArrayLike) -> tuple[Floats, Floats]: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@final
class Diagnosis:
    @property
    def kind(self) -> str: ...
    @property
    def sentence(self) -> str: ...
    @property
    def is_failure(self) -> bool: ...
    @property
    def figures(self) -> dict[str, Any]: ...
    @staticmethod
    def _from_json(text: str) -> Diagnosis: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@final
class Excluded:
    @property
    def view(self) -> str: ...
    @property
    def camera(self) -> str | None: ...
    @property
    def image(self) -> str: ...
    @property
    def panel(self) -> int | None: ...
    @property
    def corners(self) -> int: ...
    @property
    def reason(self) -> str: ...
    @staticmethod
    def _from_json(text: str) -> Excluded: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@final
class View:
    @property
    def name(self) -> str: ...
    @property
    def image(self) -> str: ...
    @property
    def pose(self) -> Pose: ...
    @property
    def pose_sd(self) -> Floats: ...
    @property
    def rms_px(self) -> float: ...
    @property
    def residuals(self) -> Floats: ...
    @property
    def pixels(self) -> Floats: ...
    @property
    def ids(self) -> Ints: ...
    @property
    def labels(self) -> Ints: ...
    @property
    def outliers(self) -> Bools: ...
    def __len__(self) -> int: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

class CalibratedCamera:
    @property
    def name(self) -> str: ...
    @property
    def camera(self) -> Camera: ...
    @property
    def model(self) -> str | None: ...
    @property
    def found(self) -> list[str]: ...
    @property
    def covariance(self) -> Floats: ...
    @property
    def observed_covariance(self) -> Floats | None: ...
    @property
    def sd(self) -> Floats: ...
    @property
    def observed_sd(self) -> Floats: ...
    @property
    def ill_conditioned(self) -> list[str]: ...
    @property
    def rms_px(self) -> float: ...
    @property
    def inlier_rms_px(self) -> float: ...
    @property
    def corner_count(self) -> int: ...
    @property
    def outlier_count(self) -> int: ...
    @property
    def pose(self) -> Pose: ...
    @property
    def pose_sd(self) -> Floats: ...
    @property
    def delay(self) -> int: ...
    @property
    def views(self) -> list[View]: ...
    @property
    def view_indices(self) -> Ints: ...
    @property
    def residuals(self) -> Floats: ...
    @property
    def pixels(self) -> Floats: ...
    @property
    def ids(self) -> Ints: ...
    @property
    def labels(self) -> Ints: ...
    @property
    def outliers(self) -> Bools: ...
    @property
    def candidates(self) -> list[Candidate]: ...
    def projection_sd(self, distance_mm: float | None = None, source: Source = "noise") -> float | None: ...
    def uncertainty_map(self, distance_mm: float | None = None, source: Source = "noise") -> Floats | None: ...
    def projection_covariance(
        self, pixels: ArrayLike, distance_mm: float | None = None, source: Source = "noise"
    ) -> Floats: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@final
class JointCovariance:
    @property
    def names(self) -> list[str]: ...
    @property
    def units(self) -> list[str]: ...
    @property
    def noise(self) -> Floats: ...
    @property
    def observed(self) -> Floats | None: ...
    @property
    def observed_freedom(self) -> float | None: ...

@final
class Calibration(CalibratedCamera):
    @staticmethod
    def load(path: AnyPath, *, target: Target | Sequence[Target] | None = None) -> Calibration: ...
    def save(
        self,
        path: AnyPath,
        format: CameraFormat | Literal["json"] = "json",
        *,
        residuals: bool = False,
        overwrite: bool = False,
    ) -> Path: ...
    @property
    def measured_target(self) -> Target | None: ...
    @property
    def diagnoses(self) -> list[Diagnosis]: ...
    @property
    def excluded(self) -> list[Excluded]: ...
    @property
    def sigma(self) -> float: ...
    @property
    def common_px(self) -> float | None: ...
    @property
    def joint_covariance(self) -> JointCovariance | None: ...
    def target_pose_sd(
        self, target: Target, distance_mm: float, camera: str | None = None
    ) -> tuple[tuple[float, float, float], tuple[float, float, float]] | None: ...
    @property
    def held_out_rms_px(self) -> float | None: ...
    @property
    def board_shape(self) -> BoardShape | None: ...
    def to_json(self, *, residuals: bool = False) -> str: ...
    def report(self, path: AnyPath, *, title: str | None = None, overwrite: bool = False) -> Path: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@final
class Rig:
    @staticmethod
    def load(path: AnyPath, *, target: Target | Sequence[Target] | None = None) -> Rig: ...
    def save(
        self,
        path: AnyPath,
        format: RigFormat = "json",
        *,
        residuals: bool = False,
        overwrite: bool = False,
    ) -> Path: ...
    @property
    def cameras(self) -> dict[str, CalibratedCamera]: ...
    @property
    def frames(self) -> list[str]: ...
    @property
    def poses(self) -> list[Pose]: ...
    @property
    def pose_sd(self) -> Floats: ...
    def depth_sd(self, first: str, second: str, distance_mm: float) -> tuple[float, float] | None: ...
    @property
    def rms_px(self) -> float: ...
    @property
    def refined_targets(self) -> list[Target]: ...
    @property
    def diagnoses(self) -> list[Diagnosis]: ...
    @property
    def excluded(self) -> list[Excluded]: ...
    @property
    def sigma(self) -> float: ...
    @property
    def common_px(self) -> float | None: ...
    @property
    def joint_covariance(self) -> JointCovariance | None: ...
    def target_pose_sd(
        self, target: Target, distance_mm: float, camera: str | None = None
    ) -> tuple[tuple[float, float, float], tuple[float, float, float]] | None: ...
    @property
    def held_out_rms_px(self) -> float | None: ...
    @property
    def board_shape(self) -> BoardShape | None: ...
    def to_json(self, *, residuals: bool = False) -> str: ...
    def report(self, path: AnyPath, *, title: str | None = None, overwrite: bool = False) -> Path: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

def calibrate(
    detections: Iterable[Detection | Failure],
    target: Target | Sequence[Target] | None = None,
    model: str = "radtan",
    *,
    camera: Camera | None = None,
    grid: Tiling | None = None,
    rows: int | None = None,
    cols: int | None = None,
    edge_mm: float | None = None,
    hold_out: int | None = None,
    loss: Loss = "huber",
    weights: Weights = "covariance",
    board_shape: bool = False,
    measure_target: bool = False,
    shape: AnyPath | None = None,
    print_scale: ArrayLike | None = None,
    distances_mm: Sequence[float] | None = None,
    names: Sequence[str] | None = None,
    assume_target: bool = False,
    board_accuracy_mm: float | None = None,
    fix: str | Sequence[str] | None = None,
    equal: str | Sequence[str] | None = None,
    prior: str | Sequence[str] | None = None,
    covariance_of_all: bool = False,
) -> Calibration: ...
def rig(
    cameras: Mapping[str, Sequence[Detection | Failure]],
    target: Target | Sequence[Target] | None = None,
    model: str = "radtan",
    *,
    known: Mapping[str, Camera] | None = None,
    refine_target: bool = False,
    hold_out: int | None = None,
    loss: Loss = "huber",
    weights: Weights = "covariance",
    board_shape: bool = False,
    measure_target: bool = False,
    print_scale: ArrayLike | None = None,
    distances_mm: Sequence[float] | None = None,
    assume_target: bool = False,
    board_accuracy_mm: float | None = None,
    covariance_of_all: bool = False,
) -> Rig: ...
@final
class NextView:
    @property
    def views(self) -> int: ...
    @property
    def description(self) -> str: ...
    @property
    def camera_from_target(self) -> Pose: ...
    @property
    def outlines(self) -> list[Floats]: ...
    @property
    def up(self) -> Floats | None: ...
    @property
    def pixels(self) -> Floats: ...
    @property
    def labels(self) -> Ints: ...
    @property
    def distance_mm(self) -> float: ...
    @property
    def tilt_rad(self) -> float: ...
    @property
    def uncertainty_px(self) -> float | None: ...
    @property
    def expected_px(self) -> float | None: ...
    def is_enough(self, until_px: float | None = None) -> bool: ...
    def to_json(self) -> str: ...

def next_view(
    detections: Iterable[Detection | Failure],
    target: Target | Sequence[Target] | None = None,
    model: str = "radtan",
    *,
    size_px: tuple[int, int] | None = None,
    camera: Camera | None = None,
    nearest_mm: float | None = None,
    farthest_mm: float | None = None,
    avoid: Sequence[NextView] | None = None,
    assume_target: bool = False,
) -> NextView: ...
@final
class Suspect:
    @property
    def camera(self) -> str: ...
    @property
    def quantity(self) -> Quantity: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class QuantityTest:
    @property
    def of(self) -> Suspect: ...
    @property
    def unit(self) -> Literal["%", "px", "mm"]: ...
    @property
    def change(self) -> float: ...
    @property
    def p_value(self) -> float: ...
    @property
    def detectable(self) -> float: ...
    @property
    def limit(self) -> float | None: ...

@final
class Check:
    @property
    def answer(self) -> Literal["unchanged", "changed", "cannot_tell"]: ...
    @property
    def changed(self) -> list[Suspect]: ...
    @property
    def alternatives(self) -> list[Suspect]: ...
    @property
    def exchanged(self) -> tuple[str, str] | None: ...
    @property
    def missing(self) -> list[str]: ...
    @property
    def tests(self) -> list[QuantityTest]: ...
    @property
    def p_value(self) -> float | None: ...
    @property
    def views(self) -> int: ...
    @property
    def corners(self) -> int: ...
    @property
    def rms_px(self) -> float: ...
    def to_json(self) -> str: ...

def check(
    calibration: CalibratedCamera | Rig,
    detections: Iterable[Detection | Failure] | Mapping[str, Sequence[Detection | Failure]],
    target: Target | Sequence[Target] | None = None,
    *,
    grid: Tiling | None = None,
    rows: int | None = None,
    cols: int | None = None,
    edge_mm: float | None = None,
    print_scale: ArrayLike | None = None,
    assume_target: bool = False,
    board_accuracy_mm: float | None = None,
) -> Check: ...
@final
class Acceptance:
    @property
    def verdict(self) -> Literal["conforms", "fails", "undecided"] | None: ...
    @property
    def frames(self) -> int: ...
    @property
    def known_mm(self) -> NDArray[numpy.float64]: ...
    @property
    def error_mm(self) -> NDArray[numpy.float64]: ...
    @property
    def combined_mm(self) -> NDArray[numpy.float64]: ...
    @property
    def expanded_mm(self) -> NDArray[numpy.float64]: ...
    @property
    def probing_mm(self) -> float: ...
    @property
    def probing_rms_mm(self) -> float: ...
    @property
    def reused(self) -> list[str]: ...
    def to_json(self) -> str: ...
    def certificate(self, calibration: str, target: str) -> str: ...

_End = tuple[int, int] | tuple[int, int, int]

def accept(
    calibration: CalibratedCamera | Rig,
    detections: Iterable[Detection | Failure] | Mapping[str, Sequence[Detection | Failure]],
    target: Target | Sequence[Target] | None = None,
    *,
    lengths: Sequence[tuple[_End, _End, float, float]] | None = None,
    limit_mm: float | None = None,
    limit_per_length: float = 0.0,
    temperature_c: tuple[float, float] | None = None,
    expansion_ppm: tuple[float, float] | None = None,
    grid: Tiling | None = None,
    rows: int | None = None,
    cols: int | None = None,
    edge_mm: float | None = None,
    print_scale: ArrayLike | None = None,
    assume_target: bool = False,
    board_accuracy_mm: float | None = None,
) -> Acceptance: ...
@final
class CameraTiming:
    @property
    def name(self) -> str: ...
    @property
    def readout_s(self) -> tuple[float, float] | None: ...
    @property
    def is_rolling(self) -> bool: ...
    @property
    def shear_px(self) -> float: ...
    @property
    def offset_s(self) -> tuple[float, float] | None: ...
    @property
    def drift(self) -> tuple[float, float] | None: ...
    @property
    def frames(self) -> int: ...

@final
class Timing:
    @property
    def cameras(self) -> list[CameraTiming]: ...
    @property
    def frames(self) -> int: ...
    @property
    def rms_px(self) -> float: ...
    @property
    def speed_px_s(self) -> float: ...
    def to_json(self) -> str: ...

def timing(
    calibration: CalibratedCamera | Rig,
    detections: Iterable[Detection | Failure] | Mapping[str, Sequence[Detection | Failure]],
    target: Target | Sequence[Target] | None = None,
    *,
    assume_target: bool = False,
) -> Timing: ...
@final
class HandEye:
    @property
    def setup(self) -> Literal["eye-in-hand", "eye-to-hand"]: ...
    @property
    def flange_from_camera(self) -> Pose: ...
    @property
    def base_from_board(self) -> Pose: ...
    @property
    def base_from_camera(self) -> Pose: ...
    @property
    def flange_from_board(self) -> Pose: ...
    @property
    def covariance(self) -> Floats: ...
    @property
    def scale(self) -> float: ...
    @property
    def scale_sd(self) -> float | None: ...
    @property
    def robot_noise(self) -> tuple[float, float]: ...
    @property
    def findings(self) -> list[str]: ...
    @property
    def camera(self) -> Camera | None: ...
    @property
    def used(self) -> list[str]: ...
    @property
    def wrong(self) -> list[str]: ...
    @property
    def rms_px(self) -> float: ...
    def to_json(self) -> str: ...

def hand_eye(
    detections: Iterable[Detection | Failure],
    robot: Sequence[Pose | None] | AnyPath,
    target: Target | Sequence[Target] | None = None,
    *,
    setup: Literal["eye-in-hand", "eye-to-hand"] = "eye-in-hand",
    camera: CalibratedCamera | Camera | None = None,
    model: str = "radtan",
    inverse_poses: bool = False,
    robot_noise: tuple[float, float] | None = None,
    scale: bool = False,
    print_scale: ArrayLike | None = None,
    assume_target: bool = False,
) -> HandEye: ...
@final
class Comparison:
    @property
    def name(self) -> str: ...
    @property
    def rms_px(self) -> float: ...
    @property
    def expected_px(self) -> float | None: ...
    @property
    def largest_px(self) -> float: ...
    @property
    def p_value(self) -> float | None: ...
    @property
    def is_significant(self) -> bool | None: ...
    @property
    def why_undecided(self) -> str | None: ...
    @property
    def second_from_first(self) -> Pose: ...
    @property
    def pixels(self) -> Floats: ...
    @property
    def differences(self) -> Floats: ...
    @property
    def sd_px(self) -> Floats: ...
    def to_json(self) -> str: ...

@final
class Motion:
    @property
    def of_frame(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def rotation_rad(self) -> Floats: ...
    @property
    def translation_mm(self) -> Floats: ...
    @property
    def p_value(self) -> float | None: ...
    @property
    def is_significant(self) -> bool | None: ...
    @property
    def why_undecided(self) -> str | None: ...

def compare(
    first: CalibratedCamera | Camera,
    second: CalibratedCamera | Camera,
    *,
    distance_mm: float | None = None,
    region: Literal["seen", "image"] | tuple[float, float, float, float] | None = None,
    assume_target: bool = False,
) -> Comparison: ...
def compare_rigs(
    first: Rig,
    second: Rig,
    *,
    distance_mm: float | None = None,
    region: Literal["seen", "image"] | tuple[float, float, float, float] | None = None,
    assume_target: bool = False,
) -> tuple[list[Comparison], list[Motion]]: ...
@final
class Located:
    @property
    def pose(self) -> Pose | None: ...
    @property
    def pose_sd(self) -> Floats | None: ...
    @property
    def why(self) -> str | None: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def rms_px(self) -> float: ...
    @property
    def residuals(self) -> Floats: ...
    def to_json(self) -> str: ...
    def __bool__(self) -> bool: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

def pose(
    detection: Detection,
    camera: Camera,
    target: Target | None = None,
    *,
    print_scale: ArrayLike | None = None,
    assume_target: bool = False,
) -> Located: ...
@final
class Truth:
    @property
    def pixels(self) -> Floats: ...
    @property
    def object_points(self) -> Floats: ...
    @property
    def ids(self) -> Ints: ...
    @property
    def rows(self) -> Ints: ...
    @property
    def cols(self) -> Ints: ...
    @property
    def panels(self) -> Ints: ...
    @property
    def pose(self) -> Pose: ...
    @staticmethod
    def load(path: AnyPath) -> Truth: ...
    @staticmethod
    def from_json(text: str) -> Truth: ...
    def to_json(self, image: str = "") -> str: ...
    def __reduce__(self) -> tuple[Any, ...]: ...
    def __len__(self) -> int: ...

def render(
    target: Target,
    camera: Camera,
    pose: Pose | None = None,
    *,
    eye: ArrayLike | None = None,
    look_at: ArrayLike | None = None,
    up: ArrayLike | None = None,
    blur_px: float = 0.8,
    noise: float = 0.01,
    gradient: ArrayLike | None = None,
    white: float = 0.9,
    black: float = 0.1,
    background: float = 0.5,
    seed: int = 0,
    dtype: Literal["uint8", "uint16", "float32"] = "uint8",
) -> tuple[NDArray[Any], Truth]: ...
def _run(name: str, arguments: Sequence[str]) -> None: ...
def _target(class_: str, json: str, family: str | None, squares: str | None) -> Target: ...
def _detector(targets: Sequence[Target], asked: Mapping[str, Any], ink: str | None) -> Detector: ...
def _detection(json: str, targets: Sequence[Target]) -> Detection: ...
def _grid(of: Detection, index: int) -> Grid: ...
def _calibration(json: str, targets: Sequence[str]) -> Calibration: ...
def _rig(json: str, targets: Sequence[str]) -> Rig: ...
def _part(json: str, targets: Sequence[str], camera: int, view: int | None) -> CalibratedCamera | View: ...
def _located(
    detection: Detection, camera: Camera, target: Target, print_scale: tuple[float, float] | None
) -> Located: ...
def _tables(
    paths: Sequence[AnyPath], targets: Target | Sequence[Target] | None, assume_target: bool
) -> list[tuple[str, Detection | None, str | None]]: ...
