"""Arrays of any layout give the same corners, and invalid arrays raise a clear exception."""

import gc
import itertools
import sys

import numpy
import pytest

import deltille


@pytest.fixture(scope="module")
def detector(board):
    return deltille.Detector(board)


@pytest.fixture(scope="module")
def picture(pictures):
    return pictures[0]


def padded(picture):
    wide = numpy.zeros((picture.shape[0], picture.shape[1] + 77), picture.dtype)
    wide[:, 13 : 13 + picture.shape[1]] = picture
    return wide[:, 13 : 13 + picture.shape[1]]


def strided(picture):
    wide = numpy.zeros((picture.shape[0] * 2, picture.shape[1] * 3), picture.dtype)
    wide[::2, ::3] = picture
    return wide[::2, ::3]


def read_only(picture):
    picture = picture.copy()
    picture.flags.writeable = False
    return picture


def unaligned(picture):
    memory = numpy.zeros(picture.nbytes + 1, numpy.uint8)
    memory[1:] = picture.reshape(-1).view(numpy.uint8)
    return memory[1:].view(picture.dtype).reshape(picture.shape)


LAYOUTS = {
    "as it is": lambda picture: picture,
    "a view": padded,
    "every second row and third column": strided,
    "transposed": lambda picture: numpy.ascontiguousarray(picture.T).T,
    "Fortran order": numpy.asfortranarray,
    "negative rows": lambda picture: numpy.ascontiguousarray(picture[::-1])[::-1],
    "negative columns": lambda picture: numpy.ascontiguousarray(picture[:, ::-1])[:, ::-1],
    "read-only": read_only,
    "unaligned": unaligned,
    "another byte order": lambda picture: picture.astype(picture.dtype.newbyteorder()),
    "a subclass": lambda picture: picture.view(numpy.ma.MaskedArray),
}


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32"])
def test_every_layout_gives_the_same_corners(detector, board, camera, layout, dtype):
    picture, _ = deltille.render(board, camera, eye=(0, -50, 420), dtype=dtype)
    expected = detector.detect(picture)
    assert len(expected) == 56
    given = LAYOUTS[layout](picture)
    before, count = given.copy(), sys.getrefcount(given)
    found = detector.detect(given)
    assert (found.pixels == expected.pixels).all() and (found.covariances == expected.covariances).all()
    assert sys.getrefcount(given) == count
    assert (given == before).all()


def laid_out(picture, order, steps):
    """A copy whose axes are in this order in memory, and whose elements are these steps apart."""
    sizes = [abs(step) * size + 1 for step, size in zip(steps, picture.shape, strict=True)]
    memory = numpy.zeros([sizes[axis] for axis in order], picture.dtype)
    view = memory.transpose(numpy.argsort(order))[tuple(slice(None, None, step) for step in steps)]
    view = view[tuple(slice(size) for size in picture.shape)]
    view[...] = picture
    return view


@pytest.fixture(scope="module")
def colours(picture):
    tint = numpy.random.default_rng(1).integers(0, 20, (*picture.shape, 3))
    return numpy.clip(picture[..., None].astype(int) - tint, 0, 255).astype(numpy.uint8)


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
@pytest.mark.parametrize("steps", [(1, 1, 1), (1, 1, -1), (-1, 1, 1), (1, -1, 1), (2, 1, 1), (1, 2, 1), (3, -2, -2)])
def test_every_layout_of_colours_gives_the_same_corners(detector, colours, order, steps):
    expected = detector.detect(colours)
    assert len(expected) > 50
    given = laid_out(colours, order, steps)
    assert (given == colours).all()
    found = detector.detect(given)
    assert (found.pixels == expected.pixels).all() and (found.covariances == expected.covariances).all()


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32", "float64"])
@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
@pytest.mark.parametrize("steps", [(-1, 1), (1, -1), (1, 2), (-2, -3)])
def test_every_layout_of_grey_values_gives_the_same_corners(detector, picture, dtype, order, steps):
    full_scale = {"uint8": 1, "uint16": 257, "float32": 1 / 255, "float64": 1 / 255}[dtype]
    grey = (picture.astype(float) * full_scale).astype(dtype)
    expected, found = detector.detect(grey), detector.detect(laid_out(grey, order, steps))
    assert len(expected) > 50
    assert (found.pixels == expected.pixels).all() and (found.covariances == expected.covariances).all()


