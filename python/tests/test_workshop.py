"""Python makes the same files as the program, byte for byte, and other programs can read them."""

import pickle
import subprocess

import numpy
import pytest

import deltille

ALL = [
    (lambda: deltille.Board(4, 5, edge_mm=20, note="Lab 3"), "board --rows 4 --cols 5 --edge 20mm --note".split() + ["Lab 3"], ["pdf"], {}),
    (lambda: deltille.Board(4, 5, edge_mm=20, mirrored=True, white="White", contour="CutContour"),
     "board --rows 4 --cols 5 --edge 20mm --mirrored --white White --contour CutContour".split(), ["pdf"], {}),
    (lambda: deltille.Checkerboard(4, 5, edge_mm=20, family="aprilTag36h11", contour="CutContour", packed=True, boards=2),
     "checkerboard --rows 4 --cols 5 --edge 20mm --family aprilTag36h11 --contour CutContour --pack --boards 2".split(), ["pdf"], {}),
    (lambda: deltille.Board(4, 5, edge_mm=20), "board --rows 4 --cols 5 --edge 20mm --pdf --laser dxf,svg --kerf 0.2mm".split(),
     ["pdf", "laser-dxf", "laser-svg"], {"kerf_mm": 0.2}),
    (lambda: deltille.Board(4, 5, edge_mm=20), "board --rows 4 --cols 5 --edge 20mm --pdf --gltf --3mf --plate 5mm --inlay 0.6mm".split(),
     ["pdf", "gltf", "3mf"], {"plate_mm": 5, "inlay_mm": 0.6}),
    (lambda: deltille.Charuco((8, 6), square_mm=25, marker_mm=18, dictionary="4x4_100", first_id=3, legacy=True, board_id=2),
     "charuco --squares 8x6 --edge 25mm --marker 18mm --dictionary 4x4_100 --first-id 3 --legacy --board-id 2".split(), ["pdf"], {}),
    (lambda: deltille.Charuco((5, 7), guide_page=True, note="a"), "charuco --squares 5x7 --guide-page --note a".split(), ["pdf"], {}),
    (lambda: deltille.AprilGrid((6, 5), tag_mm=24, gap=0.25, first_id=7, paper="A3", orientation="portrait"),
     "aprilgrid --tags 6x5 --edge 24mm --gap 0.25 --first-id 7 --paper A3 --orientation portrait".split(), ["pdf", "kalibr"], {}),
    (lambda: deltille.Circles((4, 11), asymmetric=True, spacing_mm=18, diameter_mm=12, margin_mm=8),
     "circles --circles 4x11 --asymmetric --spacing 18mm --diameter 12mm --margin 8mm".split(), ["pdf"], {}),
    (lambda: deltille.Cuboid((80, 60, 50), first_id=20, note="b"), "cuboid --size 80x60x50mm --pdf --first-id 20 --note b".split(), ["pdf"], {}),
    (lambda: deltille.Cube(edge_mm=80), "cube --edge 80mm --pdf --laser dxf --kerf 0.1mm".split(), ["pdf", "laser-dxf"], {"kerf_mm": 0.1}),
    (lambda: deltille.Octahedron(edge_mm=80, inverted=True), "octahedron --edge 80mm --invert --pdf".split(), ["pdf"], {}),
    (lambda: deltille.Cube(edge_mm=80, tags=False, inverted=True), "cube --edge 80mm --untagged --invert --pdf".split(), ["pdf"], {}),
    (lambda: deltille.Solid("../prism.obj", tiles=6, square_family="aprilTag25h9", first_square_id=4),
     "solid --mesh ../prism.obj --tiles 6 --pdf --square-family aprilTag25h9 --first-square-id 4".split(), ["pdf"], {}),
]

PRISM = """v 0 0 0
v 120 0 0
v 60 103.923048454 0
v 0 0 150
v 120 0 150
v 60 103.923048454 150
f 1 3 2
f 4 5 6
f 1 2 5 4
f 2 3 6 5
f 3 1 4 6
"""


