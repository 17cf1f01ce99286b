"""Photographs of calibration targets by other people: which corners do detectors find, and how well do they fit a camera?

    python public.py path/to/deltille FOLDER       # writes FOLDER/public.json

Downloads public archives into FOLDER/archives (220 MB); what is there is not downloaded again, and what cannot be downloaded is
skipped. Nobody knows the true corners. A corner of a detector is elsewhere if it is more than 3 px from deltille's corner of the
same label. Residuals are those of OpenCV's camera calibration, or of a pose where the camera of the photograph is published, over
the corners that the detector and deltille have in common: one figure for the corners of each, by the same functions.
"""

import fnmatch
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tarfile
import urllib.request
import zipfile

import cv2
import numpy as np

import detectors
import measured
import protocol
import score

# A package of PyPI with the options of `pip download`, or an address. Nothing of them is part of this repository.
ARCHIVES = {
    # Apache 2.0.
    "opencv": "opencv-contrib-python==5.1.0.95 --no-binary opencv-contrib-python",
    # BSD 3-Clause.
    "pose2sim": "pose2sim==0.10.49",
    # MIT or Apache 2.0; its photograph is of TUM VI (CC BY 4.0).
    "aprilgrid": "https://static.crates.io/crates/aprilgrid/aprilgrid-0.5.0.crate",
    # GPL 3.0 or later; its photographs are of EuRoC MAV and TUM VI.
    "intrinsic": "https://static.crates.io/crates/camera-intrinsic-calibration/camera-intrinsic-calibration-0.3.0.crate",
    # Three repositories that state no licence; the last says that Peter Abeles owns its files.
    "ceres": "https://codeload.github.com/LimHaeryong/Camera-Calibration-using-Ceres-Solver/tar.gz/HEAD",
    "stereo": "https://codeload.github.com/BakaAayush/Stereo-calibration/tar.gz/HEAD",
    "boofcv": "https://codeload.github.com/lessthanoptimal/BoofCV-Data/tar.gz/HEAD",
}

SAMPLES = "*/opencv/samples/data"
TUTORIALS = "*/opencv/doc/tutorials/objdetect/charuco_detection/images"
CHARUCO = "charuco --squares 5x7 --edge 40mm --marker 20mm --dictionary 6x6_250 --legacy"
APRILGRID = "aprilgrid --tags 6x6 --edge 88mm --gap 0.3"

# Cameras as published with EuRoC MAV (cam0) and TUM VI (cam0): fx, fy, cx, cy, and the distortion of OpenCV's standard or
# fisheye model.
EUROC = {"k": (458.654, 457.296, 367.215, 248.375), "d": (-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05)}
TUM_VI = {
    "fisheye": True,
    "k": (190.97847715128717, 190.9733070521226, 254.93170605935475, 256.8974428996504),
    "d": (0.0034823894022493434, 0.0007150348452162257, -0.0020532361418706202, 0.00020293673591811182),
}
TUM_VI_LARGE = {
    "fisheye": True,
    "k": (380.81042871360756, 380.81194179427075, 510.29465304840727, 514.3304630538506),
    "d": (0.010171079892421483, -0.010816440029919381, 0.005942781769412756, -0.001662284667857643),
}


def checkers(rows, cols):
    return f"checkerboard --rows {rows} --cols {cols} --edge 20mm"


# Name, archive, pattern of the photographs in it, command that describes the board, camera.
SETS = [
    ("OpenCV samples, left camera", "opencv", f"{SAMPLES}/left[01][0-9].jpg", checkers(6, 9), None),
    ("OpenCV samples, right camera", "opencv", f"{SAMPLES}/right[01][0-9].jpg", checkers(6, 9), None),
    ("OpenCV test image", "opencv", "*/modules/java/*/chessboard.jpg", checkers(6, 9), None),
    ("OpenCV tutorial, ChArUco", "opencv", f"{TUTORIALS}/choriginal.jpg", CHARUCO, None),
    ("OpenCV tutorial, hidden ChArUco", "opencv", f"{TUTORIALS}/chocclusion_original.jpg", CHARUCO, None),
    ("EuRoC MAV, AprilGrid", "intrinsic", "*/data/euroc.png", APRILGRID, EUROC),
    ("TUM VI, AprilGrid, 512 px", "intrinsic", "*/data/tum_vi_with_chart.png", APRILGRID, TUM_VI),
    ("TUM VI, AprilGrid, 1024 px", "aprilgrid", "*/data/1520525725372653511.png", APRILGRID, TUM_VI_LARGE),
    *(
        (f"Pose2Sim demonstration, camera {i}", "pose2sim", f"*/intrinsics/int_cam0{i}_img/*.jpg", checkers(4, 7), None)
        for i in range(1, 5)
    ),
    ("L. Haeryong, wide webcam", "ceres", "*/resources/checkerboard/*.png", checkers(6, 8), None),
    ("B. Aayush, webcam", "stereo", "*/calibration_images/left_*.png", checkers(7, 10), None),
    ("BoofCV, Bumblebee2", "boofcv", "*/stereo/Bumblebee2_Chess/left*.jpg", checkers(4, 6), None),
]

