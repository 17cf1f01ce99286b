"""References, memory of the interpreter and memory of the process stay constant."""

import gc
import os
import tracemalloc

import numpy
import pytest

import deltille


def resident() -> int:
    """Memory of the process, bytes."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def use(board, detector, camera, picture):
    found = detector.detect(picture)
    arrays = found.pixels, found.ids, found.object_points, found.covariances, found.rows, found.tags, found.grids
    found.to_opencv()
    camera.unproject(camera.project(found.object_points + [0, 0, 500]))
    return len(arrays)


def grown(calls: int, board, camera) -> tuple[int, int]:
    """Growth of the interpreter and of the process after this number of calls, bytes."""
    small = deltille.Camera(320, 240, 280)
    picture, _ = deltille.render(board, small, eye=(70, -50, 350))
    detector = deltille.Detector(board)
    for _ in range(50):
        use(board, detector, camera, picture)
    gc.collect()
    before = resident()
    tracemalloc.start()
    for _ in range(calls):
        use(board, detector, camera, picture)
        with pytest.raises(deltille.ImageError):
            detector.detect(picture[:0])
    gc.collect()
    kept, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return kept, resident() - before


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="memory as Linux tells it")
def test_memory_stays_constant(board, camera):
    kept, resident_bytes = grown(200, board, camera)
    assert kept < 50_000 and resident_bytes < 20_000_000


@pytest.mark.long
@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="memory as Linux tells it")
def test_memory_stays_constant_over_a_hundred_thousand_calls(board, camera):
    kept, resident_bytes = grown(100_000, board, camera)
    assert kept < 100_000 and resident_bytes < 30_000_000


def test_results_outlive_their_sources(board, camera):
    picture, _ = deltille.render(board, camera, eye=(70, -50, 350))
    found = deltille.Detector(deltille.Target.from_json(board.to_json())).detect(picture)
    expected = found.pixels.copy()
    grid, array = found.grids[0], found.pixels
    del found, picture
    gc.collect()
    junk = [numpy.random.default_rng(i).random(10000) for i in range(100)]
    assert (array == expected).all() and (grid.pixels == expected).all() and len(junk) == 100
