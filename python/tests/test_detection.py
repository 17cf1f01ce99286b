import json
import os
import pickle
import subprocess
from pathlib import Path

import numpy
import pytest

import deltille


def of_program(program, folder, pictures, *options):
    """Detections of the program."""
    command = [program, "detect", *map(str, pictures), *options, "-o", str(folder), "--format", "json"]
    subprocess.run(command, check=True, capture_output=True)
    return [(folder / f"{picture.stem}.json").read_text() for picture in pictures]


@pytest.mark.parametrize(
    ("name", "grid", "rows", "cols"),
    [("robot-hand-0108.png", "deltille", 10, 11), ("fisheye-0200.png", "checker", 8, 11)],
)
def test_corners_equal_those_of_the_program_bit_by_bit(program, root, tmp_path, name, grid, rows, cols):
    photograph = root / "tests/photographs" / name
    [text] = of_program(program, tmp_path, [photograph], "--grid", grid, "--rows", str(rows), "--cols", str(cols))
    detector = deltille.Detector(grid=grid, rows=rows, cols=cols)
    found = detector.detect_file(photograph)
    assert len(found) == rows * cols and found.error is None
    assert found.to_json() == text
    assert deltille.Detection.load(tmp_path / f"{photograph.stem}.json") == found
    assert detector.detect_bytes(photograph.read_bytes(), name=name) == found
    with pytest.raises(deltille.ImageError, match="cut.png"):
        detector.detect_bytes(photograph.read_bytes()[:5000], name="cut.png")
    # The same from an array decoded by another program.
    cv2 = pytest.importorskip("cv2")
    array = cv2.imread(str(photograph), cv2.IMREAD_UNCHANGED)
    assert (detector.detect(array).pixels == found.pixels).all()
    assert (detector.detect(numpy.repeat(array[..., None], 3, 2)).pixels == found.pixels).all()


@pytest.mark.parametrize(("folder", "grid", "rows", "cols"), [("robot-hand", "deltille", 10, 11), ("fisheye", "checker", 8, 11)])
def test_many_photographs_agree_with_the_program(program, root, tmp_path, folder, grid, rows, cols):
    shared = Path(os.environ.get("DELTILLE_DATA", root / "../shared/data"))
    here = (root / "tests/photographs").glob(f"{folder}-*.png")
    photographs = [*here, *sorted((shared / folder).glob("*.png"))[:5]]
    texts = of_program(program, tmp_path, photographs, "--grid", grid, "--rows", str(rows), "--cols", str(cols))
    detector = deltille.Detector(grid=grid, rows=rows, cols=cols)
    found = deltille.detect_many(photographs, detector, workers=2)
    assert [result.to_json() for result in found] == texts


def test_a_tracker_finds_what_a_detector_finds(root):
    detector = deltille.Detector(grid="deltille", rows=10, cols=11)
    tracker = deltille.Tracker(detector)
    photograph = detector.detect_file(root / "tests/photographs/robot-hand-0108.png")
    cv2 = pytest.importorskip("cv2")
    array = cv2.imread(str(root / "tests/photographs/robot-hand-0108.png"), cv2.IMREAD_UNCHANGED)
    for followed in (False, True, True):
        found = tracker.detect(array)
        assert tracker.has_followed is followed
        assert (abs(found.pixels - photograph.pixels) < 0.01).all()
    assert not tracker.detect(numpy.zeros_like(array)) and not tracker.has_followed
    tracker.detect(array)
    tracker.reset()
    tracker.detect(array)
    assert not tracker.has_followed
    with pytest.raises(deltille.ImageError):
        tracker.detect(numpy.zeros(3))


def test_a_detection_has_arrays(detections, board):
    found = detections[0]
    assert len(found) == 56 and not found.mirrored
    assert found.pixels.shape == (56, 2) and found.object_points.shape == (56, 3)
    assert found.covariances.shape == (56, 2, 2) and (found.covariances[:, 0, 0] > 0).all()
    order = numpy.argsort(board.corner_ids)
    numpy.testing.assert_array_equal(found.object_points, board.corners[order][found.ids])
    assert (found.rows == board.corner_rows[order][found.ids]).all()
    assert (found.cols == board.corner_cols[order][found.ids]).all()
    assert (found.panels == 0).all() and (found.grid_indices == 0).all()
    [grid] = found.grids
    assert (grid.pixels == found.pixels).all() and grid.panel == 0 and grid.kind == "deltille"
    assert {tag.id for tag in found.tags} <= set(board.tag_ids.tolist())
    assert found.why is None and found.reasons == []
    assert found.tone["used"] in (True, False) and "um" in found.ink
    assert (found.width, found.height) == (1280, 960)
    again = pickle.loads(pickle.dumps(found))
    assert again == found and (again.object_points == found.object_points).all()
    assert "circle" in found._repr_html_()


