"""What is raised, with the library's words.

Every exception is an :class:`Error`; most are a :class:`ValueError` too, files an :class:`OSError`.
"""

import errno as _errno
import os as _os
import sys as _sys
from typing import Any as _Any
from typing import Optional as _Optional

__all__ = [
    "ArgumentError",
    "CalibrationError",
    "CameraError",
    "DetectionError",
    "Error",
    "FamilyError",
    "FileError",
    "FolderError",
    "ImageError",
    "MissingFileError",
    "PermissionFileError",
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
    """A file that cannot be read or written.

    Where the system says why, ``errno``, ``strerror`` and ``filename`` are set as in every :class:`OSError`; else they are
    ``None``, and the words are the library's.
    """


class MissingFileError(FileError, FileNotFoundError):
    """A file that is not there; ``filename`` is its name."""


class PermissionFileError(FileError, PermissionError):
    """A file that the user may not read or write; ``filename`` is its name."""


class FolderError(FileError, IsADirectoryError):
    """A folder where a file is needed; ``filename`` is its name."""


def _of_system(number: _Optional[int], filename: str) -> FileError:
    """The exception for a number of the system; without one, of a folder where a file is needed."""
    plain: _Any
    if number is None:
        plain = OSError(_errno.EISDIR, _os.strerror(_errno.EISDIR))
    elif _sys.platform == "win32":
        import ctypes

        plain = getattr(ctypes, "WinError")(number)
    else:
        plain = OSError(number, _os.strerror(number))
    kinds: tuple[type[FileError], ...] = (MissingFileError, PermissionFileError, FolderError)
    kind = next((kind for kind in kinds if isinstance(plain, kind.__bases__[1])), FileError)
    return kind(plain.errno, plain.strerror, filename)


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
    FolderError,
    MissingFileError,
    PermissionFileError,
):
    _class.__module__ = "deltille"
