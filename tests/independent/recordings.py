"""Recordings that other programs write, compared with the same frames as PNG.

    recordings.py <deltille> <folder> [megabytes]
    recordings.py <deltille> tests/recordings samples

Frames of a moving board, drawn by `deltille render`, are written by `rosbags`, `mcap`, OpenCV, Pillow and ffmpeg: bags of
ROS 1 and 2 with every encoding, storage and compression, in both byte orders, and videos without loss. `deltille detect`
must find exactly the corners that it finds in PNG files, and report the time stamps. Damaged files must be read as far as
they go. With a number of megabytes, only a bag of this size is read, and the peak memory is printed. The second form
writes small recordings for the tests in Rust.
"""

import json
import pathlib
import resource
import sqlite3
import subprocess
import sys
import tempfile

import cv2
import numpy as np
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

FRAMES = 5
SIZE = (640, 480)
START_NS = 1_700_000_000_000_000_123
STEP_NS = 33_366_667

ROS1, ROS2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)
IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
BAYER = ("rggb", "grbg", "gbrg", "bggr")
RAW = ["mono8", "8UC1", "mono16", "rgb8", "bgr8", "rgba8", "bgra8", "yuv422", "yuv422_yuy2", *(f"bayer_{order}{bits}" for order in BAYER for bits in (8, 16))]


def run(*command, expect=0):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    assert done.returncode == expect, (command, done.returncode, done.stdout[-2000:], done.stderr[-2000:])
    return done


def stamp(index):
    return START_NS + index * STEP_NS


