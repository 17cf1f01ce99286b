import json
import math
import pickle
import subprocess

import numpy
import pytest

import deltille


def test_a_camera_is_calibrated_with_its_uncertainties(calibration, board, camera, detections):
    assert calibration.model == "radtan" and calibration.camera.model == "pinhole"
    found = calibration.camera.parameters
    names = calibration.camera.parameter_names
    assert names[:4] == ["fx", "fy", "cx", "cy"] and len(names) == len(calibration.sd)
    of_found = [names.index(name) for name in calibration.found]
    off = (found - camera.parameters)[of_found] / calibration.sd[of_found]
    assert numpy.abs(off).max() < 5
    assert calibration.covariance.shape == (8, 8)
    numpy.testing.assert_allclose(numpy.sqrt(numpy.diag(calibration.covariance)), calibration.sd[of_found])
    assert calibration.rms_px < 0.02 and calibration.inlier_rms_px <= calibration.rms_px
    assert calibration.corner_count == len(calibration.residuals) == sum(len(view) for view in calibration.views)
    assert calibration.residuals.shape == calibration.pixels.shape
    rms = numpy.sqrt((calibration.residuals**2).mean())
    assert rms == pytest.approx(calibration.rms_px)
    assert (numpy.bincount(calibration.view_indices) == [len(view) for view in calibration.views]).all()
    view = calibration.views[0]
    ids = {int(i): pixel for i, pixel in zip(detections[0].ids, detections[0].pixels)}
    for number, pixel in zip(view.ids, view.pixels):
        assert (ids[int(number)] == pixel).all()
    assert calibration.outliers.dtype == bool and calibration.outlier_count == calibration.outliers.sum()
    assert calibration.projection_sd() > 0 and calibration.projection_sd(400.0) > 0
    assert calibration.uncertainty_map().shape == (18, 24)
    assert calibration.projection_covariance([[640, 480]]).shape == (1, 2, 2)
    assert calibration.excluded == [] and all(said.sentence for said in calibration.diagnoses)
    few = deltille.calibrate(detections[:5], board, model="radtan")
    assert any(remedy.startswith("Only 5 views") for remedy in few.remedies())


def test_the_covariance_of_all_unknowns_has_their_names(detections, board, calibration):
    shared = calibration.joint_covariance
    assert shared.names[:2] == ["camera.fx", "camera.fy"] and shared.units[:2] == ["px", "px"]
    numpy.testing.assert_allclose(shared.noise[:8, :8], calibration.covariance, rtol=1e-6)
    numpy.testing.assert_allclose(shared.observed[:8, :8], calibration.observed_covariance, rtol=1e-6)
    every = deltille.calibrate(detections, board, covariance_of_all=True).joint_covariance
    assert len(every.names) == len(shared.names) + 6 * len(calibration.views) == len(every.noise)
    assert every.names[len(shared.names)].endswith(".rx") and every.units[-1] == "mm"
    numpy.testing.assert_allclose(every.noise[:8, :8], shared.noise[:8, :8], rtol=1e-6)
    assert numpy.linalg.eigvalsh(every.noise / numpy.sqrt(numpy.outer(*[numpy.diag(every.noise)] * 2))).min() > 0


def test_parameters_are_fixed_equal_or_measured_before(detections, board, camera):
    fx, _, cx, *_ = camera.parameters
    constrained = {"fix": ["k2", "p1=0.001"], "equal": "fx,fy", "prior": f"cx={cx}±0.5"}
    found = deltille.calibrate(detections, board, **constrained)
    values = dict(zip(found.camera.parameter_names, found.camera.parameters))
    assert values["k2"] == 0 and values["p1"] == 0.001 and values["fx"] == values["fy"]
    sd = dict(zip(found.camera.parameter_names, found.sd))
    assert abs(values["fx"] - fx) < 5 * sd["fx"] and sd["cx"] < 0.5 and sd["fx"] == sd["fy"]
    for wrong in ({"fix": "zz"}, {"equal": "fx"}, {"prior": "cx=640"}, {"fix": "fx"}):
        with pytest.raises(deltille.CalibrationError):
            deltille.calibrate(detections, board, **wrong)


