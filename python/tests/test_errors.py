import copy
import errno
import os
import pickle
import re

import numpy
import pytest

import deltille


def test_errors_are_python_exceptions_with_messages_of_the_library(tmp_path):
    cases = [
        (deltille.TargetError, ValueError, lambda: deltille.Board(1, 5), "rows"),
        (deltille.TargetError, ValueError, lambda: deltille.Board(40, 50, edge_mm=50, paper="A4"), "paper: "),
        (deltille.TargetError, ValueError, lambda: deltille.Board(4, 5, paper="B9"), ""),
        (deltille.FamilyError, ValueError, lambda: deltille.Board(4, 5, family="none"), "none"),
        (deltille.FileError, OSError, lambda: deltille.Target.load(tmp_path / "none.json"), "none.json"),
        (deltille.TargetError, ValueError, lambda: deltille.Target.from_json("{}"), "schema"),
        (deltille.DetectionError, ValueError, lambda: deltille.Detector(grid="squares"), "deltille, checker"),
        (deltille.DetectionError, ValueError, lambda: deltille.Detector(grid="checker", rows=4), "rows and cols"),
        (deltille.DetectionError, ValueError, lambda: deltille.Detector(grid="checker", tone="x"), "tone"),
        (deltille.ImageError, ValueError, lambda: deltille.Detector(grid="checker").detect_bytes(b"GIF89a", name="a.gif"), "a.gif"),
        (deltille.TargetError, ValueError, lambda: deltille.Board(4, 5).files("doc"), "doc"),
        (deltille.TargetError, ValueError, lambda: deltille.Board(4, 5).files("stl"), "solid"),
        (deltille.TargetError, ValueError, lambda: deltille.Board(4, 5).files("gltf", texture_px=0), "texture_px"),
        (deltille.TargetError, ValueError, lambda: deltille.Board(4, 5).files("gltf", texture_px=20), "texels"),
        (deltille.TargetError, ValueError, lambda: deltille.Board(4, 5).files("gltf", textures=0), "textures must be from 1 to 64"),
        (deltille.TargetError, ValueError, lambda: deltille.Board(4, 5).files("gltf", textures=2), "1 face"),
        (deltille.TargetError, ValueError, lambda: deltille.Icosahedron().files("obj", texture_px=1024), "textures"),
        (deltille.TargetError, ValueError, lambda: deltille.Board(4, 5).svg(3), "page 3"),
        (deltille.TargetError, ValueError, lambda: deltille.Board(4, 5).svg(-1), "page -1"),
        (deltille.TargetError, ValueError, lambda: deltille.Board(-1, 5), "rows: expected a whole number of at least 0, got -1"),
        (deltille.TargetError, ValueError, lambda: deltille.Icosahedron(first_id=2**40), f"first_id: {2**40} is too"),
        (deltille.CameraError, ValueError, lambda: deltille.Camera(-4, 5, 1), "width: expected"),
        (deltille.CameraError, ValueError, lambda: deltille.Camera(640, 480, float("nan")), "focal_px"),
        (deltille.CameraError, ValueError, lambda: deltille.Camera(640, 480, 500, model="radtan", distortion=[0] * 5), "radtan has at most 4"),
        (deltille.ArgumentError, ValueError, lambda: deltille.Pose(rvec=(1, 2)), "rvec: expected 3 numbers, got 2"),
        (deltille.ArgumentError, ValueError, lambda: deltille.Pose(tvec=(1, 2, float("inf"))), "tvec"),
        (deltille.ArgumentError, ValueError, lambda: deltille.Pose().apply([1, 2, 3]), "points: expected an array of N × 3, got a vector of 3"),
        (deltille.ArgumentError, ValueError, lambda: deltille.Pose.from_matrix(numpy.ones((4, 4))), "matrix: the last row"),
        (deltille.ArgumentError, ValueError, lambda: deltille.Pose.from_matrix(numpy.diag([1, 1, -1, 1])), "reflection"),
        (deltille.ArgumentError, ValueError, lambda: deltille.Camera(640, 480, 500).project([[1, 2]]), "points: expected an array of N × 3, got 1 × 2"),
        (deltille.MissingFileError, FileNotFoundError, lambda: deltille.Detector(grid="checker").detect_file(tmp_path / "a.png"), "a.png"),
        (deltille.MissingFileError, FileNotFoundError, lambda: deltille.Camera.load(tmp_path / "a.yaml"), "a.yaml"),
        (deltille.MissingFileError, FileNotFoundError, lambda: deltille.Family.load(tmp_path / "f.json"), "f.json"),
        (deltille.MissingFileError, FileNotFoundError, lambda: deltille.load_detections(tmp_path / "t.parquet"), "t.parquet"),
        (deltille.MissingFileError, FileNotFoundError, lambda: deltille.Board(4, 5).verify(tmp_path / "b.pdf"), "b.pdf"),
    ]
    for kind, base, wrong, words in cases:
        with pytest.raises(kind) as raised:
            wrong()
        assert isinstance(raised.value, deltille.Error) and isinstance(raised.value, base)
        text = str(raised.value)
        assert words in text and "::" not in text and "\n" not in text, text
        assert type(raised.value).__module__ == "deltille"


