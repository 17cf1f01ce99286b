//! Damaged glTF.

use serde_json::{Value, json};

use super::edit::{append, swap};
use super::png;
use super::{Case, Damage, cases};
use crate::common::glb::Parts;

/// Changes the JSON.
fn json(edit: impl Fn(&mut Value) + 'static) -> Damage {
    Box::new(move |bytes| {
        let mut parts = Parts::of(bytes);
        let mut root: Value = serde_json::from_slice(&parts.json).unwrap();
        edit(&mut root);
        parts.json = root.to_string().into_bytes();
        parts.join()
    })
}

/// Changes the text of the JSON.
fn words(damage: Damage) -> Damage {
    Box::new(move |bytes| {
        let Parts { json, binary } = Parts::of(bytes);
        Parts { json: damage(&json), binary }.join()
    })
}

/// Sets a value of the JSON by its pointer.
fn set(pointer: &'static str, value: Value) -> Damage {
    json(move |root| {
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        root.pointer_mut(parent).unwrap()[key] = value.clone();
    })
}

/// Adds an entry to a list of the JSON.
fn add(list: &'static str, entry: Value) -> Damage {
    json(move |root| root[list].as_array_mut().unwrap().push(entry.clone()))
}

/// Sets a key of the primitive.
fn primitive(key: &'static str, value: Value) -> Damage {
    json(move |root| root["meshes"][0]["primitives"][0][key] = value.clone())
}

fn attribute(name: &'static str, accessor: usize) -> Damage {
    json(move |root| root["meshes"][0]["primitives"][0]["attributes"][name] = json!(accessor))
}

fn material(key: &'static str, value: Value) -> Damage {
    json(move |root| root["materials"][0][key] = value.clone())
}

fn surface(key: &'static str, value: Value) -> Damage {
    json(move |root| root["materials"][0]["pbrMetallicRoughness"][key] = value.clone())
}

fn node(key: &'static str, value: Value) -> Damage {
    json(move |root| root["nodes"][0][key] = value.clone())
}

/// All nodes anew; the first has the mesh.
fn nodes(list: impl Fn() -> Vec<Value> + 'static) -> Damage {
    json(move |root| root["nodes"] = Value::Array(list()))
}

/// Each of 31 nodes has the next for its child twice: 2³⁰ ways to the last.
fn doubled() -> Vec<Value> {
    let child = |i: usize| json!({"children": [i + 1, i + 1]});
    (0..30).map(child).chain([json!({"mesh": 0})]).collect()
}

/// A chain of nodes, each the only child of the one before.
fn chain(length: usize) -> Vec<Value> {
    let child = |i: usize| json!({"children": [(i + 1) % length]});
    (0..length).map(child).collect()
}

/// Changes a float of the binary part: number `index` of buffer view `view`.
fn float(view: usize, index: usize, value: f32) -> Damage {
    Box::new(move |bytes| {
        let mut parts = Parts::of(bytes);
        let root: Value = serde_json::from_slice(&parts.json).unwrap();
        let at = root["bufferViews"][view]["byteOffset"].as_u64().unwrap() as usize + 4 * index;
        parts.binary[at..at + 4].copy_from_slice(&value.to_le_bytes());
        parts.join()
    })
}

/// Changes the texture.
fn texture(damage: Damage) -> Damage {
    Box::new(move |bytes| {
        let mut parts = Parts::of(bytes);
        let mut root: Value = serde_json::from_slice(&parts.json).unwrap();
        let view = &root["bufferViews"][4];
        let [at, length] =
            ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap() as usize);
        let picture = damage(&parts.binary[at..at + length]);
        parts.binary.truncate(at);
        parts.binary.extend(&picture);
        root["bufferViews"][4]["byteLength"] = json!(picture.len());
        root["buffers"][0]["byteLength"] = json!(parts.binary.len());
        parts.json = root.to_string().into_bytes();
        parts.join()
    })
}

