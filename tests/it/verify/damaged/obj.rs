//! Damaged OBJ with its material and texture.

use super::edit::{append, before, line, swap, text};
use super::png;
use super::{Case, Damage, cases};

/// Puts a line before the faces.
fn statement(line: &str) -> Damage {
    before("usemtl", &format!("{line}\n"))
}

/// Changes the first vertex.
fn vertex(edit: impl Fn(&str) -> String + 'static) -> Damage {
    line("v ", edit)
}

/// Of a solid.
pub fn mesh() -> Vec<Case> {
    cases(
        "t.obj",
        vec![
            ("smooth shading", "statement s", statement("s 1")),
            ("a group", "statement g", statement("g a")),
            ("a line", "statement l", statement("l 1 2")),
            ("points", "statement p", statement("p 1 2")),
            ("a curve", "statement curv", statement("curv 0 1 1 2")),
            ("another file", "statement call", statement("call a.obj")),
            ("a command", "statement csh", statement("csh ls")),
            ("levels of detail", "statement lod", statement("lod 9")),
            ("a line that goes on", "`v 0 0 \\`", statement("v 0 0 \\\n0")),
            ("colours of vertices", "`v ", vertex(|line| format!("{line} 1 0 0"))),
            ("weights of vertices", "`v ", vertex(|line| format!("{line} 2"))),
            ("two coordinates", "`v ", vertex(|line| line.rsplit_once(' ').unwrap().0.to_owned())),
            ("an exponent", "`v ", vertex(|line| format!("{line}e0"))),
            ("a coordinate that is none", "`v nan", vertex(|_| "v nan 0 0".to_owned())),
            (
                "a vertex that is moved",
                "wrong normals",
                vertex(|line| line.replacen("34.641016", "34.741016", 1)),
            ),
            ("coordinates beyond the texture", "`vt 1.5", line("vt ", |_| "vt 1.5 0".to_owned())),
            (
                "coordinates that are moved",
                "at row",
                line("vt ", |_| "vt 0.02 0.005256242".to_owned()),
            ),
            ("a depth of the texture", "`vt ", line("vt ", |line| format!("{line} 0"))),
            (
                "a normal that is turned",
                "wrong normals",
                line("vn ", |line| line.replacen("0.4", "-0.4", 1)),
            ),
            ("a face without normals", "`f 1/1 ", line("f ", |_| "f 1/1 2/2 3/3".to_owned())),
            ("a face of four corners", "`f ", line("f ", |line| format!("{line} 4/4/1"))),
            (
                "indices from the end",
                "`f -",
                line("f ", |_| "f -1/-1/-1 -2/-2/-1 -3/-3/-1".to_owned()),
            ),
            (
                "an index that points nowhere",
                "`f 1/1/1 2/2/1 99/3/1`",
                line("f ", |_| "f 1/1/1 2/2/1 99/3/1".to_owned()),
            ),
            ("a face that is missing", "a line v of no use", swap("f 1/1/1 2/2/1 3/3/1\n", "")),
            ("a vertex of no use", "a line v of no use", statement("v 0 0 9")),
            ("a blank line", "statement :", statement("")),
            ("ends of lines of another system", "`mtllib t.mtl", swap("mtl\n", "mtl\r\n")),
            ("a comment that goes on", "a comment", statement("# \\\nf 1/1/1 2/2/1 3/3/1")),
            (
                "another target's description",
                "words that do not",
                swap("\"tiles\":7", "\"tiles\":8"),
            ),
            ("a plus before an index", "`f +1/1/1", swap("f 1/1/1", "f +1/1/1")),
            ("another object", "an object other", swap("o t\n", "o u\n")),
            ("a second object", "`o u`", before("usemtl", "o u\n")),
            ("no object", "an object other", swap("o t\n", "")),
            (
                "a face that is there twice",
                "5 triangles instead of 4",
                append("f 1/1/1 2/2/1 3/3/1\n"),
            ),
            ("a face too many", "5 triangles instead of 4", append("f 1/1/1 2/2/1 6/6/2\n")),
            (
                "a face inside out",
                "wrong normals",
                line("f ", |line| {
                    let words: Vec<&str> = line.split(' ').collect();
                    format!("f {} {} {}", words[1], words[3], words[2])
                }),
            ),
            ("no material", "a face before its material", swap("usemtl print\n", "")),
            ("another material", "a material other", swap("usemtl print", "usemtl other")),
            ("a second material", "`usemtl other`", append("usemtl other\n")),
            ("no library", "no material library", swap("mtllib t.mtl\n", "")),
            ("a library elsewhere", "`mtllib ../t.mtl`", swap("mtllib t.mtl", "mtllib ../t.mtl")),
            ("a library that is not there", "cannot read", swap("mtllib t.mtl", "mtllib u.mtl")),
            ("two libraries", "`mtllib u.mtl`", append("mtllib u.mtl\n")),
            (
                "inches for millimetres",
                "scale 25.4",
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

/// Of a material library.
pub fn material() -> Vec<Case> {
    cases(
        "t.mtl",
        vec![
            ("black paint", "`Kd 0 0 0`", swap("Kd 1 1 1", "Kd 0 0 0")),
            ("paint of a spectrum", "`Kd spectral", swap("Kd 1 1 1", "Kd spectral a.rfl 1")),
            ("no paint", "no statement Kd 1 1 1", swap("Kd 1 1 1\n", "")),
            ("no opacity", "statement d:", append("d 0\n")),
            ("opacity by the angle", "statement d:", append("d -halo 1\n")),
            ("transparency", "statement Tr", append("Tr 1\n")),
            ("a filter", "statement Tf", append("Tf 0 0 0\n")),
            ("light of its own", "statement Ke", append("Ke 1 1 1\n")),
            ("no light around", "no statement Ka 0 0 0", swap("Ka 0 0 0\n", "")),
            ("gloss of the viewer's choice", "no statement Ks 0 0 0", swap("Ks 0 0 0\n", "")),
            ("no model of light", "no statement illum 1", swap("illum 1\n", "")),
            ("paint twice", "`Kd 1 1 1`", append("Kd 1 1 1\n")),
            ("the name at the end", "`newmtl print`", {
                let end = append("newmtl print\n");
                Box::new(move |bytes| end(&swap("newmtl print\n", "")(bytes)))
            }),
            ("opacity that is said", "statement d:", append("d 1\n")),
            ("a tab", "statement Kd", swap("Kd ", "Kd\t")),
            ("gloss", "`Ks 1 1 1`", swap("Ks 0 0 0", "Ks 1 1 1")),
            ("another model of light", "`illum 4`", swap("illum 1", "illum 4")),
            ("a picture of opacity", "statement map_d", append("map_d t-texture.png\n")),
            ("a picture of heights", "statement map_Bump", append("map_Bump t-texture.png\n")),
            ("a decal", "statement decal", append("decal t-texture.png\n")),
            ("a texture that is scaled", "`map_Kd -s 2 2 ", swap("map_Kd ", "map_Kd -s 2 2 ")),
            (
                "a texture that is clamped",
                "`map_Kd -clamp on",
                swap("map_Kd ", "map_Kd -clamp on "),
            ),
            ("a texture elsewhere", "`map_Kd ../", swap("map_Kd ", "map_Kd ../")),
            ("a texture that is not there", "cannot read", swap("t-texture", "u-texture")),
            ("no texture", "no texture map_Kd", swap("map_Kd t-texture.png\n", "")),
            ("a second texture", "`map_Kd u.png`", append("map_Kd u.png\n")),
            ("a second material", "`newmtl other`", append("newmtl other\n")),
        ],
    )
}

/// Of a texture.
pub fn texture() -> Vec<Case> {
    cases(
        "t-texture.png",
        vec![
            (
                "transparency",
                "pixels other than grey",
                png::pixels(|p| image::DynamicImage::from(p).to_luma_alpha8().into()),
            ),
            ("another title", "t-texture.png, byte 89: words", swap("\0t", "\0u")),
            ("a gamma", "t-texture.png, byte ", png::with_chunk(b"gAMA", &[0, 0, 0, 1])),
            ("a spot", "at row", png::square([0.33, 0.83], 30)),
            ("grey for black", "contrast", png::pixels(|p| png::grey(p, |v| v.max(30)))),
            ("a faint spot", "at row", png::level([0.33, 0.83], 30, 60)),
            (
                "a file that is cut off",
                "cut off",
                Box::new(|bytes| bytes[..bytes.len() / 2].to_vec()),
            ),
        ],
    )
}
