"""Times detection in many images on a Ray cluster of this machine's processors, and kills a worker during the run.

    python python/benches/cluster.py FOLDER                   # 20,000 images, about ten minutes, 1 GB in FOLDER
    python python/benches/cluster.py FOLDER --pictures 2000

Needs ``deltille[ray]``, pillow and psutil. Images are made once: 300 views of a board, each with many noise samples, with 1 %
of the files damaged. They are processed without Ray, by one worker, by two, and by two of which one is killed. Every run must
account for every image, with exactly the same corners.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

os.environ["RAYON_NUM_THREADS"] = "1"

import numpy
import psutil
import pyarrow as pa
import pyarrow.parquet as pq
import ray
from PIL import Image

import deltille
import deltille.ray
from deltille.ray import CORNERS, IMAGES, _Rows

SIZE = (480, 360)
VIEWS = 300
DAMAGED = 0.01


def make(folder: Path, count: int) -> deltille.Target:
    """Makes the images, unless they exist."""
    folder.mkdir(parents=True, exist_ok=True)
    board = deltille.Board(8, 9, edge_mm=20)
    camera = deltille.Camera(*SIZE, 450.0)
    random = numpy.random.default_rng(7)
    middle = board.corners.mean(axis=0)
    eyes = [middle + [*random.uniform(-160, 160, 2), random.uniform(300, 450)] for _ in range(VIEWS)]
    shots = folder / "pictures"
    shots.mkdir(exist_ok=True)
    if len(os.listdir(shots)) == count:
        return board
    views = [deltille.render(board, camera, eye=eye, noise=0.0, dtype="float32")[0] for eye in eyes]
    for index in range(count):
        view = views[index % VIEWS]
        noise = numpy.random.default_rng(index)
        grey = view + noise.normal(0.0, noise.uniform(0.002, 0.02), view.shape)
        path = shots / f"{index:06}.jpg"
        Image.fromarray((grey.clip(0, 1) * 255).round().astype("uint8")).save(path, quality=90)
        if noise.random() < DAMAGED:
            content = path.read_bytes()
            path.write_bytes(content[: int(len(content) * noise.uniform(0.0, 0.9))])
    return board


def by_one_process(shots: Path, board: deltille.Target) -> tuple[pa.Table, pa.Table]:
    """Returns both tables, without Ray."""
    detector = deltille.Detector(board)
    rows = _Rows()
    for path in sorted(shots.iterdir()):
        try:
            found = detector.detect_bytes(path.read_bytes(), name=f"{path}")
        except deltille.Error as error:
            rows.failed(f"{path}", f"{error}")
        else:
            rows.add(f"{path}", found)
    return rows.table("corner"), rows.table("picture")


def in_order(table: pa.Table) -> pa.Table:
    keys = [name for name in ("image", "grid", "row", "col") if name in table.column_names]
    return table.sort_by([(key, "ascending") for key in keys]).combine_chunks()


def written(folder: Path) -> tuple[pa.Table, pa.Table]:
    return pq.read_table(folder / "corners", schema=CORNERS), pq.read_table(folder / "images", schema=IMAGES)


class Watch(threading.Thread):
    """Records the memory of the workers once a second, and optionally kills one of them."""

    def __init__(self, kill_when: float | None, folder: Path, count: int) -> None:
        super().__init__(daemon=True)
        self.kill_when, self.folder, self.count = kill_when, folder, count
        self.killed: int | None = None
        self.memory: dict[int, list[float]] = {}
        # Processor time at the first and the last sample.
        self.processor: dict[int, tuple[float, float]] = {}
        self.is_over = threading.Event()

    def run(self) -> None:
        while not self.is_over.wait(1.0):
            for worker in workers():
                try:
                    self.memory.setdefault(worker.pid, []).append(worker.memory_info().rss / 1e6)
                    used = worker.cpu_times()
                    now = used.user + used.system
                    self.processor[worker.pid] = (self.processor.get(worker.pid, (now, now))[0], now)
                except psutil.NoSuchProcess:
                    continue
            if self.kill_when is not None and self.killed is None:
                written = [pq.read_metadata(path).num_rows for path in (self.folder / "images").glob("*.parquet")]
                if sum(written) >= self.kill_when * self.count:
                    victim = workers()[0]
                    self.killed = victim.pid
                    victim.kill()

    def words(self) -> str:
        """Returns the memory of each worker after a quarter of its time, and its maximum afterwards."""
        parts = []
        for pid, seen in self.memory.items():
            quarter = seen[len(seen) // 4 :]
            dead = ", killed" if pid == self.killed else ""
            parts.append(f"{quarter[0]:.0f} to {max(quarter):.0f} MB in {len(seen)} s{dead}")
        return "; ".join(parts)


def workers() -> list[psutil.Process]:
    """Returns the detecting processes of this run."""
    found = []
    for process in psutil.Process().children(recursive=True):
        try:
            if "_Looking" in " ".join(process.cmdline()):
                found.append(process)
        except psutil.NoSuchProcess:
            continue
    return found


def by_ray(folder: Path, shots: Path, board: deltille.Target, count: int, processes: int, kill: bool) -> float:
    """Runs Ray and returns the time taken, s."""
    shutil.rmtree(folder, ignore_errors=True)
    # The workers take some time to start.
    watch = Watch(0.4 if kill else None, folder, count)
    watch.start()
    before = psutil.cpu_times()
    begin = time.perf_counter()
    summary = deltille.ray.detect_to(folder, shots, board, concurrency=processes)
    seconds = time.perf_counter() - begin
    after = psutil.cpu_times()
    watch.is_over.set()
    watch.join()
    # On a shared machine, this shows the share of processor time that was available.
    busy = sum(getattr(after, kind) - getattr(before, kind) for kind in ("user", "nice", "system"))
    own = sum(last - first for first, last in watch.processor.values())
    if kill and watch.killed is None:
        sys.exit("no worker was killed: use more images")
    what = f"{processes} worker{'s' * (processes > 1)}{', one killed' * kill}"
    print(f"{what}: {seconds:.1f} s, {count / seconds:.0f} images/s, {summary}; {watch.words()}", flush=True)
    print(f"  processor time: {own:.0f} s in workers, {busy:.0f} s in all programs", flush=True)
    return seconds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--pictures", type=int, default=20_000)
    parser.add_argument("--program", help="the program deltille, to calibrate from the results")
    arguments = parser.parse_args()
    folder, count = arguments.folder.resolve(), arguments.pictures
    board = make(folder, count)
    shots = folder / "pictures"
    size = sum(path.stat().st_size for path in shots.iterdir())
    print(f"{count} images of {SIZE[0]} × {SIZE[1]}, {size / 1e6:.0f} MB", flush=True)

    begin = time.perf_counter()
    alone = by_one_process(shots, board)
    seconds = time.perf_counter() - begin
    print(f"without Ray: {seconds:.1f} s, {count / seconds:.0f} images/s; load {os.getloadavg()[0]:.1f}", flush=True)

    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False, logging_level="warning")
    context = ray.data.DataContext.get_current()
    context.enable_progress_bars = False
    one = by_ray(folder / "one", shots, board, count, 1, False)
    two = by_ray(folder / "two", shots, board, count, 2, False)
    by_ray(folder / "killed", shots, board, count, 2, True)
    print(f"two workers over one: {one / two:.2f}; load {os.getloadavg()[0]:.1f}", flush=True)

    failed = []
    for name in ("one", "two", "killed"):
        for what, expected, found in zip(("corners", "images"), alone, written(folder / name)):
            same = in_order(expected).equals(in_order(found))
            failed += [] if same else [f"{name}: {what}"]
            print(f"{name}: {what}: {len(found)} rows, {'the same' if same else 'NOT the same'} as from one process")
    errors = len(alone[1]) - alone[1]["error"].null_count
    print(f"{errors} images could not be read; each has a row with its error")
    again = deltille.ray.detect_to(folder / "killed", shots, board)
    print(f"repeated: {again}")
    failed += [] if (again.pictures, again.skipped) == (0, count) else ["repeated"]
    if arguments.program:
        (folder / "board.json").write_text(board.to_json())
        few = folder / "few"
        shutil.rmtree(few, ignore_errors=True)
        deltille.ray.detect_to(few, [shots / f"{index:06}.jpg" for index in range(40)], board)
        command = [arguments.program, "calibrate", few, "--target", folder / "board.json", "--model", "radtan"]
        done = subprocess.run([*map(str, command), "-o", str(few / "camera")], capture_output=True, text=True)
        focal = json.loads((few / "camera/camera.json").read_text())["parameters"][0] if done.returncode == 0 else None
        print(f"calibrated from 40 of them: {focal or done.stderr}")
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
