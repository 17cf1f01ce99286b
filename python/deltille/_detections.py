"""Detections for other packages: points for OpenCV, plots for matplotlib and notebooks."""

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
    """Returns the labelled corners in OpenCV's format.

    Returns
    -------
    object_points : ndarray of N × 3, float32
        Positions on the target, mm.
    image_points : ndarray of N × 2, float32
        Positions in the image, px.

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
    """Returns the labelled corners of many images in the format of ``cv2.calibrateCamera``.

    Parameters
    ----------
    detections : sequence of Detection
        Failures are skipped.
    least_corners : int, optional
        Images with fewer corners are skipped.

    Returns
    -------
    object_points : list of ndarray of N × 3, float32
        Positions on the target, mm.
    image_points : list of ndarray of N × 2, float32
        Positions in the image, px.
    """
    points = [opencv_points(detection) for detection in detections if detection]
    points = [(objects, pixels) for objects, pixels in points if len(objects) >= least_corners]
    return [objects for objects, _ in points], [pixels for _, pixels in points]


def stereo_to_opencv(
    left: Sequence[Detection | Failure], right: Sequence[Detection | Failure], *, least_corners: int = 6
) -> tuple[list[Points], list[Points], list[Points]]:
    """Returns the corners that two cameras observed at the same times, in the format of ``cv2.stereoCalibrate``.

    Parameters
    ----------
    left, right : sequence of Detection
        Detections at the same times in the same order. A pair with a failure is skipped.
    least_corners : int, optional
        Pairs of images with fewer common corners are skipped.

    Returns
    -------
    object_points : list of ndarray of N × 3, float32
        Positions on the target, mm.
    left_points, right_points : list of ndarray of N × 2, float32
        Positions in the image, px.
    """
    import numpy

    if len(left) != len(right):
        from .errors import DetectionError

        raise DetectionError(f"left and right must have the same number of images, got {len(left)} and {len(right)}")
    objects: list[Points] = []
    lefts: list[Points] = []
    rights: list[Points] = []
    for one, other in zip(left, right):
        if not one or not other:
            continue
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
    """Draws the corners with matplotlib (``pip install deltille[plot]``).

    Parameters
    ----------
    image : ndarray, optional
        The image, drawn beneath the corners.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on; defaults to the current axes.
    ids : bool, optional
        Write the ids next to the corners.

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
            # Outlined, so that numbers are legible on black and white tiles.
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
    """Renders a small plot of the corners for notebooks."""
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
