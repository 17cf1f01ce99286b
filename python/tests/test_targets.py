import io
import json
import pickle

import numpy
import pytest

import deltille


def test_a_board_has_corners_and_tags_in_mm():
    board = deltille.Board(10, 11, edge_mm=20)
    assert isinstance(board, deltille.Target) and len(board) == 110
    assert board.corners.shape == (110, 3) and board.corners.dtype == numpy.float64
    assert board.corner_ids.dtype == numpy.int64 and len(set(board.corner_ids)) == 110
    x = (board.corner_cols + board.corner_rows / 2) * 20
    y = board.corner_rows * 20 * 3**0.5 / 2
    numpy.testing.assert_allclose(board.corners, numpy.stack([x, y, 0 * x], 1), atol=1e-9)
    assert len(board.tags) == len(board.tag_ids) == 11
    assert board.tag_centres.shape == (11, 3) and (board.tag_centres[:, 2] == 0).all()
    assert (board.corner_panels == 0).all() and board.panels == [0]
    assert board.family.name == "delTag25h7"


def test_boards_accept_the_options_of_the_program(tmp_path):
    assert deltille.Board(10, 11, paper="A3").corners[-1, 0] > 200
    assert deltille.Board(10, 11, tags=False).tags == []
    assert deltille.Board(5, 6, family="d36h9", first_id=100).tag_ids.min() == 100
    assert deltille.Checkerboard(8, 11, edge_mm=20).tags == []
    assert deltille.Checkerboard(8, 11, family="aprilTag36h11", tags_in="white").tags
    assert deltille.Board(4, 5, boards=3).panels == [0, 1, 2]


def test_a_logo_is_a_file_or_text_and_stored_in_the_target_file(tmp_path):
    svg = '<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 9H20L10 0Z"/></svg>'
    (tmp_path / "logo.svg").write_text(svg)
    board = deltille.Board(5, 6, edge_mm=20, logo=tmp_path / "logo.svg", logo_height_mm=6)
    assert board == deltille.Board(5, 6, edge_mm=20, logo=svg, logo_height_mm=6)
    assert json.loads(board.to_json())["sheets"][0]["logos"][0]["height_mm"] == 6
    assert "logo" in json.loads(deltille.Icosahedron(logo=svg).to_json())
    with pytest.raises(deltille.TargetError, match="`text` cannot be printed: convert it to paths"):
        deltille.Board(5, 6, logo='<svg xmlns="http://www.w3.org/2000/svg"><text>x</text></svg>')
    with pytest.raises(deltille.TargetError, match="logo_height_mm"):
        deltille.Board(5, 6, logo=svg, logo_height_mm=90)
    with pytest.raises(deltille.MissingFileError):
        deltille.Board(5, 6, logo=tmp_path / "none.svg")


def test_a_target_is_read_back(tmp_path, board):
    paths = board.save(tmp_path / "made", ["pdf", "svg", "png", "dsc"])
    assert [path.name for path in paths] == ["desk.json", "desk.pdf", "desk.svg", "desk.png", "desk.dsc"]
    again = deltille.Target.load(tmp_path / "made/desk.json")
    assert again == board and again.to_json() == board.to_json()
    assert deltille.Target.from_json(board.to_json()) == board
    assert pickle.loads(pickle.dumps(board)) == board
    for path in paths[1:]:
        verdict = board.verify(path)
        assert verdict and verdict.passed and not verdict.findings, str(verdict)
    assert board.save(tmp_path / "made") == paths[:2], "files of one's own are replaced"
    (tmp_path / "made/desk.pdf").write_bytes(b"something else")
    with pytest.raises(deltille.FileError, match="would be lost"):
        board.save(tmp_path / "made")
    board.save(tmp_path / "made", overwrite=True)