/// Changes the binary part.
fn binary(edit: impl Fn(&mut Vec<u8>) + 'static) -> Damage {
    Box::new(move |bytes| {
        let mut parts = Parts::of(bytes);
        let mut root: Value = serde_json::from_slice(&parts.json).unwrap();
        edit(&mut parts.binary);
        root["buffers"][0]["byteLength"] = json!(parts.binary.len());
        parts.json = root.to_string().into_bytes();
        parts.join()
    })
}

/// Changes bytes in place.
fn byte(at: usize, value: u8) -> Damage {
    Box::new(move |bytes| {
        let mut bytes = bytes.to_vec();
        bytes[at] = value;
        bytes
    })
}

/// A third chunk.
fn third_chunk() -> Damage {
    Box::new(|bytes| {
        let mut bytes = [bytes, b"\x04\0\0\0ABCDabcd"].concat();
        let length = (bytes.len() as u32).to_le_bytes();
        bytes[8..12].copy_from_slice(&length);
        bytes
    })
}

/// Of a solid.
pub fn all() -> Vec<Case> {
    let unlit = || json!({"KHR_materials_unlit": {}});
    let transform = json!({"index": 0, "extensions": {"KHR_texture_transform": {"scale": [2, 2]}}});
    cases(
        "t.glb",
        vec![
            ("black paint", "baseColorFactor", surface("baseColorFactor", json!([0, 0, 0, 1]))),
            ("no opacity", "baseColorFactor", surface("baseColorFactor", json!([1, 1, 1, 0]))),
            ("blended", "alphaMode", material("alphaMode", json!("BLEND"))),
            ("cut by its opacity", "alphaMode", material("alphaMode", json!("MASK"))),
            ("a limit of opacity", "alphaCutoff", material("alphaCutoff", json!(2))),
            (
                "white light of its own",
                "emissiveFactor",
                material("emissiveFactor", json!([1, 1, 1])),
            ),
            (
                "a picture of light",
                "emissiveTexture",
                material("emissiveTexture", json!({"index": 0})),
            ),
            (
                "a picture of shade",
                "occlusionTexture",
                material("occlusionTexture", json!({"index": 0})),
            ),
            (
                "a picture of normals",
                "normalTexture",
                material("normalTexture", json!({"index": 0})),
            ),
            ("both sides", "doubleSided", material("doubleSided", json!(true))),
            ("metal", "metallicFactor", surface("metallicFactor", json!(1))),
            ("gloss", "roughnessFactor", surface("roughnessFactor", json!(0))),
            (
                "a picture of metal",
                "metallicRoughnessTexture",
                surface("metallicRoughnessTexture", json!({"index": 0})),
            ),
            ("without light", "extensions", material("extensions", unlit())),
            ("points", "mode 0 instead", primitive("mode", json!(0))),
            ("lines", "mode 1 instead", primitive("mode", json!(1))),
            ("strips", "mode 5 instead", primitive("mode", json!(5))),
            ("fans", "mode 6 instead", primitive("mode", json!(6))),
            ("shapes to change to", "targets", primitive("targets", json!([{"POSITION": 0}]))),
            ("another set of coordinates", "TEXCOORD_1", attribute("TEXCOORD_1", 2)),
            (
                "coordinates of that set",
                "texCoord",
                surface("baseColorTexture", json!({"index": 0, "texCoord": 1})),
            ),
            ("a transformed texture", "extensions", surface("baseColorTexture", transform)),
            ("colours of vertices", "COLOR_0", attribute("COLOR_0", 0)),
            ("tangents", "TANGENT", attribute("TANGENT", 0)),
            ("joints", "JOINTS_0", attribute("JOINTS_0", 0)),
            ("normals for positions", "min and max", attribute("POSITION", 1)),
            (
                "an empty default scene",
                "scenes: 2 entries",
                json(|root| {
                    root["scenes"] = json!([{"nodes": [0]}, {"nodes": []}]);
                    root["scene"] = json!(1);
                }),
            ),
            ("a second scene", "scenes: 2 entries", add("scenes", json!({"nodes": []}))),
            ("an empty scene", "does not reach", set("/scenes/0/nodes", json!([]))),
            ("a default scene that is not there", "default scene", set("/scene", json!(3))),
            (
                "no default scene",
                "missing field `scene`",
                json(|root| {
                    root.as_object_mut().unwrap().remove("scene");
                }),
            ),
            (
                "two default scenes",
                "duplicate field `scene`",
                words(swap("\"scene\":0", "\"scene\":0,\"scene\":0")),
            ),
            (
                "extensions in use",
                "extensionsUsed",
                set("/extensionsUsed", json!(["KHR_materials_unlit"])),
            ),
            (
                "extensions that are required",
                "extensionsRequired",
                set("/extensionsRequired", json!(["KHR_draco_mesh_compression"])),
            ),
            (
                "lamps",
                "extensions",
                set("/extensions", json!({"KHR_lights_punctual": {"lights": []}})),
            ),
            ("a camera", "cameras", set("/cameras", json!([{"type": "perspective"}]))),
            ("an animation", "animations", set("/animations", json!([]))),
            ("a skin", "skins", set("/skins", json!([{"joints": [0]}]))),
            ("a skin of the node", "skin", node("skin", json!(0))),
            ("weights of the node", "weights", node("weights", json!([1]))),
            ("instances", "extensions", node("extensions", json!({"EXT_mesh_gpu_instancing": {}}))),
            ("a larger node", "scale 1.0100", node("scale", json!([1.01, 1.01, 1.01]))),
            ("a node that is moved", "off by", node("translation", json!([0.0005, 0, 0]))),
            ("a node that is turned", "off by", node("rotation", json!([0, 0, 0.01, 0.99995]))),
            ("a mirror", "mirrors or skews", node("scale", json!([-1, 1, 1]))),
            ("a stretched node", "mirrors or skews", node("scale", json!([1, 1, 1.01]))),
            ("a node of no size", "mirrors or skews", node("scale", json!([0, 0, 0]))),
            ("a node that the scene does not reach", "does not reach", add("nodes", json!({}))),
            ("a node in a cycle", "reached twice", nodes(|| chain(1))),
            ("nodes in a cycle", "reached twice", nodes(|| chain(9))),
            ("2³⁰ ways to a node", "reached twice", nodes(doubled)),
            ("a child that is not there", "not there", node("children", json!([7]))),
            (
                "a mesh that is not shown",
                "no node shows",
                json(|root| {
                    let mesh = root["meshes"][0].clone();
                    root["meshes"].as_array_mut().unwrap().push(mesh);
                }),
            ),
            (
                "a second material",
                "materials: 2 entries",
                json(|root| {
                    let material = root["materials"][0].clone();
                    root["materials"].as_array_mut().unwrap().push(material);
                }),
            ),
            (
                "a second picture",
                "images: 2 entries",
                add("images", json!({"mimeType": "image/png", "bufferView": 4})),
            ),
            ("a picture elsewhere", "uri", set("/images/0/uri", json!("http://example.org/a.png"))),
            (
                "a picture of another kind",
                "mimeType image/jpeg",
                set("/images/0/mimeType", json!("image/jpeg")),
            ),
            ("a buffer elsewhere", "uri", set("/buffers/0/uri", json!("a.bin"))),
            ("hard pixels", "a filter other", set("/samplers/0/magFilter", json!(9728))),
            ("a repeated texture", "a wrap mode", set("/samplers/0/wrapS", json!(10497))),
            ("a mirrored texture", "a wrap mode", set("/samplers/0/wrapT", json!(33648))),
            ("sparse values", "sparse", set("/accessors/0/sparse", json!({"count": 1}))),
            ("normalised values", "normalized", set("/accessors/2/normalized", json!(true))),
            ("values at a distance", "byteStride", set("/bufferViews/0/byteStride", json!(24))),
            ("bounds that leave all out", "min and max", set("/accessors/0/max", json!([0, 0, 0]))),
            (
                "more values than there are",
                "does not hold",
                set("/accessors/0/count", json!(1_000_000_000)),
            ),
            (
                "a view beyond the end",
                "outside the binary part",
                set("/bufferViews/0/byteLength", json!(1u64 << 62)),
            ),
            ("fewer normals", "another number of vertices", set("/accessors/1/count", json!(9))),
            ("fewer triangles", "do not fill", set("/accessors/3/count", json!(9))),
            ("part of a triangle", "a part of a triangle", set("/accessors/3/count", json!(10))),
            ("values of no use", "accessors[4]: values of no use", {
                add(
                    "accessors",
                    json!({"bufferView": 1, "componentType": 5126, "count": 12, "type": "VEC3"}),
                )
            }),
            ("bytes of no use", "bytes of no", {
                add("bufferViews", json!({"buffer": 0, "byteOffset": 0, "byteLength": 0}))
            }),
            (
                "bytes before a view",
                "bytes that do not follow",
                set("/bufferViews/1/byteOffset", json!(4)),
            ),
            ("bytes after the views", "bytes of no view", binary(|binary| binary.extend([1; 8]))),
            (
                "bounds of normals",
                "min and max of no use",
                set("/accessors/1/max", json!([0, 0, 0])),
            ),
            (
                "indices for positions",
                "a view for values of another kind",
                set("/bufferViews/0/target", json!(34963)),
            ),
            (
                "values for a picture",
                "a view for values",
                set("/bufferViews/4/target", json!(34962)),
            ),
            ("another generator", "a generator other", set("/asset/generator", json!("a program"))),
            (
                "another target's description",
                "extras that do not describe",
                set("/asset/extras/spec/tiles", json!(8)),
            ),
            ("more in the extras", "extras that", set("/asset/extras/more", json!(1))),
            (
                "no extras",
                "missing field `extras`",
                json(|root| {
                    root["asset"].as_object_mut().unwrap().remove("extras");
                }),
            ),
            (
                "another name of the mesh",
                "\"u\" for the target's",
                set("/meshes/0/name", json!("u")),
            ),
            (
                "another name of the material",
                "a name other than print",
                material("name", json!("u")),
            ),
            ("extras of the node", "extras", node("extras", json!({"a": 1}))),
            ("blanks in the JSON", "blanks, a spelling", words(swap("{", "{  "))),
            (
                "an escaped name",
                "a spelling",
                words(swap("\"name\":\"t\"", "\"name\":\"\\u0074\"")),
            ),
            (
                "a key of extras twice",
                "there twice",
                words(swap("\"tiles\":7", "\"tiles\":8,\"tiles\":7")),
            ),
            (
                "a texture of another title",
                "images[0], byte 89: words",
                texture(swap("\0t", "\0u")),
            ),
            ("a later version", "version 3.0", set("/asset/version", json!("3.0"))),
            ("a least version", "minVersion", set("/asset/minVersion", json!("2.1"))),
            ("a container of another version", "a version other than 2", byte(4, 3)),
            ("data after the end", "data after", append("PK")),
            ("a third chunk", "a third chunk", third_chunk()),
            (
                "a file that is cut off",
                "cut off",
                Box::new(|bytes| bytes[..bytes.len() / 2].to_vec()),
            ),
            ("lists for objects", "a list for", words(swap("[{\"nodes\":[0]}]", "[[[0]]]"))),
            ("JSON that is none", "not glTF", words(swap("{", "x"))),
            ("a position that is none", "POSITION other than", float(0, 0, f32::NAN)),
            ("a position that is moved", "min and max", float(0, 0, 1.0)),
            ("a normal that is turned", "wrong normals", float(1, 0, -1.0)),
            ("coordinates beyond the texture", "beyond the texture", float(2, 0, 1.5)),
            ("coordinates that are moved", "at row", float(2, 0, 0.02)),
            ("an index that points nowhere", "points nowhere", float(3, 0, f32::NAN)),
            (
                "a transparent texture",
                "images[0], byte 8: pixels other",
                texture(png::pixels(|p| image::DynamicImage::from(p).to_luma_alpha8().into())),
            ),
            (
                "a gamma of the texture",
                "chunk gAMA",
                texture(png::with_chunk(b"gAMA", &[0, 0, 0, 1])),
            ),
            ("a spot on the texture", "at row", texture(png::square([0.33, 0.83], 30))),
        ],
    )
}