def test_an_empty_image_gives_the_reason(board):
    detector = deltille.Detector(board)
    found = detector.detect(numpy.zeros((480, 640), numpy.uint8))
    assert len(found) == 0 and found.pixels.shape == (0, 2) and found.object_points.shape == (0, 3)
    assert found.covariances.shape == (0, 2, 2)
    assert found.why.kind == "too_dark" and found.why.figures["brightest"] == 0 and found.why.grid is None
    assert found.why.fits is None
    assert str(found.why) == found.why.sentence and "dark" in found.why.sentence
    assert "dark" in found._repr_html_()
    assert found.to_opencv()[0].shape == (0, 3)


def test_unlabelled_corners_are_marked(pictures):
    found = deltille.Detector(grid="deltille").detect(pictures[0])
    assert (found.ids == -1).all() and numpy.isnan(found.object_points).all() and (found.panels == -1).all()


def test_several_targets_are_distinguished(camera):
    front = deltille.Board(5, 6, name="front")
    back = deltille.Board(5, 6, name="back", first_id=50)
    picture, _ = deltille.render(back, camera, eye=(60, -40, 300))
    found = deltille.Detector([front, back]).detect(picture)
    assert [grid.target for grid in found.grids] == ["back"]
    assert deltille.Detector(front).detect(picture).why.fits == {"first_id": 50}
    assert not numpy.isnan(found.object_points).any()
    with pytest.raises(deltille.DetectionError):
        deltille.Detector([front, deltille.Board(5, 6, name="other")])


def test_detections_survive_writing_and_reading(detections, board, tmp_path):
    path = detections[0].save(tmp_path / "a.json")
    assert json.loads(path.read_text())["schema"] == "deltille/detection/1"
    again = deltille.Detection.load(path, target=board)
    assert (again.object_points == detections[0].object_points).all()
    assert detections[0].save(tmp_path / "a.csv", "csv").read_text().count("\n") == 57
    with pytest.raises(deltille.FileError, match="a.csv"):
        deltille.Detection.load(tmp_path / "a.csv")
    with pytest.raises(deltille.FileError):
        deltille.Detection.load(tmp_path / "nothing.json")
    with pytest.raises(deltille.DetectionError, match="format"):
        detections[0].save(tmp_path / "a.txt", "txt")


def test_results_of_many_images_are_in_order_and_complete(board, pictures, detections, tmp_path):
    broken = tmp_path / "broken.png"
    broken.write_bytes(b"no picture")
    asked = []

    def progress(iterable, total=None):
        asked.append(total)
        yield from iterable

    given = [*pictures[:3], broken, numpy.zeros((3, 3, 3, 3)), *pictures[3:]]
    found = deltille.detect_many(given, board, workers=3, progress=progress, ink_of_all=False)
    assert asked == [len(given)]
    assert isinstance(found[3], deltille.Failure) and isinstance(found[3].error, deltille.ImageError)
    assert found[3].image == "broken.png" and not found[3] and len(found[3]) == 0
    assert isinstance(found[4], deltille.Failure)
    good = found[:3] + found[5:]
    for one, other in zip(good, detections):
        assert one.error is None and (one.pixels == other.pixels).all()
    tqdm = pytest.importorskip("tqdm")
    bar = lambda *given, **named: tqdm.tqdm(*given, **named, disable=True)  # noqa: E731
    assert len(deltille.detect_many(iter(pictures[:3]), board, progress=bar)) == 3


def test_a_detection_can_be_plotted(detections, pictures, tmp_path):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    axes = detections[0].plot(pictures[0], ids=True)
    axes.figure.savefig(tmp_path / "a.png")
    matplotlib.pyplot.close(axes.figure)


def test_detections_from_files_and_tables_are_equal(program, root, tmp_path):
    photographs = tmp_path / "photographs"
    photographs.mkdir()
    (photographs / "cut.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    for name in ["robot-hand-0108.png", "fisheye-0200.png"]:
        (photographs / name).write_bytes((root / "tests/photographs" / name).read_bytes())
    for format in ["json", "parquet"]:
        command = [program, "detect", str(photographs), "--grid", "deltille", "-o", str(tmp_path / format)]
        assert subprocess.run([*command, "--format", format], capture_output=True).returncode == 1
    texts = deltille.load_detections(tmp_path / "json")
    failure, *tables = deltille.load_detections(tmp_path / "parquet")
    assert failure.image == "cut.png" and isinstance(failure.error, deltille.ImageError)
    assert [found.image for found in tables] == [found.image for found in texts]
    for table, text in zip(tables, texts):
        assert (table.pixels == text.pixels).all() and (table.covariances == text.covariances).all()
    beside = deltille.load_detections(tmp_path / "parquet" / "corners.parquet")
    assert [found.image for found in beside] == ["cut.png", *(found.image for found in texts)]
    with pytest.raises(deltille.FileError, match="no .json or .parquet file"):
        deltille.load_detections(photographs)