def test_the_description_of_another_board_is_kept(tmp_path, board):
    board.save(tmp_path)
    larger = deltille.Board(7, 8, edge_mm=25, name="desk")
    with pytest.raises(deltille.FileError, match=r"edges of 20 mm\); without it, .* or set `overwrite`"):
        larger.save(tmp_path)
    assert deltille.Target.load(tmp_path / "desk.json") == board
    larger.save(tmp_path, overwrite=True)
    assert deltille.Target.load(tmp_path / "desk.json") == larger


def test_prints_are_verified_in_memory(board):
    assert board.pdf().startswith(b"%PDF")
    assert board.svg().lstrip().startswith("<")
    assert board.verify()
    assert board.verify(board.pdf())
    wrong = deltille.Board(7, 8, edge_mm=20, first_id=50, name="desk")
    verdict = wrong.verify(board.pdf())
    assert not verdict and verdict.findings
    with pytest.raises(deltille.VerifyError):
        board.verify(b"nothing", name="desk.txt")


def test_solids_are_meshes_too(tmp_path, root):
    solid = deltille.Icosahedron(edge_mm=120)
    assert len(solid.panels) == 20 and solid.corners.shape[1] == 3
    assert numpy.ptp(solid.corners[:, 2]) > 100
    files = solid.save(tmp_path, ["gltf", "stl"])
    assert files[1].read_bytes().startswith(b"glTF")
    assert solid.verify(files[1])
    parts = {"icosahedron.obj", "icosahedron.mtl", "icosahedron-texture.png"}
    assert solid.files("obj").keys() == parts
    for format, file in {"sdf": "icosahedron.sdf", "urdf": "icosahedron.urdf", "mjcf": "icosahedron.xml"}.items():
        assert solid.files(format, texture_px=2048).keys() == parts | {file}
    split = solid.files("mjcf", texture_px=1024, textures=4)
    numbered = {f"icosahedron-{part}" for i in range(1, 5) for part in (f"{i}.obj", f"texture-{i}.png")}
    assert split.keys() == numbered | {"icosahedron.xml", "icosahedron.obj", "icosahedron.mtl"}
    solid.save(tmp_path, ["usd"], texture_px=1024, textures=4)
    assert solid.verify(tmp_path / "icosahedron.usda")
    board = deltille.Board(5, 6, edge_mm=30.0, name="desk")
    board.save(tmp_path, ["usd"], texture_px=1024)
    assert board.verify(tmp_path / "desk.usda")
    (tmp_path / "part.obj").write_bytes(deltille.Tetrahedron().files("obj")["tetrahedron.obj"])
    part = deltille.Solid(tmp_path / "part.obj", name="part")
    assert len(part.panels) == 4
    cube = deltille.Cube(edge_mm=80)
    assert len(cube.panels) == 6 and cube.family.name == "aprilTag36h11" and cube.verify()
    assert deltille.Octahedron(skeleton=True).files("skeleton")
    with pytest.raises(deltille.TargetError, match="skeleton=True"):
        deltille.Octahedron(wall_mm=3)


def test_notebooks_show_a_preview_of_a_target(board):
    html = board._repr_html_()
    assert "<svg" in html and html.endswith("</div>")
    xml = html[html.index("<svg") : html.rindex("</div>")]
    import xml.etree.ElementTree as tree

    tree.parse(io.StringIO(xml))


def test_calibration_can_measure_the_target(detections, board, tmp_path):
    found = deltille.calibrate(detections, board, measure_target=True)
    measured = found.measured_target
    assert measured.is_measured and not board.is_measured
    off = numpy.abs(measured.corners - board.corners)
    assert 0 < off.max() < 0.1


def test_solids_fit_their_paper():
    one, two = (deltille.Octahedron(paper="A4", pages=pages) for pages in (None, 2))
    assert two.corners.max() > 1.2 * one.corners.max()
    with pytest.raises(deltille.TargetError, match="pages"):
        deltille.Icosahedron(edge_mm=150, paper="A4", pages=3)
