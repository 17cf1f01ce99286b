"""Parquet tables of :mod:`deltille.ray`: their schemas, rows, and files in a folder or bucket."""

from __future__ import annotations

import hashlib
import json
import os
import uuid
from typing import TYPE_CHECKING, Any, NamedTuple, Optional, Union

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.fs as pafs
import pyarrow.parquet as pq

if TYPE_CHECKING:
    import deltille

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
        ("file_size", pa.int64()),
        ("file_mtime_ns", pa.int64()),
    ],
    metadata={"deltille.schema": "deltille/images/1"},
)

# Columns of a corner nested in the row of its image: all except the name of the image.
_CORNER = pa.struct(list(CORNERS)[1:])
_BOTH = pa.schema([*IMAGES, pa.field("found", pa.list_(_CORNER))])


class Stamp(NamedTuple):
    """Size in bytes and modification time of a file; ``None`` if they are not known."""

    size: Optional[int] = None
    mtime_ns: Optional[int] = None

    @staticmethod
    def of(info: pafs.FileInfo) -> Stamp:
        return Stamp(info.size, info.mtime_ns) if info.is_file else Stamp()

    def differs(self, other: Stamp) -> bool:
        """Whether both are known and differ."""
        pairs = zip(self, other)
        return any(one is not None and another is not None and one != another for one, another in pairs)


def place(path: Union[str, "os.PathLike[str]"]) -> tuple[pafs.FileSystem, str]:
    """Returns the filesystem of a path, and the path in it."""
    text = os.fspath(path)
    if "://" in text:
        filesystem, inside = pafs.FileSystem.from_uri(text)
        return filesystem, inside.rstrip("/")
    # Workers have a different working directory.
    return pafs.LocalFileSystem(), os.path.abspath(text)


def files(filesystem: pafs.FileSystem, folder: str) -> list[str]:
    """Returns the tables in a folder."""
    selector = pafs.FileSelector(folder, allow_not_found=True)
    found = filesystem.get_file_info(selector)
    names = [info for info in found if info.is_file and not info.base_name.startswith(".")]
    return sorted(info.path for info in names if info.base_name.endswith(".parquet"))


def remove_halves(filesystem: pafs.FileSystem, root: str) -> None:
    """Removes files of corners without a matching file of images."""
    name = os.path.basename
    whole = {name(path) for path in files(filesystem, f"{root}/images")}
    for path in files(filesystem, f"{root}/corners"):
        if name(path) not in whole:
            filesystem.delete_file(path)


def done(folder: Union[str, "os.PathLike[str]"]) -> frozenset[str]:
    """Returns the names of the images with results in a folder of :func:`detect_to`."""
    to, root = place(folder)
    names: set[str] = set()
    for path in files(to, f"{root}/images"):
        with to.open_input_file(path) as file:
            names.update(pq.read_table(file, columns=["image"])["image"].to_pylist())
    return frozenset(names)


def forget(
    to: pafs.FileSystem, root: str, photographs: dict[str, Stamp], recordings: dict[str, Stamp], errors: bool
) -> None:
    """Removes the rows of images whose file has changed, and with `errors` of those that could not be read.

    Rows of corners are removed first, so that the next call repeats an interrupted one.
    """
    of_frames = {os.path.splitext(path)[0]: stamp for path, stamp in recordings.items()}

    def is_stale(image: str, error: Optional[str], size: Optional[int], mtime_ns: Optional[int]) -> bool:
        if errors and error is not None:
            return True
        stamp = photographs.get(image) or recordings.get(image) or of_frames.get(image.rpartition("-")[0])
        return stamp is not None and stamp.differs(Stamp(size, mtime_ns))

    for path in files(to, f"{root}/images"):
        images = _read(to, path)
        columns = [images[name].to_pylist() for name in ("image", "error", "file_size", "file_mtime_ns") if name in images.column_names]
        stale = [row[0] for row in zip(*columns) if is_stale(*row, *[None] * (4 - len(row)))]
        if stale:
            for table in ("corners", "images"):
                all_rows = _read(to, f"{root}/{table}/{os.path.basename(path)}")
                is_kept = pc.invert(pc.is_in(all_rows["image"], pa.array(stale)))
                _put(to, all_rows.filter(is_kept), f"{root}/{table}", os.path.basename(path))


def _read(filesystem: pafs.FileSystem, path: str) -> pa.Table:
    with filesystem.open_input_file(path) as file:
        return pq.read_table(file)


def _put(filesystem: pafs.FileSystem, table: pa.Table, folder: str, name: str) -> None:
    """Writes a file atomically."""
    if not isinstance(filesystem, pafs.LocalFileSystem):
        # An object in a bucket appears when its stream is closed.
        with filesystem.open_output_stream(f"{folder}/{name}") as file:
            pq.write_table(table, file, compression="snappy")
        return
    temporary = f"{folder}/.{name}-{uuid.uuid4().hex}"
    with filesystem.open_output_stream(temporary) as file:
        pq.write_table(table, file, compression="snappy")
    os.replace(temporary, f"{folder}/{name}")


class Rows:
    """Rows of both tables, column by column."""

    def __init__(self) -> None:
        self.images: list[dict[str, Any]] = []
        self.counts: list[int] = []
        self.corners: list[pa.Table] = []

    def failed(self, image: str, error: str, stamp: Stamp) -> None:
        self.images.append({"image": image, "error": error, "file_size": stamp.size, "file_mtime_ns": stamp.mtime_ns})
        self.counts.append(0)

    def add(self, image: str, found: "deltille.Detection", stamp: Stamp) -> None:
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
            "file_size": stamp.size,
            "file_mtime_ns": stamp.mtime_ns,
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


class Writing:
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
        image = images["image"].combine_chunks().take(pc.list_parent_indices(lists))
        columns = [image, *(values.field(field.name) for field in list(CORNERS)[1:])]
        corners = pa.table(columns, schema=CORNERS)
        # Work repeated after a lost process writes the same files again.
        of_these = hashlib.sha256("\n".join(images["image"].to_pylist()).encode()).hexdigest()
        name = f"{self.run}-{of_these[:16]}.parquet"
        _put(self.filesystem, corners, f"{self.root}/corners", name)
        _put(self.filesystem, images, f"{self.root}/images", name)
        errors = len(images) - images["error"].null_count
        return pa.table({"images": [len(images)], "corners": [len(corners)], "errors": [errors]})
