"""Photographs of calibration targets by other people, with deltille and OpenCV side by side.

    python public_photographs.py path/to/deltille FOLDER

downloads public archives into FOLDER and detects the target in every photograph with both programs. Archives that
cannot be downloaded are skipped; what is in FOLDER is not downloaded again. For each set it prints a row of a Markdown
table: images with a detected target, corners, and the residuals of the corners that both programs found in the same place. They are those
of OpenCV's camera calibration, or of a pose where the camera of the photograph is published; both programs' corners go
through the same functions. Needs numpy, OpenCV 4.8 or later, and 400 MB of disk space.
"""

import fnmatch
import json
import pathlib
import subprocess
import sys
import tarfile
import urllib.parse
import urllib.request
import zipfile

import cv2
import numpy as np

from aprilgrid import by_opencv

ARUCO = cv2.aruco

# Archives: a source distribution or a wheel of PyPI, a crate of crates.io, or the newest state of a GitHub repository.
ARCHIVES = {
    "opencv": ("sdist", "opencv-contrib-python"),
    "pose2sim": ("bdist_wheel", "pose2sim"),
    "aprilgrid": ("crate", "aprilgrid-0.5.0"),
    "intrinsic": ("crate", "camera-intrinsic-calibration-0.3.0"),
    "ceres": ("github", "LimHaeryong/Camera-Calibration-using-Ceres-Solver"),
    "stereo": ("github", "BakaAayush/Stereo-calibration"),
    "boofcv": ("github", "lessthanoptimal/BoofCV-Data"),
}

SAMPLES = "*/opencv/samples/data"
TUTORIALS = "*/opencv/doc/tutorials/objdetect/charuco_detection/images"
CHECKERS = {"kind": "checker", "rows": 6, "cols": 9}
CHARUCO = {"kind": "charuco", "options": "--squares 5x7 --edge 40mm --marker 20mm --dictionary 6x6_250 --legacy"}
APRILGRID = {"kind": "aprilgrid", "options": "--tags 6x6 --edge 88mm --gap 0.3"}

# Cameras as published with EuRoC MAV (cam0) and TUM VI (cam0): image size, fx, fy, cx, cy, and the distortion
# of OpenCV's standard or fisheye model.
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

# Name, archive, pattern of the photographs in it, target, camera.
SETS = [
    ("OpenCV samples, left camera", "opencv", f"{SAMPLES}/left[01][0-9].jpg", CHECKERS, None),
    ("OpenCV samples, right camera", "opencv", f"{SAMPLES}/right[01][0-9].jpg", CHECKERS, None),
    ("OpenCV test image", "opencv", "*/modules/java/*/chessboard.jpg", CHECKERS, None),
    ("OpenCV tutorial, ChArUco", "opencv", f"{TUTORIALS}/choriginal.jpg", CHARUCO, None),
    ("OpenCV tutorial, hidden ChArUco", "opencv", f"{TUTORIALS}/chocclusion_original.jpg", CHARUCO, None),
    ("EuRoC MAV, AprilGrid", "intrinsic", "*/data/euroc.png", APRILGRID, EUROC),
    ("TUM VI, AprilGrid, 512 px", "intrinsic", "*/data/tum_vi_with_chart.png", APRILGRID, TUM_VI),
    ("TUM VI, AprilGrid, 1024 px", "aprilgrid", "*/data/1520525725372653511.png", APRILGRID, TUM_VI_LARGE),
    *(
        (f"Pose2Sim demonstration, camera {i}", "pose2sim", f"*/intrinsics/int_cam0{i}_img/*.jpg", {"kind": "checker", "rows": 4, "cols": 7}, None)
        for i in range(1, 5)
    ),
    ("L. Haeryong, wide webcam", "ceres", "*/resources/checkerboard/*.png", {"kind": "checker", "rows": 6, "cols": 8}, None),
    ("B. Aayush, webcam", "stereo", "*/calibration_images/left_*.png", {"kind": "checker", "rows": 7, "cols": 10}, None),
    ("BoofCV, Bumblebee2", "boofcv", "*/stereo/Bumblebee2_Chess/left*.jpg", {"kind": "checker", "rows": 4, "cols": 6}, None),
]