def test_the_next_view_is_where_the_uncertainty_is_largest(board, camera, detections):
    first = deltille.next_view([], board, size_px=(1280, 960))
    assert first.uncertainty_px is None and not first.is_enough() and "facing the camera" in first.description
    assert first.pixels.shape == (len(first.labels), 2) and len(first.outlines) == 1
    assert first.up[1, 1] < first.up[0, 1] and abs(first.up[1, 0] - first.up[0, 0]) < 1
    few, more = (deltille.next_view(detections[:count]) for count in (5, 10))
    assert (few.views, more.views) == (5, 10)
    assert few.expected_px < few.uncertainty_px and more.uncertainty_px < few.uncertainty_px
    assert few.is_enough(few.uncertainty_px) and not few.is_enough(0.99 * few.uncertainty_px)
    middle = few.camera_from_target.apply(board.corners.mean(axis=0, keepdims=True))
    assert numpy.linalg.norm(middle) == pytest.approx(few.distance_mm)
    other = deltille.next_view(detections[:5], avoid=[few])
    assert other.expected_px >= few.expected_px and other.description != few.description
    assert json.loads(few.to_json())["schema"] == "deltille/next-view/1"
    assert deltille.next_view(detections[:5], camera=camera).uncertainty_px > 0
    for wrong in ({"model": "auto"}, {"model": "spline"}, {"nearest_mm": -1.0}):
        with pytest.raises(deltille.CalibrationError):
            deltille.next_view(detections, **wrong)
    with pytest.raises(deltille.CalibrationError, match="size_px"):
        deltille.next_view([], board)


def test_residuals_equal_detections_minus_projections(calibration, board):
    view = calibration.views[3]
    order = numpy.argsort(board.corner_ids)
    points = view.pose.apply(board.corners[order][view.ids])
    predicted = calibration.camera.project(points)
    numpy.testing.assert_allclose(view.pixels - predicted, view.residuals, atol=1e-8)


def test_the_calibration_equals_that_of_the_program(program, detections, board, calibration, tmp_path):
    board.save(tmp_path)
    (tmp_path / "corners").mkdir()
    for i, detection in enumerate(detections):
        detection.save(tmp_path / f"corners/{i}.json")
    command = [program, "calibrate", str(tmp_path / "corners"), "--target", str(tmp_path / "desk.json")]
    subprocess.run([*command, "--model", "radtan", "-o", str(tmp_path / "camera.yaml")], check=True, capture_output=True)
    assert (tmp_path / "camera.json").read_text() == calibration.to_json()
    assert (tmp_path / "camera.yaml").read_text() == calibration.save(tmp_path / "own.yaml", "own").read_text()
    again = deltille.Calibration.load(tmp_path / "camera.json", target=board)
    assert again.camera == deltille.Camera.load(tmp_path / "camera.yaml") == calibration.camera


def test_calibrations_survive_writing_and_reading(calibration, board, tmp_path):
    path = calibration.save(tmp_path / "a.json", residuals=True)
    again = deltille.Calibration.load(path, target=board)
    assert again.camera == calibration.camera
    numpy.testing.assert_array_equal(again.residuals, calibration.residuals)
    numpy.testing.assert_allclose(again.covariance, calibration.covariance)
    assert (again.ids == calibration.ids).all()
    for form, end in [("own", "yaml"), ("opencv", "yaml"), ("ros", "yaml"), ("kalibr", "yaml"), ("colmap", "txt"),
                      ("nerfstudio", "json"), ("mrcal", "cameramodel")]:
        path = calibration.save(tmp_path / f"{form}.{end}", form)
        if form != "nerfstudio":
            numpy.testing.assert_allclose(deltille.Camera.load(path).parameters, calibration.camera.parameters)
    assert len(json.loads((tmp_path / "nerfstudio.json").read_text())["frames"]) == 10
    page = calibration.report(tmp_path / "a.html", title="mine")
    assert "<html" in page.read_text() and "mine" in page.read_text()


@pytest.mark.parametrize("model", ["radtan5", "kannala-brandt", "eucm"])
def test_other_models(detections, board, model):
    found = deltille.calibrate(detections, board, model)
    assert found.model == model and found.rms_px < 0.1
    with pytest.raises(deltille.CalibrationError, match="unknown model"):
        deltille.calibrate(detections, board, "none")


def test_options(detections, board, calibration):
    held_out = deltille.calibrate(detections, hold_out=5)
    assert held_out.held_out_rms_px < 0.05 and len(held_out.views) == 8
    bent = deltille.calibrate(detections, board, board_shape=True)
    assert bent.board_shape["bent_mm"] < 0.1
    plain = deltille.calibrate(detections, board, weights="equal", loss="none")
    assert plain.common_px is None
    larger = deltille.calibrate(detections, board, print_scale=1.01)
    assert larger.views[0].pose.tvec[2] == pytest.approx(1.01 * calibration.views[0].pose.tvec[2], rel=1e-3)
    known = deltille.calibrate(detections, board, camera=calibration.camera)
    assert known.model is None and numpy.isnan(known.sd).all()
    of_grid = deltille.calibrate(detections, grid="deltille", edge_mm=20)
    numpy.testing.assert_allclose(of_grid.camera.matrix, calibration.camera.matrix, rtol=1e-6)


