"""Images without a board, in which no board may be detected: no_board.py DELTILLE FOLDER [COUNT [SEED]].

Writes COUNT pictures of 480 × 360 px in FOLDER, of alternating kinds: textures, gratings and their moirés, screens,
ordered dithers, text, cells, leaves, mosaics, gradients, and parts of the photographs in scikit-image, scikit-learn and
matplotlib, as they are and in black and white. Then `deltille detect` searches for untagged grids of both tilings and
of unknown size. The script prints the false detections and the kinds of their images. Needs numpy, scipy and pillow;
missing packages of photographs are reported.
"""

import json
import pathlib
import subprocess
import sys

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from scipy import ndimage

WIDTH, HEIGHT = 480, 360


def plane(random):
    """Coordinates after a random rotation, translation and perspective distortion, px."""
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    x, y = x - WIDTH / 2, y - HEIGHT / 2
    depth = 1 + (x * random.uniform(-1, 1) + y * random.uniform(-1, 1)) / WIDTH * 0.8
    turn = random.uniform(0, 2 * np.pi)
    u = (np.cos(turn) * x - np.sin(turn) * y) / depth
    v = (np.sin(turn) * x + np.cos(turn) * y) / depth
    return u + random.uniform(0, 100), v + random.uniform(0, 100)


def stretched(image):
    least, most = np.percentile(image, [1, 99])
    return np.clip((image - least) / max(most - least, 1e-9), 0, 1)


def black_and_white(image, random):
    return (image > np.quantile(image, random.uniform(0.3, 0.7))).astype(float)


def texture(random):
    noise = random.normal(size=(HEIGHT, WIDTH))
    long, short = np.exp(random.uniform(np.log(0.7), np.log(12), 2))
    image = ndimage.rotate(ndimage.gaussian_filter(np.tile(noise, (2, 2)), [long, short]), random.uniform(0, 180), reshape=False)
    image = stretched(image[180:180 + HEIGHT, 240:240 + WIDTH])
    return black_and_white(image, random) if random.random() < 0.5 else image


def grating(random):
    u, v = plane(random)
    period = random.uniform(6, 50)
    image = 0.5 + 0.5 * np.sin(2 * np.pi * u / period)
    if random.random() < 0.5:
        image = (image > random.uniform(0.2, 0.8)).astype(float)
    return image


def moire(random):
    """Two superimposed gratings, like two sheets of film."""
    (u, _), (s, _) = plane(random), plane(random)
    first, second = random.uniform(4, 20, 2)
    return (np.sin(2 * np.pi * u / first) > 0) * (np.sin(2 * np.pi * s / second) > 0) * 1.0


def screen(random):
    """A gradient in dots of round, elliptic or line shape; the grey changes, so dots meet only in some regions."""
    u, v = plane(random)
    period = random.uniform(5, 30)
    a, b = np.cos(2 * np.pi * u / period), np.cos(2 * np.pi * v / period)
    dot = [0.5 * (a + b), 0.7 * a + 0.3 * b, a][random.integers(3)]
    grey = stretched(ndimage.gaussian_filter(random.normal(size=(HEIGHT, WIDTH)), random.uniform(20, 90)))
    return (0.5 + 0.5 * dot < grey).astype(float)


