"""What is raised, with the library's words.

Every exception is an :class:`Error`; most are a :class:`ValueError` too, files an :class:`OSError`.
"""

__all__ = [
    "ArgumentError",
    "CalibrationError",
    "CameraError",
    "DetectionError",
    "Error",
    "FamilyError",
    "FileError",
    "ImageError",
    "MissingFileError",
    "TargetError",
    "VerifyError",
]


class Error(Exception):
    """Base of all exceptions of this package."""


class ArgumentError(Error, ValueError):
    """An array of another shape than is wanted, or a number out of its range."""


class TargetError(Error, ValueError):
    """A target that cannot be made or used."""


class FamilyError(Error, ValueError):
    """A family of tags that cannot be used."""


class ImageError(Error, ValueError):
    """A picture that is none: an array of another kind, or a file that cannot be read."""


class DetectionError(Error, ValueError):
    """A detector that cannot be made, or a detection that cannot be read."""


class CalibrationError(Error, ValueError):
    """A calibration that has no solution, or is asked for wrongly."""


class CameraError(Error, ValueError):
    """A camera that cannot be used, or that a format cannot carry."""


class VerifyError(Error, ValueError):
    """A file that cannot be compared with its target."""


class FileError(Error, OSError):
    """A file that cannot be read or written."""


class MissingFileError(FileError, FileNotFoundError):
    """A file that is not there; ``filename`` is its name."""


# Where they are imported from.
for _class in (
    Error,
    ArgumentError,
    TargetError,
    FamilyError,
    ImageError,
    DetectionError,
    CalibrationError,
    CameraError,
    VerifyError,
    FileError,
    MissingFileError,
):
    _class.__module__ = "deltille"
