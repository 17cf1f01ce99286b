"""Photographs of the paper's data set: which corners of the board do detectors find?

    python paper.py path/to/deltille FOLDER DATA     # DATA has the folders fisheye and robot-hand; writes FOLDER/paper.json

The data set of Ha et al. 2017 (CC BY 4.0) shows a checkerboard of 8 × 11 corners through a fisheye of 220° (`fisheye`), and a
deltille grid of 10 × 11 corners (`robot-hand`), both without tags and whole in every photograph. Nobody knows the true corners, so
only their number is compared.
"""

import json
import os
import pathlib
import subprocess
import sys

import detectors
import measured

# The folder of the set, the name of the board in detectors.py, and the command that describes it.
SETS = [
    ("fisheye", "checkerboard", "checkerboard --rows 8 --cols 11 --edge 20mm"),
    ("robot-hand", "deltille", "board --rows 10 --cols 11 --edge 20mm --untagged"),
]


def one(folder, board, data, name):
    """Measures a detector in this process, and prints its figures."""
    import cv2
    import numpy as np

    cv2.setNumThreads(1)
    detector = next(of for of in detectors.ALL if of.name == name)
    detect = detector(board, folder)
    count = detect.spec["rows"] * detect.spec["cols"]
    found, times = [], []
    for path in photographs(data):
        picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        begin = measured.cpu_s()
        corners = detect(picture)
        times.append(1e9 * (measured.cpu_s() - begin) / picture.size)
        found.append(len(detectors.of_board(corners)))
    print(json.dumps({
        "set": data.name, "detector": name, "version": detector.version(), "photographs": len(found),
        "whole": sum(of == count for of in found), "found": sum(found), "due": count * len(found),
        "ms_per_mpx": float(np.median(times)), "worst_ms_per_mpx": float(np.max(times)),
    }), flush=True)


def photographs(data):
    return sorted(path for path in data.iterdir() if path.suffix.lower() in (".png", ".jpg", ".jpeg"))


def main(deltille, folder, data):
    made, table = folder / "paper-boards", []
    for name, board, command in SETS:
        if not (data / name).is_dir() or not photographs(data / name):
            print(f"skipped: no photographs in {data / name}")
            continue
        command = [deltille, *command.split(), "--name", board, "-o", made, "--force", "--no-verify"]
        subprocess.run([str(part) for part in command], check=True, capture_output=True)
        for detector in detectors.ALL:
            if board in detector.boards and (row := measured.alone(__file__, detector, made, board, data / name)) is not None:
                table.append(row)
                print(row, flush=True)
    (folder / "paper.json").write_text(json.dumps(table))


if __name__ == "__main__":
    if sys.argv[1] == "--one":
        one(pathlib.Path(sys.argv[2]), sys.argv[3], pathlib.Path(sys.argv[4]), sys.argv[5])
        os._exit(0)
    main(*(pathlib.Path(path).resolve() for path in sys.argv[1:4]))
