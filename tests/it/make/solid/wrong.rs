//! Impossible solids, and files that do not show their solid.

use super::made::bipyramid;
use crate::common::command::deltille;
use crate::common::page::Page;
use deltille::layout::Printing;

/// Subtle changes to an OBJ, and the resulting findings.
#[test]
fn wrong_meshes_are_rejected_with_the_cause() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    deltille(path, "tetrahedron --edge 80mm --tiles 7 --face-margin 4mm --obj --name t").success();
    let text = std::fs::read_to_string(path.join("t.obj")).unwrap();
    let change = |edit: &dyn Fn(&str) -> String| -> String {
        text.lines().map(|line| edit(line) + "\n").collect()
    };
    let numbers = |line: &str| -> Vec<f64> {
        line.split(' ').skip(1).map(|word| word.parse().unwrap()).collect()
    };
    let scaled = change(&|line| match line.strip_prefix("v ") {
        Some(_) => format!(
            "v {}",
            numbers(line).iter().map(|v| (v * 1.01).to_string()).collect::<Vec<_>>().join(" ")
        ),
        None => line.to_owned(),
    });
    let mirrored = change(&|line| match line.strip_prefix("v ") {
        Some(_) => {
            let v = numbers(line);
            format!("v {} {} {}", -v[0], v[1], v[2])
        }
        None => line.to_owned(),
    });
    let inside_out = change(&|line| {
        let words: Vec<&str> = line.split(' ').collect();
        if words[0] == "f" {
            format!("f {} {} {}", words[1], words[3], words[2])
        } else {
            line.to_owned()
        }
    });
    let first = text.lines().find(|line| line.starts_with("v ")).unwrap();
    let v = numbers(first);
    let dented = text.replacen(first, &format!("v {} {} {}", v[0] + 0.5, v[1], v[2]), 1);
    let untextured = text.replace("usemtl print\n", "");
    let mut page = Page::default();
    for (name, changed) in [
        ("scaled", scaled),
        ("mirrored", mirrored),
        ("inside-out", inside_out),
        ("dented", dented),
        ("untextured", untextured),
    ] {
        assert_ne!(changed, text);
        std::fs::write(path.join(format!("{name}.obj")), changed).unwrap();
        let verified = page.run(path, &format!("deltille verify t.json {name}.obj"));
        assert_eq!(verified.status.code(), Some(1), "{name}");
    }
    std::fs::write(path.join("t.obj"), text).unwrap();
    let material = std::fs::read_to_string(path.join("t.mtl")).unwrap();
    std::fs::write(path.join("t.mtl"), material.replace("Kd 1 1 1", "Kd 0 0 0")).unwrap();
    assert_eq!(page.run(path, "deltille verify t.json t.obj").status.code(), Some(1));
    page.is("verify-meshes");
}

#[test]
fn meshes_that_are_not_solids_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let good = bipyramid(120.0);
    let without_last = good.trim_end().rsplit_once('\n').unwrap().0.to_owned();
    let flattened = good.replace("f 1 2 9\n", "f 1 1 9\n");
    // A face with four corners that is bent along a diagonal.
    let bent = good.replace("f 1 2 9\nf 2 1 5\n", "f 1 5 2 9\n");
    let wound = good.replace("f 1 2 9\n", "f 2 1 9\n");
    let twice = good.clone() + &good.replace("v 0 0 ", "v 999 0 ");
    let skewed: String = good
        .lines()
        .map(|line| match line.split(' ').collect::<Vec<_>>()[..] {
            ["v", x, y, z] => format!("v {x} {y} {}\n", 1.6 * z.parse::<f64>().unwrap()),
            _ => format!("{line}\n"),
        })
        .collect();
    let shifted: String = good
        .lines()
        .map(|line| match line.split(' ').collect::<Vec<_>>()[..] {
            ["v", x, y, z] => format!("v {} {y} {z}\n", 1e8 + x.parse::<f64>().unwrap()),
            _ => format!("{line}\n"),
        })
        .collect();
    let mut page = Page::default();
    for (name, text, options) in [
        ("open", without_last, ""),
        ("flat", flattened, ""),
        ("bent", bent, ""),
        ("wound", wound, ""),
        ("crowd", twice, ""),
        ("nan", good.replacen("v ", "v nan ", 1), ""),
        ("far", shifted, "--tiles 7"),
        ("text", "hello".to_owned(), ""),
        ("index", good.clone() + "f 1 2 99\n", ""),
        ("skew", skewed.clone(), ""),
        ("good", good, "--scale 0.001"),
        ("good", String::new(), "--scale 0"),
        ("good", String::new(), "--scale 2 --edge 100mm"),
        ("good", String::new(), "--tag-spacing 1"),
        ("nowhere", String::new(), ""),
    ] {
        if !text.is_empty() {
            std::fs::write(path.join(format!("{name}.obj")), text).unwrap();
        }
        page.refused(path, &format!("deltille solid --mesh {name}.obj -o out {options}"));
    }
    page.refused(path, "deltille solid --mesh good.obj --obj");
    page.is("solid");
    // A mesh that is skewed on purpose is accepted.
    std::fs::write(path.join("skew.obj"), skewed).unwrap();
    deltille(path, "solid --mesh skew.obj --allow-skew --tiles 7").success();
}

