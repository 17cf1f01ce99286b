"""Types in the signatures of this package, for annotations in your own code.

The package itself does not import this module.
"""

from __future__ import annotations

from os import PathLike
from typing import Literal, Optional, TypeAlias, TypedDict, Union

import numpy
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[numpy.float64]
Ints: TypeAlias = NDArray[numpy.int64]
Words: TypeAlias = NDArray[numpy.uint64]
Bools: TypeAlias = NDArray[numpy.bool_]
AnyPath: TypeAlias = Union[str, PathLike[str]]
Orientation: TypeAlias = Literal["auto", "portrait", "landscape"]
Tiling: TypeAlias = Literal["deltille", "checker"]
Source: TypeAlias = Literal["noise", "observed"]
Loss: TypeAlias = Literal["huber", "cauchy", "none"]
Weights: TypeAlias = Literal["covariance", "equal"]
Quantity: TypeAlias = Literal[
    "focal_length",
    "principal_point",
    "distortion",
    "pose",
    "board",
    "resolution",
    "crop",
    "orientation",
]
# list: names (written by tests/it/files/lists.rs)
TargetFormat: TypeAlias = Literal[
    "json",
    "pdf",
    "svg",
    "png",
    "dsc",
    "dsc-fork",
    "dsc-original",
    "gltf",
    "glb",
    "obj",
    "sdf",
    "urdf",
    "mjcf",
    "usd",
    "usda",
    "3mf",
    "stl",
    "skeleton",
    "skeleton-3mf",
    "panels",
    "net",
    "laser-dxf",
    "laser-svg",
    "kalibr",
]
DetectionFormat: TypeAlias = Literal[
    "json",
    "orpc",
    "csv",
]
CameraFormat: TypeAlias = Literal[
    "own",
    "opencv",
    "ros",
    "kalibr",
    "colmap",
    "nerfstudio",
    "mrcal",
]
RigFormat: TypeAlias = Literal[
    "json",
    "kalibr",
    "colmap",
    "colmap-rig",
]
CameraModel: TypeAlias = Literal[
    "pinhole",
    "fisheye",
    "eucm",
    "double-sphere",
    "pupil",
    "radtan",
    "radtan5",
    "rational",
    "thin-prism",
    "kannala-brandt",
]
# end of list

class _Identity(TypedDict):
    name: str
    fingerprint: str
    labels: str
    panels: int
    corners: int
    edge_mm: tuple[float, float]

class TargetIdentity(_Identity, total=False):
    plan: str

class Candidate(TypedDict):
    model: str
    parameters: int
    held_out_px: Optional[float]
    is_stable: bool
    adequate: bool
    chosen: bool

class BoardShape(TypedDict):
    bent_mm: float
    stretched_mm: float
    f_ratio: float
    is_significant: bool

