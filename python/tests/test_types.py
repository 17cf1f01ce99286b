"""Stubs and module agree, and type checkers accept a user's script."""

import importlib.util
import re
import shutil
import subprocess
import sys
import sysconfig

import pytest

SCRIPT = '''
from pathlib import Path

import numpy
from numpy.typing import NDArray

import deltille

board: deltille.Target = deltille.Board(10, 11, edge_mm=20, paper="A4", name="desk")
paths: list[Path] = board.save("out", ["pdf", "svg"])
verdict: deltille.Verdict = board.verify()
detector = deltille.Detector(board, tone="auto")
image: NDArray[numpy.uint8] = numpy.zeros((480, 640), numpy.uint8)
found: deltille.Detection = detector.detect(image)
pixels: NDArray[numpy.float64] = found.pixels
if found.why is not None:
    print(found.why.kind, found.why.sentence)
results = deltille.detect_many(["a.png", "b.png"], board, workers=2)
detections: list[deltille.Detection] = [result for result in results if isinstance(result, deltille.Detection)]
seen: list[deltille.Detection] = [result for result in results if result]
for result in results:
    if result.error is not None:
        print(result.image, result.error)
view: deltille.Undistortion = deltille.undistort(deltille.Camera.from_opencv(numpy.eye(3), None, (640, 480)))
flat: NDArray[numpy.uint8] = view.apply(image)
calibration: deltille.Calibration = deltille.calibrate(detections, board, "radtan", hold_out=5)
matrix: NDArray[numpy.float64] = calibration.camera.matrix
objects, points = deltille.to_opencv(detections)
pose = deltille.pose(detections[0], calibration.camera).pose
if pose is not None:
    print((pose @ pose.inverse()).matrix)
found_rig: deltille.Rig = deltille.rig({"left": detections, "right": detections}, board, refine_target=True)
for name, camera in found_rig.cameras.items():
    print(name, camera.rms_px, camera.pose.tvec)
picture, truth = deltille.render(board, calibration.camera, eye=(0, 0, 500), seed=3)
family: deltille.Family = deltille.search_family("d25h7", seconds=1, callback=lambda part, codes: print(part, codes))
ids, rotations, corrected = family.decode(family.codes)
comparison = deltille.compare(calibration, calibration.camera, region=(0, 0, 100, 100))
try:
    deltille.Board(1, 1)
except deltille.TargetError as error:
    print(error)
'''


@pytest.fixture
def user(tmp_path):
    path = tmp_path / "user.py"
    path.write_text(SCRIPT)
    return path


def test_a_users_script_is_clean_under_mypy(user):
    pytest.importorskip("mypy")
    done = subprocess.run([sys.executable, "-m", "mypy", "--strict", str(user)], capture_output=True, text=True, cwd=user.parent)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_recipes_of_the_guide_are_clean_under_mypy(root, tmp_path):
    pytest.importorskip("mypy")
    recipes = re.findall(r"```python\n(.*?)```", (root / "docs/python.md").read_text(), re.S)
    assert len(recipes) >= 8
    # Each recipe continues the previous one.
    (tmp_path / "recipes.py").write_text("\n".join(recipes))
    # Recipes reuse names with other types, and OpenCV may have no types.
    command = [sys.executable, "-m", "mypy", "--strict", "--allow-redefinition", "--ignore-missing-imports", "recipes.py"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_users_script_is_clean_under_pyright(user):
    program = shutil.which("pyright", path=sysconfig.get_path("scripts"))
    if program is None:
        pytest.skip("pyright is not installed")
    done = subprocess.run([program, "--pythonpath", sys.executable, str(user)], capture_output=True, text=True, cwd=user.parent)
    if "error" not in done.stdout and done.returncode:
        pytest.skip("pyright cannot be run here")
    assert done.returncode == 0, done.stdout + done.stderr


def test_stubs_and_module_agree(tmp_path):
    pytest.importorskip("mypy")
    command = [sys.executable, "-m", "mypy.stubtest", "deltille._core", "--ignore-disjoint-bases"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_package_is_clean_under_mypy(tmp_path):
    pytest.importorskip("mypy")
    command = [sys.executable, "-m", "mypy", "--strict", "-p", "deltille"]
    # Packages of the extras may have no types, or be missing.
    command += ["--ignore-missing-imports"]
    if importlib.util.find_spec("ray") is None:
        command += ["--allow-subclassing-any"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