/// Printing errors on a mesh are named, even if the detector tolerates them.
#[test]
fn wrong_marks_on_a_mesh_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    deltille(path, "tetrahedron --edge 80mm --tiles 7 --face-margin 4mm --obj --name t").success();
    let target =
        Printing::from_json(&std::fs::read_to_string(path.join("t.json")).unwrap()).unwrap();
    let written = std::fs::read(path.join("t-texture.png")).unwrap();
    let good = image::open(path.join("t-texture.png")).unwrap().into_luma8();
    let obj = std::fs::read_to_string(path.join("t.obj")).unwrap();
    let uv: Vec<[f64; 2]> = obj
        .lines()
        .filter_map(|line| line.strip_prefix("vt "))
        .map(|line| {
            let (u, v) = line.split_once(' ').unwrap();
            [u.parse().unwrap(), v.parse().unwrap()]
        })
        .collect();
    // Texels of the first face from millimetres of its panel: its lower edge is horizontal.
    let (w, h) = (f64::from(good.width()), f64::from(good.height()));
    let texels_per_mm = (uv[1][0] - uv[0][0]) * w / 80.0;
    let panel = &target.target.panels[0];
    let margin = 4.0;
    let left = -1.5 * panel.edge_mm - 3f64.sqrt() * margin;
    let lower = -0.75f64.sqrt() * panel.edge_mm - margin;
    let texel = |[x, y]: [f64; 2]| {
        let u = uv[0][0] * w + (x - left) * texels_per_mm;
        let v = (1.0 - uv[0][1]) * h - (y - lower) * texels_per_mm;
        [u as i64, v as i64]
    };
    let e = panel.edge_mm;
    let tag = panel.tags[0];
    let centre = |row: i32, col: i32, third: f64| {
        let (row, col) = (f64::from(row) + third, f64::from(col) + third);
        [(col + row / 2.0) * e, row * 0.75f64.sqrt() * e]
    };
    // Position and width of the changed square, mm.
    let mut page = Page::default();
    let cell = e / 9.5;
    for (name, at, side) in [
        ("cell", centre(tag.row, tag.col, 1.0 / 3.0), cell * 0.8),
        ("tile", centre(-1, 0, 1.0 / 3.0), e),
        ("white", centre(0, 0, 2.0 / 3.0), e / 4.0),
        ("margin", [0.0, lower + 1.2], 1.0),
    ] {
        let mut changed = good.clone();
        let [u, v] = texel(at);
        let half = (side * texels_per_mm / 2.0) as i64;
        for (x, y) in (v - half..=v + half).flat_map(|y| (u - half..=u + half).map(move |x| (x, y)))
        {
            let pixel = changed.get_pixel_mut(x as u32, y as u32);
            pixel.0[0] = if name == "cell" || name == "tile" { 255 - pixel.0[0] } else { 0 };
        }
        changed.save(path.join("t-texture.png")).unwrap();
        page.title(name);
        assert_eq!(page.run(path, "deltille verify t.json t.obj").status.code(), Some(1));
    }
    page.is("verify-textures");
    std::fs::write(path.join("t-texture.png"), written).unwrap();
    deltille(path, "verify t.json t.obj").success();
}

