#!/usr/bin/env python3
"""Publish the calibration of a camera with every image, for drivers and bags without `camera_info`.

    deltille calibrate corners --target desk/desk.json --model radtan --format own,ros -o front.yaml
    python3 publish_camera_info.py front-ros.yaml /front/image_raw

Publishes `/front/camera_info`. Each message has the time stamp and frame of its image, since `image_proc` pairs them by
their stamps. Needs ROS 2 (rclpy, sensor_msgs, PyYAML).
"""

import sys

import yaml


def filled(message, calibration: dict):
    """Fills a `sensor_msgs/CameraInfo` from the YAML of `--format ros`."""
    message.width = calibration["image_width"]
    message.height = calibration["image_height"]
    message.distortion_model = calibration["distortion_model"]
    message.d = [float(value) for value in calibration["distortion_coefficients"]["data"]]
    message.k = [float(value) for value in calibration["camera_matrix"]["data"]]
    message.r = [float(value) for value in calibration["rectification_matrix"]["data"]]
    message.p = [float(value) for value in calibration["projection_matrix"]["data"]]
    return message


def main() -> None:
    import rclpy
    from rclpy.node import Node
    from rclpy.qos import qos_profile_sensor_data
    from sensor_msgs.msg import CameraInfo, Image

    rclpy.init(args=sys.argv)
    arguments = rclpy.utilities.remove_ros_args(sys.argv)
    if len(arguments) != 3:
        sys.exit("usage: publish_camera_info.py CAMERA-ros.yaml /camera/image_raw")
    with open(arguments[1], encoding="utf-8") as file:
        info = filled(CameraInfo(), yaml.safe_load(file))
    image_topic = arguments[2]
    node = Node("publish_camera_info")
    publisher = node.create_publisher(CameraInfo, image_topic.rsplit("/", 1)[0] + "/camera_info", 10)

    def publish(image: Image) -> None:
        if (image.width, image.height) != (info.width, info.height):
            size = f"{image.width} × {image.height} px, but the calibration is for {info.width} × {info.height} px"
            node.get_logger().error(f"{image_topic} has {size}", throttle_duration_sec=5.0)
            return
        info.header = image.header
        publisher.publish(info)

    node.create_subscription(Image, image_topic, publish, qos_profile_sensor_data)
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass


if __name__ == "__main__":
    main()