def header(store, index, time_ns=None):
    time_ns = stamp(index) if time_ns is None else time_ns
    time = store.types["builtin_interfaces/msg/Time"](sec=time_ns // 10**9, nanosec=time_ns % 10**9)
    sequence = {"seq": index} if store is ROS1 else {}
    return store.types["std_msgs/msg/Header"](stamp=time, frame_id="camera", **sequence)


def coloured(frame, encoding):
    """Pixels in an encoding: greys as colours, or the frame as the mosaic of a grey scene."""
    deep = frame.astype(np.uint16) * 257
    if encoding in ("rgb8", "bgr8"):
        return np.repeat(frame[..., None], 3, 2)
    if encoding in ("rgba8", "bgra8"):
        return np.dstack([np.repeat(frame[..., None], 3, 2), np.full_like(frame, 9)])
    if encoding.startswith("yuv422"):
        planes = [np.full_like(frame, 128), frame]
        return np.dstack(planes[::-1] if encoding.endswith("yuy2") else planes)
    return deep if encoding.endswith("16") else frame


def raw(store, index, frame, encoding, big=False, gap=0, time_ns=None):
    pixels = coloured(frame, encoding)
    pixels = pixels.astype(pixels.dtype.newbyteorder(">" if big else "<"))
    rows = np.frombuffer(pixels.tobytes(), np.uint8).reshape(len(frame), -1)
    rows = np.pad(rows, ((0, 0), (0, gap)), constant_values=77)
    height, width = frame.shape
    return store.types[IMAGE](
        header=header(store, index, time_ns), height=height, width=width, encoding=encoding, is_bigendian=int(big),
        step=rows.shape[1], data=rows.ravel(),
    )


def compressed(store, index, frame, end):
    data = cv2.imencode(f".{end}", frame, [cv2.IMWRITE_JPEG_QUALITY, 100])[1].ravel()
    return store.types[COMPRESSED](header=header(store, index), format=end, data=data)


def bag1(path, messages, compression=None, more=()):
    """A bag of ROS 1; `more` are (topic, type, messages)."""
    path.unlink(missing_ok=True)
    writer = Writer1(path)
    if compression:
        writer.set_compression(compression)
    with writer:
        for topic, kind, of_topic in [("/camera/image", messages[0].__msgtype__, messages), *more]:
            connection = writer.add_connection(topic, kind, typestore=ROS1)
            for index, message in enumerate(of_topic):
                writer.write(connection, stamp(index) + 7, ROS1.serialize_ros1(message, kind))
    return path


def bag2(path, messages, storage, mode=CompressionMode.NONE, more=(), little=True):
    if path.exists():
        run("rm", "-r", path)
    writer = Writer2(path, version=9, storage_plugin=storage)
    if mode is not CompressionMode.NONE:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        for topic, kind, of_topic in [("/camera/image", messages[0].__msgtype__, messages), *more]:
            connection = writer.add_connection(topic, kind, typestore=ROS2)
            for index, message in enumerate(of_topic):
                data = ROS2.serialize_cdr(message, kind, little_endian=little)
                writer.write(connection, stamp(index) + 7, data)
    return path


def mcap(path, messages, compression, is_ros1=False, chunk=1 << 16):
    store = ROS1 if is_ros1 else ROS2
    with open(path, "wb") as out:
        writer = Writer(out, compression=compression, use_chunking=compression is not None, chunk_size=chunk)
        writer.start(profile="ros1" if is_ros1 else "ros2")
        kind = messages[0].__msgtype__
        schema = writer.register_schema(kind.replace("/msg/", "/") if is_ros1 else kind, "ros1msg" if is_ros1 else "ros2msg", b"")
        channel = writer.register_channel("/camera/image", "ros1" if is_ros1 else "cdr", schema)
        for index, message in enumerate(messages):
            data = store.serialize_ros1(message, kind) if is_ros1 else store.serialize_cdr(message, kind)
            writer.add_message(channel, stamp(index) + 7, bytes(data), stamp(index) + 7)
        writer.finish()
    return path


def rendered(program, folder, size=SIZE, count=FRAMES, noise=1):
    """The board, and frames in which it moves."""
    run(program, "board", "--rows", 5, "--cols", 6, "--edge", "30mm", "--no-verify", "-o", folder, "--force")
    camera = folder / "camera.yaml"
    (width, height), focal = size, 0.94 * size[0]
    camera.write_text(f"width: {width}\nheight: {height}\nmodel: pinhole\nfocal_px: [{focal}, {focal}]\ncentre_px: [{width / 2}, {height / 2}]\n")
    frames = []
    (folder / "png").mkdir(exist_ok=True)
    for index in range(count):
        path = folder / "png" / f"{index:06}.png"
        eye = f"{60 + 15 * index},{-40 + 5 * index},{330 + 5 * index}"
        run(program, "render", folder / "board.json", "--camera", camera, f"--eye={eye}", "--seed", index, "--noise", noise, "-o", path, "--force")
        frames.append(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE))
        path.with_suffix(".json").unlink()
    return folder / "board.json", frames


class Check:
    def __init__(self, program, folder):
        self.program, self.folder = program, folder
        self.board, self.frames = rendered(program, folder)
        self.expected = {8: self.of_pngs("png", self.frames)}
        self.expected[16] = self.of_pngs("png16", [frame.astype(np.uint16) * 257 for frame in self.frames])
        self.count = 0

    def of_pngs(self, name, frames):
        (self.folder / name).mkdir(exist_ok=True)
        for index, frame in enumerate(frames):
            cv2.imwrite(str(self.folder / name / f"{index:06}.png"), frame)
        return self.detect(self.folder / name)

    def detect(self, path, *options, expect=0):
        out = self.folder / "out"
        run("rm", "-rf", out)
        self.last = run(self.program, "detect", path, "--target", self.board, "-o", out, *options, expect=expect)
        return [json.loads(file.read_text()) for file in sorted(out.glob("*.json"))]

    def equal(self, path, *options, bits=8, stamps=stamp, count=FRAMES, expected=None):
        found = self.detect(path, *options)
        assert len(found) == count, (path, len(found), self.last.stderr)
        for index, (one, other) in enumerate(zip(found, expected or self.expected[bits])):
            assert one["grids"] == other["grids"] and one["grids"][0]["corners"], f"{path}: frame {index}"
            if stamps:
                assert one["time_ns"] == stamps(index), f"{path}: {one['time_ns']}, not {stamps(index)}"
        self.count += 1

    def refused(self, path, words, *options):
        self.detect(path, *options, expect=2)
        line = self.last.stderr.strip()
        assert "\n" not in line and words in line and path.name in line, line
        self.count += 1
        return line


