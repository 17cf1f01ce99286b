"""Measures the overhead of calls from Python, the speed-up by threads, and memory growth over many calls.

    python python/benches/overhead.py            # a minute
    python python/benches/overhead.py --calls 100000
"""

from __future__ import annotations

import argparse
import gc
import os
import re
import shutil
import statistics
import subprocess
import sys
import sysconfig
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy

import deltille


def resident() -> int:
    """Memory of the process, bytes; 0 if not available."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        return 0


def milliseconds(work, repeats: int) -> float:
    """Median time of a call, ms."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(1e3 * (time.perf_counter() - start))
    return statistics.median(times)


def layouts(picture) -> dict[str, numpy.ndarray]:
    """The image in types and layouts that `detect` converts."""
    tint = numpy.random.default_rng(1).integers(0, 20, (*picture.shape, 3))
    colours = numpy.clip(picture[..., None].astype(int) - tint, 0, 255).astype(numpy.uint8)
    found = {"uint8": picture, "float32": (picture / 255).astype(numpy.float32), "RGB": colours}
    for name, image in [("uint8", picture), ("RGB", colours)]:
        found[f"{name}, flipped rows"] = image[::-1].copy()[::-1]
        found[f"{name}, every second column"] = numpy.repeat(image, 2, axis=1)[:, ::2]
        found[f"{name}, transposed"] = image.swapaxes(0, 1).copy().swapaxes(0, 1)
    return found | {"RGB, reversed channels": colours[..., ::-1].copy()[..., ::-1]}


def cpu_times(detector, images, repeats: int) -> dict[str, float]:
    """Median CPU time of a call with each image, ms; the images take turns."""
    times = {name: [] for name in images}
    for _ in range(repeats):
        for name, image in images.items():
            start = time.process_time()
            detector.detect(image)
            times[name].append(1e3 * (time.process_time() - start))
    return {name: statistics.median(of_image) for name, of_image in times.items()}


def rate(detector, board, camera, workers: int) -> float:
    """Images per second with this number of threads; the best of twelve rounds, as the machine may be shared."""
    pictures = [deltille.render(board, camera, eye=(100, -60 + i, 420), seed=i)[0] for i in range(16)]
    best = 0.0
    with ThreadPoolExecutor(workers) as pool:
        for _ in range(12):
            start = time.perf_counter()
            list(pool.map(detector.detect, pictures))
            best = max(best, len(pictures) / (time.perf_counter() - start))
    return best


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--calls", type=int, default=2000, help="calls after which memory is compared")
    parser.add_argument("--repeats", type=int, default=50)
    parser.add_argument("--workers", type=int, help=argparse.SUPPRESS)
    arguments = parser.parse_args()

    board = deltille.Board(10, 11, edge_mm=20)
    camera = deltille.Camera(1600, 1200, 1500)
    detector = deltille.Detector(board)

    if arguments.workers:
        print(rate(detector, board, camera, arguments.workers))
        return

    # An image without a target takes the library least time, so that the overhead of the call dominates.
    blank = numpy.zeros((1200, 1600), numpy.uint8)
    small = numpy.zeros((1, 1), numpy.uint8)
    print(f"call with an image of one pixel: {milliseconds(lambda: detector.detect(small), 2000):.4f} ms")
    print(f"call with a black image of 1600 × 1200: {milliseconds(lambda: detector.detect(blank), arguments.repeats):.3f} ms")

    picture, _ = deltille.render(board, camera, eye=(100, -60, 420))
    of_call = milliseconds(lambda: detector.detect(picture), arguments.repeats)
    print(f"call with a board in 1600 × 1200: {of_call:.2f} ms")
    found = detector.detect(picture)
    arrays = milliseconds(lambda: (found.pixels, found.ids, found.object_points, found.covariances), 200)
    print(f"arrays of the result: {arrays:.4f} ms")
    times = cpu_times(detector, layouts(picture), arguments.repeats)
    for name, of_call in times.items():
        print(f"CPU time of a call with {name}: {of_call:.1f} ms")

    # The library alone, as measured by its own program.
    program = shutil.which("deltille", path=sysconfig.get_path("scripts"))
    with tempfile.TemporaryDirectory() as folder:
        board.save(folder)
        path = Path(folder) / "picture.pgm"
        path.write_bytes(b"P5 1600 1200 255\n" + picture.tobytes())
        command = [program, "bench", "detect", str(path), "--target", str(Path(folder) / "board.json")]
        done = subprocess.run(command, capture_output=True, text=True)
        print("the library alone:")
        print(re.sub(r"^", "    ", done.stdout or done.stderr, flags=re.M).rstrip())

    # The library also splits an image among threads. Their number is fixed at the start, so each one needs its own process.
    rates = {}
    for workers in (1, 2):
        command = [sys.executable, __file__, "--workers", str(workers)]
        environment = {**os.environ, "RAYON_NUM_THREADS": str(workers)}
        done = subprocess.run(command, capture_output=True, text=True, env=environment, check=True)
        rates[workers] = float(done.stdout)
    print(f"1 thread {rates[1]:.1f}, 2 threads {rates[2]:.1f} images/s: {rates[2] / rates[1]:.2f} times")

    tiny, _ = deltille.render(board, deltille.Camera(320, 240, 280), eye=(100, -60, 420))
    for _ in range(200):
        detector.detect(tiny).pixels  # noqa: B018
    gc.collect()
    before = resident()
    for _ in range(arguments.calls):
        found = detector.detect(tiny)
        found.pixels, found.ids, found.object_points, found.covariances, found.tags  # noqa: B018
    gc.collect()
    print(f"{arguments.calls} calls: {(resident() - before) / 1e6:+.2f} MB")


if __name__ == "__main__":
    main()