def test_a_missing_file_raises_the_error_of_the_system(tmp_path):
    with pytest.raises(FileNotFoundError) as raised:
        deltille.Target.load(tmp_path / "none.json")
    assert raised.value.errno == errno.ENOENT and raised.value.filename == str(tmp_path / "none.json")
    with pytest.raises(deltille.FileError) as raised:
        deltille.Target.load(tmp_path)
    assert not isinstance(raised.value, FileNotFoundError)


def test_file_errors_have_errno_and_survive_pickling(tmp_path):
    locked = tmp_path / "locked.json"
    locked.write_text("{}")
    cases = [
        (deltille.MissingFileError, FileNotFoundError, errno.ENOENT, tmp_path / "none.json"),
        (deltille.FolderError, IsADirectoryError, errno.EISDIR, tmp_path),
    ]
    if hasattr(os, "geteuid") and os.geteuid() != 0:
        locked.chmod(0)
        cases.append((deltille.PermissionFileError, PermissionError, errno.EACCES, locked))
    readers = [deltille.Target.load, deltille.Camera.load, deltille.Detection.load, deltille.Calibration.load, deltille.Rig.load]
    for kind, base, number, path in cases:
        # A folder is read as the description in it.
        for read in readers if kind is not deltille.FolderError else readers[1:]:
            with pytest.raises(base) as raised:
                read(path)
            found = raised.value
            for error in [found, pickle.loads(pickle.dumps(found)), copy.copy(found), copy.deepcopy(found)]:
                assert type(error) is kind and isinstance(error, deltille.FileError)
                assert (error.errno, error.strerror, error.filename) == (number, os.strerror(number), str(path)), read
                assert str(path) in str(error) and "Errno" not in str(error) and "os error" not in str(error)
    # Errors without an errno have the message of the library.
    words = deltille.FileError("a.csv: names two formats")
    assert str(pickle.loads(pickle.dumps(words))) == "a.csv: names two formats" and words.errno is None


def test_wrong_types_are_type_errors(board):
    for wrong in [lambda: deltille.Board("a", 5), lambda: deltille.Detector(3), lambda: deltille.calibrate([1]),
                  lambda: deltille.pose(None, None), lambda: deltille.Board(4, 5, nothing=3),
                  lambda: deltille.Pose() @ numpy.eye(4), lambda: deltille.compare(1, 2)]:
        with pytest.raises(TypeError):
            wrong()


def test_extreme_numbers_give_a_result_or_an_exception(board, camera):
    """Calls with extreme numbers end with an exception of this package, or with a result."""
    odd = [0.0, -1.0, 1e300, -1e300, float("nan"), float("inf"), 1e-300]
    for number in odd:
        for call in [lambda: deltille.Board(4, 5, edge_mm=number), lambda: deltille.Icosahedron(edge_mm=number),
                     lambda: deltille.Board(4, 5, tag_border=number), lambda: deltille.Board(4, 5, margin_mm=number),
                     lambda: deltille.Camera(640, 480, number), lambda: camera.project([[number] * 3]),
                     lambda: camera.unproject([[number] * 2]), lambda: board.files("png", dpi=number),
                     lambda: deltille.render(board, camera, eye=(number, 0, 300), blur_px=0.5),
                     lambda: deltille.Pose((number, 0, 0)), lambda: deltille.Detector(board, ink=number, tone=number),
                     lambda: deltille.search_family("d16h5", seconds=number if number < 1 else -1)]:
            try:
                call()
            except deltille.Error:
                pass


def test_all_public_names_have_docstrings():
    for name in deltille.__all__:
        thing = getattr(deltille, name)
        if name == "__version__":
            continue
        assert thing.__doc__, name
        if isinstance(thing, type) and thing.__module__ == "deltille" and not issubclass(thing, Exception):
            for part, member in vars(thing).items():
                if not part.startswith("_"):
                    assert member.__doc__, f"{name}.{part}"
    assert re.fullmatch(r"\d+\.\d+\.\d+", deltille.__version__)
    assert numpy.dtype("u1")


def test_a_folder_stands_for_the_only_description_in_it(tmp_path):
    with pytest.raises(deltille.FileError, match="no description of a target in this folder"):
        deltille.Target.load(tmp_path)
    board = deltille.Board(4, 5, edge_mm=20, name="desk")
    board.save(tmp_path, ["svg"])
    assert deltille.Target.load(tmp_path) == board
    deltille.Board(4, 5, edge_mm=20, name="other").save(tmp_path, ["svg"])
    with pytest.raises(deltille.FileError, match="desk.json, other.json"):
        deltille.Target.load(tmp_path)