def test_colours_are_converted_to_grey_as_by_the_program(detector, colours, tmp_path):
    cv2 = pytest.importorskip("cv2")
    cv2.imwrite(str(tmp_path / "colours.png"), colours[..., ::-1])
    expected = detector.detect_file(tmp_path / "colours.png").pixels
    assert (detector.detect(colours).pixels == expected).all()
    assert (detector.detect(read_only(colours)).pixels == expected).all()


@pytest.mark.parametrize("at", [(0, 0), (239, 100), (-1, -1)])
@pytest.mark.parametrize("value", [-1e-7, 1.0000001, numpy.nan, numpy.inf])
def test_a_single_float_outside_the_range_is_reported(detector, at, value):
    picture = numpy.full((480, 640), 0.5, numpy.float32)
    picture[at] = value
    with pytest.raises(deltille.ImageError, match="float images range from 0"):
        detector.detect(picture.T)
    with pytest.raises(deltille.ImageError, match="float images range from 0"):
        detector.detect(picture)


def test_a_view_is_detected_without_a_copy(detector, picture):
    """A borrowed image is unchanged during detection, and released afterwards."""
    whole = numpy.tile(picture, (1, 2)).copy()
    left = whole[:, : picture.shape[1]]
    assert (detector.detect(left).pixels == detector.detect(picture).pixels).all()
    count = sys.getrefcount(whole)
    del left
    gc.collect()
    assert sys.getrefcount(whole) == count - 1


WRONG = {
    "empty": numpy.zeros((0, 0), numpy.uint8),
    "no rows": numpy.zeros((0, 640), numpy.uint8),
    "no columns of colours": numpy.zeros((480, 0, 3), numpy.uint8),
    "one dimension": numpy.zeros(100, numpy.uint8),
    "no dimension": numpy.uint8(3),
    "four channels": numpy.zeros((480, 640, 4), numpy.uint8),
    "four dimensions": numpy.zeros((1, 480, 640, 3), numpy.uint8),
    "signed": numpy.zeros((480, 640), numpy.int8),
    "int64": numpy.zeros((480, 640), numpy.int64),
    "bool": numpy.zeros((480, 640), bool),
    "float64 to 255": numpy.full((480, 640), 255.0),
    "float16": numpy.zeros((480, 640), numpy.float16),
    "float colours": numpy.zeros((480, 640, 3), numpy.float32),
    "floats to 255": numpy.full((480, 640), 255, numpy.float32),
    "not a number": numpy.full((480, 640), numpy.nan, numpy.float32),
    "objects": numpy.zeros((480, 640), object),
    "text": numpy.full((480, 640), "a"),
    "dates": numpy.zeros((480, 640), "datetime64[s]"),
    "records": numpy.zeros((480, 640), [("a", "u1")]),
    "a list": [[0, 1], [1, 0]],
    "nothing": None,
    "bytes": b"abc",
    "huge": numpy.lib.stride_tricks.as_strided(numpy.zeros(1, numpy.uint8), (10**6, 10**6), (0, 0)),
    "more than there is": numpy.lib.stride_tricks.as_strided(numpy.zeros(1, numpy.uint8), (2**40, 2**20), (0, 0)),
}


@pytest.mark.parametrize("what", WRONG)
def test_invalid_images_are_rejected(detector, what):
    with pytest.raises(deltille.ImageError) as refused:
        detector.detect(WRONG[what])
    assert "\n" not in str(refused.value) and "`" not in str(refused.value)


def test_small_and_large_images(detector):
    for shape in [(1, 1), (1, 5000), (5000, 1), (2, 3), (24, 24)]:
        assert len(detector.detect(numpy.zeros(shape, numpy.uint8))) == 0
    few = deltille.Detector(detector.targets, max_pixels=1000)
    with pytest.raises(deltille.ImageError, match="max_pixels"):
        few.detect(numpy.zeros((40, 40), numpy.uint8))
