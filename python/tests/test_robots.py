import json

import numpy
import pytest

import deltille


def on_robot(detections, calibration):
    """Poses of a robot with the camera on its flange, and its true mountings."""
    flange_from_camera = deltille.Pose(rvec=(0.1, -0.2, 1.4), tvec=(30, -12, 55))
    base_from_board = deltille.Pose(rvec=(0.3, 0.1, -0.6), tvec=(500, 120, 15))
    seen = {view.name: view.pose for view in calibration.views}
    names = [detection.image.removesuffix(".png") for detection in detections]
    poses = [base_from_board @ seen[name].inverse() @ flange_from_camera.inverse() for name in names]
    return poses, flange_from_camera, base_from_board


def off(found, truth):
    return (found @ truth.inverse()).matrix - numpy.eye(4)


def test_camera_and_board_are_located_on_a_robot(calibration, detections, tmp_path):
    poses, flange_from_camera, base_from_board = on_robot(detections, calibration)
    poses[3] = None
    found = deltille.hand_eye(detections, poses, camera=calibration)
    assert found.setup == "eye-in-hand" and not hasattr(found, "base_from_camera")
    assert not hasattr(found, "flange_from_board")
    assert numpy.abs(off(found.flange_from_camera, flange_from_camera)).max() < 0.1
    assert numpy.abs(off(found.base_from_board, base_from_board)).max() < 0.3
    assert found.covariance.shape == (12, 12) and (found.scale, found.scale_sd) == (1.0, None)
    assert len(found.used) == 9 and found.wrong == [] and found.rms_px < 0.1
    assert json.loads(found.to_json())["unpaired"] == ["3"]
    assert found.camera is not None and found.camera.width == calibration.camera.width

    # The same poses in a file, in metres, with a scale.
    rows = [f"{i},{p.tvec[0] / 1000},{p.tvec[1] / 1000},{p.tvec[2] / 1000},{p.rvec[0]},{p.rvec[1]},{p.rvec[2]}"
            for i, p in enumerate(poses) if p is not None]
    table = tmp_path / "poses.csv"
    table.write_text("\n".join(["image,x_m,y_m,z_m,rx_rad,ry_rad,rz_rad", *rows]) + "\n")
    scaled = deltille.hand_eye(detections, table, camera=calibration.camera, scale=True, robot_noise=(0.01, 0.1))
    assert scaled.covariance.shape == (13, 13) and abs(scaled.scale - 1) < 5 * scaled.scale_sd
    assert scaled.robot_noise == pytest.approx((0.01, 0.1))


def test_poses_that_do_not_fit_are_refused(calibration, detections):
    poses, *_ = on_robot(detections, calibration)
    with pytest.raises(deltille.CalibrationError, match="look inverted"):
        deltille.hand_eye(detections, poses, setup="eye-to-hand", camera=calibration)
    with pytest.raises(deltille.CalibrationError, match="only 2 photographs"):
        deltille.hand_eye(detections, poses[:2] + [None] * (len(poses) - 2), camera=calibration)
    with pytest.raises(deltille.CalibrationError, match="pass one for each"):
        deltille.hand_eye(detections, poses[:4], camera=calibration)
