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

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from typing_extensions import TypeAlias

    Paths: TypeAlias = Union[str, "os.PathLike[str]", Sequence[Union[str, "os.PathLike[str]"]]]
    Targets: TypeAlias = Union["deltille.Target", Sequence["deltille.Target"]]

__all__ = ["CORNERS", "IMAGES", "Summary", "detect", "detect_to", "done"]

#: Metadata key of a table: a hash of the target and the options of its images.
ASKED = b"deltille.asked"

#: Columns of the table of corners.
CORNERS = pa.schema(
    [
        ("image", pa.string()),
        ("grid", pa.int32()),
        ("kind", pa.string()),
        ("target", pa.string()),
        ("panel", pa.uint32()),
        ("mirrored", pa.bool_()),
        ("row", pa.int32()),
        ("col", pa.int32()),
        ("id", pa.uint32()),
        ("x", pa.float64()),
        ("y", pa.float64()),
        ("cov_xx", pa.float64()),
        ("cov_xy", pa.float64()),
        ("cov_yy", pa.float64()),
        ("target_x_mm", pa.float64()),
        ("target_y_mm", pa.float64()),
        ("target_z_mm", pa.float64()),
    ],
    metadata={"deltille.schema": "deltille/corners/1"},
)

#: Columns of the table of images.
IMAGES = pa.schema(
    [
        ("image", pa.string()),
        ("width", pa.int32()),
        ("height", pa.int32()),
        ("grids", pa.int32()),
        ("corners", pa.int32()),
        ("tags", pa.int32()),
        ("why", pa.string()),
        ("why_text", pa.string()),
        ("reasons", pa.string()),
        ("tone_black", pa.float64()),
        ("tone_white", pa.float64()),
        ("tone_kappa", pa.float64()),
        ("tone_kappa_sd", pa.float64()),
        ("tone_kappa_odd", pa.float64()),
        ("tone_used", pa.bool_()),
        ("ink_edges", pa.float64()),
        ("ink_edges_sd", pa.float64()),
        ("ink_um", pa.float64()),
        ("ink_um_sd", pa.float64()),
        ("ink_used", pa.bool_()),
        ("ink_images", pa.int32()),
        ("exif_orientation", pa.int32()),
        ("damage", pa.string()),
        ("error", pa.string()),
        ("targets", pa.string()),
        ("time_ns", pa.int64()),
        ("camera", pa.string()),
    ],
    metadata={"deltille.schema": "deltille/images/1"},
)

