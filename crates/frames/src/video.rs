//! Compressed video, decoded by an installed ffmpeg.
//!
//! ffmpeg writes the luma of each frame as Y4M to a pipe, and the time stamps in its log. The pipe holds few frames, so
//! ffmpeg waits for the reader. It rotates frames as the metadata of the video states.

use std::io::{BufRead, BufReader, ErrorKind};
use std::path::Path;
use std::process::{Child, ChildStderr, ChildStdout, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};

use deltille_core::raster::AnyGray;
use deltille_core::words::cut;
use deltille_files::limits::Limits;

use crate::problem::Problem;
use crate::y4m::Y4m;

/// The program, found through `PATH`.
const FFMPEG: &str = "ffmpeg";

/// Versions that know `-vsync` but not `-fps_mode`.
const OLD_VERSIONS: [&str; 4] =
    ["ffmpeg version 3.", "ffmpeg version 4.", "ffmpeg version n4.", "ffmpeg version 5.0"];

/// What ffmpeg states about a frame: its time stamp, ns, and its width and height, px.
type Stated = (Option<i64>, Option<[usize; 2]>);

/// A decoded frame.
pub(crate) struct VideoFrame {
    pub(crate) time_ns: Option<i64>,
    /// Fraction of the video up to this frame, if its duration is known.
    pub(crate) part: Option<f64>,
    pub(crate) image: AnyGray,
}

/// The frames of a video.
pub(crate) struct Video {
    child: Child,
    /// The frames, until the end.
    frames: Option<Y4m<BufReader<ChildStdout>>>,
    /// Time stamps in the order of the frames, ns, and sizes, px.
    stated: Receiver<Stated>,
    /// Reads the log, and returns the first error.
    log: Option<JoinHandle<Option<String>>>,
    /// Duration, ns; 0 while it is not known.
    duration_ns: Arc<AtomicI64>,
    limits: Limits,
    has_frames: bool,
    has_ended: bool,
}

impl Video {
    /// Starts ffmpeg. With `is_rotated`, frames are rotated as the metadata states.
    pub(crate) fn open(path: &Path, is_rotated: bool, limits: &Limits) -> Result<Self, Problem> {
        // A missing file is not a problem of ffmpeg.
        std::fs::File::open(path).map_err(Problem::Io)?;
        let mut file = std::ffi::OsString::from("file:");
        file.push(path);
        let mut command = Command::new(FFMPEG);
        command.args(["-nostdin", "-hide_banner", "-nostats", "-loglevel", "level+info"]);
        // A playlist must not open other addresses.
        command.args(["-protocol_whitelist", "file"]);
        if !is_rotated {
            command.arg("-noautorotate");
        }
        command.arg("-i").arg(file).args(["-map", "0:v:0"]);
        command.args(["-vf", "extractplanes=y,showinfo=checksum=0"]);
        command.args(every_frame_once()?);
        command.args(["-f", "yuv4mpegpipe", "-strict", "-1", "pipe:1"]);
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        // Ctrl-C is for this program, which ends ffmpeg.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn().map_err(not_started)?;
        let (sender, stated) = channel();
        let duration_ns = Arc::new(AtomicI64::new(0));
        let duration = Arc::clone(&duration_ns);
        let read = move |log| thread::spawn(move || read_log(log, &sender, &duration));
        let log = child.stderr.take().map(read);
        let limits = *limits;
        let (has_frames, has_ended) = (false, false);
        Ok(Self { child, frames: None, stated, log, duration_ns, limits, has_frames, has_ended })
    }

    fn next_frame(&mut self) -> Result<Option<VideoFrame>, Problem> {
        if let Some(pipe) = self.child.stdout.take() {
            self.frames = Y4m::open(BufReader::new(pipe), &self.limits)?;
        }
        let Some(frames) = &mut self.frames else { return Ok(None) };
        let Some(image) = frames.next_frame()? else { return Ok(None) };
        let (time_ns, size) = self.stated.recv().unwrap_or_default();
        // ffmpeg scales all frames to the size of the first.
        let [width, height] = [image.width(), image.height()];
        if let Some([other_width, other_height]) = size.filter(|size| *size != [width, height]) {
            return Err(Problem::Unsupported(format!(
                "the size of the frames changes from {width} × {height} to {other_width} × {other_height} px; split the video"
            )));
        }
        let duration = self.duration_ns.load(Ordering::Relaxed);
        let part = |time: i64| (time as f64 / duration as f64).clamp(0.0, 1.0);
        let part = time_ns.filter(|_| duration > 0).map(part);
        Ok(Some(VideoFrame { time_ns, part, image }))
    }