def dither(random):
    """Bayer's ordered dither of a gradient, in cells of several pixels."""
    bayer = np.array([[0]])
    for _ in range(random.integers(1, 4)):
        bayer = np.block([[4 * bayer, 4 * bayer + 2], [4 * bayer + 3, 4 * bayer + 1]])
    u, v = plane(random)
    size, n = random.uniform(3, 12), len(bayer)
    threshold = (bayer[(u // size).astype(int) % n, (v // size).astype(int) % n] + 0.5) / n**2
    grey = stretched(ndimage.gaussian_filter(random.normal(size=(HEIGHT, WIDTH)), random.uniform(20, 90)))
    return (threshold < grey).astype(float)


def text(random):
    image = Image.new("L", (WIDTH, HEIGHT), 255)
    draw = ImageDraw.Draw(image)
    size = random.uniform(8, 60)
    font = ImageFont.load_default(size)
    letters = list("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 .,-#%&XHKNMW")
    for line in range(int(HEIGHT / size) + 1):
        draw.text((0, line * size * 1.15), "".join(random.choice(letters, 120)), fill=0, font=font)
    return np.asarray(image.rotate(random.uniform(-45, 45), fillcolor=255)) / 255.0


def cells(random):
    """Squares or triangles, black and white at random, as of two-dimensional codes."""
    u, v = plane(random)
    size = random.uniform(5, 30)
    grid = random.integers(0, 2, (512, 512, 2))
    if random.random() < 0.5:
        i, j, half = u // size, v // size, 0
    else:
        s, t = u / size - v / size / np.sqrt(3), 2 * v / size / np.sqrt(3)
        i, j = np.floor(s), np.floor(t)
        half = ((s - i) + (t - j) > 1).astype(int)
    return grid[i.astype(int) % 512, j.astype(int) % 512, half].astype(float)


def leaves(random):
    image = Image.new("L", (WIDTH, HEIGHT), int(random.uniform(0, 255)))
    draw = ImageDraw.Draw(image)
    size = random.uniform(8, 60)
    for _ in range(int(3 * WIDTH * HEIGHT / size**2)):
        centre = random.uniform([0, 0], [WIDTH, HEIGHT])
        corners = random.integers(3, 8)
        angles = np.sort(random.uniform(0, 2 * np.pi, corners))
        points = centre + random.uniform(0.3, 1) * size * np.stack([np.cos(angles), np.sin(angles)], 1)
        draw.polygon([tuple(point) for point in points], fill=int(random.uniform(0, 255)))
    return np.asarray(image) / 255.0


def mosaic(random):
    """Voronoi's cells of points at random, or of points that nearly lie on a lattice."""
    u, v = plane(random)
    size = random.uniform(8, 40)
    i, j = np.mgrid[-40:40, -40:40] * size
    loose = random.uniform(0.2, 1) * size
    points = np.stack([i, j], -1).reshape(-1, 2) + random.uniform(-loose, loose, (6400, 2))
    from scipy.spatial import cKDTree

    nearest = cKDTree(points).query(np.stack([u, v], -1).reshape(-1, 2))[1].reshape(HEIGHT, WIDTH)
    return random.uniform(0, 1, 6400).round(random.integers(0, 2))[nearest]


def gradient(random):
    u, v = plane(random)
    image = stretched(u * random.normal() + v * random.normal() + random.uniform(0, 60) * random.normal(size=u.shape))
    return black_and_white(image, random) if random.random() < 0.5 else image


def photographs():
    """Images that are part of Python packages."""
    found = []
    try:
        import skimage.data

        folder = pathlib.Path(skimage.data.__file__).parent
        found += [path for end in ("png", "jpg", "jpeg", "gif", "tif") for path in folder.rglob(f"*.{end}")]
    except ImportError:
        print("scikit-image is missing")
    try:
        import sklearn.datasets

        found += pathlib.Path(sklearn.datasets.__file__).parent.rglob("*.jpg")
    except ImportError:
        print("scikit-learn is missing")
    try:
        import matplotlib

        found += pathlib.Path(matplotlib.get_data_path(), "sample_data").glob("*.*g")
    except ImportError:
        print("matplotlib is missing")
    images = []
    for path in found:
        # The chessboard image of scikit-image shows a checkerboard.
        if "chessboard" in path.name:
            continue
        try:
            images.append(np.asarray(Image.open(path).convert("L")) / 255.0)
        except OSError:
            continue
    return [image for image in images if min(image.shape) > 100]


def part_of(images):
    def part(random):
        image = images[random.integers(len(images))]
        u, v = plane(random)
        scale = np.exp(random.uniform(np.log(0.3), np.log(2)))
        places = [v / scale + image.shape[0] / 2, u / scale + image.shape[1] / 2]
        seen = ndimage.map_coordinates(image, places, order=1, mode="mirror")
        return black_and_white(seen, random) if random.random() < 0.4 else seen

    return part


def main():
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    count, seed = (int(text) for text in (sys.argv[3:] + ["10000", "1"][len(sys.argv) - 3:]))
    kinds = [texture, grating, moire, screen, dither, text, cells, leaves, mosaic, gradient]
    images = photographs()
    if images:
        kinds += [part_of(images)] * 2
        print(f"{len(images)} photographs of packages")
    folder.mkdir(parents=True)
    for index in range(count):
        random = np.random.default_rng([seed, index])
        kind = kinds[index % len(kinds)]
        image = ndimage.gaussian_filter(kind(random), random.uniform(0.5, 1.2))
        image = 0.08 + 0.8 * image + 0.01 * random.normal(size=image.shape)
        name = f"{kind.__name__}-{index:05}.png"
        Image.fromarray((255 * np.clip(image, 0, 1) + 0.5).astype(np.uint8)).save(folder / name)
    found = 0
    for grid in ("checker", "deltille"):
        out = folder / f"found-{grid}"
        subprocess.run([program, "detect", folder, "--grid", grid, "-o", out], stdout=subprocess.DEVNULL)
        seen = sorted(out.glob("*.json"))
        assert len(seen) >= count, f"{grid}: {len(seen)} of {count} pictures were looked at"
        for path in seen:
            grids = json.loads(path.read_text()).get("grids", [])
            found += bool(grids)
            for one in grids:
                print(f"{path.stem}: {grid}: {len(one['corners'])} corners")
    print(f"{found} of {2 * count} searches found a grid")
    sys.exit(found > 0)


if __name__ == "__main__":
    main()