# Corners farther from each other are different corners.
SAME_PX = 3.0


def address(kind, name):
    if kind in ("sdist", "bdist_wheel"):
        with urllib.request.urlopen(f"https://pypi.org/pypi/{name}/json", timeout=60) as answer:
            release = json.load(answer)
        link = next(file["url"] for file in release["urls"] if file["packagetype"] == kind)
        return urllib.parse.urljoin(f"https://pypi.org/simple/{name}/", link)
    if kind == "crate":
        return f"https://static.crates.io/crates/{name.rsplit('-', 1)[0]}/{name}.crate"
    return f"https://codeload.github.com/{name}/tar.gz/HEAD"


def fetched(folder, archive):
    """The archive in the folder, downloaded if it is not there; `None` if that fails."""
    path = folder / f"{archive}.archive"
    if not path.exists():
        part = path.with_suffix(".part")
        try:
            urllib.request.urlretrieve(address(*ARCHIVES[archive]), part)
        except (OSError, StopIteration) as error:
            print(f"{archive}: skipped, {error}", file=sys.stderr)
            return None
        part.rename(path)
    return path


def extracted(folder, archive, pattern):
    """The files of an archive that match a pattern, in the order of their names."""
    path = fetched(folder, archive)
    if path is None:
        return []
    to = folder / "photographs" / archive
    to.mkdir(parents=True, exist_ok=True)
    is_zip = zipfile.is_zipfile(path)
    with zipfile.ZipFile(path) if is_zip else tarfile.open(path) as files:
        names = files.namelist() if is_zip else files.getnames()
        chosen = sorted(name for name in names if fnmatch.fnmatch(name, pattern))
        read = files.read if is_zip else lambda name: files.extractfile(name).read()
        found = [to / name.replace("/", "_") for name in chosen]
        for name, path in zip(chosen, found):
            path.write_bytes(read(name))
    return found


def run(*command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    assert done.returncode in (0, 1), f"{' '.join(map(str, command))}: {done.stderr}"


def grey(path):
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if image.dtype == np.uint16:
        image = (image / (image.max() / 255)).astype(np.uint8)
    return cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if image.ndim == 3 else image


def ours(deltille, folder, images, target):
    """Corners that deltille finds in each image, by id, and the positions of all corners on the target, mm."""
    out = folder / "detections"
    if target["kind"] == "checker":
        rows, cols = target["rows"], target["cols"]
        run(deltille, "detect", *images, "--grid", "checker", "--rows", rows, "--cols", cols, "-o", out, "--force")
        key = lambda corner: corner["row"] * cols + corner["col"]
        points = {r * cols + c: (float(c), float(r), 0.0) for r in range(rows) for c in range(cols)}
        board = None
    else:
        run(deltille, target["kind"], *target["options"].split(), "--name", "board", "-o", folder, "--force", "--no-verify")
        run(deltille, "detect", *images, "--target", folder / "board.json", "-o", out, "--force")
        board = json.loads((folder / "board.json").read_text())
        key = lambda corner: corner["id"]
        points = {corner["id"]: corner["target_mm"] for corner in board["panels"][0]["corners"]}
    found = []
    for image in images:
        detection = json.loads((out / f"{image.stem}.json").read_text())
        grids = [grid["corners"] for grid in detection["grids"] if grid["panel"] == (None if board is None else 0)]
        corners = max(grids, key=len, default=[])
        found.append({key(c): np.array([c["x"], c["y"]]) for c in corners})
    return found, points, board


def theirs(images, target, points, board):
    """The same by OpenCV: for checkerboards, the better of its two detectors."""
    found = []
    for image in map(grey, images):
        corners = {}
        if target["kind"] == "checker":
            size = (target["cols"], target["rows"])
            is_found, places = cv2.findChessboardCornersSB(image, size, flags=cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY)
            if not is_found:
                is_found, places = cv2.findChessboardCorners(image, size)
                if is_found:
                    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 100, 1e-4)
                    places = cv2.cornerSubPix(image, places, (5, 5), (-1, -1), criteria)
            if is_found:
                corners = dict(enumerate(places.reshape(-1, 2)))
        elif target["kind"] == "charuco":
            spec = board["spec"]
            dictionary = ARUCO.getPredefinedDictionary(getattr(ARUCO, spec["dictionary"]))
            charuco = ARUCO.CharucoBoard(spec["squares"], spec["square_mm"], spec["marker_mm"], dictionary)
            charuco.setLegacyPattern(spec["legacy"])
            places, ids, _, _ = ARUCO.CharucoDetector(charuco).detectBoard(image)
            if ids is not None:
                corners = dict(zip(ids.ravel().tolist(), places.reshape(-1, 2)))
        else:
            columns, rows = board["spec"]["tags"]
            grid = {"tagCols": columns, "tagRows": rows, "codeOffset": 0}
            corners = by_opencv(image, grid, board["panels"][0], ARUCO.DICT_APRILTAG_36h11)
            if corners:
                # The window of the detector is too small to reach the saddle point from the corner of a contour.
                criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 100, 1e-4)
                places = np.float32(list(corners.values())).reshape(-1, 1, 2)
                corners = dict(zip(corners, cv2.cornerSubPix(image, places, (4, 4), (-1, -1), criteria).reshape(-1, 2)))
        found.append(corners)
    return found


