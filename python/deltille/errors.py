"""Exceptions of this package.

Every exception is an :class:`Error`. Most are also a :class:`ValueError`; exceptions about files are an :class:`OSError`.
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
    """An array of the wrong shape, or a number out of range."""


class TargetError(Error, ValueError):
    """An invalid or unusable target."""


class FamilyError(Error, ValueError):
    """An unusable family of tags."""


class ImageError(Error, ValueError):
    """An invalid image: an unsupported array, or a file that cannot be decoded."""


class DetectionError(Error, ValueError):
    """An invalid detector, or a detection that cannot be read."""


class CalibrationError(Error, ValueError):
    """A calibration that failed, or invalid arguments of a calibration."""


class CameraError(Error, ValueError):
    """An unusable camera, or one that a format does not support."""


class VerifyError(Error, ValueError):
    """A file that cannot be compared with its target."""


class FileError(Error, OSError):
    """A file that cannot be read or written.

    If the operating system reports the reason, ``errno``, ``strerror`` and ``filename`` are set as in every :class:`OSError`;
    otherwise they are ``None``.
    """

    _text: _Optional[str] = None

    def __str__(self) -> str:
        return super().__str__() if self._text is None else self._text


class MissingFileError(FileError, FileNotFoundError):
    """A missing file; ``filename`` is its name."""


class PermissionFileError(FileError, PermissionError):
    """A file that the user may not read or write; ``filename`` is its name."""


class FolderError(FileError, IsADirectoryError):
    """A folder where a file is needed; ``filename`` is its name."""


def _of_system(number: _Optional[int], filename: str, text: str) -> FileError:
    """Returns the exception for an ``errno`` with a message; without one, for a folder where a file is needed."""
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
    error = kind(plain.errno, plain.strerror, filename)
    error._text = text
    return error


# Show the public module in tracebacks.
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
