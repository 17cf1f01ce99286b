"""Detection in large sets of images on a Ray cluster (``pip install 'deltille[ray]'``).

:func:`detect` makes a dataset with a row for each corner or for each image. :func:`detect_to` writes both as Parquet tables
into a folder or bucket, and skips images that already have results; ``deltille calibrate`` reads the folder. Both read
photographs, and the frames of videos and recordings, which are divided into ranges of frames.

Only paths or encoded files are sent to the workers, and the workers return small tables. Decoded images stay in the worker
process, which uses one thread. Ray handles lost processes and machines.
"""

from __future__ import annotations

import hashlib
import json
import os
import uuid
from typing import TYPE_CHECKING, Any, Callable, Optional, Union

import pyarrow as pa
import pyarrow.fs as pafs
import pyarrow.parquet as pq
import ray
import ray.data

import deltille
from deltille import _recordings
from deltille._tables import ASKED, CORNERS, IMAGES, Rows, Stamp, Writing, done, files, forget, place, remove_halves

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from typing_extensions import TypeAlias

    Paths: TypeAlias = Union[str, "os.PathLike[str]", Sequence[Union[str, "os.PathLike[str]"]]]
    Targets: TypeAlias = Union["deltille.Target", Sequence["deltille.Target"]]

__all__ = ["CORNERS", "IMAGES", "Summary", "detect", "detect_to", "done"]

_ENDINGS = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".pgm", ".ppm", ".pnm", ".pbm", ".webp")


class Summary:
    """Summary of a run of :func:`detect_to`.

    Attributes
    ----------
    images, corners, errors : int
        Number of images processed, of corners found in them, and of images that could not be read.
    skipped : int
        Number of photographs that already had results. Images of a dataset and frames of recordings are not counted,
        because their number is not known.
    """

    def __init__(self, images: int, corners: int, errors: int, skipped: int) -> None:
        self.images = images
        self.corners = corners
        self.errors = errors
        self.skipped = skipped

    def __repr__(self) -> str:
        return (
            f"<Summary: {self.images} images, {self.corners} corners, {self.errors} errors, "
            f"{self.skipped} skipped>"
        )


def detect(
    images: Union["ray.data.Dataset", Paths],
    target: Optional[Targets] = None,
    *,
    per: str = "corner",
    concurrency: Union[int, tuple[int, int], None] = None,
    batch_size: int = 64,
    filesystem: Any = None,
    accept_damaged: bool = False,
    topic: Optional[str] = None,
    every: int = 1,
    **options: Any,
) -> "ray.data.Dataset":
    """Detects a target in images, on all machines of a cluster.

    Parameters
    ----------
    images : str, path-like, sequence of these, or ray.data.Dataset
        Photographs and folders of them, on any filesystem that Ray supports (``"s3://bucket/day"``) and every worker can
        access. Videos and recordings (:func:`deltille.frames`), on a disk that every worker mounts; each is divided
        into ranges of frames so that all processes have work. Or a dataset with a column ``path``, and optionally
        ``bytes`` (encoded files, as from :func:`ray.data.read_binary_files` with ``include_paths=True``).
    target : Target or sequence of Target, optional
        The target to find.
    per : str, optional
        ``"corner"``: one row per corner, with the columns :data:`CORNERS`. ``"image"``: one row per image, with the
        columns :data:`IMAGES`; images that could not be read have a message in ``error``. ``"both"``: one row per image
        with an additional column ``found``, the list of its corners.
    concurrency : int or (int, int), optional
        Number of detecting processes, or its minimum and maximum. Defaults to the number of processors of the cluster, or
        one less for a dataset, which needs processors itself. Each process uses one processor.
    batch_size : int, optional
        Number of images sent to a process at a time. The process keeps the bytes and pixels of only one in memory.
    filesystem : pyarrow.fs.FileSystem or fsspec filesystem, optional
        Filesystem of the paths; by default derived from them.
    accept_damaged : bool, optional
        Accept truncated JPEG files.
    topic : str, optional
        Topic of the images in recordings; needed if several contain images.
    every : int, optional
        Read only every N-th frame of videos and recordings.
    **options
        Options of :class:`deltille.Detector`, such as ``grid``, ``rows``, ``cols`` or ``ink``. Images are processed
        independently, without a combined ink estimate; pass a known ink spread as ``ink``, in µm.

    Returns
    -------
    ray.data.Dataset
        A dataset that is computed when it is consumed, in arbitrary order.

    Raises
    ------
    FileNotFoundError
        If a path does not exist.
    deltille.Error
        If neither a target nor a grid is given.
    """
    if per not in ("corner", "image", "both"):
        raise ValueError(f'unknown per {per} (known: "corner", "image", "both")')
    found: ray.data.Dataset
    reading = _Reading(filesystem, accept_damaged, topic, every)
    found, _ = _detect(_listed(images, reading.filesystem), frozenset(), target, per, concurrency, batch_size, reading, options)
    return found