def encodings(check, folder):
    for encoding in RAW:
        bits = 16 if encoding.endswith("16") else 8
        for big in (False, True) if bits == 16 else (False,):
            messages = [raw(ROS2, i, frame, encoding, big, gap=i) for i, frame in enumerate(check.frames)]
            check.equal(mcap(folder / "run.mcap", messages, CompressionType.ZSTD), bits=bits)
    for end in ("png", "jpg"):
        expected = None
        if end == "jpg":
            (folder / "jpg").mkdir(exist_ok=True)
            for index, frame in enumerate(check.frames):
                cv2.imwrite(str(folder / "jpg" / f"{index:06}.jpg"), frame, [cv2.IMWRITE_JPEG_QUALITY, 100])
            expected = check.detect(folder / "jpg")
        check.equal(bag1(folder / "run.bag", [compressed(ROS1, i, f, end) for i, f in enumerate(check.frames)]), expected=expected)
        bag = bag2(folder / "bag", [compressed(ROS2, i, f, end) for i, f in enumerate(check.frames)], StoragePlugin.SQLITE3)
        check.equal(bag, expected=expected)


def storages(check, folder):
    of = lambda store: [raw(store, i, frame, "mono8") for i, frame in enumerate(check.frames)]
    for compression in (None, Writer1.CompressionFormat.BZ2, Writer1.CompressionFormat.LZ4):
        check.equal(bag1(folder / "run.bag", of(ROS1), compression))
    for compression in (None, CompressionType.NONE, CompressionType.LZ4, CompressionType.ZSTD):
        check.equal(mcap(folder / "run.mcap", of(ROS2), compression))
        check.equal(mcap(folder / "run.mcap", of(ROS1), compression, is_ros1=True))
    for storage in (StoragePlugin.SQLITE3, StoragePlugin.MCAP):
        for mode in (CompressionMode.NONE, CompressionMode.MESSAGE):
            bag = bag2(folder / "bag", of(ROS2), storage, mode)
            check.equal(bag)
            if mode is CompressionMode.NONE:
                check.equal(next(file for file in bag.iterdir() if file.suffix != ".yaml"))
                (bag / "metadata.yaml").unlink()
                check.equal(bag)
    check.equal(bag2(folder / "bag", of(ROS2), StoragePlugin.SQLITE3, little=False))
    bag = bag2(folder / "bag", of(ROS2), StoragePlugin.SQLITE3, CompressionMode.FILE)
    check.refused(bag, "zstd -d")
    # Without a stamp in the header, the time of the recording counts.
    unstamped = [raw(ROS2, i, frame, "mono8", time_ns=0) for i, frame in enumerate(check.frames)]
    check.equal(mcap(folder / "run.mcap", unstamped, CompressionType.LZ4), stamps=lambda index: stamp(index) + 7)


def topics(check, folder):
    half = lambda store: [raw(store, i, frame, "mono8") for i, frame in enumerate(check.frames[:3])]
    for bag in (
        bag1(folder / "run.bag", [raw(ROS1, i, f, "mono8") for i, f in enumerate(check.frames)], more=[("/right", IMAGE, half(ROS1))]),
        bag2(folder / "bag", [raw(ROS2, i, f, "mono8") for i, f in enumerate(check.frames)], StoragePlugin.SQLITE3, more=[("/right", IMAGE, half(ROS2))]),
        bag2(folder / "bag2", [raw(ROS2, i, f, "mono8") for i, f in enumerate(check.frames)], StoragePlugin.MCAP, more=[("/right", IMAGE, half(ROS2))]),
    ):
        check.equal(bag, "--topic", "/camera/image")
        check.equal(bag, "--topic", "/right", count=3)
        check.refused(bag, "/camera/image, /right")
        check.refused(bag, "`/left` is not a topic with images", "--topic", "/left")


