"""Tests of the installed package. They read photographs of the repository, and run from any folder."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sysconfig
from pathlib import Path

import numpy
import pytest

import deltille

ROOT = Path(__file__).resolve().parents[2]


def pytest_addoption(parser):
    parser.addoption("--long", action="store_true", help="proofs that take minutes, too")


def pytest_collection_modifyitems(config, items):
    if config.getoption("--long"):
        return
    skipped = pytest.mark.skip(reason="takes minutes; run with --long")
    for item in items:
        if "long" in item.keywords:
            item.add_marker(skipped)


@pytest.fixture(scope="session")
def root() -> Path:
    return ROOT


def script(name: str) -> str:
    """Returns a program installed by the package."""
    found = shutil.which(name, path=sysconfig.get_path("scripts"))
    assert found, f"{name} is not installed"
    return found


def started(command, **options):
    """A program that ignores no signal, although a shell that runs the tests in the background may ignore some."""

    def default():
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_DFL)

    return subprocess.Popen(command, preexec_fn=None if os.name == "nt" else default, **options)


@pytest.fixture(scope="session")
def program() -> str:
    """Returns the native program if it was built, otherwise that of the package."""
    native = os.environ.get("DELTILLE_PROGRAM")
    return native or script("deltille")


@pytest.fixture(scope="session")
def board() -> deltille.Target:
    return deltille.Board(7, 8, edge_mm=20, name="desk")


@pytest.fixture(scope="session")
def camera() -> deltille.Camera:
    return deltille.Camera(1280, 960, 1100, distortion=[-0.1, 0.02, 0.001, -0.0005])


EYES = [(0, -50, 420), (300, 60, 330), (-90, 200, 380), (250, 280, 350), (80, -160, 300), (380, 200, 300),
        (100, 60, 330), (-40, 20, 300), (180, 300, 300), (330, -80, 380)]


@pytest.fixture(scope="session")
def pictures(board, camera) -> list[numpy.ndarray]:
    return [deltille.render(board, camera, eye=eye, seed=i)[0] for i, eye in enumerate(EYES)]


@pytest.fixture(scope="session")
def detections(board, pictures) -> list[deltille.Detection]:
    detector = deltille.Detector(board)
    return [detector.detect(picture, name=f"{i}.png") for i, picture in enumerate(pictures)]


@pytest.fixture(scope="session")
def calibration(detections, board) -> deltille.Calibration:
    return deltille.calibrate(detections, board)
