//! Malicious and invalid files: each ends its command soon, in little memory, with one line that names it.

use std::fs::{self, File};
use std::io::{Cursor, Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::LazyLock;
use std::time::{Duration, Instant};

use crate::common::command::deltille;
use crate::common::glb::Parts;
use crate::common::page::Page;
use crate::common::png::chunk;
use flate2::{Compression, write::ZlibEncoder};
use serde_json::{Value, json};
use tempfile::TempDir;

/// Time after which a command counts as hanging; tests may run on a slow, busy machine.
const PATIENCE: Duration = Duration::from_secs(100);

/// Maximum memory of a command, kB.
const MAX_KB: u64 = 1_000_000;

/// Valid files: `b.*` of a board, `s.*` of a solid, a camera and a detection.
static GOOD: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = TempDir::new().unwrap();
    let make = |args: &str| {
        deltille(folder.path(), args).success();
    };
    make("board --rows 4 --cols 5 --name b --pdf --svg --png --dsc --no-verify");
    make(
        "tetrahedron --edge 60mm --tiles 7 --face-margin 4mm --name s --gltf --obj --stl --dxf --no-verify",
    );
    make("detect --target b.json b.png -o d --format json,parquet");
    fs::write(folder.path().join("c.yaml"), CAMERA).unwrap();
    folder
});

const CAMERA: &str = "width: 640\nheight: 480\nfocal_px: [500, 500]\ncentre_px: [320, 240]\n";

fn good(name: &str) -> Vec<u8> {
    fs::read(GOOD.path().join(name)).unwrap()
}

/// The end of a command.
struct End {
    /// `None` if it was killed by a signal.
    code: Option<i32>,
    said: String,
    /// Maximum memory, if it can be measured.
    kb: Option<u64>,
}

/// Runs a command. In its arguments, `@` is a file of the folder, and `+` is the folder of valid files.
fn run(folder: &Path, command: &str, file: &str) -> End {
    let mut words = command.split(' ').map(|word| match word {
        "@" => file.to_owned(),
        word => word.replace('+', &GOOD.path().display().to_string()),
    });
    let program = match words.next().unwrap().as_str() {
        "deltag" => env!("CARGO_BIN_EXE_deltag"),
        _ => env!("CARGO_BIN_EXE_deltille"),
    };
    let mut process = Command::new(program);
    process.args(words).current_dir(folder).stdin(Stdio::null());
    let mut child = process.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let mut errors = child.stderr.take().unwrap();
    let begin = Instant::now();
    let mut kb = None;
    let status = loop {
        kb = peak_kb(&child).max(kb);
        match child.try_wait().unwrap() {
            Some(status) => break Some(status),
            None if begin.elapsed() > PATIENCE => {
                child.kill().unwrap();
                child.wait().unwrap();
                break None;
            }
            None => std::thread::sleep(Duration::from_millis(2)),
        }
    };
    let mut said = String::new();
    errors.read_to_string(&mut said).unwrap();
    End { code: status.and_then(|status| status.code()), said, kb }
}

