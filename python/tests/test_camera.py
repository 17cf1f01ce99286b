import pickle

import numpy
import pytest

import deltille


@pytest.mark.parametrize(
    ("model", "distortion"),
    [("pinhole", [-0.1, 0.02]), ("fisheye", [0.01, -0.002]), ("eucm", [0.6, 1.1]), ("double-sphere", [0.1, 0.5]),
     ("pupil", [0.01, 0, 0, 0, 0, 0, 0, 0.5, 0.1, 0])],
)
def test_rays_and_projections_are_inverse(model, distortion, tmp_path):
    camera = deltille.Camera(1280, 960, 500, model=model, distortion=distortion)
    assert camera.model == model
    pixels = numpy.random.default_rng(1).uniform((0, 0), (1279, 959), (500, 2))
    origins, directions = camera.rays(pixels)
    numpy.testing.assert_allclose(camera.project(origins + 700 * directions), pixels, atol=1e-6)
    numpy.testing.assert_allclose(camera.unproject(pixels), directions)
    assert deltille.Camera.load(camera.save(tmp_path / "a.yaml")) == camera == pickle.loads(pickle.dumps(camera))
    if model in ("pinhole", "fisheye"):
        assert len(camera.distortion) == 4
    else:
        with pytest.raises(deltille.CameraError, match="opencv"):
            camera.distortion


def test_points_outside_the_lens_are_nan():
    camera = deltille.Camera(640, 480, 500)
    assert numpy.isnan(camera.project([[0, 0, -100]])).all()
    assert camera.project(numpy.zeros((0, 3))).shape == (0, 2)
    assert camera.project([(1, 2, 100)]).shape == (1, 2), "lists are arrays too"
    for wrong in ([[1, 2]], [[1, 2, 3, 4]]):
        with pytest.raises(deltille.Error, match="N × 3"):
            camera.project(wrong)
    with pytest.raises((TypeError, ValueError)):
        camera.project([1, 2, 3])


def test_invalid_cameras_are_rejected(tmp_path):
    for wrong in [{"focal_px": 0}, {"focal_px": float("nan")}, {"model": "x"}, {"distortion": [1] * 20}, {"width": 0}]:
        with pytest.raises(deltille.CameraError):
            deltille.Camera(**{"width": 640, "height": 480, "focal_px": 500, **wrong})
    (tmp_path / "a.yaml").write_text("nothing")
    with pytest.raises(deltille.FileError, match="a.yaml"):
        deltille.Camera.load(tmp_path / "a.yaml")
    with pytest.raises(deltille.CameraError, match="format"):
        deltille.Camera(640, 480, 500).save(tmp_path / "b", "none")


def test_one_of_several_cameras_is_named(tmp_path):
    path = tmp_path / "cameras.txt"
    path.write_text("1 PINHOLE 640 480 500 500 320 240\n2 SIMPLE_RADIAL 640 480 400 320 240 -0.1\n")
    assert deltille.Camera.load(f"{path}:2") == deltille.Camera(640, 480, 400, distortion=[-0.1])
    with pytest.raises(deltille.FileError, match="contains the cameras 1, 2"):
        deltille.Camera.load(path)


def test_poses_are_motions():
    pose = deltille.Pose((0.1, -0.2, 0.3), (10, 20, 30))
    numpy.testing.assert_allclose(pose.rvec, (0.1, -0.2, 0.3))
    again = deltille.Pose.from_matrix(pose.matrix)
    numpy.testing.assert_allclose(again.matrix, pose.matrix)
    numpy.testing.assert_allclose((pose @ pose.inverse()).matrix, numpy.eye(4), atol=1e-12)
    point = numpy.array([[1.0, 2, 3]])
    numpy.testing.assert_allclose(pose.apply(point)[0], pose.rotation @ point[0] + pose.tvec)
    numpy.testing.assert_allclose(pose.origin, pose.inverse().tvec)
    numpy.testing.assert_allclose(pickle.loads(pickle.dumps(pose)).matrix, pose.matrix)
    with pytest.raises(deltille.Error):
        deltille.Pose.from_matrix(numpy.ones((4, 4)))
    with pytest.raises(deltille.Error):
        deltille.Pose((numpy.nan, 0, 0))