@pytest.mark.parametrize("make, arguments, formats, sizes", ALL, ids=lambda value: value[0] if isinstance(value, list) else "")
def test_files_are_those_of_the_program(make, arguments, formats, sizes, program, tmp_path, monkeypatch):
    (tmp_path / "prism.obj").write_text(PRISM)
    (tmp_path / "own").mkdir()
    monkeypatch.chdir(tmp_path / "own")
    own = make()
    written = own.save(".", formats, **sizes)
    done = subprocess.run([program, *arguments, "-o", "../its"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    its = {path.name: path.read_bytes() for path in (tmp_path / "its").iterdir()}
    assert {path.name: path.read_bytes() for path in written} == its
    assert pickle.loads(pickle.dumps(own)) == own
    if own.name != "aprilgrid" or "kalibr" not in formats:
        for path in written[1:]:
            assert own.verify(path), path


def page(target, dpi=200):
    """Returns the first page in grey, decoded by OpenCV."""
    cv2 = pytest.importorskip("cv2")
    png = next(iter(target.files("png", dpi=dpi).values()))
    return cv2, cv2.imdecode(numpy.frombuffer(png, numpy.uint8), cv2.IMREAD_GRAYSCALE)


def plane_error_mm(cv2, pixels, places):
    """Returns the largest error, mm, of points mapped from pixels by the best homography."""
    mapping, _ = cv2.findHomography(numpy.float64(pixels), numpy.float64(places))
    found = cv2.perspectiveTransform(numpy.float64(pixels)[None], mapping)[0]
    return numpy.abs(found - places).max()


def test_opencv_reads_charuco_boards():
    own = deltille.Charuco((7, 5), square_mm=30, marker_mm=22, dictionary="5x5_100")
    cv2, image = page(own)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100)
    board = cv2.aruco.CharucoBoard((7, 5), 30.0, 22.0, dictionary)
    corners, ids, _, markers = cv2.aruco.CharucoDetector(board).detectBoard(image)
    assert sorted(ids.ravel()) == sorted(own.corner_ids) and len(markers) == len(own.tags)
    by_id = dict(zip(own.corner_ids, own.corners[:, :2]))
    # Both use the same frame.
    numpy.testing.assert_allclose(own.corners[numpy.argsort(own.corner_ids)], board.getChessboardCorners(), atol=1e-4)
    assert plane_error_mm(cv2, corners.reshape(-1, 2), [by_id[i] for i in ids.ravel()]) < 0.05


def test_opencv_reads_grids_of_circles():
    for size, asymmetric in (((9, 7), False), ((4, 11), True)):
        own = deltille.Circles(size, asymmetric=asymmetric, spacing_mm=18)
        cv2, image = page(own)
        kind = cv2.CALIB_CB_ASYMMETRIC_GRID if asymmetric else cv2.CALIB_CB_SYMMETRIC_GRID
        is_found, centres = cv2.findCirclesGrid(image, size, flags=kind)
        assert is_found and len(centres) == len(own)
        order = numpy.argsort(own.corner_ids)
        places = own.corners[order][:, :2]
        assert plane_error_mm(cv2, centres.reshape(-1, 2), places) < 0.1


def test_the_kalibr_file_describes_the_grid():
    yaml = deltille.AprilGrid((6, 5), tag_mm=24, gap=0.25, first_id=7, name="grid").files("kalibr")["grid.yaml"].decode()
    fields = dict(line.split("#")[0].split(":") for line in yaml.splitlines())
    assert {key: value.strip() for key, value in fields.items()} == {
        "target_type": "'aprilgrid'", "tagCols": "6", "tagRows": "5", "tagSize": "0.024", "tagSpacing": "0.25", "codeOffset": "7"}
    for other in (deltille.AprilGrid((6, 5), tag_border=1), deltille.Board(4, 5)):
        with pytest.raises(deltille.TargetError, match="Kalibr cannot read"):
            other.files("kalibr")


def test_a_kerf_grows_plates_and_shrinks_black_parts():
    board = deltille.Board(4, 5, edge_mm=20, tags=False)
    without, with_kerf = (outlines(board.files("laser-svg", kerf_mm=kerf)["board-laser.svg"].decode()) for kerf in (0, 0.2))
    assert with_kerf.keys() == without.keys() and len(with_kerf["cut"]) == 1
    by = numpy.ptp(with_kerf["cut"][0], axis=0) - numpy.ptp(without["cut"][0], axis=0)
    numpy.testing.assert_allclose(by, 0.2, atol=1e-4)
    # A triangle offset inwards by d stays similar: its sides become shorter by 2 √3 d.
    ratio = (1 - 2 * 3**0.5 * 0.1 / 20) ** 2
    for before, after in zip(without["engrave"], with_kerf["engrave"]):
        assert abs(area(after) / area(before) - ratio) < 1e-4


def outlines(svg):
    """Returns the closed outlines by kind: cut or engrave."""
    import re
    import xml.etree.ElementTree as tree

    found = {}
    for element in tree.fromstring(svg).iter():
        if element.tag.endswith("path"):
            parts = [part for part in re.split("[MZ]", element.get("d")) if part.strip()]
            numbers = [numpy.float64(re.findall(r"-?[\d.]+", part)).reshape(-1, 2) for part in parts]
            kind = "cut" if "cut" in str(element.attrib) else "engrave"
            found.setdefault(kind, []).extend(numbers)
    return found


def area(points):
    x, y = points.T
    return abs(numpy.dot(x, numpy.roll(y, 1)) - numpy.dot(y, numpy.roll(x, 1))) / 2


def test_unused_or_invalid_keywords_are_rejected():
    board, cube = deltille.Board(4, 5), deltille.Cube(edge_mm=80)
    two = deltille.Board(4, 5, two_sided_mm=3)
    cases = [
        (lambda: board.files("pdf", kerf_mm=0.1), "kerf_mm needs"),
        (lambda: board.files("gltf", inlay_mm=0.1), "inlay_mm needs 3mf"),
        (lambda: board.files("pdf", plate_mm=3), "plate_mm needs"),
        (lambda: board.save("none", texture_px=512), "texture_px needs"),
        (lambda: cube.files("gltf", plate_mm=3), "plate_mm applies to boards only"),
        (lambda: two.files("gltf", plate_mm=3), "plate_mm conflicts with two_sided_mm"),
        (lambda: board.files("laser-dxf", kerf_mm=30), "kerf"),
        (lambda: board.files("laser-dxf", kerf_mm=float("nan")), "kerf"),
        (lambda: deltille.Board(4, 5, note="ü"), "note: "),
        (lambda: deltille.Board(4, 5, white="Black"), "white: "),
        (lambda: deltille.Board(4, 5, white="W", contour="W"), "contour: "),
        (lambda: deltille.Board(4, 5, mirrored=True, two_sided_mm=3), "two_sided_mm: "),
        (lambda: deltille.Board(4, 5, mirrored=True, guide_page=True), "guide_page: "),
        (lambda: deltille.Charuco((2, 5)), "squares: "),
        (lambda: deltille.Charuco((5, 5), dictionary="9x9"), "dictionary: "),
        (lambda: deltille.Charuco((5, 5), marker_mm=40), "marker_mm: "),
        (lambda: deltille.Charuco((5, -5)), "squares: expected a whole number"),
        (lambda: deltille.Charuco((5, 5), dictionary="4x4_50", first_id=45), "first_id: "),
        (lambda: deltille.AprilGrid((1, 5)), "tags: "),
        (lambda: deltille.AprilGrid((5, 5), gap=2), "gap: "),
        (lambda: deltille.Circles((5, 5), diameter_mm=19), "diameter_mm: "),
        (lambda: deltille.Circles((5, 5), spacing_mm=float("inf")), "spacing_mm: "),
        (lambda: deltille.Cuboid((0, 100, 200)), "size_mm: "),
        (lambda: deltille.Cuboid((float("nan"), 1, 2)), ""),
    ]
    for wrong, words in cases:
        with pytest.raises(deltille.TargetError) as raised:
            wrong()
        text = str(raised.value)
        assert words in text and "::" not in text and "\n" not in text, text
    for wrong in (lambda: deltille.Cuboid((1, 2)), lambda: deltille.Charuco(5), lambda: deltille.Circles((5, 5, 5))):
        with pytest.raises((TypeError, ValueError)):
            wrong()


def test_shared_ids_are_rejected():
    board = deltille.Board(4, 5)
    with pytest.raises(deltille.TargetError, match="first_id"):
        board.check_beside(deltille.Icosahedron())
    board.check_beside(deltille.Icosahedron(first_id=50, board_id=7))


def test_recommended_correction_follows_natural_images():
    family = deltille.Family.load("delTag25h7")
    natural, coins = family.natural_false_positive_rates(), family.false_positive_rates()
    assert natural.shape == coins.shape == (family.correctable + 1,)
    assert (numpy.diff(natural) > 0).all() and (numpy.diff(coins) > 0).all() and (coins > natural).all()
    # Random cells: the fraction of words within t cells of a code, in any rotation.
    within = numpy.cumsum([1, 25, 25 * 24 // 2, 25 * 24 * 23 // 6])
    numpy.testing.assert_allclose(coins, 3 * len(family) * within / 2**25, rtol=1e-9)
    limit = family.recommended_correction()
    assert natural[limit] <= 1e-4 and (limit == family.correctable or natural[limit + 1] > 1e-4)
    assert family.recommended_correction(0.0) is None and family.recommended_correction(1.0) == family.correctable
    square = deltille.Family.load("aprilTag36h11")
    assert square.natural_false_positive_rates() is None and square.recommended_correction() is None
    with pytest.raises(deltille.FamilyError, match="accepted"):
        family.recommended_correction(2.0)
