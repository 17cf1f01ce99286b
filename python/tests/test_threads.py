"""One detector in several threads, and Ctrl-C."""

import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy
import pytest
from conftest import started

import deltille


def test_a_detector_serves_several_threads(board, pictures, detections):
    detector = deltille.Detector(board)
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(detector.detect, pictures * 4))
    for one, other in zip(found, detections * 4):
        assert (one.pixels == other.pixels).all()


def test_a_detector_can_be_sent_to_other_processes(board, pictures, detections):
    import pickle

    for detector in (deltille.Detector(board, tone="linear"), deltille.Detector(grid="checker", rows=4, cols=5)):
        again = pickle.loads(pickle.dumps(detector))
        for picture in pictures[:2]:
            assert again.detect(picture) == detector.detect(picture)
    detector = deltille.Detector(board)
    inked = detector.with_ink_of([deltille.Detection.from_json(WITH_INK), deltille.Detection.from_json(WITH_INK)])
    assert inked is not None
    assert pickle.loads(pickle.dumps(inked)).detect(pictures[0]) == inked.detect(pictures[0])


WITH_INK = """{"schema": "deltille/detection/1", "image": "a", "width": 9, "height": 9, "grids": [], "tone": null,
    "ink": {"edges": 0.01, "edges_sd": 0.0001, "um": 200, "um_sd": 2, "used": true, "images": 1}}"""


def test_other_threads_run_during_detection(board):
    picture = numpy.random.default_rng(1).integers(0, 255, (3000, 4000), numpy.uint8)
    detector, ticks, ended = deltille.Detector(board), [], threading.Event()

    def tick():
        while not ended.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.002)

    thread = threading.Thread(target=tick)
    thread.start()
    start = time.monotonic()
    detector.detect(picture)
    end = time.monotonic()
    ended.set()
    thread.join()
    assert len([at for at in ticks if start < at < end]) > (end - start) / 0.05


LONG = {
    "save": "deltille.Board(40, 46, edge_mm=15, tags=False, paper='A0').save('out', ['png'], dpi=600)",
    "search": "deltille.search_family('d36h9', seconds=100)",
    "calibrate": "deltille.calibrate(detections * 1, model='spline', measure_target=True)",
    "detect_many": "deltille.detect_many([picture] * 2000, board, workers=2)",
    "verify": "[deltille.Icosahedron(edge_mm=200).verify() for _ in range(100)]",
}
SETUP = """
import deltille, sys, numpy, time
board = deltille.Board(9, 10, edge_mm=20)
camera = deltille.Camera(1600, 1200, 1300)
if {calibrates}:
    detector = deltille.Detector(board)
    generator = numpy.random.default_rng(1)
    detections = []
    for i in range(14):
        eye = generator.uniform((-50, -50, 250), (250, 250, 400))
        picture, _ = deltille.render(board, camera, eye=eye.tolist(), seed=i, noise=0.03)
        detections.append(detector.detect(picture, name=str(i)))
else:
    picture, _ = deltille.render(board, camera, eye=(80, -50, 350))
print('ready', flush=True)
start = time.monotonic()
try:
    {work}
    print('done', time.monotonic() - start)
except KeyboardInterrupt:
    print('interrupted', time.monotonic() - start)
"""


@pytest.mark.skipif(os.name == "nt", reason="signals of Unix")
@pytest.mark.parametrize("what", LONG)
def test_ctrl_c_ends_long_work(what, tmp_path):
    code = SETUP.format(work=LONG[what], calibrates=what == "calibrate")
    process = started([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path)
    assert process.stdout.readline() == "ready\n"
    time.sleep(0.4)
    start = time.monotonic()
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert out.startswith("interrupted"), (out, err)
    assert time.monotonic() - start < 5
