"""Calibrate a camera from photographs of a board: with this package, and with OpenCV on the same corners.

    python calibrate_camera.py board.json photos/*.jpg
    python calibrate_camera.py                # with synthetic photographs
"""

import sys
from pathlib import Path

import cv2
import numpy

import deltille


def photographs(board: deltille.Target) -> list[numpy.ndarray]:
    """Renders synthetic photographs with a known camera."""
    camera = deltille.Camera(1280, 960, 1100, distortion=[-0.12, 0.05, 0.0005, -0.001])
    generator = numpy.random.default_rng(1)
    eyes = generator.uniform((-80, -80, 280), (280, 260, 420), (20, 3))
    return [deltille.render(board, camera, eye=eye, seed=i)[0] for i, eye in enumerate(eyes)]


def main() -> None:
    if len(sys.argv) > 2:
        board, pictures = deltille.Target.load(sys.argv[1]), sys.argv[2:]
    else:
        board = deltille.Board(10, 11, edge_mm=20, name="desk")
        pictures = photographs(board)

    results = deltille.detect_many(pictures, board)
    for result in results:
        if result.error or not result:
            print(f"{result.image}: {result.error or result.why}")
    detections = [result for result in results if not result.error]

    # This package: every fifth view is held out, to test how well the others predict it.
    calibration = deltille.calibrate(detections, board, model="radtan", hold_out=5)
    camera = calibration.camera
    for name, value, sd in zip(camera.parameter_names, camera.parameters, calibration.sd):
        if sd == sd:
            print(f"{name:5} {value:12.5f} ± {sd:.5f}")
    print(f"rms {calibration.rms_px:.4f} px, {calibration.held_out_rms_px:.4f} px in held-out views")
    for diagnosis in calibration.diagnoses:
        print("warning:", diagnosis)
    calibration.save("camera.json")
    camera.save("camera.yaml")
    camera.save("camera-opencv.yaml", "opencv")
    calibration.report("camera.html")

    # OpenCV, on the same corners.
    objects, pixels = deltille.to_opencv(detections)
    size = (detections[0].width, detections[0].height)
    rms, matrix, distortion, _, _ = cv2.calibrateCamera(objects, pixels, size, None, None, flags=cv2.CALIB_FIX_K3)
    print(f"OpenCV: rms {rms / 2**0.5:.4f} px per axis, fx {matrix[0, 0]:.3f}, ours {camera.matrix[0, 0]:.3f}")
    theirs = deltille.Camera(*size, (matrix[0, 0], matrix[1, 1]), (matrix[0, 2], matrix[1, 2]), distortion=distortion.ravel())
    print(f"both differ by {deltille.compare(calibration, theirs).rms_px:.4f} px over the image")
    print("wrote", ", ".join(str(path) for path in sorted(Path(".").glob("camera*"))))


if __name__ == "__main__":
    main()
