"""Undistorted and rectified images are those of the programs, and agree with OpenCV; corners are drawn over images."""

import pickle
import subprocess

import numpy
import pytest

import deltille

Image = pytest.importorskip("PIL.Image")


def saved(array, path):
    Image.fromarray(array).save(path)
    return path


def test_images_and_cameras_are_those_of_the_program(camera, pictures, program, tmp_path):
    camera.save(tmp_path / "wide.yaml")
    grey = saved(pictures[0], tmp_path / "grey.png")
    colours = saved(numpy.dstack([pictures[0], pictures[1], pictures[2]]), tmp_path / "colours.png")
    for keywords, options in [({}, []), ({"field": "whole", "size_px": (640, 480)}, "--field whole --size 640x480".split()),
                              ({"focal_px": 900}, ["--field", "900px"]), ({"field": numpy.pi / 3}, ["--field", "60deg"])]:
        done = subprocess.run([program, "undistort", grey, colours, "--camera", tmp_path / "wide.yaml", "-o", tmp_path / "out",
                               *options], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        view = deltille.undistort(camera, **keywords)
        for path in (grey, colours):
            its = numpy.array(Image.open(tmp_path / f"out/{path.stem}-undistorted.png"))
            assert numpy.array_equal(view.apply(numpy.array(Image.open(path))), its)
        assert view.camera == deltille.Camera.load(tmp_path / "out/wide-undistorted.yaml")


def test_dtype_channels_and_layout_are_kept(camera, pictures):
    view = deltille.undistort(camera)
    grey = view.apply(pictures[0])
    deep = view.apply(pictures[0].astype(numpy.uint16) * 257)
    assert grey.dtype == numpy.uint8 and deep.dtype == numpy.uint16 and abs(deep / 257 - grey).max() < 1
    for dtype in (numpy.float32, numpy.float64):
        real = view.apply(pictures[0].astype(dtype))
        assert real.dtype == dtype and abs(real.clip(0, 255) - grey).max() <= 0.5
    four = numpy.repeat(pictures[0][..., None], 4, axis=2)
    assert (view.apply(four[..., ::-1]) == grey[..., None]).all() and view.apply(four[..., :1]).shape == (960, 1280, 1)
    assert pickle.loads(pickle.dumps(view)) == view != deltille.undistort(camera, field="whole")
    for wrong in (pictures[0][:-1], four[..., [0] * 5], pictures[0].astype(int), [[1]]):
        with pytest.raises(deltille.ImageError):
            view.apply(wrong)
    for wrong in ({"field": "all"}, {"field": -1.0}, {"field": 1.0, "focal_px": 800}, {"size_px": (1, 5)}):
        with pytest.raises(deltille.ArgumentError):
            deltille.undistort(camera, **wrong)
    with pytest.raises(deltille.CameraError, match="180"):
        deltille.undistort(camera, field=4.0)


def test_maps_are_those_of_opencv(camera):
    cv2 = pytest.importorskip("cv2")
    view = deltille.undistort(camera, focal_px=1000)
    size = (camera.width, camera.height)
    x, y = cv2.initUndistortRectifyMap(camera.K, camera.dist, numpy.eye(3), view.camera.K, size, cv2.CV_32FC1)
    inside = view.map_x >= 0
    assert inside.mean() > 0.8
    numpy.testing.assert_allclose(view.map_x[inside], x[inside], atol=1e-3)
    numpy.testing.assert_allclose(view.map_y[inside], y[inside], atol=1e-3)


def test_rectified_pairs_are_those_of_the_program(board, camera, program, tmp_path):
    right_from_left = deltille.Pose(rvec=(0.02, 0.1, -0.03), tvec=(-80, 3, 10))
    detector = deltille.Detector(board)
    seen = {"left": [], "right": []}
    middle = board.corners.mean(axis=0)
    for index in range(8):
        eye = middle + [40 * (index % 3) - 40, 50 * (index % 4) - 60, 400]
        left = deltille.Pose.looking_at(eye, middle)
        for side, pose in (("left", left), ("right", right_from_left @ left)):
            picture, _ = deltille.render(board, camera, pose, seed=index)
            (tmp_path / side).mkdir(exist_ok=True)
            saved(picture, tmp_path / side / f"{index}.png")
            seen[side].append(detector.detect(picture, name=f"{index}.png"))
    rig = deltille.rig(seen, board)
    rig.save(tmp_path / "rig.json")
    done = subprocess.run([program, "rectify", tmp_path / "rig.json", "--pair", "left,right", "--first", tmp_path / "left/0.png",
                           "--second", tmp_path / "right/0.png", "-o", tmp_path / "out"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    # The rig as it was written, with the digits of the file.
    pair = deltille.rectify(deltille.Rig.load(tmp_path / "rig.json"), ("left", "right"))
    images = pair.apply(*[numpy.array(Image.open(tmp_path / side / "0.png")) for side in ("left", "right")])
    for side, image in zip(("left", "right"), images):
        assert numpy.array_equal(image, numpy.array(Image.open(tmp_path / f"out/{side}/0-rectified.png")))
    left, right = [detector.detect(image) for image in images]
    _, own, its = numpy.intersect1d(left.ids, right.ids, return_indices=True)
    assert len(own) > 40 and abs(left.pixels[own, 1] - right.pixels[its, 1]).max() < 0.1
    x, y = left.pixels[own[0]]
    point = pair.Q @ [x, y, x - right.pixels[its[0], 0], 1]
    assert point[2] / point[3] == pytest.approx(400, rel=0.15)
    assert pair.baseline_mm[0] == pytest.approx(80.7, abs=1) and pair.baseline_mm[1] == 0
    assert pickle.loads(pickle.dumps(pair)) == pair and pair.views[0].camera == pair.views[1].camera
    with pytest.raises(deltille.CalibrationError, match="left, right"):
        deltille.rectify(rig, ("left", "top"))


def test_drawings_have_the_size_of_the_image_or_are_those_of_the_program(board, pictures, detections, program, tmp_path):
    drawn = detections[0].draw(pictures[0])
    assert drawn.shape == (*pictures[0].shape, 3) and drawn.dtype == numpy.uint8
    is_coloured = (drawn.max(axis=2).astype(int) - drawn.min(axis=2)) > 60
    x, y = detections[0].pixels.round().astype(int).T
    near = numpy.zeros_like(is_coloured)
    for dx in range(-8, 9):
        near[y.clip(8, 951) + dx, x] = True
    assert is_coloured[near].mean() > 0.1
    assert abs(drawn.astype(int) - detections[0].draw(pictures[0] / 255.0)).max() <= 1
    path = saved(pictures[0], tmp_path / "one.png")
    board.save(tmp_path / "board", formats=[])
    command = [program, "detect", path, "--target", tmp_path / "board/desk.json", "--overlay", "-o", tmp_path]
    assert subprocess.run(command, capture_output=True).returncode == 0
    its = numpy.array(Image.open(tmp_path / "one.overlay.jpg")).astype(int)
    legible = deltille.Detector(board).detect(pictures[0]).draw(pictures[0], legible=True)
    assert legible.shape == its.shape and abs(legible - its).mean() < 4
    with pytest.raises(deltille.ImageError, match="1280 × 960"):
        detections[0].draw(pictures[0][:100])
