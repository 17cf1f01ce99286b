"""Frames of recordings: `tests/independent/recordings.py` writes the files."""

import pathlib
import warnings

import numpy as np
import pytest

import deltille

RECORDINGS = pathlib.Path(__file__).resolve().parents[2] / "tests" / "recordings"
TIMES_NS = [1_700_000_000_000_000_123, 1_700_000_000_033_366_790]
BOARD = deltille.Board(5, 6, edge_mm=30)


@pytest.mark.parametrize(("file", "topic"), [("run.bag", None), ("run.db3", None), ("run.mcap", "/camera/image")])
def test_frames_have_names_times_and_images(file, topic):
    frames = deltille.frames(RECORDINGS / file, topic=topic)
    for _ in range(2):
        found = list(frames)
        assert [frame.name for frame in found] == ["run-000000", "run-000001"]
        assert [frame.time_ns for frame in found] == TIMES_NS
        assert [frame.time for frame in found] == [time / 1e9 for time in TIMES_NS]
        assert all(frame.image.shape == (120, 160) and frame.image.dtype == np.uint8 for frame in found)
    assert [frame.name for frame in deltille.frames(RECORDINGS / file, topic=topic, every=2)] == ["run-000000"]
    for start, stop, numbers in [(0, 1, [0]), (1, None, [1]), (1, 9, [1]), (0, 0, []), (5, None, [])]:
        part = deltille.frames(RECORDINGS / file, topic=topic, start=start, stop=stop)
        assert [frame.name for frame in part] == [f"run-{number:06}" for number in numbers]


def test_frames_are_detected_like_arrays():
    frames = deltille.frames(RECORDINGS / "run.bag")
    detector, tracker = deltille.Detector(BOARD), deltille.Tracker(deltille.Detector(BOARD))
    for frame in frames:
        found = detector.detect(frame)
        assert (found.image, found.time_ns, len(found)) == (frame.name, frame.time_ns, 30)
        assert np.array_equal(found.pixels, detector.detect(frame.image).pixels)
        assert len(tracker.detect(frame, name="other")) == 30
    many = deltille.detect_many(frames, BOARD)
    assert [(found.time_ns, len(found)) for found in many] == [(time, 30) for time in TIMES_NS]


def test_problems_are_exceptions_or_warnings(tmp_path):
    with pytest.raises(deltille.ImageError, match="choose one with topic"):
        iter(deltille.frames(RECORDINGS / "run.mcap"))
    with pytest.raises(deltille.MissingFileError):
        iter(deltille.frames(tmp_path / "absent.mcap"))
    with pytest.raises(deltille.ArgumentError):
        deltille.frames(tmp_path, every=0)
    with pytest.raises(deltille.ArgumentError):
        deltille.frames(tmp_path, start=-1)
    whole = (RECORDINGS / "run.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) * 6 // 10])
    with pytest.warns(UserWarning, match="incomplete after 1 frame"):
        assert len(list(deltille.frames(tmp_path / "cut.mcap", topic="/camera/image"))) == 1
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos" / "a.png").write_bytes(b"no photograph")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        (failure,) = deltille.detect_many(deltille.frames(tmp_path / "photos"), BOARD)
    assert isinstance(failure, deltille.Failure) and failure.image == "a.png"
