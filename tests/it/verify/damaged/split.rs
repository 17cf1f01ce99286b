//! Damaged meshes with two textures, and the MuJoCo model with a part of the mesh for each.

use serde_json::{Value, json};

use super::edit::{append, before, swap, text};
use super::glb::json;
use super::{Case, Damage, cases, png};

/// Swaps two words everywhere in a text.
fn exchange(one: &'static str, other: &'static str) -> Damage {
    text(move |text| text.replace(one, "\0").replace(other, one).replace('\0', other))
}

/// Edits the two primitives.
fn primitives(edit: impl Fn(&mut Vec<Value>) + 'static) -> Damage {
    json(move |root| edit(root["meshes"][0]["primitives"].as_array_mut().unwrap()))
}

/// Sets a value of the JSON of a glTF, given its pointer.
fn set(pointer: &'static str, value: Value) -> Damage {
    json(move |root| *root.pointer_mut(pointer).unwrap() = value.clone())
}

/// Reverses the entries of a list in the JSON of a glTF.
fn reverse(list: &'static str) -> Damage {
    json(move |root| root[list].as_array_mut().unwrap().reverse())
}

pub fn glb() -> Vec<Case> {
    cases(
        "s.glb",
        vec![
            ("faces with swapped textures", {
                primitives(|list| {
                    list[0]["material"] = json!(1);
                    list[1]["material"] = json!(0);
                })
            }),
            ("all faces with one texture", primitives(|list| list[1]["material"] = json!(0))),
            ("a missing material", primitives(|list| list[1]["material"] = json!(2))),
            ("missing faces", primitives(|list| list.truncate(1))),
            ("the texture of another material", {
                set("/materials/1/pbrMetallicRoughness/baseColorTexture/index", json!(0))
            }),
            ("the image of another texture", set("/textures/1/source", json!(0))),
            ("images in a different order", reverse("images")),
            ("materials in a different order", reverse("materials")),
            ("one image for both textures", {
                json(|root| {
                    root["images"][1]["bufferView"] = root["images"][0]["bufferView"].clone()
                })
            }),
            ("a different name of an image", set("/images/1/name", json!("s"))),
            ("a different name of a material", set("/materials/1/name", json!("print"))),
            ("an additional material", {
                json(|root| {
                    let material = root["materials"][1].clone();
                    root["materials"].as_array_mut().unwrap().push(material);
                })
            }),
            ("a missing image", json(|root| drop(root["images"].as_array_mut().unwrap().pop()))),
            ("paint on the second", {
                json(|root| {
                    let surface = &mut root["materials"][1]["pbrMetallicRoughness"];
                    surface["baseColorFactor"] = json!([0, 0, 0, 1]);
                })
            }),
        ],
    )
}

pub fn obj() -> Vec<Case> {
    cases(
        "s.obj",
        vec![
            ("faces with swapped textures", exchange("print-1", "print-2")),
            ("all faces with one texture", swap("usemtl print-2\n", "")),
            ("a face with the texture of other faces", {
                text(|text| {
                    let (head, tail) = text.split_once("usemtl print-2\n").unwrap();
                    let (face, rest) = tail.split_once('\n').unwrap();
                    format!("{head}{face}\nusemtl print-2\n{rest}")
                })
            }),
            ("a material that no face uses", append("usemtl print-3\n")),
            ("a repeated material", {
                text(|text| {
                    let (head, last) = text.trim_end().rsplit_once('\n').unwrap();
                    format!("{head}\nusemtl print-1\n{last}\n")
                })
            }),
            ("an unlisted material", swap("usemtl print-2", "usemtl print-3")),
        ],
    )
}

pub fn material() -> Vec<Case> {
    cases(
        "s.mtl",
        vec![
            ("swapped textures", exchange("s-texture-1", "s-texture-2")),
            ("one texture for both", swap("s-texture-2", "s-texture-1")),
            ("materials in a different order", exchange("newmtl print-1", "newmtl print-2")),
            ("one name for both materials", swap("print-2", "print-1")),
            ("no paint on the second", {
                text(|text| {
                    let at = text.rfind("Kd 1 1 1\n").unwrap();
                    text[..at].to_owned() + &text[at + 9..]
                })
            }),
            ("an additional material", {
                append(
                    "newmtl print-3\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd s-texture-3.png\n",
                )
            }),
            ("no second texture", swap("map_Kd s-texture-2.png\n", "")),
            ("a statement before all materials", before("newmtl", "Kd 1 1 1\n")),
        ],
    )
}

pub fn texture() -> Vec<Case> {
    cases(
        "s-texture-2.png",
        vec![
            ("a different title", swap("\0s", "\0u")),
            ("a spot", png::square([0.5, 0.5], 30)),
            ("a truncated file", Box::new(|bytes| bytes[..bytes.len() / 2].to_vec())),
        ],
    )
}

pub fn usd() -> Vec<Case> {
    cases(
        "s.usda",
        vec![
            ("faces with swapped textures", exchange("indices = [0, 1]", "indices = [2, 3]")),
            ("a face with the texture of other faces", {
                let more = swap("indices = [0, 1]", "indices = [0, 1, 2]");
                let less = swap("indices = [2, 3]", "indices = [3]");
                Box::new(move |bytes| less(&more(bytes)))
            }),
            ("a face in two subsets", swap("indices = [2, 3]", "indices = [1, 2, 3]")),
            ("a face in no subset", swap("indices = [2, 3]", "indices = [2]")),
            ("a face that does not exist", swap("indices = [2, 3]", "indices = [2, 3, 4]")),
            ("a fractional face index", swap("indices = [2, 3]", "indices = [2, 3.5]")),
            ("swapped materials", exchange("</s/material_1>", "</s/material_2>")),
            ("swapped textures", exchange("s-texture-1", "s-texture-2")),
            ("points in place of faces", swap("elementType = \"face\"", "elementType = \"point\"")),
            ("an unused family", swap("familyName = \"materialBind\"", "familyName = \"other\"")),
        ],
    )
}

pub fn mujoco() -> Vec<Case> {
    let model = cases(
        "s.xml",
        vec![
            ("swapped textures", exchange("s-texture-1", "s-texture-2")),
            ("swapped materials", exchange("material=\"s-1\"", "material=\"s-2\"")),
            ("swapped parts", exchange("s-1.obj", "s-2.obj")),
            ("a part that is not shown", swap("mesh=\"s-2\" material", "mesh=\"s-1\" material")),
            ("the whole mesh shown", swap(" group=\"3\"", "")),
        ],
    );
    let part = cases(
        "s-2.obj",
        vec![
            ("the material of the other part", swap("usemtl print-2", "usemtl print-1")),
            ("a different library", swap("s.mtl", "t.mtl")),
            ("a missing face", {
                text(|text| text.trim_end().rsplit_once('\n').unwrap().0.to_owned() + "\n")
            }),
            ("displaced texture coordinates", {
                text(|text| {
                    let line = text.lines().find(|line| line.starts_with("vt ")).unwrap();
                    text.replacen(line, "vt 0.5 0.5", 1)
                })
            }),
            ("a scale", swap("v ", "s 1\nv ")),
        ],
    );
    model.into_iter().chain(part).collect()
}