def detect_to(
    folder: Union[str, "os.PathLike[str]"],
    images: Union["ray.data.Dataset", Paths],
    target: Optional[Targets] = None,
    *,
    concurrency: Union[int, tuple[int, int], None] = None,
    batch_size: int = 64,
    filesystem: Any = None,
    accept_damaged: bool = False,
    topic: Optional[str] = None,
    every: int = 1,
    images_per_file: int = 1000,
    retry_errors: bool = False,
    **options: Any,
) -> Summary:
    """Detects a target in images and writes results continuously to ``folder/corners`` and ``folder/images``.

    Images that already have results in the folder are skipped, even if they have no corners or an error: repeat the same call
    to resume an interrupted run. Images and recordings whose files have another size or modification time since are processed
    again, except those of a dataset. ``deltille calibrate FOLDER --target …`` reads the folder.

    Parameters
    ----------
    folder : str or path-like
        A folder or bucket that every worker can access; created if necessary.
    images, target, concurrency, batch_size, filesystem, accept_damaged, topic, every, **options
        See :func:`detect`; `filesystem` is that of the images.
    images_per_file : int, optional
        Minimum number of images per file of either table. An interrupted run loses images that are not in a file yet.
    retry_errors : bool, optional
        Process images again that could not be read.

    Returns
    -------
    Summary

    Raises
    ------
    deltille.DetectionError
        If the folder contains results for another target or other options.
    """
    if images_per_file < 1:
        raise ValueError("images_per_file must be at least 1")
    to, root = place(folder)
    of_topic = {} if topic is None else {"topic": topic}
    asked = _asked(target, {**options, **of_topic, "accept_damaged": accept_damaged})
    for path in files(to, f"{root}/images")[:1]:
        with to.open_input_file(path) as file:
            known = (pq.read_schema(file).metadata or {}).get(ASKED, asked)
        if known != asked:
            what = "the folder contains results for another target or other options; use another folder"
            raise deltille.DetectionError(f"{folder}: {what}")
    remove_halves(to, root)
    reading = _Reading(filesystem, accept_damaged, topic, every)
    listed = _listed(images, reading.filesystem)
    photographs, recordings = ({}, {}) if isinstance(listed, ray.data.Dataset) else listed
    forget(to, root, photographs, recordings, retry_errors)
    dataset, skipped = _detect(listed, done(folder), target, "both", concurrency, batch_size, reading, options)
    if dataset is None:
        return Summary(0, 0, 0, skipped)
    # A single process writes all files, because Ray needs a second to start a process. It reserves no processor: the
    # detecting processes occupy all processors, so the writer would never start and they would wait for it forever.
    written = dataset.map_batches(
        Writing,
        batch_size=images_per_file,
        batch_format="pyarrow",
        compute=ray.data.ActorPoolStrategy(size=1),
        num_cpus=0,
        fn_constructor_kwargs={"filesystem": to, "root": root, "run": uuid.uuid4().hex[:12], "asked": asked},
    )
    counts = [[row["images"], row["corners"], row["errors"]] for row in written.iter_rows()]
    images_seen, corners, errors = (sum(column) for column in zip(*counts)) if counts else (0, 0, 0)
    return Summary(images_seen, corners, errors, skipped)


def _asked(target: Optional[Targets], options: dict[str, Any]) -> bytes:
    """Returns a hash of the target and the options."""
    targets = [] if target is None else [target] if isinstance(target, deltille.Target) else list(target)
    asked = [[one.to_json() for one in targets], sorted((name, str(value)) for name, value in options.items())]
    return hashlib.sha256(json.dumps(asked).encode()).hexdigest().encode()