def same_order(reference, corners, points):
    """Renames corners of a checkerboard, which may begin at another of its outermost corners."""
    if not reference or not corners:
        return corners
    ids = sorted(points)
    width = 1 + int(max(point[0] for point in points.values()))
    by_row = np.array(ids).reshape(-1, width)
    ways = [by_row, by_row[::-1, ::-1], by_row[::-1], by_row[:, ::-1]]
    renamed = [{int(to): corners[at] for at, to in zip(ids, way.ravel()) if at in corners} for way in ways]
    distance = lambda way: np.median([np.hypot(*(way[i] - reference[i])) for i in way if i in reference])
    return min(renamed, key=distance)


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
        starts = [np.array([[f, 0, size[0] / 2 - 0.5], [0, f, size[1] / 2 - 0.5], [0, 0, 1]]) for f in max(size) * np.array([0.5, 1, 2])]
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
    folder.mkdir(parents=True, exist_ok=True)
    print("| photographs | images | corners due | deltille: images, corners | OpenCV | deltille: RMS error per axis, median distance, px | OpenCV |")
    print("|---|---|---|---|---|---|---|")
    for name, archive, pattern, target, camera in SETS:
        images = extracted(folder, archive, pattern)
        if not images:
            continue
        # OpenCV's checkerboard detector draws random numbers.
        cv2.setRNGSeed(1)
        own, points, board = ours(deltille, folder, images, target)
        other = theirs(images, target, points, board)
        if target["kind"] == "checker":
            other = [same_order(a, b, points) for a, b in zip(own, other)]
        both = [sorted(i for i in set(a) & set(b) if np.hypot(*(a[i] - b[i])) < SAME_PX) for a, b in zip(own, other)]
        elsewhere = sum(len(set(a) & set(b)) for a, b in zip(own, other)) - sum(map(len, both))
        used = [i for i, ids in enumerate(both) if len(ids) >= 8]
        height, width = grey(images[0]).shape
        words = ["", ""]
        if used:
            for who, found in enumerate((own, other)):
                rest = residuals([{k: found[i][k] for k in both[i]} for i in used], (width, height), points, camera)
                words[who] = f"{np.sqrt(np.mean(rest**2)):.3f}, {np.median(np.hypot(*rest.T)):.3f}"
        counts = [f"{sum(map(bool, found))}, {sum(map(len, found))}" for found in (own, other)]
        counts[1] += f" ({elsewhere} elsewhere)" if elsewhere else ""
        print(f"| {name} | {len(images)} | {len(images) * len(points)} | {counts[0]} | {counts[1]} | {words[0]} | {words[1]} |", flush=True)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]))
