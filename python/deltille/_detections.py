"""What other packages take of detections: points for OpenCV, pictures for matplotlib and notebooks."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING, Any, Optional

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy
    from numpy.typing import NDArray

    from ._core import Detection
    from .batch import Failure

    Points = NDArray[numpy.float32]

__all__ = ["opencv_points", "plot", "repr_html", "stereo_to_opencv", "to_opencv"]


def opencv_points(self: Detection) -> tuple[Points, Points]:
    """Corners with labels as OpenCV takes them.

    Returns
    -------
    object_points : ndarray of N × 3, float32
        Places on the target, mm.
    image_points : ndarray of N × 2, float32
        Positions, px.

    Examples
    --------
    ``cv2.solvePnP(*self.to_opencv(), camera.matrix, camera.distortion)``
    """
    import numpy

    objects = self.object_points
    is_known = ~numpy.isnan(objects).any(axis=1)
    return objects[is_known].astype(numpy.float32), self.pixels[is_known].astype(numpy.float32)


def to_opencv(
    detections: Sequence[Detection | Failure], *, least_corners: int = 6
) -> tuple[list[Points], list[Points]]:
    """Corners with labels of many pictures, as ``cv2.calibrateCamera`` takes them.

    Parameters
    ----------
    detections : sequence of Detection
        What could not be read is passed over.
    least_corners : int, optional
        Pictures with fewer corners are left out.

    Returns
    -------
    object_points : list of ndarray of N × 3, float32
        Places on the target, mm.
    image_points : list of ndarray of N × 2, float32
        Positions, px.
    """
    points = [opencv_points(detection) for detection in detections if detection.error is None]
    points = [(objects, pixels) for objects, pixels in points if len(objects) >= least_corners]
    return [objects for objects, _ in points], [pixels for _, pixels in points]


def stereo_to_opencv(
    left: Sequence[Detection], right: Sequence[Detection], *, least_corners: int = 6
) -> tuple[list[Points], list[Points], list[Points]]:
    """Corners that two cameras saw at the same moments, as ``cv2.stereoCalibrate`` takes them.

    Parameters
    ----------
    left, right : sequence of Detection
        Of the same moments in the same order.
    least_corners : int, optional
        Moments in which fewer corners are in both pictures are left out.

    Returns
    -------
    object_points : list of ndarray of N × 3, float32
        Places on the target, mm.
    left_points, right_points : list of ndarray of N × 2, float32
        Positions, px.
    """
    import numpy

    if len(left) != len(right):
        from .errors import DetectionError

        raise DetectionError(f"left and right: {len(left)} and {len(right)} pictures are not of the same moments")
    objects: list[Points] = []
    lefts: list[Points] = []
    rights: list[Points] = []
    for one, other in zip(left, right):
        ids, own, theirs = numpy.intersect1d(one.ids, other.ids, return_indices=True)
        own, theirs = own[ids >= 0], theirs[ids >= 0]
        places = one.object_points[own]
        is_known = ~numpy.isnan(places).any(axis=1)
        if int(is_known.sum()) < least_corners:
            continue
        objects.append(places[is_known].astype(numpy.float32))
        lefts.append(one.pixels[own[is_known]].astype(numpy.float32))
        rights.append(other.pixels[theirs[is_known]].astype(numpy.float32))
    return objects, lefts, rights


def plot(
    self: Detection,
    image: Optional[NDArray[Any]] = None,
    ax: Any = None,
    *,
    ids: bool = False,
) -> Any:
    """Draw the corners with matplotlib (``pip install deltille[plot]``).

    Parameters
    ----------
    image : ndarray, optional
        The picture, drawn below them.
    ax : matplotlib.axes.Axes, optional
        Where to draw; the current axes if left out.
    ids : bool, optional
        Whether ids are written beside the corners.

    Returns
    -------
    matplotlib.axes.Axes
    """
    import matplotlib.patheffects as patheffects
    import matplotlib.pyplot as pyplot

    if ax is None:
        ax = pyplot.gca()
    if image is not None:
        ax.imshow(image, cmap="gray")
    for grid in self.grids:
        pixels = grid.pixels
        label = "no labels" if grid.panel is None else f"panel {grid.panel}"
        ax.plot(pixels[:, 0], pixels[:, 1], "+", label=label)
        if ids:
            # Tiles are black and white: numbers stand out from both.
            outline = [patheffects.withStroke(linewidth=1.5, foreground="white")]
            for (x, y), number in zip(pixels, grid.ids):
                if number >= 0:
                    ax.annotate(str(number), (x, y), xytext=(2, 2), textcoords="offset points", fontsize=6, path_effects=outline)
    ax.set_xlim(-0.5, self.width - 0.5)
    ax.set_ylim(self.height - 0.5, -0.5)
    ax.set_aspect("equal")
    ax.set_title(self.image)
    if self.grids:
        ax.legend(loc="lower right", fontsize="small")
    elif self.why is not None:
        ax.text(0.5, 0.5, self.why.sentence, transform=ax.transAxes, ha="center", wrap=True)
    return ax


_COLOURS = ("#1f77b4", "#ff7f0e", "#2ca02c", "#d62728", "#9467bd", "#8c564b", "#e377c2", "#7f7f7f")


def repr_html(self: Detection) -> str:
    """A small picture of the corners for notebooks."""
    width, height = max(self.width, 1), max(self.height, 1)
    radius = max(width, height) / 320
    dots: list[str] = []
    for index, grid in enumerate(self.grids):
        colour = _COLOURS[index % len(_COLOURS)]
        dots += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" fill="{colour}"/>' for x, y in grid.pixels]
    why = "".join(f"<br>{html.escape(reason.sentence)}" for reason in self.reasons)
    if not dots:
        return f"<div><code>{html.escape(repr(self))}</code>{why}</div>"
    return (
        f"<div><code>{html.escape(repr(self))}</code>{why}<br>"
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="320" '
        f'style="background:#f4f4f4;border:1px solid #ccc">{"".join(dots)}</svg></div>'
    )