def test_a_synthetic_image_has_its_truth(board, camera):
    picture, truth = deltille.render(board, camera, eye=(60, -50, 400), noise=0, blur_px=1)
    assert picture.shape == (960, 1280) and picture.dtype == numpy.uint8
    numpy.testing.assert_allclose(camera.project(truth.pose.apply(truth.object_points)), truth.pixels, atol=1e-9)
    found = deltille.Detector(board).detect(picture)
    order = numpy.argsort(truth.ids)
    off = found.pixels - truth.pixels[order][numpy.searchsorted(truth.ids[order], found.ids)]
    assert numpy.abs(off).max() < 0.05
    again, _ = deltille.render(board, camera, truth.pose, noise=0, blur_px=1)
    assert (again == picture).all()
    seeds = [deltille.render(board, camera, truth.pose, seed=seed)[0] for seed in (1, 2)]
    assert (seeds[0] != seeds[1]).any()
    for dtype in ("uint16", "float32"):
        assert deltille.render(board, camera, truth.pose, dtype=dtype)[0].dtype == dtype
    for wrong in [{"noise": -1}, {"dtype": "int8"}, {"gradient": (9, 0)}, {}]:
        with pytest.raises(deltille.TargetError):
            deltille.render(board, camera, **({"eye": (60, -50, 400)} if wrong else {}), **wrong)


def test_rendering_from_behind_warns(board, camera):
    for target, side, sign in [(board, "z > 0", 1), (deltille.Charuco((5, 7)), "z < 0", -1)]:
        middle = target.corners.mean(axis=0)
        with pytest.warns(UserWarning, match=side):
            assert not deltille.render(target, camera, eye=middle - [0, 0, sign * 400])[1]
        assert deltille.render(target, camera, eye=middle + [0, 0, sign * 400])[1]


def test_an_unnamed_image_is_named_in_the_reason_without_a_pose(board, camera):
    found = deltille.Detector(board).detect(numpy.zeros((960, 1280), numpy.uint8))
    why = deltille.pose(found, camera).why
    assert why and why[0].isalpha(), why


@pytest.mark.parametrize(
    ("model", "parameters"),
    [("SIMPLE_PINHOLE", [400, 320.5, 240.2]), ("PINHOLE", [400, 410, 320.5, 240.2]),
     ("SIMPLE_RADIAL", [400, 320.5, 240.2, -0.1]), ("RADIAL", [400, 320.5, 240.2, -0.1, 0.02]),
     ("OPENCV", [400, 410, 320.5, 240.2, -0.1, 0.02, 0.003, -0.002]),
     ("FULL_OPENCV", [400, 410, 320.5, 240.2, -0.1, 0.02, 0.003, -0.002, 0.01, 0.02, -0.01, 0.003]),
     ("SIMPLE_RADIAL_FISHEYE", [400, 320.5, 240.2, -0.05]), ("RADIAL_FISHEYE", [400, 320.5, 240.2, -0.05, 0.01]),
     ("OPENCV_FISHEYE", [400, 410, 320.5, 240.2, -0.05, 0.01, 0.002, -0.001]),
     ("EUCM", [400, 410, 320.5, 240.2, 0.6, 1.2])],
)
def test_cameras_of_colmap_image_points_as_colmap_does(model, parameters, tmp_path):
    """COLMAP has the centre of the first pixel at (0.5, 0.5)."""
    pycolmap = pytest.importorskip("pycolmap")
    original = pycolmap.Camera(model=model, width=640, height=480, params=parameters)
    file = tmp_path / "cameras.txt"
    file.write_text(f"# Camera list\n1 {model} 640 480 {' '.join(map(str, parameters))}\n")
    points = numpy.column_stack([numpy.random.default_rng(5).uniform(-0.5, 0.5, (50, 2)), numpy.ones(50)])
    expected = [original.img_from_cam(point) - 0.5 for point in points]
    numpy.testing.assert_allclose(deltille.Camera.load(file).project(points), expected, atol=1e-9)
