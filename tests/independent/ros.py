"""The way of `docs/ros.md` without a robot: from a bag to `camera_info` and rectified points.

    ros.py <deltille> <folder>

`rosbags` writes a bag of two cameras, drawn by `deltille render`, with known intrinsics. `deltille` detects and calibrates
from it. The YAML of `--format ros`, read by PyYAML, fills a `sensor_msgs/CameraInfo` as in the example, which `rosbags`
must serialise. The remap table that `image_proc` makes from it with OpenCV must be that of the true camera to within
WITHIN_PX. The corners, written for Foxglove by the other example, are read back by `mcap`.
"""

import importlib.util
import json
import pathlib
import sys

import cv2
import numpy as np
import yaml
from mcap.reader import make_reader
from recordings import IMAGE, ROS2, bag2, raw, run
from rosbags.rosbag2 import StoragePlugin

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "examples" / "ros2"
WIDTH, HEIGHT, FOCAL = 640, 480, 520.0
# Name in ROS, and in camera files; coefficients.
MODELS = {
    "radtan": ("plumb_bob", "pinhole", [-0.2, 0.05, 0.001, -0.002]),
    "kannala-brandt": ("equidistant", "fisheye", [0.02, -0.01, 0.002, 0.0]),
}
WITHIN_PX = 0.2


def frames(program, folder, model, coefficients):
    run(program, "board", "--rows", 8, "--cols", 9, "--edge", "20mm", "--no-verify", "-o", folder, "--force")
    camera = folder / "true.yaml"
    camera.write_text(
        f"width: {WIDTH}\nheight: {HEIGHT}\nmodel: {model}\nfocal_px: [{FOCAL}, {FOCAL}]\n"
        f"centre_px: [{WIDTH / 2 + 3}, {HEIGHT / 2 - 4}]\ndistortion: {coefficients}\n"
    )
    images = []
    for index in range(24):
        angle = 2.4 * index
        x, y = 80 + 150 * np.cos(angle), 60 + 130 * np.sin(angle)
        path = folder / f"{index:02}.png"
        eye = f"{x:.0f},{y:.0f},{150 + 8 * (index % 5)}"
        run(program, "render", folder / "board.json", "--camera", camera, f"--eye={eye}", "--seed", index, "-o", path, "--force")
        images.append(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE))
    return images


def example():
    """The publisher as a module; it imports ROS only when it runs."""
    spec = importlib.util.spec_from_file_location("example", EXAMPLES / "publish_camera_info.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Message:
    """Takes the fields of a message before it is made."""


def camera_info(path):
    message = example().filled(Message(), yaml.safe_load(path.read_text()))
    header = ROS2.types["std_msgs/msg/Header"](
        stamp=ROS2.types["builtin_interfaces/msg/Time"](sec=1, nanosec=2), frame_id="front"
    )
    roi = ROS2.types["sensor_msgs/msg/RegionOfInterest"](x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
    fields = {name: np.array(getattr(message, name)) for name in "dkrp"}
    info = ROS2.types["sensor_msgs/msg/CameraInfo"](
        header=header, height=message.height, width=message.width, distortion_model=message.distortion_model,
        binning_x=0, binning_y=0, roi=roi, **fields,
    )
    data = ROS2.serialize_cdr(info, "sensor_msgs/msg/CameraInfo")
    return ROS2.deserialize_cdr(data, "sensor_msgs/msg/CameraInfo")


def check_annotations(corners, path):
    run(sys.executable, EXAMPLES / "foxglove_annotations.py", corners, path)
    found = [json.loads(file.read_text()) for file in corners.glob("*.json")]
    due = {one["time_ns"]: [corner for grid in one["grids"] for corner in grid["corners"]] for one in found}
    with open(path, "rb") as file:
        messages = list(make_reader(file).iter_messages())
    assert sorted(due) == [message.log_time for _, _, message in messages]
    for schema, channel, message in messages:
        assert (schema.name, channel.message_encoding) == ("foxglove.ImageAnnotations", "json")
        shown = [point for group in json.loads(message.data)["points"] for point in group["points"]]
        assert shown == [{"x": corner["x"] + 0.5, "y": corner["y"] + 0.5} for corner in due[message.log_time]]


def check(program, folder, model):
    name, own, coefficients = MODELS[model]
    folder.mkdir(parents=True, exist_ok=True)
    images = frames(program, folder, own, coefficients)
    messages = [raw(ROS2, index, image, "mono8") for index, image in enumerate(images)]
    other = [raw(ROS2, index, image[:60, :80].copy(), "mono8") for index, image in enumerate(images)]
    bag = bag2(folder / "run", messages, StoragePlugin.MCAP, more=[("/rear/image_raw", IMAGE, other)])
    board = folder / "board.json"
    run(program, "detect", "--target", board, bag, "--topic", "/camera/image", "-o", folder / "corners", "--force")
    run(program, "calibrate", folder / "corners", "--target", board, "--model", model, "--format", "own,ros",
        "-o", folder / "front.yaml", "--force")
    check_annotations(folder / "corners", folder / "corners.mcap")
    info = camera_info(folder / "front-ros.yaml")
    assert (info.distortion_model, info.width, info.height) == (name, WIDTH, HEIGHT)
    K, R, P = info.k.reshape(3, 3), info.r.reshape(3, 3), info.p.reshape(3, 4)
    is_fisheye = name == "equidistant"
    lens = cv2.fisheye if is_fisheye else cv2
    map_x, map_y = lens.initUndistortRectifyMap(K, info.d, R, P[:, :3], (WIDTH, HEIGHT), cv2.CV_32FC1)
    # The map gives the pixel of the image for each pixel of the rectified one.
    columns, rows = np.meshgrid(np.arange(0, WIDTH, 40), np.arange(0, HEIGHT, 40))
    columns, rows = columns.ravel(), rows.ravel()
    rays = np.stack([columns, rows, np.ones(columns.size)], 1) @ np.linalg.inv(P[:, :3]).T
    true_K = np.array([[FOCAL, 0, WIDTH / 2 + 3], [0, FOCAL, HEIGHT / 2 - 4], [0, 0, 1.0]])
    seen, _ = lens.projectPoints(rays[:, None], np.zeros(3), np.zeros(3), true_K, np.array(coefficients))
    seen = seen.reshape(-1, 2)
    off = np.hypot(map_x[rows, columns] - seen[:, 0], map_y[rows, columns] - seen[:, 1]).max()
    print(f"{model}: the remap table is exact to {off:.3f} px, f {K[0, 0]:.2f} of {FOCAL} px")
    assert off < WITHIN_PX, off


if __name__ == "__main__":
    for one in MODELS:
        check(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]) / one, one)