def test_poses(detections, board, calibration, camera):
    found = deltille.pose(detections[2], camera)
    assert found and found.why is None and found.warnings == []
    assert found.residuals.shape == (len(detections[2]), 2)
    assert found.pose_sd.shape == (6,) and json.loads(found.to_json())["schema"] == "deltille/pose/1"
    eye = found.pose.origin
    numpy.testing.assert_allclose(eye, (-90, 200, 380), atol=0.3)
    nothing = deltille.Detector(board).detect(numpy.zeros((960, 1280), numpy.uint8))
    lost = deltille.pose(nothing, camera)
    assert not lost and lost.pose is None and "dark" in lost.why
    small = deltille.pose(detections[2], deltille.Camera(640, 480, 500))
    assert not small and "640" in small.why


def test_a_calibration_is_accepted_as_its_camera(detections, board, calibration):
    camera = calibration.camera
    assert deltille.pose(detections[2], calibration) == deltille.pose(detections[2], camera)
    assert deltille.undistort(calibration) == deltille.undistort(camera)
    view = calibration.views[0].pose
    assert (deltille.render(board, calibration, view)[0] == deltille.render(board, camera, view)[0]).all()
    assert deltille.calibrate(detections, camera=calibration).camera == camera
    assert deltille.next_view(detections, camera=calibration) == deltille.next_view(detections, camera=camera)
    with pytest.raises(TypeError, match="Camera"):
        deltille.pose(detections[2], calibration.views)


def test_comparisons(detections, board, calibration, tmp_path):
    halves = [deltille.calibrate(detections[i::2], board) for i in range(2)]
    same = deltille.compare(*halves, distance_mm=400)
    assert same.rms_px < 1 and same.p_value is not None and same.pixels.shape == same.differences.shape
    moved = calibration.camera
    other = deltille.Camera(1280, 960, (1111, 1111), tuple(moved.parameters[2:4]), distortion=moved.parameters[4:].tolist())
    changed = deltille.compare(calibration, other, region="image")
    assert changed.rms_px > 1 and changed.is_significant is None and changed.largest_px >= changed.rms_px
    with pytest.raises(deltille.CalibrationError, match="region"):
        deltille.compare(calibration, other, region="nowhere")


def test_check(calibration, detections, board):
    found = deltille.check(calibration, detections, board_accuracy_mm=0)
    assert found.answer in ("unchanged", "cannot_tell") and found.changed == []
    tests = {test.of.quantity: test for test in found.tests}
    assert set(tests) == {"focal_length", "principal_point", "distortion", "board"}
    assert tests["focal_length"].unit == "%" and tests["focal_length"].detectable > 0
    assert json.loads(found.to_json())["answer"] == found.answer
    assert deltille.check(calibration, [], board).missing == ["no photograph shows enough corners of the target"]
    with pytest.raises(deltille.CalibrationError, match="as a sequence"):
        deltille.check(calibration, {"left": detections}, board)


def test_acceptance(calibration, detections, board):
    known = deltille.calibrate(detections[::2], board, board_accuracy_mm=0)
    found = deltille.accept(known, detections[1::2], board_accuracy_mm=0, limit_mm=1)
    assert found.verdict == "conforms" and found.frames == len(detections[1::2]) and found.reused == []
    assert found.error_mm.shape == found.known_mm.shape == found.expanded_mm.shape
    assert numpy.mean(abs(found.error_mm) < found.expanded_mm) > 0.8 and (found.combined_mm > 0).all()
    assert 0 < found.probing_rms_mm < found.probing_mm
    assert json.loads(found.to_json())["verdict"] == "conforms"
    assert "<b>Conforms.</b>" in found.certificate("camera", "board")
    ends = [(int(board.corner_rows[i]), int(board.corner_cols[i])) for i in (0, -1)]
    length_mm = float(numpy.linalg.norm(board.corners[0] - board.corners[-1]))
    one = deltille.accept(known, detections[1::2], lengths=[(*ends, length_mm, 0.001)])
    assert one.verdict is None and set(one.known_mm) == {length_mm}
    with pytest.raises(deltille.CalibrationError, match="no corner in row 1 and column 99"):
        deltille.accept(known, detections[1::2], lengths=[(ends[0], (1, 99), 100.0, 0.001)])
    with pytest.raises(deltille.CalibrationError, match="used for the calibration"):
        deltille.accept(known, detections[::2])