    /// Returns the error of ffmpeg after the last frame, if there is one.
    fn end(&mut self) -> Option<Problem> {
        let status = self.child.wait();
        let error = self.log.take().and_then(|log| log.join().ok().flatten());
        let error = error.or_else(|| match status {
            Ok(status) if status.success() => None,
            Ok(status) => Some(status.to_string()),
            Err(error) => Some(error.to_string()),
        });
        let why = match self.has_frames {
            true => "",
            false => ", so the video was not finished, not copied completely, or is damaged",
        };
        error.map(|error| Problem::Damaged(format!("ffmpeg reports: {}{why}", cut(&error))))
    }
}

impl Iterator for Video {
    type Item = Result<VideoFrame, Problem>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.has_ended {
            return None;
        }
        let next = self.next_frame();
        if let Ok(Some(frame)) = next {
            self.has_frames = true;
            return Some(Ok(frame));
        }
        self.has_ended = true;
        if let Err(problem @ (Problem::Exceeded(_) | Problem::Unsupported(_))) = next {
            return Some(Err(problem));
        }
        // ffmpeg knows more about a stream that it ended early.
        self.end().or(next.err()).map(Err)
    }
}

impl Drop for Video {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Returns the options that write each frame once, at any frame rate.
fn every_frame_once() -> Result<[&'static str; 2], Problem> {
    let version = Command::new(FFMPEG).arg("-version").stdin(Stdio::null()).output();
    let version = version.map_err(not_started)?.stdout;
    let is_old = OLD_VERSIONS.iter().any(|old| version.starts_with(old.as_bytes()));
    Ok(if is_old { ["-vsync", "0"] } else { ["-fps_mode", "passthrough"] })
}

fn not_started(error: std::io::Error) -> Problem {
    match error.kind() {
        ErrorKind::NotFound => Problem::NoFfmpeg,
        _ => Problem::Unsupported(format!("ffmpeg cannot be started: {error}")),
    }
}

/// Sends the time stamp and size of each frame, sets the duration, and returns the first error.
fn read_log(log: ChildStderr, stated: &Sender<Stated>, duration: &AtomicI64) -> Option<String> {
    let (mut time_base, mut error) = (None, None);
    for line in BufReader::new(log).split(b'\n').map_while(Result::ok) {
        let line = String::from_utf8_lossy(&line);
        let line = line.trim_end();
        if line.starts_with("[Parsed_showinfo") {
            time_base = after(line, "config in time_base: ").and_then(ratio).or(time_base);
            if let Some(stamp) = after(line, " pts:") {
                let time = stamp.parse().ok().zip(time_base);
                let time_ns = time.and_then(|(pts, base)| in_ns(pts, base));
                // The reader may have stopped.
                let _ = stated.send((time_ns, after(line, " s:").and_then(size)));
            }
        } else if let Some(ns) = after(line, "  Duration: ").and_then(clock_ns) {
            duration.store(ns, Ordering::Relaxed);
        } else if let Some((_, what)) =
            line.split_once("[error] ").or_else(|| line.split_once("[fatal] "))
        {
            error.get_or_insert_with(|| what.to_owned());
        }
    }
    error
}

/// Returns the word after a mark.
fn after<'a>(line: &'a str, mark: &str) -> Option<&'a str> {
    let (_, rest) = line.split_once(mark)?;
    rest.split_whitespace().next()
}

/// Parses a time base such as `1/15360,`.
fn ratio(text: &str) -> Option<[i64; 2]> {
    let (seconds, parts) = text.trim_end_matches(',').split_once('/')?;
    Some([seconds.parse().ok()?, parts.parse().ok().filter(|parts| *parts > 0)?])
}

/// Parses a size such as `640x480`.
fn size(text: &str) -> Option<[usize; 2]> {
    let (width, height) = text.split_once('x')?;
    Some([width.parse().ok()?, height.parse().ok()?])
}

/// Parses a duration such as `00:01:02.50,`, ns.
fn clock_ns(text: &str) -> Option<i64> {
    let parts = text.trim_end_matches(',').split(':');
    let seconds = parts.map(|part| part.parse::<f64>().ok().filter(|part| *part >= 0.0));
    let seconds = seconds.reduce(|all, part| Some(60.0 * all? + part?))??;
    Some((1e9 * seconds) as i64)
}

/// Returns a time stamp in units of a time base, s, as ns.
fn in_ns(pts: i64, [seconds, parts]: [i64; 2]) -> Option<i64> {
    let ns = i128::from(pts) * i128::from(seconds) * 1_000_000_000;
    i64::try_from(ns.div_euclid(parts.into())).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_stamps_are_exact() {
        let base = ratio("1001/30000,").unwrap();
        assert_eq!(in_ns(30_000, base), Some(1_001_000_000_000));
        assert_eq!(in_ns(1, base), Some(33_366_666));
        assert_eq!(clock_ns("00:01:02.50,"), Some(62_500_000_000));
        assert_eq!(clock_ns("N/A,"), None);
        assert_eq!(size("640x480"), Some([640, 480]));
        assert_eq!(after("[x] n:   1 pts:   1001 pts_time:0.03", " pts:"), Some("1001"));
    }
}