# Corners farther from each other are different corners.
SAME_PX = 3.0
# Fewer corners in a photograph do not contribute to residuals.
LEAST = 8
# Calls for each photograph: most sets have few photographs.
CALLS = 3


def fetched(folder, archive):
    """The archive, downloaded if it is not in the folder; None if that fails."""
    path, source = folder / archive, ARCHIVES[archive]
    if not path.exists():
        part = path.with_suffix(".part")
        part.mkdir(parents=True, exist_ok=True)
        try:
            if source.startswith("https:"):
                with urllib.request.urlopen(source, timeout=60) as answer, open(part / archive, "wb") as file:
                    shutil.copyfileobj(answer, file)
            else:
                pip = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--dest", part]
                subprocess.run([*pip, *source.split()], check=True)
        except (OSError, subprocess.CalledProcessError) as error:
            print(f"skipped: {archive}: {error}", flush=True)
            return None
        part.rename(path)
    return next(path.iterdir())


def extract(path, pattern, folder):
    """Writes the files of an archive that match a pattern."""
    folder.mkdir(parents=True, exist_ok=True)
    is_zip = zipfile.is_zipfile(path)
    with zipfile.ZipFile(path) if is_zip else tarfile.open(path) as files:
        for name in fnmatch.filter(files.namelist() if is_zip else files.getnames(), pattern):
            if is_zip or files.getmember(name).isfile():
                content = files.read(name) if is_zip else files.extractfile(name).read()
                (folder / pathlib.PurePosixPath(name).name).write_bytes(content)


def picture(path):
    """A photograph as the file has it, except for 16 bits, which not every detector reads."""
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    return (image / (image.max() / 255)).astype(np.uint8) if image.dtype == np.uint16 else image


def one(folder, board, name):
    """Detects the corners of all photographs of a set in this process, and prints them."""
    cv2.setNumThreads(1)
    # OpenCV's checkerboard detector draws random numbers.
    cv2.setRNGSeed(1)
    detector = next(of for of in detectors.ALL if of.name == name)
    detect = detector(board, folder)
    pictures = [picture(path) for path in sorted((folder / "photographs").iterdir())]
    detect(pictures[0])
    found, times = [], []
    for image in pictures:
        for _ in range(CALLS):
            begin = measured.cpu_s()
            corners = detect(image)
            times.append(1e9 * (measured.cpu_s() - begin) / (image.shape[0] * image.shape[1]))
        found.append([{"label": label, "x": float(x), "y": float(y)} for label, x, y, _ in detectors.of_board(corners)])
    print(json.dumps({"version": detector.version(), "photographs": found, "ms_per_mpx": float(np.median(times))}))


def common(ours, theirs, count):
    """Corners that both have, as pairs of theirs and ours, and the number of their corners that are elsewhere."""
    pairs = score.labelled(ours, theirs) if ours and theirs else []
    near = lambda a, b: b is not None and np.hypot(a["x"] - b["x"], a["y"] - b["y"]) < SAME_PX
    same = [pair for pair in pairs if near(*pair)]
    # Corners of labels that deltille lacks are unknown, unless it has the whole board.
    known = sum(at is not None or len(ours) == count for _, at in pairs)
    return same, known - len(same)


def compared(ours, theirs, description, size, camera):
    """Figures of a detector over the photographs of a set."""
    target = {corner["id"]: corner["target_mm"] for corner in description["panels"][0]["corners"]}
    pairs, elsewhere = zip(*(common(*of, len(target)) for of in zip(ours["photographs"], theirs["photographs"])))
    key = lambda label: label["id"] if "id" in label else (label["row"], label["col"])
    place = lambda label: target[label["id"]] if "id" in label else (label["col"], label["row"], 0)
    points = {key(corner["label"]): place(corner["label"]) for found in ours["photographs"] for corner in found}

    def rms(which):
        views = [{key(pair[1]["label"]): (pair[which]["x"], pair[which]["y"]) for pair in of} for of in pairs if len(of) >= LEAST]
        return float(np.sqrt(np.mean(residuals(views, size, points, camera) ** 2))) if views else None

    return {
        "images": sum(map(bool, theirs["photographs"])), "corners": sum(map(len, theirs["photographs"])),
        "elsewhere": sum(elsewhere), "rms_px": rms(0), "deltille_rms_px": rms(1), "ms_per_mpx": theirs["ms_per_mpx"],
    }


