"""OpenCV accepts our corners, and its lens models agree with ours."""

import numpy
import pytest

import deltille

cv2 = pytest.importorskip("cv2")


def test_calibrate_camera_takes_our_corners(detections, calibration, board):
    objects, pixels = deltille.to_opencv(detections)
    flags = cv2.CALIB_FIX_K3
    rms, matrix, distortion, _, _ = cv2.calibrateCamera(objects, pixels, (1280, 960), None, None, flags=flags)
    ours = deltille.calibrate(detections, board, weights="equal", loss="none")
    assert rms / 2**0.5 == pytest.approx(ours.rms_px, rel=1e-3)
    numpy.testing.assert_allclose(matrix, ours.camera.matrix, rtol=2e-4)


def test_solve_pnp_takes_our_corners(detections, camera):
    for detection in detections[:3]:
        ok, rvec, tvec = cv2.solvePnP(*detection.to_opencv(), camera.matrix, camera.distortion)
        found = deltille.pose(detection, camera).pose
        assert ok
        numpy.testing.assert_allclose(tvec.ravel(), found.tvec, atol=0.2)
        numpy.testing.assert_allclose(rvec.ravel(), found.rvec, atol=2e-3)


def test_stereo_calibrate_takes_our_corners(board, camera, detections, pictures):
    detector = deltille.Detector(board)
    right_from_left = deltille.Pose((0, 0.1, 0), (-80, 5, 0))
    right = []
    for i, detection in enumerate(detections):
        place = right_from_left @ deltille.pose(detection, camera).pose
        right.append(detector.detect(deltille.render(board, camera, place, seed=50 + i)[0]))
    points = deltille.stereo_to_opencv(detections, right)
    given = (camera.matrix, camera.distortion, camera.matrix, camera.distortion, (1280, 960))
    found = cv2.stereoCalibrate(*points, *given, flags=cv2.CALIB_FIX_INTRINSIC)
    numpy.testing.assert_allclose(found[6].ravel(), right_from_left.tvec, atol=0.5)
    with pytest.raises(deltille.DetectionError):
        deltille.stereo_to_opencv(detections, right[:3])


@pytest.mark.parametrize(
    "distortion",
    [[], [-0.1, 0.02], [-0.1, 0.02, 0.001, -0.002], [-0.1, 0.02, 0.001, -0.002, 0.01],
     [0.1, 0.02, 0.001, -0.002, 0.01, 0.3, 0.05, 0.01],
     [0.1, 0.02, 0.001, -0.002, 0.01, 0.3, 0.05, 0.01, 1e-3, 2e-3, -1e-3, 5e-4]],
)
def test_perspective_lenses_agree_with_opencv(distortion):
    camera = deltille.Camera(1280, 960, (900, 910), (630, 470), distortion=distortion)
    points = numpy.random.default_rng(1).uniform((-200, -150, 300), (200, 150, 600), (1000, 3))
    pose = deltille.Pose((0.1, -0.2, 0.3), (10, 20, 30))
    ours = camera.project(pose.apply(points))
    theirs, _ = cv2.projectPoints(points, pose.rvec, pose.tvec, camera.matrix, camera.distortion)
    numpy.testing.assert_allclose(ours, theirs[:, 0], atol=1e-9)
    back = camera.unproject(ours)
    numpy.testing.assert_allclose(numpy.linalg.norm(back, axis=1), 1)
    numpy.testing.assert_allclose(camera.project(back * 500), ours, atol=1e-6)


def test_fisheyes_agree_with_opencv():
    camera = deltille.Camera(1280, 960, (300, 310), (630, 470), model="fisheye", distortion=[0.01, -0.02, 0.003, -1e-4])
    points = numpy.random.default_rng(1).uniform((-400, -400, 50), (400, 400, 600), (1000, 3))
    theirs, _ = cv2.fisheye.projectPoints(points[:, None], numpy.zeros(3), numpy.zeros(3), camera.matrix, camera.distortion)
    numpy.testing.assert_allclose(camera.project(points), theirs[:, 0], atol=1e-9)


@pytest.mark.parametrize("count", [4, 5, 8, 12, 14])
def test_cameras_from_opencv(count, calibration):
    matrix = numpy.array([[900, 0, 630], [0, 910, 470], [0, 0, 1.0]])
    distortion = numpy.array([0.1, 0.02, 0.001, -0.002, 0.01, 0.3, 0.05, 0.01, 1e-3, 2e-3, -1e-3, 5e-4, 0, 0])[:count]
    # OpenCV returns rows or columns, depending on its version.
    for shape in [(count,), (1, count), (count, 1)]:
        camera = deltille.Camera.from_opencv(matrix, distortion.reshape(shape), (1280, 960))
        numpy.testing.assert_array_equal(camera.K, matrix)
        numpy.testing.assert_array_equal(camera.dist, distortion[:12])
    assert deltille.Camera.from_opencv(matrix, None, (1280, 960)).model == "pinhole"
    wide = deltille.Camera.from_opencv(matrix, [0.01, -0.02, 0.003, -1e-4], (1280, 960), fisheye=True)
    assert wide.model == "fisheye" and list(wide.dist) == [0.01, -0.02, 0.003, -1e-4]
    tilted = [*distortion[:12], *[0] * (13 - len(distortion[:12])), 0.1]
    for wrong, words in [(([[1, 2], [3, 4]], None, (4, 4)), "matrix"), ((numpy.ones((3, 3)), None, (4, 4)), "matrix: expected fx"),
                         ((matrix, [1, 2, 3], (4, 4)), "4, 5, 8, 12, 14 coefficients"), ((matrix, tilted, (4, 4)), "tilted")]:
        with pytest.raises(deltille.Error, match=words):
            deltille.Camera.from_opencv(*wrong)


def test_poses_of_views_are_those_of_opencv(detections, board):
    ours = deltille.calibrate(detections, board, weights="equal", loss="none")
    size = (ours.camera.width, ours.camera.height)
    *_, rvecs, tvecs = cv2.calibrateCamera(*deltille.to_opencv(detections), size, None, None, flags=cv2.CALIB_FIX_K3)
    numpy.testing.assert_allclose(ours.tvecs, numpy.reshape(tvecs, (-1, 3)), atol=0.3)
    numpy.testing.assert_allclose(ours.rvecs, numpy.reshape(rvecs, (-1, 3)), atol=3e-3)


def test_failures_are_skipped(detections):
    broken = deltille.Failure("a.png", deltille.ImageError("a.png: broken"))
    assert len(deltille.to_opencv([broken, *detections])[0]) == len(detections)
    points = deltille.stereo_to_opencv([broken, *detections[:3]], [detections[0], broken, *detections[1:3]])
    assert [len(of_pair) for of_pair in points] == [2, 2, 2]


def test_opencv_reads_our_camera_files(calibration, tmp_path):
    path = calibration.save(tmp_path / "a.yaml", "opencv")
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    numpy.testing.assert_array_equal(storage.getNode("camera_matrix").mat(), calibration.camera.matrix)