def _detect(
    images: Union["ray.data.Dataset", tuple[dict[str, Stamp], dict[str, Stamp]]],
    there: frozenset[str],
    target: Optional[Targets],
    per: str,
    concurrency: Any,
    batch_size: int,
    reading: "_Reading",
    options: dict[str, Any],
) -> tuple[Any, int]:
    """Returns the dataset, or ``None`` if nothing is left to do, and the number of skipped images."""
    if batch_size < 1:
        raise ValueError("batch_size must be at least 1")
    # Report wrong options here, not in every worker.
    deltille.Detector(target, **options)
    skipped = 0
    if not ray.is_initialized():
        ray.init()
    resources: Callable[[], dict[str, float]] = ray.cluster_resources
    processors = max(1, int(resources().get("CPU", 1)))
    if isinstance(images, ray.data.Dataset):
        names = set(images.schema().names)
        if "path" not in names:
            raise ValueError("images: the dataset has no column path with the names of the images")
        dataset, rows = images, batch_size
    else:
        left = [path for path in images[0] if path not in there]
        skipped = len(images[0]) - len(left)
        most = processors if concurrency is None else concurrency if isinstance(concurrency, int) else concurrency[1]
        recordings = [path for path in images[1] if path not in there]
        ranges = _recordings.ranges(recordings, most, reading.every, reading.topic, batch_size)
        if not left and not ranges and per == "both":
            return None, skipped
        work = [left[at : at + batch_size] for at in range(0, len(left), batch_size)]
        tables = [_work(paths) for paths in work] + [_work([], one) for one in ranges]
        dataset, rows = ray.data.from_arrow(tables or [_work([])]), 1
        there = there if ranges else frozenset()
    if concurrency is None:
        # The stages that make a dataset need a processor, too, and would wait for it forever.
        concurrency = processors if images is not dataset else (1, max(1, processors - 1))
    least, most = concurrency if isinstance(concurrency, tuple) else (concurrency, concurrency)
    found = dataset.map_batches(
        _Looking,
        batch_size=rows,
        batch_format="pyarrow",
        compute=ray.data.ActorPoolStrategy(min_size=least, max_size=most),
        num_cpus=1,
        fn_constructor_kwargs={
            "target": target,
            "options": options,
            "per": per,
            "reading": reading,
            "images_per_table": batch_size,
            "there": there,
        },
    )
    return found, skipped


class _Reading:
    """How images are read."""

    def __init__(self, filesystem: Any, accept_damaged: bool, topic: Optional[str], every: int) -> None:
        if every < 1:
            raise ValueError("every must be at least 1")
        if filesystem is not None and not isinstance(filesystem, pafs.FileSystem):
            filesystem = pafs.PyFileSystem(pafs.FSSpecHandler(filesystem))
        self.filesystem = filesystem
        self.accept_damaged = accept_damaged
        self.topic = topic
        self.every = every


def _work(paths: list[str], of: Optional[_recordings.Range] = None) -> pa.Table:
    """Makes the row of a task: photographs, or a range of a recording."""
    return pa.table(
        {
            "photographs": pa.array([paths], pa.list_(pa.string())),
            "recording": pa.array([of and of.path], pa.string()),
            "start": pa.array([of and of.start], pa.int64()),
            "stop": pa.array([of and of.stop], pa.int64()),
        }
    )


