"""Detection in many images, on the threads of one machine."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Sized
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any, Callable, Literal, Optional, Union

from ._core import Detection, Detector, Frame, Frames, Target, _tables
from .errors import Error, FileError, ImageError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from numpy.typing import NDArray
    from typing import TypeAlias

    Picture: TypeAlias = Union[str, "os.PathLike[str]", bytes, NDArray[Any], Frame]
    Result: TypeAlias = Union[Detection, "Failure"]

__all__ = ["Failure", "detect_many", "load_detections"]


class Failure:
    """An image that could not be read, in place of its detection.

    Attributes
    ----------
    image : str
        Name of the image.
    error : Error
        The reason.
    """

    def __init__(self, image: str, error: Error) -> None:
        self.image = image
        self.error = error

    def __bool__(self) -> Literal[False]:
        return False

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Failure):
            return NotImplemented
        return (self.image, type(self.error), str(self.error)) == (other.image, type(other.error), str(other.error))

    def __len__(self) -> int:
        return 0

    def __repr__(self) -> str:
        return f"<Failure {self.image}: {self.error}>"


def detect_many(
    pictures: Iterable[Picture],
    target: Union[Target, Sequence[Target], Detector],
    *,
    workers: Optional[int] = None,
    progress: Optional[Callable[..., Any]] = None,
    ink_of_all: bool = True,
    accept_damaged: bool = False,
) -> list[Result]:
    """Detects a target in many images, several in parallel.

    Parameters
    ----------
    pictures : iterable of path-like, bytes, ndarray or Frame
        Paths of photographs, contents of their files, or arrays as for :meth:`Detector.detect`; or :func:`frames` of a video
        or recording.
    target : Target, sequence of Target, or Detector
        The target to find.
    workers : int, optional
        Number of images processed in parallel; defaults to the number of processors.
    progress : callable, optional
        A wrapper such as ``tqdm.tqdm``, called with an iterable, and with ``total`` if the number of images is known.
    ink_of_all : bool, optional
        Repeat detection in all images with their combined ink estimate, as ``deltille detect`` does. Arrays are kept in
        memory for that; :func:`frames` are read again.
    accept_damaged : bool, optional
        Accept truncated JPEG files.

    Returns
    -------
    list of Detection or Failure
        Results in the order of the images. For an image that cannot be read, the result is a :class:`Failure`. It is falsy,
        has no corners, and contains the reason in ``error``. For a :class:`Detection`, ``error`` is ``None``.
    """
    if isinstance(pictures, (str, bytes, os.PathLike)) or hasattr(pictures, "shape"):
        raise TypeError("pictures: expected a list, [picture]")
    detector = target if isinstance(target, Detector) else Detector(target)
    count = workers if workers is not None else (os.cpu_count() or 1)
    if count < 1:
        raise ValueError("workers must be at least 1")
    total = len(pictures) if isinstance(pictures, Sized) else None
    seen: list[Picture] = []

    def taken() -> Iterator[Picture]:
        for picture in pictures:
            if ink_of_all and not isinstance(pictures, Frames):
                seen.append(picture)
            yield picture

    found = _all(detector, taken(), count, progress, total, accept_damaged)
    if not ink_of_all:
        return found
    good = [index for index, result in enumerate(found) if isinstance(result, Detection)]
    again = detector.with_ink_of([result for result in found if isinstance(result, Detection)])
    if again is not None:
        wanted = set(good)
        every = enumerate(pictures if isinstance(pictures, Frames) else seen)
        repeated = (picture for index, picture in every if index in wanted)
        second = _all(again, repeated, count, progress, len(good), accept_damaged)
        for index, result in zip(good, second):
            if isinstance(result, Detection):
                found[index] = result
    return found


def load_detections(
    path: Union[str, os.PathLike[str]],
    target: Union[Target, Sequence[Target], None] = None,
    *,
    assume_target: bool = False,
) -> list[Result]:
    """Reads the detections of many images from files.

    Parameters
    ----------
    path : path-like
        A folder with ``.json`` files or Parquet tables from ``deltille detect`` or :mod:`deltille.ray`; or one of the two
        tables, if the other is in the same folder.
    target : Target or sequence of Target, optional
        The target searched for, needed for :attr:`Detection.object_points`.
    assume_target : bool, optional
        Use the target even if the files name another one.

    Returns
    -------
    list of Detection or Failure
        Results in the order of the file names, or of the image names in tables. An image that could not be read during
        detection is represented by a :class:`Failure`.

    Raises
    ------
    FileError
        If these files do not exist, or if one is damaged.
    """
    place = Path(path)
    texts = sorted(place.glob("*.json")) if place.is_dir() else []
    if texts:
        return [Detection.load(text, target=target, assume_target=assume_target) for text in texts]
    if place.suffix == ".json":
        return [Detection.load(place, target=target, assume_target=assume_target)]
    rows = sorted(_tables([place], target, assume_target), key=lambda row: row[0])
    if not rows and place.is_dir():
        raise FileError(f"{place}: no .json or .parquet file in this folder")
    return [found if found is not None else Failure(image, ImageError(why)) for image, found, why in rows]


def _all(
    detector: Detector,
    pictures: Iterator[Picture],
    workers: int,
    progress: Optional[Callable[..., Any]],
    total: Optional[int],
    accept_damaged: bool,
) -> list[Result]:
    results = _in_order(detector, pictures, workers, accept_damaged)
    if progress is None:
        return list(results)
    return list(progress(results, total=total) if total is not None else progress(results))


def _in_order(
    detector: Detector, pictures: Iterator[Picture], workers: int, accept_damaged: bool
) -> Iterator[Result]:
    """Yields results in the order of the images; at most twice as many images as workers are in memory."""
    pool = ThreadPoolExecutor(workers, thread_name_prefix="deltille")
    waiting: deque[Future[Result]] = deque()
    try:
        for index, picture in enumerate(pictures):
            waiting.append(pool.submit(_one, detector, index, picture, accept_damaged))
            if len(waiting) >= 2 * workers:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        # After Ctrl-C, running work finishes and pending work is cancelled.
        pool.shutdown(wait=True, cancel_futures=True)


def _one(detector: Detector, index: int, picture: Picture, accept_damaged: bool) -> Result:
    if isinstance(picture, Frame):
        name = picture.name
    else:
        name = Path(picture).name if isinstance(picture, (str, os.PathLike)) else f"{index:04}"
    try:
        if isinstance(picture, (str, os.PathLike)):
            return detector.detect_file(picture, accept_damaged=accept_damaged)
        if isinstance(picture, bytes):
            return detector.detect_bytes(picture, name=name, accept_damaged=accept_damaged)
        return detector.detect(picture, name=name)
    except Error as error:
        return Failure(name, error)