def residuals(views, size, points, camera):
    """Residuals of corners by image, px: rows of x and y."""
    space = [np.float32([points[i] for i in view]) for view in views]
    image = [np.float32(list(view.values())) for view in views]
    if camera is None:
        flags = cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_K3
        if len(views) == 1:
            flags |= cv2.CALIB_FIX_PRINCIPAL_POINT | cv2.CALIB_FIX_ASPECT_RATIO | cv2.CALIB_ZERO_TANGENT_DIST
        criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 1000, 1e-12)
        # Some initial focal lengths lead to a local minimum.
        middle = [of / 2 - 0.5 for of in size]
        starts = [np.array([[f, 0, middle[0]], [0, f, middle[1]], [0, 0, 1]]) for f in max(size) * np.array([0.5, 1, 2])]
        solved = [cv2.calibrateCamera(space, image, size, start, None, flags=flags, criteria=criteria) for start in starts]
        _, matrix, distortion, rotations, shifts = min(solved, key=lambda found: found[0])
        poses = [np.concatenate([r.ravel(), t.ravel()]) for r, t in zip(rotations, shifts)]
        return np.vstack([off(pose, *pair, matrix, distortion, False) for pose, *pair in zip(poses, space, image)])
    fx, fy, cx, cy = camera["k"]
    matrix, distortion = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]), np.array(camera["d"])
    rest = []
    for there, here in zip(space, image):
        given = (there, here, matrix, distortion, camera.get("fisheye", False))
        model = cv2.fisheye if camera.get("fisheye") else cv2
        plain = model.undistortPoints(here.reshape(-1, 1, 2), matrix, distortion)
        _, rotation, shift = cv2.solvePnP(there, plain, np.eye(3), None)
        pose = np.concatenate([rotation.ravel(), shift.ravel()])
        for _ in range(20):
            base = off(pose, *given).ravel()
            steps = np.diag(1e-6 * np.maximum(1, np.abs(pose)))
            jacobian = np.column_stack([(off(pose + step, *given).ravel() - base) / step.sum() for step in steps])
            pose = pose - np.linalg.lstsq(jacobian, base, rcond=None)[0]
        rest.append(off(pose, *given))
    return np.vstack(rest)


def off(pose, there, here, matrix, distortion, is_fisheye):
    project = cv2.fisheye.projectPoints if is_fisheye else cv2.projectPoints
    seen, _ = project(there.reshape(-1, 1, 3), pose[:3], pose[3:], matrix, distortion)
    return seen.reshape(-1, 2) - here


def main(deltille, folder):
    table = []
    for name, archive, pattern, command, camera in SETS:
        path = fetched(folder / "archives", archive)
        if path is None:
            continue
        board, made = command.split()[0], folder / "public" / protocol.slug(name)
        extract(path, pattern, made / "photographs")
        photographs = sorted((made / "photographs").iterdir())
        if not photographs:
            print(f"skipped: {name}: no photographs in {path}", flush=True)
            continue
        describe = [deltille, *command.split(), "--name", board, "-o", made, "--force", "--no-verify"]
        subprocess.run(describe, check=True, capture_output=True)
        description = json.loads((made / f"{board}.json").read_text())
        size = picture(photographs[0]).shape[1::-1]
        due = len(photographs) * len(description["panels"][0]["corners"])
        print(f"{name}, {len(photographs)} photographs", flush=True)
        found = {of: measured.alone(__file__, of, made, board) for of in detectors.ALL if board in of.boards}
        ours = found[detectors.Deltille]
        for detector, theirs in found.items():
            if ours is None or theirs is None:
                continue
            about = {"set": name, "photographs": len(photographs), "due": due, "detector": detector.name}
            row = about | {"version": theirs["version"]} | compared(ours, theirs, description, size, camera)
            table.append(row)
            print(row, flush=True)
    (folder / "public.json").write_text(json.dumps(table))


if __name__ == "__main__":
    if sys.argv[1] == "--one":
        one(pathlib.Path(sys.argv[2]), *sys.argv[3:])
        # Without destructors, in which pupil-apriltags may crash.
        sys.stdout.flush()
        os._exit(0)
    main(*(pathlib.Path(path).resolve() for path in sys.argv[1:3]))