/// The maximum memory of a running process so far.
fn peak_kb(child: &Child) -> Option<u64> {
    let status = fs::read_to_string(format!("/proc/{}/status", child.id())).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// The problem with the end of a command, which must have one of the codes, and with code 2 one line of error.
fn fault(end: &End, codes: &[i32]) -> Option<String> {
    let End { code, said, kb } = end;
    let lines = said.lines().count();
    let wrong = match code {
        None => "was killed",
        Some(code) if !codes.contains(code) => "other code",
        _ if said.contains("panicked") => "panicked",
        Some(2) if lines != 1 || !said.starts_with("error: ") => "not one line",
        _ if kb.is_some_and(|kb| kb > MAX_KB) => "too much memory",
        _ => return None,
    };
    Some(format!("{wrong}: code {code:?}, {kb:?} kB, {said}"))
}

/// Every reader of files except images: the extension, the command, and a valid file.
const READERS: [(&str, &str, &str); 20] = [
    ("json", "deltille verify @", "b.json"),
    ("dsc", "deltille detect --target @ +/b.png -o out", "b.dsc"),
    ("json", "deltille calibrate --target +/b.json --model radtan -o out @", "d/b.json"),
    (
        "parquet",
        "deltille calibrate --target +/b.json --model radtan -o out @",
        "d/corners.parquet",
    ),
    ("json", "deltille pose --target @ --camera +/c.yaml +/b.png", "b.json"),
    ("yaml", "deltille pose --target +/b.json --camera @ +/b.png", "c.yaml"),
    ("yaml", "deltille render +/b.json --eye 0,0,500 -o out --camera @", "c.yaml"),
    ("json", "deltag info @", "b.json"),
    ("json", "deltille board --rows 4 --cols 4 -o out --family @", "b.json"),
    ("json", "deltille board --rows 4 --cols 4 -o out --with @", "b.json"),
    ("json", "deltag gen-family d16h5 --method search -o out --resume @", "b.json"),
    ("obj", "deltille solid -o out --mesh @", "s.obj"),
    ("json", "deltille calibrate --target +/b.json --model radtan +/d/b.json --shape @", "b.json"),
    ("svg", "deltille verify +/b.json @", "b.svg"),
    ("pdf", "deltille verify +/b.json @", "b.pdf"),
    ("png", "deltille verify +/b.json @", "b.png"),
    ("dsc", "deltille verify +/b.json @", "b.dsc"),
    ("glb", "deltille verify +/s.json @", "s.glb"),
    ("obj", "deltille verify +/s.json @", "s.obj"),
    ("stl", "deltille verify +/s.json @", "s.stl"),
];

/// Readers for which an empty file is valid.
const READERS_OF_LINES: [(&str, &str, &str); 3] = [
    ("toml", "deltille board --rows 2 --cols 2 -o out --template @", ""),
    ("toml", "deltag gen-family d16h5 --time 1 -o out --rules @", ""),
    ("csv", "deltille refine --kind checker +/b.png --seeds @", ""),
];

#[test]
fn invalid_files_are_named() {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (mut faults, mut page) = (Vec::new(), Page::default());
    for (extension, command, sample) in READERS.into_iter().chain(READERS_OF_LINES) {
        page.title(command);
        let mut kinds = vec!["folder", "sparse", "noise"];
        if !sample.is_empty() {
            kinds.extend(["empty", "half", "brackets"]);
        }
        if cfg!(unix) {
            kinds.extend(["zero", "pipe"]);
        }
        for kind in kinds {
            let name = format!("{kind}.{extension}");
            if !at(&name).exists() {
                make(kind, &at(&name), sample);
            }
            // A file that is accepted must be valid.
            let is_read = ["noise", "empty", "half", "brackets"].contains(&kind);
            let codes: &[i32] = if is_read { &[1, 2] } else { &[2] };
            let end = run(folder.path(), command, &name);
            page.line(&end.said);
            let named = end.code != Some(2) || end.said.contains(&name);
            let unnamed = (!named).then(|| format!("{name} is not named: {}", end.said));
            let fault = fault(&end, codes).or(unnamed);
            faults.extend(fault.map(|fault| format!("{command}, {kind}: {fault}")));
            if kind == "half" {
                fs::remove_file(at(&name)).unwrap();
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    if cfg!(unix) {
        page.is("no-such-file");
    }
}

/// Makes an invalid file.
fn make(kind: &str, path: &Path, sample: &str) {
    match kind {
        "empty" => fs::write(path, "").unwrap(),
        "folder" => fs::create_dir(path).unwrap(),
        "sparse" => File::create(path).unwrap().set_len(1 << 31).unwrap(),
        "noise" => {
            let noise = (0..100_000u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8);
            fs::write(path, noise.collect::<Vec<_>>()).unwrap();
        }
        "half" => {
            let bytes = good(sample);
            // Text is cut after a field: within a number, the result would depend on the digits.
            let half = &bytes[..bytes.len() / 2];
            let comma = half.iter().rposition(|&b| b == b',').filter(|_| bytes[0] == b'{');
            fs::write(path, &half[..comma.map_or(half.len(), |at| at + 1)]).unwrap();
        }
        "brackets" => fs::write(path, "{\"a\":[".repeat(300_000)).unwrap(),
        #[cfg(unix)]
        "zero" => std::os::unix::fs::symlink("/dev/zero", path).unwrap(),
        "pipe" => assert!(Command::new("mkfifo").arg(path).status().unwrap().success()),
        _ => panic!("{kind}"),
    }
}

/// Chunks of a PNG, by default grey with 8 bits.
fn png(width: u32, height: u32, more: &[u8]) -> Vec<u8> {
    let size = [width.to_be_bytes(), height.to_be_bytes()].concat();
    let resolution = [11811u32.to_be_bytes(), 11811u32.to_be_bytes()].concat();
    let rows = zeros((u64::from(width) + 1) * u64::from(height));
    [
        b"\x89PNG\r\n\x1a\n".to_vec(),
        chunk(b"IHDR", &[&size[..], &[8, 0, 0, 0, 0]].concat()),
        chunk(b"pHYs", &[&resolution[..], &[1]].concat()),
        more.to_vec(),
        chunk(b"IDAT", &rows),
        chunk(b"IEND", &[]),
    ]
    .concat()
}

/// Almost half a million corners.
fn fabric() -> Vec<u8> {
    let weave = |x, y| image::Luma([if (x / 5 + y / 5) % 2 == 0 { 250u8 } else { 5 }]);
    let mut bytes = Cursor::new(Vec::new());
    let picture = image::GrayImage::from_fn(3150, 3150, weave);
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// The given number of zero bytes, compressed a thousandfold.
fn zeros(count: u64) -> Vec<u8> {
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::best());
    std::io::copy(&mut std::io::repeat(0).take(count), &mut packed).unwrap();
    packed.finish().unwrap()
}

/// The valid mesh with an edited JSON.
fn glb(edit: impl Fn(&mut Value)) -> Vec<u8> {
    let mut parts = Parts::of(&good("s.glb"));
    let mut root: Value = serde_json::from_slice(&parts.json).unwrap();
    edit(&mut root);
    parts.json = root.to_string().into_bytes();
    parts.join()
}

/// A chain of nodes, each with the next node as child `times` times.
fn chain(length: usize, times: usize) -> Vec<u8> {
    glb(|root| {
        let nodes = root["nodes"].as_array_mut().unwrap();
        let first = nodes.len();
        let links = (1..length).map(|i| json!({ "children": vec![first + i; times] }));
        nodes.extend(links.chain([json!({})]));
        root["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(first));
    })
}

/// The valid SVG with additional elements.
fn svg(more: &str) -> Vec<u8> {
    let text = String::from_utf8(good("b.svg")).unwrap();
    text.replace("</svg>", &format!("{more}</svg>")).into_bytes()
}

/// The valid SVG with a changed attribute of its first element.
fn svg_with(from: &str, to: &str) -> Vec<u8> {
    let text = String::from_utf8(good("b.svg")).unwrap();
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1).into_bytes()
}

/// Unordered lines across a page.
fn zigzag(first: &str, next: &str, after: &str) -> String {
    let to = |i: u64| format!("{next}{} {}{after}", i * 7919 % 297, i * 104_729 % 210);
    first.to_owned() + &(0..120_000).map(to).collect::<String>()
}

/// A PDF with one page.
fn pdf(size: &str, content: &[u8]) -> Vec<u8> {
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::best());
    packed.write_all(content).unwrap();
    let packed = packed.finish().unwrap();
    let length = packed.len();
    let head = format!("<</Length {length}/Filter/FlateDecode>>stream\n").into_bytes();
    let stream = [head, packed, b"\nendstream".to_vec()];
    let objects = [
        b"<</Type/Catalog/Pages 2 0 R/ViewerPreferences<</PrintScaling/None>>>>".to_vec(),
        b"<</Type/Pages/Count 1/Kids[3 0 R]>>".to_vec(),
        format!("<</Type/Page/Parent 2 0 R/MediaBox[{size}]/TrimBox[{size}]/CropBox[{size}]/Contents 4 0 R>>")
            .into_bytes(),
        stream.concat(),
    ];
    let mut file = b"%PDF-1.3\n".to_vec();
    let mut table = "xref\n0 5\n0000000000 65535 f \n".to_owned();
    for (index, object) in objects.iter().enumerate() {
        table += &format!("{:010} 00000 n \n", file.len());
        file.extend(format!("{} 0 obj\n", index + 1).bytes());
        file.extend(object);
        file.extend(b"\nendobj\n");
    }
    let at = file.len();
    file.extend(table.bytes());
    file.extend(format!("trailer\n<</Root 1 0 R/Size 5>>\nstartxref\n{at}\n%%EOF\n").bytes());
    file
}

/// A file, the command that reads it, and its code.
type Bomb = (&'static str, Vec<u8>, &'static str, i32);

const BOARD: &str = "deltille verify +/b.json @";
const SOLID: &str = "deltille verify +/s.json @";
const DETECT: &str = "deltille detect --grid deltille -o out @";
const RENDER: &str = "deltille render +/b.json --eye 0,0,500 -o out --camera @";

fn meshes() -> Vec<Bomb> {
    let cycle = glb(|root| root["nodes"][0]["children"] = json!([0]));
    vec![
        ("cycle.glb", cycle, SOLID, 1),
        ("doubled.glb", chain(32, 2), SOLID, 1),
        ("long.glb", chain(100_000, 1), SOLID, 2),
        ("many.stl", vec![0; 84 + 50 * 3_000_000], SOLID, 1),
    ]
}

fn pages() -> Vec<Bomb> {
    let turbulence =
        svg("<filter id=\"f\"><feTurbulence baseFrequency=\".5\" numOctaves=\"999999\"/>\
                          </filter><rect width=\"100%\" height=\"100%\" filter=\"url(#f)\"/>");
    let lines =
        zigzag("<g fill=\"#000\" fill-rule=\"evenodd\"><path d=\"M0 0", "L", "") + "Z\"/></g>";
    let strokes =
        zigzag("<g fill=\"none\"><path stroke=\"#000\" stroke-width=\"99\" d=\"M0 0", "L", "")
            + "\"/></g>";
    let area = "<path d=\"M0 0L297 0L297 210L0 210Z\"/>".repeat(100_000);
    let attributes: String = (0..50_000).map(|i| format!("a{i}=\"\" ")).collect();
    let long = svg_with("width=\"297mm\"", "width=\"100000000mm\"");
    let long =
        String::from_utf8(long).unwrap().replacen("height=\"210mm\"", "height=\"0.000001mm\"", 1);
    let wide = zigzag("0 0 0 1 k\n0 0 m\n", "", " l\n") + "h\nf*\n";
    let fills = "0 0 0 1 k\n".to_owned() + &"0 0 m\n842 0 l\n842 595 l\nh\nf*\n".repeat(300_000);
    let colours = b"0 0 0 1 k\n".repeat(8_000_000);
    vec![
        ("turbulence.svg", turbulence, BOARD, 1),
        ("lines.svg", svg(&lines), BOARD, 1),
        ("strokes.svg", svg(&strokes), BOARD, 1),
        ("areas.svg", svg(&format!("<g fill=\"#000\">{area}</g>")), BOARD, 1),
        (
            "small.svg",
            svg_with("viewBox=\"0 0 297 210\"", "viewBox=\"0 0 0.0000001 0.0000001\""),
            BOARD,
            1,
        ),
        ("attributes.svg", svg_with("<svg ", &format!("<svg {attributes}")), BOARD, 2),
        ("long.svg", long.into_bytes(), BOARD, 1),
        ("groups.svg", svg(&("<g>".repeat(100_000) + &"</g>".repeat(100_000))), BOARD, 1),
        ("lines.pdf", pdf("0 0 842 595", wide.as_bytes()), BOARD, 1),
        ("areas.pdf", pdf("0 0 842 595", fills.as_bytes()), BOARD, 1),
        ("colours.pdf", pdf("0 0 842 595", &colours), BOARD, 1),
        ("blanks.pdf", pdf("0 0 842 595", &vec![b' '; 400_000_000]), BOARD, 1),
        ("long.pdf", pdf("0 0 99999999999 0.0000001", b""), BOARD, 1),
    ]
}

fn pictures() -> Vec<Bomb> {
    let profile = chunk(b"iCCP", &[&b"p\0\0"[..], &zeros(1 << 29)].concat());
    vec![
        ("bomb.png", png(30_000, 30_000, &[]), BOARD, 2),
        ("photograph.png", png(30_000, 30_000, &[]), DETECT, 2),
        ("large.png", png(12_000, 12_000, &[]), DETECT, 2),
        ("fabric.png", fabric(), "deltille detect --grid checker @ -o out", 1),
        ("page.png", png(12_000, 12_000, &[]), BOARD, 1),
        ("profile.png", png(8, 8, &profile), DETECT, 1),
    ]
}

fn cameras() -> Vec<Bomb> {
    let large = CAMERA.replace("640", "50000").replace("480", "50000").into_bytes();
    let aliases = (0..26u8).map(|i| {
        let name = |i: u8| char::from(b'a' + i);
        let list = vec![format!("*{}", name(i.saturating_sub(1))); 9].join(",");
        format!("{}: &{} [{}]\n", name(i), name(i), if i == 0 { "x".to_owned() } else { list })
    });
    vec![
        ("large.yaml", large, RENDER, 2),
        ("maps.yaml", "a: {".repeat(12_000).into_bytes(), RENDER, 2),
        ("lists.yaml", format!("a: {}", "[".repeat(49_000)).into_bytes(), RENDER, 2),
        ("dashes.yaml", "- ".repeat(24_000).into_bytes(), RENDER, 2),
        ("keys.yaml", "? ".repeat(24_000).into_bytes(), RENDER, 2),
        ("aliases.yaml", aliases.collect::<String>().into_bytes(), RENDER, 2),
        ("long.yaml", "a: {".repeat(200_000).into_bytes(), RENDER, 2),
    ]
}

fn others() -> Vec<Bomb> {
    let calibrate = "deltille calibrate --target +/b.json --model radtan -o out @";
    let detection: Value = serde_json::from_slice(&good("d/b.json")).unwrap();
    let mut grids = detection.clone();
    let mut empty = detection["grids"][0].clone();
    empty["corners"] = json!([]);
    grids["grids"] = json!(vec![empty; 100_000]);
    let tables = "a = [".to_owned() + &"[".repeat(40_000);
    let template = "deltille board --rows 4 --cols 4 -o out --template @";
    let dsc = "deltille detect --target @ +/b.png -o out";
    vec![
        ("grids.json", grids.to_string().into_bytes(), calibrate, 2),
        ("tables.toml", tables.into_bytes(), template, 2),
        ("large.dsc", b"0,4294967295,4294967295,1e308\n".to_vec(), dsc, 2),
    ]
}

fn assert_defused(what: &str, bombs: impl IntoIterator<Item = Bomb>) {
    let folder = TempDir::new().unwrap();
    let (mut faults, mut page) = (Vec::new(), Page::default());
    for (name, bytes, command, code) in bombs {
        fs::write(folder.path().join(name), bytes).unwrap();
        let end = run(folder.path(), command, name);
        if code == 2 {
            page.line(&end.said);
        }
        faults.extend(fault(&end, &[code]).map(|fault| format!("{name}: {fault}")));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    page.is(&format!("hostile-{what}"));
}

#[test]
fn hostile_meshes_are_rejected_or_harmless() {
    assert_defused("meshes", meshes());
}

#[test]
fn hostile_pages_are_rejected_or_harmless() {
    assert_defused("pages", pages());
}

#[test]
fn hostile_images_are_rejected_or_harmless() {
    assert_defused("pictures", pictures());
}

#[test]
fn hostile_cameras_and_other_texts_are_rejected_or_harmless() {
    assert_defused("texts", cameras().into_iter().chain(others()));
}

#[test]
fn many_large_images_need_the_memory_of_one() {
    let folder = TempDir::new().unwrap();
    let picture = png(9000, 9000, &[]);
    for name in ["a.png", "b.png", "c.png", "d.png"] {
        fs::write(folder.path().join(name), &picture).unwrap();
    }
    let end = run(
        folder.path(),
        "deltille detect --grid deltille -j 4 --stream . --max-pixels 90M \
            --max-pixels-per-byte 10k",
        "",
    );
    assert_eq!(fault(&end, &[1]), None);
}
