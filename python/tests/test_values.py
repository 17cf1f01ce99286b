"""Results are values: they can be pickled, copied and compared."""

import copy
import pickle

import numpy
import pytest

import deltille


def again(value):
    for made in (copy.copy(value), copy.deepcopy(value), pickle.loads(pickle.dumps(value))):
        assert type(made) is type(value) and made == value
    return pickle.loads(pickle.dumps(value))


@pytest.fixture(scope="module")
def rig(board, camera):
    """Two cameras that observe a board at the same times."""
    right_from_left = deltille.Pose(rvec=(0, 0.1, 0), tvec=(-80, 0, 10))
    detector = deltille.Detector(board)
    seen = {"left": [], "right": []}
    middle = board.corners.mean(axis=0)
    for index in range(8):
        eye = middle + [40 * (index % 3) - 40, 50 * (index % 4) - 60, 400]
        left = deltille.Pose.looking_at(eye, middle)
        for side, pose in (("left", left), ("right", right_from_left @ left)):
            picture, _ = deltille.render(board, camera, pose, seed=index)
            seen[side].append(detector.detect(picture, name=f"{index}.png"))
    return deltille.rig(seen, board)


def test_calibrations_and_their_parts(calibration):
    assert again(calibration) == calibration and calibration != "camera"
    view = again(calibration.views[2])
    assert (view.residuals == calibration.views[2].residuals).all()
    numpy.testing.assert_allclose(view.pose.matrix, calibration.views[2].pose.matrix, atol=1e-9)


def test_rigs_and_their_parts(rig, board, tmp_path):
    made = again(rig)
    assert made == rig and made.frames == rig.frames and list(made.cameras) == ["left", "right"]
    right = again(rig.cameras["right"])
    assert right.name == "right" and right.pose == made.cameras["right"].pose
    assert numpy.isnan(rig.cameras["left"].pose_sd).all() and (right.pose_sd > 0).all()
    assert (right.residuals == rig.cameras["right"].residuals).all()
    # The frames are known without the target, too.
    loaded = deltille.Rig.load(rig.save(tmp_path / "rig.json"))
    assert loaded.frames == rig.frames and len(loaded.poses) == len(rig.poses)
    numpy.testing.assert_allclose(loaded.poses[1].matrix, rig.poses[1].matrix, atol=1e-9)


def test_a_rig_accepts_any_mapping(rig, detections, board):
    from types import MappingProxyType

    with pytest.raises(deltille.CalibrationError, match="a rig has at least two cameras"):
        deltille.rig(MappingProxyType({"left": detections}), board)


def test_targets_keep_their_class(board):
    for target in [board, deltille.Checkerboard(4, 5), deltille.Icosahedron(), deltille.Cube(), deltille.Target.from_json(board.to_json())]:
        assert again(target) == target
    assert again(board.tags[0]) == board.tags[0]


def test_small_values(detections, board, camera, calibration):
    found = detections[0]
    assert again(found) == found and again(found.tags[0]) == found.tags[0]
    assert (again(found.grids[0]).pixels == found.grids[0].pixels).all()
    dark = deltille.Detector(board).detect(numpy.zeros((400, 400), numpy.uint8))
    assert again(dark.why) == dark.why and dark.why.kind == "too_dark"
    pose = deltille.Pose(rvec=(0.1, 0.2, 0.3), tvec=(1, 2, 3))
    assert again(pose) == pose != pose.inverse()
    family = deltille.Family.load("d16h5")
    assert again(family) == family and len({family, again(family)}) == 1
    located = deltille.pose(found, camera)
    assert again(located).pose == located.pose and (again(located).residuals == located.residuals).all()
    for said in [*calibration.diagnoses, *calibration.excluded]:
        assert again(said) == said


def test_truth_is_read_back(board, camera, tmp_path):
    _, truth = deltille.render(board, camera, eye=(0, 0, 400), noise=0.02, seed=5)
    path = tmp_path / "truth.json"
    path.write_text(truth.to_json("view.png"))
    for made in [again(truth), deltille.Truth.load(path)]:
        assert (made.pixels == truth.pixels).all() and (made.object_points == truth.object_points).all()
        numpy.testing.assert_allclose(made.pose.matrix, truth.pose.matrix, atol=1e-12)


def test_loaded_values_equal_those_that_were_saved(calibration, rig, detections, board, camera, tmp_path):
    for target in [board, deltille.Charuco((5, 7)), deltille.AprilGrid((4, 4)), deltille.Circles((4, 11)), deltille.Cuboid((80, 60, 50)),
                   deltille.Board(4, 5, boards=2, note="Lab", mirrored=True), deltille.Board(5, 7, family="dense9")]:
        assert deltille.Target.load(target.save(tmp_path / f"{len(target)}", formats=[])[0]) == target
    assert deltille.Detection.load(detections[0].save(tmp_path / "found.json")) == detections[0] != detections[1]
    for of in [camera, deltille.Camera(640, 480, 300.1, model="fisheye", distortion=[0.1, 0.01, 1 / 3, 1e-9]), calibration.camera]:
        assert deltille.Camera.load(of.save(tmp_path / "camera.yaml")) == of
    for residuals in (False, True):
        made = deltille.Calibration.load(calibration.save(tmp_path / f"{residuals}.json", residuals=residuals), target=board)
        assert made == calibration
        assert deltille.Rig.load(rig.save(tmp_path / f"rig-{residuals}.json", residuals=residuals), target=board) == rig
    family = deltille.Family.load("d16h5")
    assert deltille.Family.load(family.save(tmp_path / "family.json")) == family


def test_results_are_compared_by_their_content(calibration, detections, board, camera):
    def twice(make):
        one, other = make(), make()
        assert one == other and one != "another"
        return one

    twice(lambda: detections[0].grids[0]), twice(lambda: calibration.views[0]), twice(board.verify)
    twice(lambda: deltille.next_view(detections)), twice(lambda: deltille.check(calibration, detections[:3]))
    assert twice(lambda: deltille.pose(detections[0], camera)) != deltille.pose(detections[1], camera)
    assert twice(lambda: deltille.compare(calibration, camera)) != deltille.compare(camera, calibration)
    twice(lambda: calibration.joint_covariance), twice(lambda: deltille.Failure("a", deltille.ImageError("b")))
    assert calibration.views[0] != calibration.views[1]
