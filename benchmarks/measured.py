"""Runs the detectors, each on each board in a process and a thread of its own, and writes what they find.

    python measured.py FOLDER              # as photographs.py wrote it; writes FOLDER/found/<detector>-<board>.json

The files have the format that `score.py` reads, with CPU times and memory.
"""

import argparse
import json
import os
import pathlib
import resource
import shutil
import subprocess
import sys
import time

import detectors
import protocol

ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "RAYON_NUM_THREADS": "1"}


def cpu_s():
    """CPU time of this process and of the programs that it has run, s."""
    of = os.times()
    # Of this process with more digits.
    return time.process_time() + of.children_user + of.children_system


def run(folder):
    """Measures what is installed; prints what is not."""
    shutil.rmtree(folder / "found", ignore_errors=True)
    (folder / "found").mkdir()
    for detector in detectors.ALL:
        if not detector.is_installed():
            print(f"not compared, because it is not installed: {detector.name}")
            continue
        for board in (board for board in detector.boards if (folder / board / "truth.json").exists()):
            command = [sys.executable, __file__, str(folder), "--detector", detector.name, "--of", board]
            code = subprocess.run(command, env=os.environ | ONE_THREAD).returncode
            if code != 0:
                print(f"not compared: {detector.name} on {board} ended with exit code {code}")


def alone(script, detector, *arguments):
    """What `script --one … <detector>` prints as JSON, in a process and a thread of its own; None if it fails."""
    if not detector.is_installed():
        return None
    command = [str(of) for of in (sys.executable, script, "--one", *arguments, detector.name)]
    done = subprocess.run(command, env=os.environ | ONE_THREAD, capture_output=True, text=True)
    if done.returncode:
        reason = (done.stderr.strip() or f"exit code {done.returncode}").splitlines()[-1]
        print(f"not compared: {detector.name}: {reason}", flush=True)
        return None
    return json.loads(done.stdout)


def one(folder, detector, board):
    """Measures a detector on the photographs of a board, in this process."""
    import cv2

    cv2.setNumThreads(1)
    images = sorted((folder / board).glob("*.png"))
    pictures = {path.stem: cv2.imread(str(path), cv2.IMREAD_UNCHANGED) for path in images}
    detect = detector(board, folder / "boards")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    detect(next(iter(pictures.values())))
    found = {}
    for name, picture in pictures.items():
        begin = cpu_s()
        corners = detect(picture)
        seconds = cpu_s() - begin
        corners = [{"label": label, "x": x, "y": y, "covariance": covariance} for label, x, y, covariance in corners]
        found[name] = {"corners": corners, "cpu_s": seconds, "px": picture.shape[0] * picture.shape[1]}
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    result = {
        "detector": detector.name, "version": detector.version(), "settings": detector.settings, "board": board,
        "memory_mb": (after - before) / 1024, "photographs": found,
    }
    plain = lambda value: value.item() if hasattr(value, "item") else value
    path = folder / "found" / f"{protocol.slug(detector.name)}-{board}.json"
    path.write_text(json.dumps(result, default=plain))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--detector")
    parser.add_argument("--of", metavar="BOARD")
    given = parser.parse_args()
    if given.detector:
        one(given.folder, next(of for of in detectors.ALL if of.name == given.detector), given.of)
        # Without destructors, in which pupil-apriltags may crash.
        os._exit(0)
    else:
        run(given.folder)
