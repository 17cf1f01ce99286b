"""Calibrates a camera with OpenCV from the same corners, and reads its files for other programs: camera.py FOLDER."""

import json
import sys

import cv2
import numpy
import yaml

folder = sys.argv[1]
text = lambda name: open(f"{folder}/{name}").read()
board, found = json.loads(text("board.json")), json.loads(text("camera.json"))
places = {(c["row"], c["col"]): c["target_mm"] for c in board["panels"][0]["corners"]}
seen = [view["corners"] for view in found["views"]]
points = [numpy.float32([places[c["row"], c["col"]] for c in view]) for view in seen]
pixels = [numpy.float32([[c["x"], c["y"]] for c in view]) for view in seen]
size = (found["width"], found["height"])
criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 1000, 1e-15)
rms, matrix, distortion, _, _ = cv2.calibrateCamera(
    points, pixels, size, None, None, flags=cv2.CALIB_FIX_K3, criteria=criteria)
rms /= 2**0.5
assert abs(rms - found["rms_px"]) < 1e-4, (rms, found["rms_px"])
storage = cv2.FileStorage(f"{folder}/camera-opencv.yaml", cv2.FILE_STORAGE_READ)
read = storage.getNode("camera_matrix").mat()
assert numpy.abs(read - matrix).max() < 0.01, (read, matrix)
k = storage.getNode("distortion_coefficients").mat().ravel()
assert numpy.abs(k[:4] - distortion.ravel()[:4]).max() < 1e-3, (k, distortion)
fx = float(read[0, 0])
ros, chain = yaml.safe_load(text("camera-ros.yaml")), yaml.safe_load(text("camera-camchain.yaml"))
assert ros["camera_matrix"]["data"][0] == fx and chain["cam0"]["intrinsics"][0] == fx
lines = [line.split() for line in text("camera-cameras.txt").splitlines() if line[:1] != "#"]
assert lines[0][1] == "OPENCV" and float(lines[0][4]) == fx, lines
assert json.loads(text("camera-transforms.json"))["fl_x"] == fx
print(f"OpenCV: the same camera from the same corners, rms {rms:.5f} and {found['rms_px']:.5f} px")
print("PyYAML: ROS and Kalibr files are read; COLMAP and nerfstudio files have the same camera")
