"""3MF files for printers with two colours: the face with the tags as seen from above, and the tags in such a picture."""

import collections
import json
import xml.etree.ElementTree as xml
import zipfile

import cv2
import numpy as np

CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
PRODUCTION = "{http://schemas.microsoft.com/3dmanufacturing/production/2015/06}"
# `paint_color` of triangles that are painted as a whole, in Bambu Studio and its relatives, and the number of the filament.
PAINT = {"4": 0, "8": 1}
TAGS = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)


def bodies(path):
    """The vertices (mm), the triangles and the colours of triangles of each body, as it lies on the printer's bed."""
    with zipfile.ZipFile(path) as files:
        parts = {f"/{name}": xml.fromstring(files.read(name)) for name in files.namelist() if name.endswith(".model")}
        settings = "Metadata/project_settings.config"
        filaments = json.loads(files.read(settings))["filament_colour"] if settings in files.namelist() else []
    assert all(part.get("unit", "millimeter") == "millimeter" for part in parts.values())

    def body(part, number, place):
        materials = {of.get("id"): [base.get("displaycolor") for base in of] for of in parts[part].iter(f"{CORE}basematerials")}
        item = next(of for of in parts[part].iter(f"{CORE}object") if of.get("id") == number)

        def colour(triangle):
            if "paint_color" in triangle.keys():
                return filaments[PAINT[triangle.get("paint_color")]]
            material = triangle.get("pid", item.get("pid"))
            return materials[material][int(triangle.get("p1", item.get("pindex", 0)))] if material else filaments[0]

        for of in item.iter(f"{CORE}component"):
            yield from body(of.get(f"{PRODUCTION}path", part), of.get("objectid"), transform(of) @ place)
        for mesh in item.iter(f"{CORE}mesh"):
            vertices = np.array([[float(of.get(axis)) for axis in "xyz"] + [1] for of in mesh.iter(f"{CORE}vertex")])
            triangles = list(mesh.iter(f"{CORE}triangle"))
            corners = np.array([[int(of.get(name)) for name in ("v1", "v2", "v3")] for of in triangles])
            yield (vertices @ place)[:, :3], corners, [colour(of) for of in triangles]

    main = "/3D/3dmodel.model"
    items = parts[main].iter(f"{CORE}item")
    return [of for item in items for of in body(main, item.get("objectid"), transform(item))]


def transform(element):
    """The matrix by which rows `x y z 1` are multiplied."""
    matrix = np.eye(4)
    matrix[:, :3] = np.reshape(element.get("transform", "1 0 0 0 1 0 0 0 1 0 0 0").split(), (4, 3)).astype(float)
    return matrix


def is_closed(triangles):
    """Each edge belongs to two triangles, in opposite directions. Vertices are those of the file, as the specification of 3MF has
    it: where black areas touch at a corner, two vertices are in the same place."""
    edges = collections.Counter(zip(triangles.ravel().tolist(), np.roll(triangles, -1, axis=1).ravel().tolist()))
    return all(count == 1 and edges[b, a] == 1 for (a, b), count in edges.items())


def write_face(of, path, margin=10.0):
    """An SVG of what is seen from above, at its size, on a white page, turned by half a degree.

    Edges along rows of pixels would be where the program that draws the page has its grid, 1/15 px in cairo.
    """
    layers = collections.defaultdict(list)
    for vertices, triangles, colours in of:
        for triangle, colour in zip(vertices[triangles], colours):
            (ax, ay), (bx, by) = np.diff(triangle, axis=0)[:, :2]
            if ax * by - ay * bx > 1e-9:
                assert np.ptp(triangle[:, 2]) < 1e-6, "not parallel to the page"
                layers[round(triangle[0, 2], 4), colour != "#FFFFFF", colour].append(triangle[:, :2])
    places = np.vstack([vertices[:, :2] for vertices, _, _ in of])
    low, high = places.min(0) - margin, places.max(0) + margin
    width, height = high - low
    # What is lower comes first, and white before black, so that pixels on edges are those of black on a white page. The triangles
    # of a layer are in one path, which has no seams between them.
    drawn = "".join(
        f'<path fill="{layer[2]}" d="{"".join(f"M{a} {b}L{c} {d}L{e} {f}Z" for (a, b), (c, d), (e, f) in layers[layer])}"/>\n'
        for layer in sorted(layers)
    )
    path.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}mm" height="{height}mm" viewBox="0 0 {width} {height}">\n'
        f'<g transform="rotate(0.5) matrix(1 0 0 -1 {-low[0]} {high[1]})">\n{drawn}</g></svg>\n'
    )


def tags(image, dpi):
    """The corners (px) of each tag, in the order of OpenCV, and whether all of its cells are as in the dictionary."""
    # Tags are several hundred pixels wide.
    scale = 75 / dpi
    small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    found, ids, _ = cv2.aruco.ArucoDetector(TAGS).detectMarkers(small)
    result = {}
    for number, places in zip([] if ids is None else ids.ravel().tolist(), found):
        near = (places[0] + 0.5) / scale - 0.5
        edges = [edge(image, near[i], near[(i + 1) % 4]) for i in range(4)]
        corners = np.array([np.cross(edges[i - 1], edges[i]) for i in range(4)])
        corners = corners[:, :2] / corners[:, 2:]
        result[number] = corners, is_exact(image, corners, number)
    return result


def edge(image, a, b, reach=30):
    """The line `x y 1` through an edge of a black square on white, between positions near its ends."""
    if is_upright := abs(b[1] - a[1]) > abs(b[0] - a[0]):
        image, a, b = image.T, a[::-1], b[::-1]
    left, right = sorted([a[0], b[0]])
    x = np.arange(round(left + (right - left) / 5), round(right - (right - left) / 5))
    top = round((a[1] + b[1]) / 2) - reach
    # What is dark in a column sums up to the part of its length that is in the square, however the edge crosses its pixels.
    strip = image[top:top + 2 * reach, x] / 255
    y = top - 0.5 + np.sum(1 - strip if strip[0].mean() < 0.5 else strip, axis=0)
    slope, start = np.polyfit(x, y, 1)
    return np.array([-1, slope, start] if is_upright else [slope, -1, start])


def is_exact(image, corners, number, px=20, inset=4):
    side = TAGS.markerSize + 2
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * side * px - 0.5
    to_square = cv2.getPerspectiveTransform(corners.astype(np.float32), square.astype(np.float32))
    cells = cv2.warpPerspective(image, to_square, (side * px, side * px)).reshape(side, px, side, px)
    cells = cells[:, inset:-inset, :, inset:-inset]
    stated = cv2.aruco.generateImageMarker(TAGS, number, side)[:, None, :, None]
    return bool((np.abs(cells - stated.astype(int)) < 26).all())
