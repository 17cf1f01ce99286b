//! The same commands write the same bytes, with any number of threads, in any locale and time zone, from any folder, and
//! repeatedly.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use assert_cmd::Command;

/// The environment of commands.
struct Way {
    /// Whether commands run in the folder itself, or in its parent.
    from_above: bool,
    threads: &'static str,
    environment: &'static [(&'static str, &'static str)],
}

const WAYS: [Way; 3] = [
    Way { from_above: false, threads: "1", environment: &[("LC_ALL", "C"), ("TZ", "UTC")] },
    Way {
        from_above: true,
        threads: "2",
        environment: &[("LC_ALL", "de_DE.UTF-8"), ("TZ", "Pacific/Auckland"), ("HOME", "/")],
    },
    Way {
        from_above: false,
        threads: "4",
        environment: &[("LANG", "tr_TR.UTF-8"), ("TERM", "dumb")],
    },
];

const CAMERA: &str = "width: 640\nheight: 480\nfocal_px: [620, 620]\ncentre_px: [321, 238]\n\
                      distortion: [-0.1, 0.02]\n";

/// Runs commands in a new folder and returns their files and output. In the commands, `@` is the folder and `$` the number of
/// threads.
fn outcome(way: &Way, commands: &[String]) -> BTreeMap<String, Vec<u8>> {
    let above = tempfile::tempdir().unwrap();
    let folder = above.path().join("in");
    std::fs::create_dir(&folder).unwrap();
    std::fs::write(folder.join("camera.yaml"), CAMERA).unwrap();
    let (from, prefix) = if way.from_above { (above.path(), "in/") } else { (&*folder, "") };
    let mut outcome = BTreeMap::new();
    for (index, text) in commands.iter().enumerate() {
        let text = text.replace('@', prefix).replace('$', way.threads);
        let mut words = text.split_whitespace();
        let mut command = Command::cargo_bin(words.next().unwrap()).unwrap();
        command.current_dir(from).env("RAYON_NUM_THREADS", way.threads).args(words);
        command.envs(way.environment.iter().copied());
        let output = command.output().unwrap();
        assert!(output.status.success(), "{text}: {}", String::from_utf8_lossy(&output.stderr));
        for (what, said) in [("out", output.stdout), ("error", output.stderr)] {
            // The progress of a search after ten seconds is not reproducible.
            let said = String::from_utf8(said).unwrap().replace(prefix, "");
            let lines = said.lines().filter(|line| !line.contains(" %, "));
            let said = lines.collect::<Vec<_>>().join("\n");
            outcome.insert(format!("{what} of {index}: {}", commands[index]), said.into_bytes());
        }
    }
    collect(&folder, &folder, &mut outcome);
    outcome
}

fn collect(root: &Path, folder: &Path, files: &mut BTreeMap<String, Vec<u8>>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path: PathBuf = entry.unwrap().path();
        if path.is_dir() {
            collect(root, &path, files);
        } else {
            let name = path.strip_prefix(root).unwrap().to_string_lossy().replace('\\', "/");
            files.insert(name, std::fs::read(&path).unwrap());
        }
    }
}

/// Runs commands in all environments and compares the results.
fn check(commands: &[String], least_files: usize) {
    let [first, others @ ..] = WAYS.map(|way| outcome(&way, commands));
    assert!(first.len() >= least_files + 2 * commands.len(), "{:?}", first.keys());
    for other in others {
        assert_eq!(first.keys().collect::<Vec<_>>(), other.keys().collect::<Vec<_>>());
        for (name, content) in &first {
            assert!(
                *content == other[name],
                "{name} differs: {}",
                difference(content, &other[name])
            );
        }
    }
}

/// The first difference between two contents.
fn difference(one: &[u8], other: &[u8]) -> String {
    let at = one.iter().zip(other).position(|(a, b)| a != b);
    let at = at.unwrap_or(one.len().min(other.len()));
    let near = |bytes: &[u8]| {
        let end = (at + 60).min(bytes.len());
        String::from_utf8_lossy(&bytes[at.saturating_sub(30)..end]).into_owned()
    };
    format!("at byte {at}: {:?} and {:?}", near(one), near(other))
}

#[test]
fn targets_and_their_verification() {
    let commands = [
        "deltille board --rows 5 --cols 4 --pdf --svg --png --dsc --dpi 200 -o @board",
        "deltille verify @board/board.json --report @board-verified.json",
        "deltille icosahedron --tiles 6 --edge 100mm --board-id 40 --gltf --obj --stl --skeleton --dxf --pdf \
         --svg --png --dsc --dpi 200 --no-verify -o @solid",
        "deltille tetrahedron --tiles 6 --edge 60mm --gltf --dxf --no-verify -o @small",
        "deltille verify @small/tetrahedron.json --report @small-verified.json",
        "deltag sheet d25h7 --ids 0-3 --edge 40mm -o @tags",
    ];
    check(&commands.map(str::to_owned), 20);
}

#[test]
fn families() {
    let commands = [
        "deltag gen-family d16h8 --work 1 -j $ -o @best",
        "deltag gen-family d9h3 --work 1 --from-scratch --method algebraic -j $ -o @algebraic",
        "deltag gen-family d9h3 --method search --rounds 1 -j $ -o @search",
    ];
    check(&commands.map(str::to_owned), 3);
}

#[test]
fn detections_and_calibrations() {
    let mut commands = vec!["deltille board --rows 6 --cols 5 --no-verify -o @board".to_owned()];
    // Images of one moment: the right camera is 60 mm beside the left one.
    let poses = [
        [3.13, 0.0, 0.0, -45.0, 45.0, 300.0],
        [2.7, 0.1, 0.1, -40.0, 45.0, 280.0],
        [3.5, -0.1, 0.0, -50.0, 40.0, 320.0],
        [3.1, 0.1, 0.6, -45.0, 50.0, 300.0],
        [3.1, 0.0, -0.6, -40.0, 40.0, 290.0],
        [2.8, 0.2, 0.5, -30.0, 45.0, 310.0],
    ];
    for (camera, aside) in [("left", 0.0), ("right", 60.0)] {
        for (index, [rx, ry, rz, x, y, z]) in poses.into_iter().enumerate() {
            commands.push(format!(
                "deltille render @board/board.json --camera @camera.yaml --pose {rx},{ry},{rz},{},{y},{z} \
                 --seed {index} -o @{camera}/{index}.png",
                x - aside
            ));
        }
        commands.push(format!(
            "deltille detect --target @board/board.json @{camera}/0.png @{camera}/1.png @{camera}/2.png \
             @{camera}/3.png @{camera}/4.png @{camera}/5.png --format json,csv,orpc,parquet --overlay -j $ -o @{camera}-seen"
        ));
    }
    commands.push(
        "deltille calibrate @left-seen --target @board/board.json --model radtan --holdout 6 --report \
         @report.html --images @left --format own,opencv,ros,kalibr,colmap,nerfstudio -o @camera/left.yaml"
            .to_owned(),
    );
    commands.push(
        "deltille rig --camera left=@left-seen --camera right=@right-seen --target @board/board.json --model radtan \
         --format kalibr,colmap --refine-target -o @rig"
            .to_owned(),
    );
    check(&commands, 12 * 5 + 10);
}