def _listed(
    images: Union["ray.data.Dataset", Paths], filesystem: Any
) -> Union["ray.data.Dataset", tuple[dict[str, Stamp], dict[str, Stamp]]]:
    """Lists the photographs among paths and in folders, sorted by name within a folder, and the recordings among paths.

    A dataset is returned unchanged.
    """
    if isinstance(images, ray.data.Dataset):
        return images
    listed: dict[str, Stamp] = {}
    recordings: dict[str, Stamp] = {}
    for path in [images] if isinstance(images, (str, os.PathLike)) else images:
        text = os.fspath(path)
        on, inside = (filesystem, text) if filesystem is not None else place(text)
        info = on.get_file_info(inside)
        if info.type == pafs.FileType.NotFound:
            raise FileNotFoundError(f"{text}: no such file or folder")
        is_folder = info.type == pafs.FileType.Directory
        if _recordings.is_recording(text, on, inside, is_folder):
            recordings[_recordings.local(text, on, inside)] = Stamp.of(info)
            continue
        if not is_folder:
            listed[text] = Stamp.of(info)
            continue
        found = on.get_file_info(pafs.FileSelector(inside, recursive=True))
        inner = sorted(
            (file.path[len(inside) :].lstrip("/"), Stamp.of(file))
            for file in found
            if file.is_file and file.path.lower().endswith(_ENDINGS) and not file.path.endswith(".overlay.jpg")
        )
        listed |= {f"{text.rstrip('/')}/{name}": stamp for name, stamp in inner}
    return listed, recordings


class _Looking:
    """A worker process that detects targets in images."""

    def __init__(
        self,
        target: Optional[Targets],
        options: dict[str, Any],
        per: str,
        reading: _Reading,
        images_per_table: int,
        there: frozenset[str],
    ) -> None:
        # Ray runs one process per processor.
        os.environ["RAYON_NUM_THREADS"] = "1"
        self.detector = deltille.Detector(target, **options)
        self.per = per
        self.reading = reading
        self.images_per_table = images_per_table
        self.there = there

    def __call__(self, batch: pa.Table) -> Iterator[pa.Table]:
        if "photographs" not in batch.column_names:
            yield self._photographs(batch)
            return
        (work,) = batch.to_pylist()
        if work["recording"] is None:
            yield self._photographs(pa.table({"path": pa.array(work["photographs"], pa.string())}))
        else:
            yield from self._frames(_recordings.Range(work["recording"], work["start"], work["stop"]))

    def _frames(self, of: _recordings.Range) -> Iterator[pa.Table]:
        """Detects targets in a range of a recording; yields tables so that little is lost if the run is interrupted."""
        rows = Rows()
        stamp = Stamp.of(pafs.LocalFileSystem().get_file_info(of.path))
        try:
            reading = self.reading
            for name, frame in _recordings.frames(of, reading.topic, reading.every, reading.accept_damaged):
                if name not in self.there:
                    self._add(rows, name, stamp, lambda: self.detector.detect(frame, name=name))
                if len(rows.images) == self.images_per_table:
                    yield rows.table(self.per)
                    rows = Rows()
        except (deltille.Error, OSError, ValueError) as error:
            rows.failed(of.path, f"{error}", stamp)
        yield rows.table(self.per)

    def _photographs(self, batch: pa.Table) -> pa.Table:
        rows = Rows()
        names = batch.column_names
        content = batch["bytes"] if "bytes" in names else [None] * len(batch)
        for path, encoded in zip(batch["path"], content):
            # One image at a time: a batch of files may be large.
            name = path.as_py()
            if name in self.there:
                continue
            stamp = self._stamp(name) if encoded is None else Stamp()
            self._add(rows, name, stamp, lambda: self._detected(name, encoded))
        return rows.table(self.per)

    def _detected(self, name: str, encoded: Any) -> "deltille.Detection":
        data = self._read(name) if encoded is None else encoded.as_buffer()
        return self.detector.detect_bytes(data, name=name, accept_damaged=self.reading.accept_damaged)

    def _add(self, rows: Rows, name: str, stamp: Stamp, detect: Callable[[], "deltille.Detection"]) -> None:
        try:
            found = detect()
        except (deltille.Error, OSError, ValueError) as error:
            rows.failed(name, f"{error}", stamp)
        else:
            rows.add(name, found, stamp)

    def _place(self, path: str) -> Any:
        filesystem = self.reading.filesystem
        return (filesystem, path) if filesystem is not None else place(path)

    def _stamp(self, path: str) -> Stamp:
        """Returns the stamp of a file before it is read, so that a later change is noticed."""
        on, inside = self._place(path)
        try:
            return Stamp.of(on.get_file_info(inside))
        except OSError:
            return Stamp()

    def _read(self, path: str) -> Any:
        on, inside = self._place(path)
        with on.open_input_stream(inside) as file:
            return file.read()