def test_timing(calibration, detections, board, camera):
    readout_s, template = 0.01, json.loads(detections[0].to_json())
    generator = numpy.random.default_rng(1)
    frames = []
    for index in range(60):

        def seen(at_s):
            eye = (70 + 60 * math.sin(3 * at_s), 60 + 50 * math.cos(2.5 * at_s), 350 + 20 * math.sin(2 * at_s))
            pose = deltille.Pose.looking_at(eye, (70, 60, 0))
            return camera.project(board.corners @ pose.rotation.T + pose.tvec)

        pixels = seen(index / 30)
        for _ in range(4):
            # The row of a corner is exposed when the corner is there.
            at_s = index / 30 + readout_s * (pixels[:, 1] / camera.height - 0.5)
            pixels = numpy.array([seen(at)[i] for i, at in enumerate(at_s)])
        pixels = pixels + generator.normal(0, 0.02, pixels.shape)
        at = dict(zip(zip(board.corner_rows.tolist(), board.corner_cols.tolist()), pixels.tolist()))
        for corner in template["grids"][0]["corners"]:
            corner["x"], corner["y"] = at[corner["row"], corner["col"]]
            corner["cov"] = [4e-4, 0, 4e-4]
        template["image"], template["time_ns"] = f"{index:03}", round(index / 30 * 1e9)
        frames.append(deltille.Detection.from_json(json.dumps(template)))
    found = deltille.timing(calibration, frames, board)
    (only,) = found.cameras
    value, sd = only.readout_s
    assert only.is_rolling and abs(value - readout_s) < 4 * sd + 5e-5 and sd < 5e-4 and only.offset_s is None
    assert found.rms_px < 0.05 and json.loads(found.to_json())["frames"] == found.frames > 50
    with pytest.raises(deltille.CalibrationError, match="no time stamps"):
        deltille.timing(calibration, detections, board)


def test_rigs(board, camera, tmp_path):
    detector = deltille.Detector(board)
    left_from_right = deltille.Pose((0, 0.1, 0), (-80, 5, 0))
    eyes = [(0, -50, 420), (300, 60, 330), (-90, 200, 380), (250, 280, 350), (80, -160, 300), (380, 200, 300)]
    seen = {"left": [], "right": []}
    for i, eye in enumerate(eyes):
        pose = deltille.Pose.looking_at(eye, (70, 60, 0))
        for name, place in (("left", pose), ("right", left_from_right @ pose)):
            picture, _ = deltille.render(board, camera, place, seed=i)
            seen[name].append(detector.detect(picture, name=f"{i}.png"))
    found = deltille.rig(seen)
    assert list(found.cameras) == ["left", "right"] and found.frames == [str(i) for i in range(6)]
    numpy.testing.assert_allclose(found.cameras["right"].pose.tvec, left_from_right.tvec, atol=1)
    assert numpy.isnan(found.cameras["left"].pose_sd).all() and found.cameras["right"].pose_sd.shape == (6,)
    assert len(found.poses) == 6 and found.pose_sd.shape == (6, 6) and found.rms_px < 0.02
    sd_mm, mm_per_px = found.depth_sd("left", "right", 600)
    # Twice as far, noise counts four times.
    assert sd_mm > 0 and 3.5 < found.depth_sd("left", "right", 1200)[1] / mm_per_px < 4.5
    with pytest.raises(deltille.CalibrationError, match="no camera is named up"):
        found.depth_sd("left", "up", 600)
    calibration, per_px = found.target_pose_sd(board, 600, camera="right")
    assert len(calibration) == 3 and 0 < per_px[1] < per_px[2]
    assert found.target_pose_sd(board, 60) is None
    path = found.save(tmp_path / "rig.json", residuals=True)
    again = deltille.Rig.load(path, target=board)
    assert again.cameras["left"].camera == found.cameras["left"].camera
    cameras, motions = deltille.compare_rigs(found, again)
    assert len(cameras) == 2 and cameras[0].rms_px < 1e-9 and motions[0].is_significant is False
    for form in ("kalibr", "colmap", "colmap-rig"):
        assert found.save(tmp_path / form, form).stat().st_size > 50
    assert found.report(tmp_path / "rig.html").exists()
    with pytest.raises(deltille.CalibrationError, match="at least two"):
        deltille.rig({"left": seen["left"]})
    with pytest.raises(deltille.CalibrationError, match="same corners"):
        deltille.rig({"left": seen["left"], "right": seen["left"]})
    with pytest.raises(deltille.FileError, match="Rig.load"):
        deltille.Calibration.load(path)


