"""Detection on a cluster gives the same corners as one process, loses nothing and repeats nothing."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy
import pytest

pytest.importorskip("pyarrow")
ray = pytest.importorskip("ray")
pytest.importorskip("ray.data")
Image = pytest.importorskip("PIL.Image")

import pyarrow as pa
import pyarrow.fs as pafs
import pyarrow.parquet as pq

import deltille
import deltille.ray
from deltille.ray import CORNERS, IMAGES


@pytest.fixture(scope="module", autouse=True)
def cluster():
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False, logging_level="error")
    yield
    ray.shutdown()


@pytest.fixture(scope="module")
def target():
    return deltille.Board(6, 7, edge_mm=20)


@pytest.fixture(scope="module")
def shots(tmp_path_factory, target) -> Path:
    """Nine photographs in two folders, and a file that is not an image."""
    folder = tmp_path_factory.mktemp("shots")
    camera = deltille.Camera(480, 360, 450.0)
    middle = target.corners.mean(axis=0)
    for index in range(9):
        place = folder / ("a" if index < 5 else "b")
        place.mkdir(exist_ok=True)
        eye = middle + [40.0 * (index % 3) - 30.0, 50.0 * (index % 4) - 60.0, 280.0]
        picture, _ = deltille.render(target, camera, eye=eye, seed=index)
        Image.fromarray(picture).save(place / f"{index}.png")
    (folder / "b/broken.png").write_bytes((folder / "b/7.png").read_bytes()[:900])
    (folder / "notes.txt").write_text("no picture")
    return folder


def places(corners) -> dict:
    return {(row["image"], row["id"]): (row["x"], row["y"], row["cov_xx"]) for row in corners}


def expected(shots: Path, target) -> dict:
    detector = deltille.Detector(target)
    found = {}
    for path in sorted(shots.rglob("?.png")):
        seen = detector.detect_file(path)
        for number, pixel, cov in zip(seen.ids, seen.pixels, seen.covariances):
            found[f"{path}", int(number)] = (pixel[0], pixel[1], cov[0, 0])
    return found


def test_a_row_for_each_corner_and_for_each_picture(shots, target):
    corners = deltille.ray.detect(shots, target, batch_size=3)
    rows = corners.take_all()
    assert list(corners.schema().names) == CORNERS.names
    assert places(rows) == expected(shots, target)
    of_board = {int(number): place for number, place in zip(target.corner_ids, target.corners)}
    for row in rows:
        place = [row["target_x_mm"], row["target_y_mm"], row["target_z_mm"]]
        assert numpy.array_equal(place, of_board[row["id"]])

    pictures = deltille.ray.detect([shots / "b", shots / "a/0.png"], target, per="image").take_all()
    assert len(pictures) == 6 and list(pictures[0]) == IMAGES.names
    errors = {row["image"]: row["error"] for row in pictures if row["error"]}
    assert list(errors) == [f"{shots}/b/broken.png"] and "broken.png" in errors[f"{shots}/b/broken.png"]


def test_encoded_files_and_paths_of_a_dataset(shots, target):
    encoded = ray.data.read_binary_files(f"{shots}/a", include_paths=True)
    paths = ray.data.from_items([{"path": f"{path}"} for path in sorted((shots / "a").iterdir())])
    due = {key: place for key, place in expected(shots, target).items() if "/a/" in key[0]}
    for dataset in (encoded, paths):
        assert places(deltille.ray.detect(dataset, target).take_all()) == due
    with pytest.raises(ValueError, match="no column path"):
        deltille.ray.detect(ray.data.range(3), target)


def test_written_results_are_skipped_and_can_be_calibrated(shots, target, tmp_path):
    out = tmp_path / "found"
    first = deltille.ray.detect_to(out, shots / "a", target, images_per_file=2, batch_size=2)
    assert (first.images, first.errors, first.skipped) == (5, 0, 0)
    # The file left by a task that was killed between writing its two files.
    orphan = out / "corners/lost-000000.parquet"
    shutil.copy(next((out / "corners").iterdir()), orphan)
    second = deltille.ray.detect_to(out, shots, target)
    assert (second.images, second.errors, second.skipped) == (5, 1, 5)
    assert not orphan.exists()
    again = deltille.ray.detect_to(out, shots, target)
    assert (again.images, again.skipped) == (0, 10)
    assert len(deltille.ray.done(out)) == 10
    assert places(pq.read_table(out / "corners").to_pylist()) == expected(shots, target)
    of_dataset = ray.data.read_binary_files(f"{shots}/a", include_paths=True)
    assert deltille.ray.detect_to(out, of_dataset, target).images == 0
    assert not [name for _, _, files in os.walk(out) for name in files if name.startswith(".")]

    program = shutil.which("deltille", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    if program is None:
        pytest.skip("the program deltille is not there")
    target.save(tmp_path, formats=[])
    description = next(tmp_path.glob("*.json"))
    single = tmp_path / "single"
    single.mkdir()
    detector = deltille.Detector(target)
    for image in sorted(shots.rglob("?.png")):
        (single / f"{image.stem}.json").write_text(detector.detect_file(image).to_json())
    cameras = []
    for of in (out, single):
        command = [program, "calibrate", of, "--target", description, "--model", "radtan", "-o", tmp_path / of.name]
        done = subprocess.run([f"{part}" for part in command], capture_output=True, text=True)
        assert done.returncode in (0, 1), done.stderr
        cameras.append((tmp_path / of.name / "camera.yaml").read_text())
    assert cameras[0] == cameras[1]


def test_errors_and_changed_files_are_processed_again(shots, video, target, tmp_path):
    folder, found = tmp_path / "shots", tmp_path / "found"
    shutil.copytree(shots / "b", folder)
    recording = Path(shutil.copy(video, folder / "run.y4m"))
    run = lambda **options: deltille.ray.detect_to(found, [folder, recording], target, images_per_file=2, **options)
    assert run().images == 12
    shutil.copy(folder / "6.png", folder / "broken.png")
    shutil.copy(folder / "5.png", folder / "8.png")
    (folder / "extra.png").write_bytes(b"no image")
    again = run()
    assert (again.images, again.errors, again.skipped) == (3, 1, 3)
    os.utime(recording, (1, 1))
    retried = run(retry_errors=True)
    assert (retried.images, retried.errors, retried.skipped) == (1 + 7, 1, 5)
    assert run().images == 0
    images = pq.read_table(found / "images")["image"].to_pylist()
    assert len(images) == len(set(images)) == 13 and deltille.ray.done(found) == set(images)
    corners = places(pq.read_table(found / "corners").to_pylist())
    assert len(corners) == pq.read_table(found / "corners").num_rows
    assert {key: place for key, place in corners.items() if ".png" in key[0]} == expected(folder, target) | {
        (f"{folder}/broken.png", number): place for (path, number), place in corners.items() if path.endswith("/6.png")
    }


def test_filesystems(shots, target):
    inside = pafs.SubTreeFileSystem(f"{shots}", pafs.LocalFileSystem())
    pictures = deltille.ray.detect("a", target, per="image", filesystem=inside).take_all()
    assert sorted(row["image"] for row in pictures) == [f"a/{index}.png" for index in range(5)]
    uri = deltille.ray.detect(f"file://{shots}/a", target, per="image").take_all()
    assert {row["corners"] for row in uri} == {row["corners"] for row in pictures}


@pytest.fixture(scope="module")
def video(tmp_path_factory, target) -> Path:
    """A video of seven frames, uncompressed."""
    camera = deltille.Camera(480, 360, 450.0)
    middle = target.corners.mean(axis=0)
    eyes = [middle + [10.0 * index - 30.0, -60.0, 280.0] for index in range(7)]
    shots = [deltille.render(target, camera, eye=eye, seed=index)[0] for index, eye in enumerate(eyes)]
    path = tmp_path_factory.mktemp("video") / "run.y4m"
    path.write_bytes(b"YUV4MPEG2 W480 H360 F30:1 Cmono\n" + b"".join(b"FRAME\n" + shot.tobytes() for shot in shots))
    return path


def test_a_recording_is_divided_among_processes(video, shots, target):
    detector = deltille.Detector(target)
    due = {}
    for frame in deltille.frames(video):
        found = detector.detect(frame)
        for number, pixel, cov in zip(found.ids, found.pixels, found.covariances):
            due[f"{video.parent / frame.name}", int(number)] = (pixel[0], pixel[1], cov[0, 0])
    for batch_size in (1, 3, 64):
        assert places(deltille.ray.detect(video, target, batch_size=batch_size).take_all()) == due
    assert places(deltille.ray.detect([video, shots], target, batch_size=2).take_all()) == due | expected(shots, target)
    third = deltille.ray.detect(video, target, per="image", every=3, batch_size=1).take_all()
    assert {Path(row["image"]).name: row["time_ns"] for row in third} == {
        frame.name: frame.time_ns for frame in deltille.frames(video, every=3)
    }


def test_frames_with_results_are_skipped(video, target, tmp_path):
    first = deltille.ray.detect_to(tmp_path / "found", video, target, every=2)
    assert (first.images, first.errors) == (4, 0)
    assert deltille.ray.detect_to(tmp_path / "found", video, target).images == 3
    assert deltille.ray.detect_to(tmp_path / "found", video, target).images == 0
    images = pq.read_table(tmp_path / "found/images")["image"].to_pylist()
    assert sorted(images) == [f"{video.parent / 'run'}-{number:06}" for number in range(7)]


def test_recordings_that_cannot_be_read_have_errors(video, root, target, tmp_path):
    bag = root / "tests/recordings/run.mcap"
    (row,) = deltille.ray.detect(bag, target, per="image").take_all()
    assert row["image"] == f"{bag}" and "choose one with topic" in row["error"]
    rows = deltille.ray.detect(bag, target, per="image", topic="/camera/image").take_all()
    assert sorted(Path(row["image"]).name for row in rows) == ["run-000000", "run-000001"]
    cut = tmp_path / "cut.y4m"
    cut.write_bytes(video.read_bytes()[:-1000])
    with pytest.warns(UserWarning, match="incomplete after 6 frames"):
        assert deltille.ray.detect(cut, target, per="image").count() == 6
    with pytest.raises(ValueError, match="every"):
        deltille.ray.detect(video, target, every=0)


def test_errors_are_reported_before_work_starts(shots, target, tmp_path):
    with pytest.raises(FileNotFoundError, match="nowhere"):
        deltille.ray.detect(shots / "nowhere", target)
    with pytest.raises(ValueError, match="per"):
        deltille.ray.detect(shots, target, per="row")
    with pytest.raises(deltille.Error):
        deltille.ray.detect(shots)
    # A folder without images is not an error; an earlier run may have emptied it.
    (tmp_path / "empty").mkdir()
    assert deltille.ray.detect(tmp_path / "empty", target).count() == 0
    assert deltille.ray.detect_to(tmp_path / "out", tmp_path / "empty", target).images == 0


def test_both_tables_are_one_dataset(shots, target):
    both = deltille.ray.detect(shots / "a", target, per="both").to_arrow_refs()
    table = pa.concat_tables(ray.get(both), promote_options="permissive")
    assert table["corners"].to_pylist() == [len(row) for row in table["found"].to_pylist()]


def test_a_folder_of_another_target_is_rejected(tmp_path):
    board, other = deltille.Board(5, 6, edge_mm=20), deltille.Board(5, 7, edge_mm=20)
    camera = deltille.Camera(320, 240, 300)
    pictures = tmp_path / "images"
    pictures.mkdir()
    picture, _ = deltille.render(board, camera, eye=(50, 40, 250))
    (pictures / "one.pgm").write_bytes(b"P5 320 240 255\n" + picture.tobytes())
    found = tmp_path / "found"
    assert deltille.ray.detect_to(found, pictures, board).images == 1
    assert deltille.ray.detect_to(found, pictures, board).skipped == 1
    for changed in ({"target": other}, {"target": board, "tone": "linear"}):
        with pytest.raises(deltille.DetectionError, match="use another folder"):
            deltille.ray.detect_to(found, pictures, **changed)


def test_the_example(root, shots, target, tmp_path):
    """As a script, on a cluster of its own."""
    target.save(tmp_path, formats=[])
    description = next(tmp_path.glob("*.json"))
    command = [sys.executable, root / "python/examples/cluster.py", description, shots, tmp_path / "found"]
    done = subprocess.run([f"{part}" for part in command], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "10 images" in done.stdout and "1 errors, 0 skipped" in done.stdout and "broken.png: " in done.stdout