/// Bodies for printing that are open, rotated or of the wrong size are rejected.
#[test]
fn wrong_bodies_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    deltille(path, "icosahedron --stl --skeleton --name i").success();
    let read = |name: &str| std::fs::read(path.join(name)).unwrap();
    let numbers = |bytes: &mut Vec<u8>, change: &dyn Fn(usize, [f32; 3]) -> [f32; 3]| {
        for at in (84..bytes.len()).step_by(50).flat_map(|t| (0..4).map(move |i| t + 12 * i)) {
            let number =
                |i: usize| f32::from_le_bytes(bytes[at + 4 * i..][..4].try_into().unwrap());
            let vector = change((at - 84) % 50 / 12, [0, 1, 2].map(number));
            bytes.splice(at..at + 12, vector.into_iter().flat_map(f32::to_le_bytes));
        }
    };
    let bare = read("i.stl");
    let mut open = bare[..bare.len() - 50].to_vec();
    open[80] -= 1;
    let mut mirrored = bare.clone();
    numbers(&mut mirrored, &|_, [x, y, z]| [-x, y, z]);
    let mut scaled = bare.clone();
    numbers(&mut scaled, &|i, v| if i == 0 { v } else { v.map(|x| x * 1.01) });
    let mut turned = bare.clone();
    numbers(&mut turned, &|_, [x, y, z]| [-y, x, z]);
    let mut thick = read("i-skeleton.stl");
    numbers(&mut thick, &|i, v| if i == 0 { v } else { v.map(|x| x * 1.002) });
    // A wall that is thinner deep inside, where no ray probes a seat.
    let mut thin = read("i-skeleton.stl");
    let far = |v: [f32; 3]| v.iter().map(|x| x * x).sum::<f32>().sqrt();
    let nearest_mm = std::cell::Cell::new(f32::INFINITY);
    numbers(&mut thin, &|i, v| {
        nearest_mm.set(nearest_mm.get().min(if i > 0 { far(v) } else { f32::INFINITY }));
        v
    });
    let is_deep = |v: [f32; 3]| far(v) < 1.001 * nearest_mm.get();
    numbers(&mut thin, &|i, v| if i > 0 && is_deep(v) { v.map(|x| x * 1.02) } else { v });
    for at in (84..thin.len()).step_by(50) {
        let number = |i: usize| f32::from_le_bytes(thin[at + 4 * i..][..4].try_into().unwrap());
        let [a, b, c] = [1, 2, 3].map(|k| glam::Vec3::from([0, 1, 2].map(|i| number(3 * k + i))));
        let normal = (b - a).cross(c - a).normalize().to_array();
        thin.splice(at..at + 12, normal.into_iter().flat_map(f32::to_le_bytes));
    }
    let mut page = Page::default();
    for (name, bytes, code) in [
        ("open.stl", open, 1),
        ("mirrored.stl", mirrored, 1),
        ("scaled.stl", scaled, 1),
        ("turned.stl", turned, 1),
        ("cut.stl", bare[..300].to_vec(), 2),
        ("i-skeleton.stl", thick, 1),
        ("i-skeleton.stl", thin, 1),
    ] {
        std::fs::write(path.join(name), bytes).unwrap();
        let verified = page.run(path, &format!("deltille verify i.json {name}"));
        assert_eq!(verified.status.code(), Some(code), "{name}");
    }
    page.is("verify-bodies");
}

#[test]
fn impossible_targets_are_rejected_in_one_line_and_leave_no_files() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut page = Page::default();
    for args in [
        "dodecahedron",
        "solid",
        "icosahedron --edge 20mm",
        "icosahedron --edge NaN",
        "icosahedron --edge -150mm",
        "icosahedron --tiles 3",
        "icosahedron --face-margin -1mm",
        "icosahedron --first-id 300",
        "icosahedron --family delTag16h5",
        "icosahedron --texture-dpi 50",
        "icosahedron --texture-dpi 9000",
        "icosahedron --pdf --edge 3m",
        "icosahedron --pdf --paper A5 --edge 440mm",
        "icosahedron --pdf --face-margin 1mm",
        "icosahedron --pdf --paper 50x60mm",
        "icosahedron --pdf --per-face --edge 3m",
        "icosahedron --pdf --per-face --paper A5 --edge 150mm",
        "icosahedron --paper A4 --edge 150mm --pages 3",
        "icosahedron --untagged --texture 64",
        "icosahedron --skeleton --rib 1mm",
        "tetrahedron --invert --skeleton --face-margin 6mm --laser svg",
        "icosahedron --skeleton --panel-thickness 12mm --face-margin 5mm",
        "tetrahedron --skeleton --edge 60mm --tiles 6 --face-margin 6mm --wall 6mm",
        "icosahedron --wall 4mm",
        "icosahedron --stl --pages 2",
        "icosahedron --stl --texture-dpi 300",
        "icosahedron -o /proc/nowhere",
    ] {
        page.refused(at, &format!("deltille {args}"));
    }
    page.title("A file that cannot be replaced prevents the others from being written");
    std::fs::create_dir(at.join("octahedron.stl")).unwrap();
    page.refused(at, "deltille octahedron --stl");
    page.is("icosahedron");
}