# Columns of a corner nested in the row of its image: all except the name of the image.
_CORNER = pa.struct(list(CORNERS)[1:])
_BOTH = pa.schema([*IMAGES, pa.field("found", pa.list_(_CORNER))])

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
    found, _ = _detect(images, frozenset(), target, per, concurrency, batch_size, reading, options)
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
    **options: Any,
) -> Summary:
    """Detects a target in images and writes results continuously to ``folder/corners`` and ``folder/images``.

    Images that already have results in the folder are skipped, even if they have no corners or an error: repeat the same call
    to resume an interrupted run. ``deltille calibrate FOLDER --target …`` reads the folder.

    Parameters
    ----------
    folder : str or path-like
        A folder or bucket that every worker can access; created if necessary.
    images, target, concurrency, batch_size, filesystem, accept_damaged, topic, every, **options
        See :func:`detect`; `filesystem` is that of the images.
    images_per_file : int, optional
        Minimum number of images per file of either table. An interrupted run loses images that are not in a file yet.

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
    to, root = _place(folder)
    of_topic = {} if topic is None else {"topic": topic}
    asked = _asked(target, {**options, **of_topic, "accept_damaged": accept_damaged})
    for path in _files(to, f"{root}/images")[:1]:
        with to.open_input_file(path) as file:
            known = (pq.read_schema(file).metadata or {}).get(ASKED, asked)
        if known != asked:
            what = "the folder contains results for another target or other options; use another folder"
            raise deltille.DetectionError(f"{folder}: {what}")
    _remove_halves(to, root)
    there = done(folder)
    reading = _Reading(filesystem, accept_damaged, topic, every)
    dataset, skipped = _detect(images, there, target, "both", concurrency, batch_size, reading, options)
    if dataset is None:
        return Summary(0, 0, 0, skipped)
    # A single process writes all files, because Ray needs a second to start a process. It reserves no processor: the
    # detecting processes occupy all processors, so the writer would never start and they would wait for it forever.
    written = dataset.map_batches(
        _Writing,
        batch_size=images_per_file,
        batch_format="pyarrow",
        compute=ray.data.ActorPoolStrategy(size=1),
        num_cpus=0,
        fn_constructor_kwargs={"filesystem": to, "root": root, "run": uuid.uuid4().hex[:12], "asked": asked},
    )
    counts = [[row["images"], row["corners"], row["errors"]] for row in written.iter_rows()]
    images_seen, corners, errors = (sum(column) for column in zip(*counts)) if counts else (0, 0, 0)
    return Summary(images_seen, corners, errors, skipped)


def done(folder: Union[str, "os.PathLike[str]"]) -> frozenset[str]:
    """Returns the names of the images with results in a folder of :func:`detect_to`."""
    to, root = _place(folder)
    names: set[str] = set()
    for path in _files(to, f"{root}/images"):
        with to.open_input_file(path) as file:
            names.update(pq.read_table(file, columns=["image"])["image"].to_pylist())
    return frozenset(names)


def _asked(target: Optional[Targets], options: dict[str, Any]) -> bytes:
    """Returns a hash of the target and the options."""
    targets = [] if target is None else [target] if isinstance(target, deltille.Target) else list(target)
    asked = [[one.to_json() for one in targets], sorted((name, str(value)) for name, value in options.items())]
    return hashlib.sha256(json.dumps(asked).encode()).hexdigest().encode()


def _place(path: Union[str, "os.PathLike[str]"]) -> tuple[pafs.FileSystem, str]:
    """Returns the filesystem of a path, and the path in it."""
    text = os.fspath(path)
    if "://" in text:
        filesystem, inside = pafs.FileSystem.from_uri(text)
        return filesystem, inside.rstrip("/")
    # Workers have a different working directory.
    return pafs.LocalFileSystem(), os.path.abspath(text)


def _files(filesystem: pafs.FileSystem, folder: str) -> list[str]:
    """Returns the tables in a folder."""
    selector = pafs.FileSelector(folder, allow_not_found=True)
    found = filesystem.get_file_info(selector)
    names = [info for info in found if info.is_file and not info.base_name.startswith(".")]
    return sorted(info.path for info in names if info.base_name.endswith(".parquet"))


def _remove_halves(filesystem: pafs.FileSystem, root: str) -> None:
    """Removes files of corners without a matching file of images."""
    name = os.path.basename
    whole = {name(path) for path in _files(filesystem, f"{root}/images")}
    for path in _files(filesystem, f"{root}/corners"):
        if name(path) not in whole:
            filesystem.delete_file(path)


def _detect(
    images: Any,
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
        paths, recordings = _listed(images, reading.filesystem)
        left = [path for path in paths if path not in there]
        skipped = len(paths) - len(left)
        most = processors if concurrency is None else concurrency if isinstance(concurrency, int) else concurrency[1]
        recordings = [path for path in recordings if path not in there]
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


def _listed(paths: Paths, filesystem: Any) -> tuple[list[str], list[str]]:
    """Lists the photographs among paths and in folders, sorted by name within a folder, and the recordings among paths."""
    listed: list[str] = []
    recordings: list[str] = []
    for path in [paths] if isinstance(paths, (str, os.PathLike)) else paths:
        text = os.fspath(path)
        on, inside = (filesystem, text) if filesystem is not None else _place(text)
        info = on.get_file_info(inside)
        if info.type == pafs.FileType.NotFound:
            raise FileNotFoundError(f"{text}: no such file or folder")
        is_folder = info.type == pafs.FileType.Directory
        if _recordings.is_recording(text, on, inside, is_folder):
            recordings.append(_recordings.local(text, on, inside))
            continue
        if not is_folder:
            listed.append(text)
            continue
        found = on.get_file_info(pafs.FileSelector(inside, recursive=True))
        inner = sorted(
            file.path[len(inside) :].lstrip("/")
            for file in found
            if file.is_file and file.path.lower().endswith(_ENDINGS) and not file.path.endswith(".overlay.jpg")
        )
        listed.extend(f"{text.rstrip('/')}/{name}" for name in inner)
    return list(dict.fromkeys(listed)), list(dict.fromkeys(recordings))


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
        rows = _Rows()
        try:
            reading = self.reading
            for name, frame in _recordings.frames(of, reading.topic, reading.every, reading.accept_damaged):
                if name not in self.there:
                    self._add(rows, name, lambda: self.detector.detect(frame, name=name))
                if len(rows.images) == self.images_per_table:
                    yield rows.table(self.per)
                    rows = _Rows()
        except (deltille.Error, OSError, ValueError) as error:
            rows.failed(of.path, f"{error}")
        yield rows.table(self.per)

    def _photographs(self, batch: pa.Table) -> pa.Table:
        rows = _Rows()
        names = batch.column_names
        content = batch["bytes"] if "bytes" in names else [None] * len(batch)
        for path, encoded in zip(batch["path"], content):
            # One image at a time: a batch of files may be large.
            name = path.as_py()
            if name in self.there:
                continue
            self._add(rows, name, lambda: self._detected(name, encoded))
        return rows.table(self.per)

    def _detected(self, name: str, encoded: Any) -> "deltille.Detection":
        data = self._read(name) if encoded is None else encoded.as_buffer()
        return self.detector.detect_bytes(data, name=name, accept_damaged=self.reading.accept_damaged)

    def _add(self, rows: "_Rows", name: str, detect: Callable[[], "deltille.Detection"]) -> None:
        try:
            found = detect()
        except (deltille.Error, OSError, ValueError) as error:
            rows.failed(name, f"{error}")
        else:
            rows.add(name, found)

    def _read(self, path: str) -> Any:
        filesystem = self.reading.filesystem
        on, inside = (filesystem, path) if filesystem is not None else _place(path)
        with on.open_input_stream(inside) as file:
            return file.read()


class _Rows:
    """Rows of both tables, column by column."""

    def __init__(self) -> None:
        self.images: list[dict[str, Any]] = []
        self.counts: list[int] = []
        self.corners: list[pa.Table] = []

    def failed(self, image: str, error: str) -> None:
        self.images.append({"image": image, "error": error})
        self.counts.append(0)

    def add(self, image: str, found: "deltille.Detection") -> None:
        reasons = [
            {"kind": reason.kind}
            | ({} if reason.grid is None else {"grid": reason.grid})
            | ({"figures": reason.figures} if reason.figures else {})
            for reason in found.reasons
        ]
        picture: dict[str, Any] = {
            "image": image,
            "width": found.width,
            "height": found.height,
            "grids": len(found.grids),
            "corners": len(found),
            "tags": len(found.tags),
            "exif_orientation": found.exif_orientation,
            "damage": found.damage,
            "time_ns": found.time_ns,
        }
        if found.target_identities:
            picture["targets"] = json.dumps(found.target_identities)
        if found.camera is not None:
            picture["camera"] = json.dumps(found.camera)
        if reasons:
            picture["why"] = reasons[0]["kind"]
            picture["why_text"] = "; ".join(str(reason) for reason in found.reasons)
            picture["reasons"] = json.dumps(reasons)
        for name, estimate in (("tone", found.tone), ("ink", found.ink)):
            if estimate is not None:
                fields = (field for field in IMAGES.names if field.startswith(f"{name}_"))
                picture |= {field: _field(estimate, field.removeprefix(f"{name}_")) for field in fields}
        self.images.append(picture)
        self.counts.append(len(found))
        if len(found):
            self.corners.append(_corners(image, found))

    def table(self, per: str) -> pa.Table:
        corners = pa.concat_tables([CORNERS.empty_table(), *self.corners])
        if per == "corner":
            return corners
        images = pa.Table.from_pylist(self.images, IMAGES)
        if per == "image":
            return images
        parts = corners.drop_columns(["image"]).combine_chunks()
        arrays = [parts[name].combine_chunks() for name in parts.column_names]
        values = pa.StructArray.from_arrays(arrays, fields=list(_CORNER))
        ends = [0]
        for count in self.counts:
            ends.append(ends[-1] + count)
        found = pa.ListArray.from_arrays(pa.array(ends, pa.int32()), values)
        return pa.table([*images.columns, found], schema=_BOTH)


def _field(record: Any, name: str) -> Any:
    return record.get(name) if isinstance(record, dict) else getattr(record, name, None)


def _corners(image: str, found: "deltille.Detection") -> pa.Table:
    """Makes the table of corners of an image."""
    grids = found.grid_indices
    each = found.grids
    cov, pixels, places = found.covariances, found.pixels, found.object_points

    def of_grid(what: Any) -> list[Any]:
        values = [what(grid) for grid in each]
        return [values[grid] for grid in grids]

    def known(ids: Any) -> pa.Array:
        return pa.array(ids, mask=ids < 0).cast(pa.uint32())

    def number(values: Any) -> pa.Array:
        # NaN stands for unknown numbers.
        return pa.array(values, pa.float64(), from_pandas=True)

    columns = {
        "image": [image] * len(grids),
        "grid": grids,
        "kind": of_grid(lambda grid: grid.kind),
        "target": of_grid(lambda grid: grid.target),
        "panel": known(found.panels),
        "mirrored": of_grid(lambda grid: grid.mirrored),
        "row": found.rows,
        "col": found.cols,
        "id": known(found.ids),
        "x": number(pixels[:, 0]),
        "y": number(pixels[:, 1]),
        "cov_xx": number(cov[:, 0, 0]),
        "cov_xy": number(cov[:, 0, 1]),
        "cov_yy": number(cov[:, 1, 1]),
        "target_x_mm": number(places[:, 0]),
        "target_y_mm": number(places[:, 1]),
        "target_z_mm": number(places[:, 2]),
    }
    arrays = [
        values.cast(field.type) if isinstance(values, pa.Array) else pa.array(values, field.type)
        for field, values in zip(CORNERS, columns.values())
    ]
    return pa.table(arrays, schema=CORNERS)


class _Writing:
    """A process that writes rows of images as a file of corners and then a file of images, with the same name.

    An image counts as done once it is in a file of images. Readers ignore a file of corners without a file of images, and the
    next run removes it.
    """

    def __init__(self, filesystem: pafs.FileSystem, root: str, run: str, asked: bytes) -> None:
        self.filesystem = filesystem
        self.root = root
        self.run = run
        self.asked = asked
        for table in ("corners", "images"):
            self.filesystem.create_dir(f"{root}/{table}", recursive=True)

    def __call__(self, both: pa.Table) -> pa.Table:
        if not len(both):
            return pa.table({"images": [0], "corners": [0], "errors": [0]})
        both = both.combine_chunks()
        images = both.select(IMAGES.names).cast(IMAGES)
        images = images.replace_schema_metadata({**(IMAGES.metadata or {}), ASKED: self.asked})
        lists = both["found"].combine_chunks()
        values = lists.flatten()
        image = images["image"].combine_chunks().take(pa.compute.list_parent_indices(lists))
        columns = [image, *(values.field(field.name) for field in list(CORNERS)[1:])]
        corners = pa.table(columns, schema=CORNERS)
        # Work repeated after a lost process writes the same files again.
        of_these = hashlib.sha256("\n".join(images["image"].to_pylist()).encode()).hexdigest()
        name = f"{self.run}-{of_these[:16]}.parquet"
        self._put(corners, f"{self.root}/corners", name)
        self._put(images, f"{self.root}/images", name)
        errors = len(images) - images["error"].null_count
        return pa.table({"images": [len(images)], "corners": [len(corners)], "errors": [errors]})

    def _put(self, table: pa.Table, folder: str, name: str) -> None:
        """Writes a file atomically."""
        if not isinstance(self.filesystem, pafs.LocalFileSystem):
            # An object in a bucket appears when its stream is closed.
            with self.filesystem.open_output_stream(f"{folder}/{name}") as file:
                pq.write_table(table, file, compression="snappy")
            return
        temporary = f"{folder}/.{name}-{uuid.uuid4().hex}"
        with self.filesystem.open_output_stream(temporary) as file:
            pq.write_table(table, file, compression="snappy")
        os.replace(temporary, f"{folder}/{name}")
