//! Damaged OBJ files with their material and texture.

use super::edit::{append, before, line, swap, text};
use super::{Case, Damage, cases, png};

/// Inserts a line before the faces.
fn statement(line: &str) -> Damage {
    before("usemtl", &format!("{line}\n"))
}

/// Edits the first vertex.
fn vertex(edit: impl Fn(&str) -> String + 'static) -> Damage {
    line("v ", edit)
}

/// Returns the cases for a solid.
pub fn mesh() -> Vec<Case> {
    cases(
        "t.obj",
        vec![
            ("smooth shading", statement("s 1")),
            ("a group", statement("g a")),
            ("a line", statement("l 1 2")),
            ("points", statement("p 1 2")),
            ("a curve", statement("curv 0 1 1 2")),
            ("a call of another file", statement("call a.obj")),
            ("a command", statement("csh ls")),
            ("levels of detail", statement("lod 9")),
            ("a continued line", statement("v 0 0 \\\n0")),
            ("vertex colours", vertex(|line| format!("{line} 1 0 0"))),
            ("vertex weights", vertex(|line| format!("{line} 2"))),
            ("two coordinates", vertex(|line| line.rsplit_once(' ').unwrap().0.to_owned())),
            ("an exponent", vertex(|line| format!("{line}e0"))),
            ("a NaN coordinate", vertex(|_| "v nan 0 0".to_owned())),
            ("a displaced vertex", vertex(|line| line.replacen("34.641016", "34.741016", 1))),
            ("texture coordinates beyond the texture", line("vt ", |_| "vt 1.5 0".to_owned())),
            ("displaced texture coordinates", line("vt ", |_| "vt 0.02 0.005256242".to_owned())),
            ("a third texture coordinate", line("vt ", |line| format!("{line} 0"))),
            ("a rotated normal", line("vn ", |line| line.replacen("0.4", "-0.4", 1))),
            ("a face without normals", line("f ", |_| "f 1/1 2/2 3/3".to_owned())),
            ("a quadrilateral face", line("f ", |line| format!("{line} 4/4/1"))),
            ("negative indices", line("f ", |_| "f -1/-1/-1 -2/-2/-1 -3/-3/-1".to_owned())),
            ("an index out of range", line("f ", |_| "f 1/1/1 2/2/1 99/3/1".to_owned())),
            ("a missing face", swap("f 1/1/1 2/2/1 3/3/1\n", "")),
            ("an unused vertex", statement("v 0 0 9")),
            ("a blank line", statement("")),
            ("CRLF line ends", swap("mtl\n", "mtl\r\n")),
            ("a continued comment", statement("# \\\nf 1/1/1 2/2/1 3/3/1")),
            ("the description of a different target", swap("\"tiles\":7", "\"tiles\":8")),
            ("a plus before an index", swap("f 1/1/1", "f +1/1/1")),
            ("a different object name", swap("o t\n", "o u\n")),
            ("a second object", before("usemtl", "o u\n")),
            ("no object", swap("o t\n", "")),
            ("a duplicate face", append("f 1/1/1 2/2/1 3/3/1\n")),
            ("an additional face", append("f 1/1/1 2/2/1 6/6/2\n")),
            (
                "a face inside out",
                line("f ", |line| {
                    let words: Vec<&str> = line.split(' ').collect();
                    format!("f {} {} {}", words[1], words[3], words[2])
                }),
            ),
            ("no material", swap("usemtl print\n", "")),
            ("a different material", swap("usemtl print", "usemtl other")),
            ("a second material", append("usemtl other\n")),
            ("no library", swap("mtllib t.mtl\n", "")),
            ("a library in another folder", swap("mtllib t.mtl", "mtllib ../t.mtl")),
            ("a missing library", swap("mtllib t.mtl", "mtllib u.mtl")),
            ("two libraries", append("mtllib u.mtl\n")),
            (
                "inches for millimetres",
                text(|text| {
                    let larger = |line: &str| match line.strip_prefix("v ") {
                        Some(rest) => {
                            let words = rest.split(' ').map(|w| 25.4 * w.parse::<f64>().unwrap());
                            let words: Vec<String> = words.map(|v| v.to_string()).collect();
                            format!("v {}\n", words.join(" "))
                        }
                        None => format!("{line}\n"),
                    };
                    text.lines().map(larger).collect()
                }),
            ),
        ],
    )
}

/// Returns the cases for a material library.
pub fn material() -> Vec<Case> {
    cases(
        "t.mtl",
        vec![
            ("black paint", swap("Kd 1 1 1", "Kd 0 0 0")),
            ("spectral paint", swap("Kd 1 1 1", "Kd spectral a.rfl 1")),
            ("no paint", swap("Kd 1 1 1\n", "")),
            ("zero opacity", append("d 0\n")),
            ("angle-dependent opacity", append("d -halo 1\n")),
            ("transparency", append("Tr 1\n")),
            ("a filter", append("Tf 0 0 0\n")),
            ("emission", append("Ke 1 1 1\n")),
            ("no ambient statement", swap("Ka 0 0 0\n", "")),
            ("no specular statement", swap("Ks 0 0 0\n", "")),
            ("no illumination model", swap("illum 1\n", "")),
            ("duplicate paint", append("Kd 1 1 1\n")),
            ("the name at the end", {
                let end = append("newmtl print\n");
                Box::new(move |bytes| end(&swap("newmtl print\n", "")(bytes)))
            }),
            ("explicit full opacity", append("d 1\n")),
            ("a tab", swap("Kd ", "Kd\t")),
            ("gloss", swap("Ks 0 0 0", "Ks 1 1 1")),
            ("a different illumination model", swap("illum 1", "illum 4")),
            ("an opacity map", append("map_d t-texture.png\n")),
            ("a bump map", append("map_Bump t-texture.png\n")),
            ("a decal", append("decal t-texture.png\n")),
            ("a scaled texture", swap("map_Kd ", "map_Kd -s 2 2 ")),
            ("a clamped texture", swap("map_Kd ", "map_Kd -clamp on ")),
            ("a texture in another folder", swap("map_Kd ", "map_Kd ../")),
            ("a missing texture", swap("t-texture", "u-texture")),
            ("no texture", swap("map_Kd t-texture.png\n", "")),
            ("a second texture", append("map_Kd u.png\n")),
            ("a second material", append("newmtl other\n")),
        ],
    )
}

/// Returns the cases for a texture.
pub fn texture() -> Vec<Case> {
    cases(
        "t-texture.png",
        vec![
            ("transparency", png::pixels(|p| image::DynamicImage::from(p).to_luma_alpha8().into())),
            ("a different title", swap("\0t", "\0u")),
            ("a gamma", png::with_chunk(b"gAMA", &[0, 0, 0, 1])),
            ("a spot", png::square([0.33, 0.83], 30)),
            ("grey in place of black", png::pixels(|p| png::grey(p, |v| v.max(30)))),
            ("a faint spot", png::level([0.33, 0.83], 30, 60)),
            ("a truncated file", Box::new(|bytes| bytes[..bytes.len() / 2].to_vec())),
        ],
    )
}