def damaged(check, folder):
    of = lambda store: [raw(store, i, frame, "mono8") for i, frame in enumerate(check.frames)]
    files = [bag1(folder / "run.bag", of(ROS1)), mcap(folder / "run.mcap", of(ROS2), CompressionType.LZ4), mcap(folder / "plain.mcap", of(ROS2), None)]
    bag = bag2(folder / "bag", of(ROS2), StoragePlugin.SQLITE3)
    files.append(next(bag.glob("*.db3")))
    for path in files:
        whole = path.read_bytes()
        path.write_bytes(whole[: len(whole) * 7 // 10])
        check.equal(path, count=len(check.detect(path)))
        assert len(check.detect(path)) in (2, 3), path
        assert f"{path.name}: incomplete after" in check.last.stderr, check.last.stderr
        path.write_bytes(whole[:11])
        check.refused(path, path.name)
    text = folder / "text.mcap"
    text.write_text("no recording")
    check.refused(text, "not an MCAP file")


def videos(check, folder):
    height, width = check.frames[0].shape
    grey = b"".join(frame.tobytes() for frame in check.frames)
    planes = b"".join(frame.tobytes() + bytes([128]) * (width * height // 2) for frame in check.frames)
    source = lambda format: ["ffmpeg", "-y", "-v", "error", "-f", "rawvideo", "-pix_fmt", format, "-s", f"{width}x{height}", "-r", "30000/1001", "-i", "pipe:0"]

    def write(path, *options, data=planes, format="yuv420p"):
        subprocess.run([*source(format), *options, str(folder / path)], input=data, check=True)
        return folder / path

    time = lambda index: index * 1001 * 10**9 // 30000
    near = lambda index: round(round(index * 1001 / 30) * 10**6)
    lossless = ("-c:v", "libx264", "-qp", "0", "-bf", "2")
    check.equal(write("run.y4m", "-f", "yuv4mpegpipe"), stamps=time)
    check.equal(write("grey.y4m", "-f", "yuv4mpegpipe", data=grey, format="gray"), stamps=time)
    for end in ("mp4", "mov"):
        check.equal(write(f"run.{end}", *lossless, "-video_track_timescale", "30000"), stamps=time)
    check.equal(write("run.mkv", *lossless), stamps=near)
    check.equal(write("run.avi", "-c:v", "ffv1"), stamps=time)
    check.equal(write("run.webm", "-c:v", "libvpx-vp9", "-lossless", "1"), stamps=near)
    check.equal(folder / "run.mp4", "--every", "2", count=3, stamps=lambda index: time(2 * index), expected=check.expected[8][::2])

    # A phone held upright: stored in landscape, shown in portrait, as OpenCV shows it.
    plain = write("landscape.mp4", *lossless)
    turned = folder / "portrait.mp4"
    run("ffmpeg", "-y", "-v", "error", "-i", plain, "-c", "copy", "-metadata:s:v:0", "rotate=90", turned)
    shown = cv2.cvtColor(cv2.VideoCapture(str(turned)).read()[1], cv2.COLOR_BGR2GRAY).astype(float)
    off = lambda way: np.abs(cv2.rotate(check.frames[0], way) - shown).mean()
    way = min((cv2.ROTATE_90_CLOCKWISE, cv2.ROTATE_90_COUNTERCLOCKWISE), key=off)
    expected = check.of_pngs("turned", [cv2.rotate(frame, way) for frame in check.frames])
    check.equal(turned, stamps=None, expected=expected)

    cut = folder / "cut.mkv"
    cut.write_bytes((folder / "run.mkv").read_bytes()[: -(folder / "run.mkv").stat().st_size // 3])
    check.detect(cut)
    assert "cut.mkv: incomplete after" in check.last.stderr, check.last.stderr
    text = folder / "text.mp4"
    text.write_text("no video")
    check.refused(text, "ffmpeg reports")
    # Without ffmpeg, the message says what to install.
    done = subprocess.run([check.program, "detect", plain, "--target", check.board, "-o", folder / "out"], env={"PATH": ""}, capture_output=True, text=True)
    assert done.returncode == 2 and "install" in done.stderr, done.stderr
    # A tracked video has the same corners, to within a fraction of their standard deviations.
    check.equal(folder / "run.mp4", "--track", "--ink", "none", stamps=time, expected=check.detect(folder / "png", "--track", "--ink", "none"))


def samples(program, folder):
    """Small recordings of two frames: MCAP with two topics, bags of ROS 1 and 2, and a video."""
    with tempfile.TemporaryDirectory() as scratch:
        _, frames = rendered(program, pathlib.Path(scratch), (160, 120), 2, 0)
        bag = bag2(pathlib.Path(scratch) / "bag", [compressed(ROS2, i, f, "png") for i, f in enumerate(frames)], StoragePlugin.SQLITE3)
        (folder / "run.db3").unlink(missing_ok=True)
        with sqlite3.connect(next(bag.glob("*.db3"))) as database:
            database.executescript(f"PRAGMA page_size = 512; VACUUM INTO '{folder / 'run.db3'}';")
        bag = bag2(pathlib.Path(scratch) / "bag", [raw(ROS2, i, f, "mono8") for i, f in enumerate(frames)], StoragePlugin.MCAP, more=[("/right", COMPRESSED, [compressed(ROS2, 0, frames[0], "png")])])
        with open(next(bag.glob("*.mcap")), "rb") as file, open(folder / "run.mcap", "wb") as out:
            reader, writer = make_reader(file), Writer(out, compression=CompressionType.ZSTD, chunk_size=1 << 14)
            writer.start(profile="ros2")
            schemas, channels = {}, {}
            for schema, channel, message in reader.iter_messages():
                if channel.id not in channels:
                    schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, b"")
                    channels[channel.id] = writer.register_channel(channel.topic, "cdr", schemas[schema.id])
                writer.add_message(channels[channel.id], message.log_time, message.data, message.publish_time)
            writer.finish()
    bag1(folder / "run.bag", [raw(ROS1, i, f, "mono8") for i, f in enumerate(frames)], Writer1.CompressionFormat.BZ2)
    size = f"{frames[0].shape[1]}x{frames[0].shape[0]}"
    grey = b"".join(frame.tobytes() for frame in frames)
    command = ["ffmpeg", "-y", "-v", "error", "-f", "rawvideo", "-pix_fmt", "gray", "-s", size, "-r", "25", "-i", "pipe:0"]
    subprocess.run([*command, "-frames:v", "1", "-f", "yuv4mpegpipe", str(folder / "run.y4m")], input=grey, check=True)


def large(check, folder, megabytes):
    """The peak memory while a large bag is read."""
    size = check.frames[0].size
    count = megabytes * 1_000_000 // size
    path = folder / "large.mcap"
    frames = (raw(ROS2, i, check.frames[i % FRAMES], "mono8") for i in range(count))
    with open(path, "wb") as out:
        writer = Writer(out, compression=CompressionType.NONE)
        writer.start(profile="ros2")
        schema = writer.register_schema(IMAGE, "ros2msg", b"")
        channel = writer.register_channel("/camera/image", "cdr", schema)
        for index, message in enumerate(frames):
            writer.add_message(channel, stamp(index), bytes(ROS2.serialize_cdr(message, IMAGE)), stamp(index))
        writer.finish()
    found = check.detect(path, "--track", "--format", "csv", "--ink", "none")
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(f"{path.stat().st_size / 1e6:.0f} MB, {count} frames: peak memory {peak:.0f} MB")
    path.unlink()


def main(program, folder, megabytes="0"):
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    if megabytes == "samples":
        return samples(program, folder)
    check = Check(program, folder)
    if int(megabytes):
        return large(check, folder, int(megabytes))
    for part in (encodings, storages, topics, damaged, videos):
        before = check.count
        part(check, folder)
        print(f"{part.__name__}: {check.count - before} comparisons", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
