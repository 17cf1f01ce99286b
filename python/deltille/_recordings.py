"""Recordings for :mod:`deltille.ray`: division into ranges of frames, and detection in a range."""

from __future__ import annotations

import os
import warnings
from typing import TYPE_CHECKING, Any, NamedTuple, Optional

import pyarrow.fs as pafs
import ray

import deltille

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

_ENDINGS = (".mcap", ".bag", ".active", ".db3", ".y4m", ".mp4", ".m4v", ".mov", ".mkv", ".avi", ".webm")


class Range(NamedTuple):
    """Frames of a recording, from `start` up to, but without, `stop`."""

    path: str
    start: int
    stop: Optional[int]


def is_recording(path: str, filesystem: Any, inside: str, is_folder: bool) -> bool:
    """Whether a path is a recording or the folder of a bag of ROS 2."""
    if is_folder:
        metadata = f"{inside}/metadata.yaml"
        if filesystem.get_file_info(metadata).type != pafs.FileType.File:
            return False
        with filesystem.open_input_stream(metadata) as file:
            return bool(file.read(64).startswith(b"rosbag2_bagfile_information"))
    return path.lower().endswith(_ENDINGS)


def local(path: str, filesystem: Any, inside: str) -> str:
    """Returns the path of a recording on this machine; recordings are not read from buckets."""
    if isinstance(filesystem, pafs.SubTreeFileSystem) and isinstance(filesystem.base_fs, pafs.LocalFileSystem):
        return os.path.join(filesystem.base_path, inside)
    if not isinstance(filesystem, pafs.LocalFileSystem):
        raise ValueError(f"{path}: recordings are read from disks only; copy it to one that all workers mount")
    return inside


def ranges(paths: Sequence[str], parts: int, every: int, topic: Optional[str], shortest: int) -> list[Range]:
    """Divides recordings so that `parts` processes have work, into ranges of at least `shortest` frames that are read.

    A recording that cannot be read is one range, in which its error occurs again.
    """
    if len(paths) >= parts:
        return [Range(path, 0, None) for path in paths]
    of_each = -(-parts // max(1, len(paths)))
    counts = ray.get([_count.remote(path, topic) for path in paths])
    divided: list[Range] = []
    for path, (count, warning) in zip(paths, counts):
        if warning is not None:
            warnings.warn(warning, stacklevel=4)
        length = max(-(-count // of_each), every * shortest)
        starts = range(0, count, length) if count else [0]
        divided.extend(Range(path, start, min(start + length, count) or None) for start in starts)
    return divided


@ray.remote  # type: ignore[untyped-decorator, unused-ignore]
def _count(path: str, topic: Optional[str]) -> tuple[int, Optional[str]]:
    """Returns the number of frames and why there are not more; 0 if the recording cannot be read."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UserWarning)
        try:
            count = sum(1 for _ in deltille.frames(path, topic=topic))
        except (deltille.Error, OSError, ValueError):
            return 0, None
    said = [f"{warning.message}" for warning in caught if warning.category is UserWarning]
    return count, said[0] if said else None


def frames(
    of: Range, topic: Optional[str], every: int, accept_damaged: bool
) -> "Iterator[tuple[str, deltille.Frame]]":
    """Iterates over the frames of a range and their names: the path of the recording with the number of the frame."""
    opened = deltille.frames(
        of.path, topic=topic, every=every, start=of.start, stop=of.stop, accept_damaged=accept_damaged
    )
    for frame in opened:
        yield os.path.join(os.path.dirname(of.path), frame.name), frame
