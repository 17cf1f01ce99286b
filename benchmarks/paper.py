"""Photographs by a fisheye of 220° of the paper's data set: which corners of the board do detectors find?

    python fisheye.py path/to/deltille FOLDER DATA     # DATA has the photographs; writes FOLDER/fisheye.json

The set `fisheye` of Ha et al. 2017 (CC BY 4.0) shows a checkerboard of 8 × 11 corners, whole in every photograph. Nobody knows the
true corners, so only their number is compared.
"""

import json
import os
import pathlib
import subprocess
import sys
import time

import detectors
from measured import ONE_THREAD

COMMAND = "checkerboard --rows 8 --cols 11 --edge 20mm --name checkerboard"


def one(folder, data, name):
    """Measures a detector in this process, and prints its figures."""
    import cv2
    import numpy as np

    cv2.setNumThreads(1)
    detector = next(of for of in detectors.ALL if of.name == name)
    detect = detector("checkerboard", folder)
    count = detect.spec["rows"] * detect.spec["cols"]
    paths = sorted(path for path in data.iterdir() if path.suffix.lower() in (".png", ".jpg", ".jpeg"))
    found, times = [], []
    for path in paths:
        picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        begin = time.process_time()
        found.append(len(detect(picture)))
        times.append(1e9 * (time.process_time() - begin) / picture.size)
    print(json.dumps({
        "detector": name, "version": detector.version(), "photographs": len(paths), "whole": sum(of == count for of in found),
        "found": sum(found), "due": count * len(paths), "ms_per_mpx": float(np.median(times)),
        "worst_ms_per_mpx": float(np.max(times)),
    }), flush=True)


def main(deltille, folder, data):
    made = folder / "fisheye-board"
    subprocess.run([str(part) for part in (deltille, *COMMAND.split(), "-o", made, "--force")], check=True, capture_output=True)
    table = []
    for detector in detectors.ALL:
        if "checkerboard" in detector.boards:
            command = [sys.executable, __file__, "--one", made, data, detector.name]
            done = subprocess.run([str(of) for of in command], env=os.environ | ONE_THREAD, capture_output=True, text=True)
            if done.returncode:
                print(f"not compared: {detector.name}: {(done.stderr.strip() or 'no output').splitlines()[-1]}")
                continue
            table.append(json.loads(done.stdout))
            print(table[-1], flush=True)
    (folder / "fisheye.json").write_text(json.dumps(table))


if __name__ == "__main__":
    if sys.argv[1] == "--one":
        one(pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3]), sys.argv[4])
        os._exit(0)
    main(*(pathlib.Path(path) for path in sys.argv[1:4]))
