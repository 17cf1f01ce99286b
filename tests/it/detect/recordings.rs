//! Frames of videos, MCAP files and bags. `tests/independent/recordings.py` writes the files.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::Stdio;

use assert_cmd::Command;
use deltille::detect::Detection;
use deltille::export::detection;

use crate::common::command::deltille;
use crate::common::folder::names;
use crate::common::page::Page;

/// Time stamps of the frames in the bags, ns.
const TIMES_NS: [i64; 2] = [1_700_000_000_000_000_123, 1_700_000_000_033_366_790];

/// A folder with the board of the recordings, and copies of these.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    deltille(folder.path(), "board --rows 5 --cols 6 --edge 30mm").success();
    let recordings = Path::new(crate::common::REPOSITORY).join("tests/recordings");
    for entry in fs::read_dir(recordings).unwrap().map(Result::unwrap) {
        fs::copy(entry.path(), folder.path().join(entry.file_name())).unwrap();
    }
    folder
}

/// Returns the results of a run in the order of their names.
fn found(folder: &Path) -> Vec<Detection> {
    let read =
        |name: String| detection::read(&fs::read_to_string(folder.join(name)).unwrap()).unwrap();
    names(folder).into_iter().map(read).collect()
}

#[test]
fn frames_have_the_same_corners_in_every_recording() {
    let folder = folder();
    let detect = |images: &str, out: &str| {
        let args = format!("detect {images} --target board.json -o {out}");
        deltille(folder.path(), &args).success();
        found(&folder.path().join(out))
    };
    let expected = detect("run.bag", "ros1");
    assert_eq!(expected.iter().map(|found| found.time_ns.unwrap()).collect::<Vec<_>>(), TIMES_NS);
    assert!(expected.iter().all(|found| found.grids[0].corners.len() == 30));
    assert_eq!([&*expected[0].image, &*expected[1].image], ["run-000000", "run-000001"]);
    assert_eq!(detect("run.db3", "ros2"), expected);
    assert_eq!(detect("run.mcap --topic /camera/image", "mcap"), expected);
    let of_right = detect("run.mcap --topic /right", "right");
    assert_eq!((of_right.len(), of_right[0].time_ns), (1, Some(TIMES_NS[0])));
    let of_video = detect("run.y4m --ink none --track", "video");
    assert_eq!((of_video.len(), of_video[0].time_ns), (1, Some(0)));
    assert_eq!(of_video[0].grids[0].corners.len(), 30);
    assert_eq!(detect("run.bag --every 2", "every").len(), 1);
}

/// The camera of the recordings.
const CAMERA: &str =
    "width: 160\nheight: 120\nmodel: pinhole\nfocal_px: [150.4, 150.4]\ncentre_px: [80, 60]\n";

#[test]
fn poses_have_the_times_of_their_frames() {
    let folder = folder();
    fs::write(folder.path().join("camera.yaml"), CAMERA).unwrap();
    let args = "pose run.db3 --target board.json --camera camera.yaml";
    let lines = deltille(folder.path(), args).success().get_output().stdout.clone();
    let lines = String::from_utf8(lines).unwrap();
    let times: Vec<i64> = lines
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap()["time_ns"].as_i64())
        .map(Option::unwrap)
        .collect();
    assert_eq!(times, TIMES_NS);
}

#[test]
fn interrupted_poses_are_written() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("camera.yaml"), CAMERA).unwrap();
    image::GrayImage::new(160, 120).save(at.join("blank.png")).unwrap();
    let mut pose = std::process::Command::new(env!("CARGO_BIN_EXE_deltille"));
    pose.args(["pose", "run.db3", "blank.png", "-", "--target", "board.json"]);
    pose.args(["--camera", "camera.yaml", "-o", "poses.ndjson"]).current_dir(at);
    pose.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut pose = pose.spawn().unwrap();
    // Reported after the frames of the recording, and before the list on standard input.
    let mut said = BufReader::new(pose.stderr.take().unwrap());
    let mut line = String::new();
    said.read_line(&mut line).unwrap();
    assert!(line.starts_with("blank.png: "), "{line}");
    let id = pose.id().to_string();
    assert!(std::process::Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    line.clear();
    said.read_line(&mut line).unwrap();
    assert_eq!(line, "writing the results; a second signal aborts\n");
    pose.stdin.take().unwrap().write_all(b"blank.png\n").unwrap();
    assert_eq!(pose.wait().unwrap().code(), Some(130));
    assert_eq!(fs::read_to_string(at.join("poses.ndjson")).unwrap().lines().count(), 2);
}

/// Files that end early are read as far as they go.
#[test]
fn unfinished_recordings_are_noted() {
    let folder = folder();
    let path = folder.path().join("run.mcap");
    let whole = fs::read(&path).unwrap();
    fs::write(&path, &whole[..whole.len() * 6 / 10]).unwrap();
    let args = "detect run.mcap --topic /camera/image --target board.json -o out";
    let done = deltille(folder.path(), args).success();
    let said = String::from_utf8(done.get_output().stderr.clone()).unwrap();
    assert!(said.starts_with("note: run.mcap: incomplete after 1 frame: "), "{said}");
}

#[test]
fn messages_name_the_recording_and_the_remedy() {
    let folder = folder();
    let (path, mut page) = (folder.path(), Page::default());
    fs::write(path.join("text.mcap"), "no recording").unwrap();
    fs::write(path.join("text.bag"), "#ROSBAG V2.0\nno recording").unwrap();
    fs::write(path.join("text.db3"), "no recording").unwrap();
    fs::write(path.join("text.y4m"), "YUV4MPEG2 W16\n").unwrap();
    page.title("recordings that are not read");
    fs::create_dir(path.join("videos")).unwrap();
    fs::write(path.join("videos/a.mp4"), "no video").unwrap();
    for images in [
        "run.mcap",
        "run.mcap --topic /left",
        "text.mcap",
        "text.bag",
        "text.db3",
        "text.y4m",
        "absent.mcap",
        "videos",
    ] {
        page.refused(path, &format!("deltille detect {images} --target board.json -o out"));
    }
    page.is("recordings");
}

/// A photograph that cannot be read is an error also among others, and what to install is said.
#[test]
fn photographs_and_videos_without_a_decoder_are_errors() {
    let folder = folder();
    let path = folder.path();
    fs::create_dir(path.join("photos")).unwrap();
    image::GrayImage::new(64, 64).save(path.join("photos/a.png")).unwrap();
    fs::write(path.join("photos/b.HEIC"), "no photograph").unwrap();
    // Converted.
    fs::write(path.join("photos/a.heic"), "no photograph").unwrap();
    fs::write(path.join("photos/c.mov"), "no video").unwrap();
    let run = |images: &str| {
        let mut command = Command::cargo_bin("deltille").unwrap();
        let args = format!("detect {images} --target board.json -o out");
        let command = command.current_dir(path).env("PATH", "").args(args.split_whitespace());
        String::from_utf8(command.assert().failure().get_output().stderr.clone()).unwrap()
    };
    let said = run("photos");
    assert!(said.contains("note: 1 file such as photos/c.mov not read"), "{said}");
    assert!(said.contains("note: 1 HEIC photograph such as photos/a.heic not read"), "{said}");
    assert!(
        said.contains("photos/b.HEIC: a HEIC photograph") && said.contains("convert"),
        "{said}"
    );
    let said = run("photos/c.mov");
    assert!(said.contains("photos/c.mov: videos need the program ffmpeg: install it"), "{said}");
}