def test_impossible_calibrations_are_reported(detections, board):
    with pytest.raises(deltille.CalibrationError, match="views"):
        deltille.calibrate(detections[:1], board)
    with pytest.raises(deltille.CalibrationError):
        deltille.calibrate([])
    with pytest.raises(deltille.CalibrationError, match="loss"):
        deltille.calibrate(detections, loss="l1")
    with pytest.warns(UserWarning, match="counted once"):
        deltille.calibrate([*detections, detections[0]])


def test_loaded_calibrations_equal_saved_ones(detections, board, tmp_path):
    found = deltille.calibrate(detections, board, hold_out=5)
    found.save(tmp_path / "plain.json")
    found.save(tmp_path / "listed.json", residuals=True)
    figures = ("corner_count", "outlier_count", "inlier_rms_px", "rms_px", "sigma", "common_px", "held_out_rms_px")
    loaded = [deltille.Calibration.load(tmp_path / f"{name}.json", target=target)
              for name in ("plain", "listed") for target in (None, board)]
    for one in [*loaded, pickle.loads(pickle.dumps(found))]:
        assert [getattr(one, figure) for figure in figures] == [getattr(found, figure) for figure in figures]
        assert [str(said) for said in one.diagnoses] == [str(said) for said in found.diagnoses]
    loaded[0].save(tmp_path / "again.json")
    assert (tmp_path / "again.json").read_text() == (tmp_path / "plain.json").read_text()
    loaded[3].report(tmp_path / "page.html")
    with pytest.raises(deltille.CalibrationError, match="residuals=True"):
        loaded[0].report(tmp_path / "empty.html")
    with pytest.raises(deltille.FileError, match=r"Calibration\.load"):
        deltille.Rig.load(tmp_path / "plain.json")


def test_failures_are_skipped(pictures, board):
    found = deltille.detect_many([*pictures, b"no picture"], board)
    assert found[-1].error and not found[-1]
    names = [f"view{i}" for i in range(len(found))]
    calibration = deltille.calibrate(found, board, names=names)
    assert calibration.views[-1].name == names[len(pictures) - 1]
    assert len(deltille.to_opencv(found)[0]) == len(pictures)
    with pytest.raises(TypeError, match="expected a list"):
        deltille.calibrate(found[0], board)
    with pytest.raises(TypeError, match="expected a list"):
        deltille.detect_many("photograph.png", board)


def test_labels_of_another_target_are_rejected(detections):
    other = deltille.Board(9, 8, edge_mm=20)
    with pytest.raises(deltille.DetectionError, match="it was detected as desk .* but the given target is board"):
        deltille.Detection.from_json(detections[0].to_json(), target=other)


def test_a_board_of_another_size_is_rejected(tmp_path, board, camera, detections, calibration):
    larger = deltille.Board(7, 8, edge_mm=25, name="desk")
    own, other = board.identity, larger.identity
    assert own["labels"] == other["labels"] and own["fingerprint"] != other["fingerprint"]
    assert [found["fingerprint"] for found in detections[0].target_identities] == [own["fingerprint"]]
    for found in detections[:3]:
        found.save(tmp_path / f"{found.image}.json")
    calibration.save(tmp_path / "camera" / "camera.json")
    sizes = r"edges of 20 mm\).*edges of 25 mm\)"
    for call in (
        lambda **keywords: deltille.calibrate(detections, larger, **keywords),
        lambda **keywords: deltille.rig({"a": detections}, larger, refine_target=True, **keywords),
        lambda **keywords: deltille.next_view(detections, larger, **keywords),
        lambda **keywords: deltille.pose(detections[0], camera, larger, **keywords),
        lambda **keywords: deltille.load_detections(tmp_path, larger, **keywords),
        lambda **keywords: deltille.Detection.load(tmp_path / "0.png.json", target=larger, **keywords),
    ):
        with pytest.raises(deltille.Error, match=sizes + ".*assume_target=True"):
            call()
        call(assume_target=True)
    with pytest.raises(deltille.Error, match=sizes):
        deltille.Calibration.load(tmp_path / "camera" / "camera.json", target=larger)
    wrong = deltille.calibrate(detections, larger, assume_target=True)
    with pytest.raises(deltille.CalibrationError, match=sizes + ".*assume_target=True"):
        deltille.compare(calibration, wrong)
    assert deltille.compare(calibration, wrong, assume_target=True).rms_px < 1e-3


def test_models_have_their_names_in_other_programs(detections, board):
    fisheye = deltille.calibrate(detections, board, model="fisheye")
    assert fisheye.model == "kannala-brandt" and fisheye == deltille.calibrate(detections, board, model="kannala-brandt")
