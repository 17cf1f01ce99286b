"""Track a board in a webcam or a video: corners and pose in each frame, drawn over the image.

    python follow_video.py 0                  # a webcam
    python follow_video.py video.mp4          # a file
    python follow_video.py                    # a synthetic video

With ``--show``, a window shows the frames. The last frame is written to followed.png.
"""

import sys
import tempfile
import time
from pathlib import Path

import cv2
import numpy

import deltille


def made_here(board: deltille.Target, camera: deltille.Camera, folder: Path) -> str:
    """Renders a video of the board with a moving camera."""
    path = str(folder / "board.avi")
    writer = cv2.VideoWriter(path, cv2.VideoWriter_fourcc(*"MJPG"), 10, (camera.width, camera.height))
    for frame in range(20):
        angle = 0.3 * frame
        eye = (100 + 150 * numpy.sin(angle), 90 + 150 * numpy.cos(angle), 380)
        picture, _ = deltille.render(board, camera, eye=eye, seed=frame)
        writer.write(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR))
    writer.release()
    return path


def main() -> None:
    arguments = [argument for argument in sys.argv[1:] if argument != "--show"]
    board = deltille.Board(10, 11, edge_mm=20, name="desk")
    # Without a calibration, a guess is good enough for drawing: a horizontal field of view of 60°.
    camera = deltille.Camera(960, 720, 960 / 2 / numpy.tan(numpy.radians(30)))
    tracker = deltille.Tracker(deltille.Detector(board))
    with tempfile.TemporaryDirectory() as folder:
        source = arguments[0] if arguments else made_here(board, camera, Path(folder))
        video = cv2.VideoCapture(int(source) if source.isdigit() else source)
        frames = 0
        while True:
            there, picture = video.read()
            if not there:
                break
            start = time.perf_counter()
            # OpenCV's colours are blue, green, red; this makes a view, not a copy.
            found = tracker.detect(picture[..., ::-1], name=f"frame {frames}")
            located = deltille.pose(found, camera) if found else None
            milliseconds = 1e3 * (time.perf_counter() - start)
            if located:
                distance = numpy.linalg.norm(located.pose.tvec)
                print(f"{found.image}: {len(found)} corners, {distance:.0f} mm away, {milliseconds:.0f} ms")
            else:
                print(f"{found.image}: {found.why or located.why}")
            for x, y in found.pixels:
                cv2.drawMarker(picture, (round(x), round(y)), (0, 0, 255), cv2.MARKER_CROSS, 9)
            if "--show" in sys.argv:
                cv2.imshow("deltille", picture)
                if cv2.waitKey(1) == 27:
                    break
            frames += 1
            last = picture
        video.release()
    if not frames:
        raise SystemExit(f"{source}: no frame could be read")
    cv2.imwrite("followed.png", last)
    print("wrote followed.png")


if __name__ == "__main__":
    main()
