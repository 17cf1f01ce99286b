//! Damaged glTF.

use serde_json::{Value, json};

use super::edit::{append, swap};
use super::{Case, Damage, cases, png};
use crate::common::glb::Parts;

/// Edits the JSON.
pub fn json(edit: impl Fn(&mut Value) + 'static) -> Damage {
    Box::new(move |bytes| {
        let mut parts = Parts::of(bytes);
        let mut root: Value = serde_json::from_slice(&parts.json).unwrap();
        edit(&mut root);
        parts.json = root.to_string().into_bytes();
        parts.join()
    })
}

/// Edits the text of the JSON.
fn words(damage: Damage) -> Damage {
    Box::new(move |bytes| {
        let Parts { json, binary } = Parts::of(bytes);
        Parts { json: damage(&json), binary }.join()
    })
}

/// Sets a value of the JSON, given its pointer.
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

/// Replaces all nodes; the first has the mesh.
fn nodes(list: impl Fn() -> Vec<Value> + 'static) -> Damage {
    json(move |root| root["nodes"] = Value::Array(list()))
}

/// Creates 31 nodes, each with the next one as its child twice: 2³⁰ paths to the last.
fn doubled() -> Vec<Value> {
    let child = |i: usize| json!({"children": [i + 1, i + 1]});
    (0..30).map(child).chain([json!({"mesh": 0})]).collect()
}

/// Creates a chain of nodes, each the only child of the previous one.
fn chain(length: usize) -> Vec<Value> {
    let child = |i: usize| json!({"children": [(i + 1) % length]});
    (0..length).map(child).collect()
}

/// Sets a float of the binary part: number `index` of buffer view `view`.
fn float(view: usize, index: usize, value: f32) -> Damage {
    Box::new(move |bytes| {
        let mut parts = Parts::of(bytes);
        let root: Value = serde_json::from_slice(&parts.json).unwrap();
        let at = root["bufferViews"][view]["byteOffset"].as_u64().unwrap() as usize + 4 * index;
        parts.binary[at..at + 4].copy_from_slice(&value.to_le_bytes());
        parts.join()
    })
}

/// Edits the texture.
pub fn texture(damage: Damage) -> Damage {
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

/// Edits the binary part.
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

/// Sets a byte.
fn byte(at: usize, value: u8) -> Damage {
    Box::new(move |bytes| {
        let mut bytes = bytes.to_vec();
        bytes[at] = value;
        bytes
    })
}

/// Adds a third chunk.
fn third_chunk() -> Damage {
    Box::new(|bytes| {
        let mut bytes = [bytes, b"\x04\0\0\0ABCDabcd"].concat();
        let length = (bytes.len() as u32).to_le_bytes();
        bytes[8..12].copy_from_slice(&length);
        bytes
    })
}

/// Returns the cases for a solid.
pub fn all() -> Vec<Case> {
    let unlit = || json!({"KHR_materials_unlit": {}});
    let transform = json!({"index": 0, "extensions": {"KHR_texture_transform": {"scale": [2, 2]}}});
    cases(
        "t.glb",
        vec![
            ("black paint", surface("baseColorFactor", json!([0, 0, 0, 1]))),
            ("zero opacity", surface("baseColorFactor", json!([1, 1, 1, 0]))),
            ("alpha blending", material("alphaMode", json!("BLEND"))),
            ("alpha masking", material("alphaMode", json!("MASK"))),
            ("an alpha cutoff", material("alphaCutoff", json!(2))),
            ("white emission", material("emissiveFactor", json!([1, 1, 1]))),
            ("an emissive texture", material("emissiveTexture", json!({"index": 0}))),
            ("an occlusion texture", material("occlusionTexture", json!({"index": 0}))),
            ("a normal map", material("normalTexture", json!({"index": 0}))),
            ("a double-sided material", material("doubleSided", json!(true))),
            ("metal", surface("metallicFactor", json!(1))),
            ("gloss", surface("roughnessFactor", json!(0))),
            (
                "a metallic-roughness texture",
                surface("metallicRoughnessTexture", json!({"index": 0})),
            ),
            ("an unlit material", material("extensions", unlit())),
            ("points", primitive("mode", json!(0))),
            ("lines", primitive("mode", json!(1))),
            ("strips", primitive("mode", json!(5))),
            ("fans", primitive("mode", json!(6))),
            ("morph targets", primitive("targets", json!([{"POSITION": 0}]))),
            ("a second set of texture coordinates", attribute("TEXCOORD_1", 2)),
            (
                "a texture that uses the second set",
                surface("baseColorTexture", json!({"index": 0, "texCoord": 1})),
            ),
            ("a transformed texture", surface("baseColorTexture", transform)),
            ("vertex colours", attribute("COLOR_0", 0)),
            ("tangents", attribute("TANGENT", 0)),
            ("joints", attribute("JOINTS_0", 0)),
            ("normals for positions", attribute("POSITION", 1)),
            (
                "an empty default scene",
                json(|root| {
                    root["scenes"] = json!([{"nodes": [0]}, {"nodes": []}]);
                    root["scene"] = json!(1);
                }),
            ),
            ("a second scene", add("scenes", json!({"nodes": []}))),
            ("an empty scene", set("/scenes/0/nodes", json!([]))),
            ("a missing default scene", set("/scene", json!(3))),
            (
                "no stated default scene",
                json(|root| {
                    root.as_object_mut().unwrap().remove("scene");
                }),
            ),
            ("two default scenes", words(swap("\"scene\":0", "\"scene\":0,\"scene\":0"))),
            ("used extensions", set("/extensionsUsed", json!(["KHR_materials_unlit"]))),
            (
                "required extensions",
                set("/extensionsRequired", json!(["KHR_draco_mesh_compression"])),
            ),
            ("lights", set("/extensions", json!({"KHR_lights_punctual": {"lights": []}}))),
            ("a camera", set("/cameras", json!([{"type": "perspective"}]))),
            ("an animation", set("/animations", json!([]))),
            ("a skin", set("/skins", json!([{"joints": [0]}]))),
            ("a node with a skin", node("skin", json!(0))),
            ("a node with weights", node("weights", json!([1]))),
            ("instances", node("extensions", json!({"EXT_mesh_gpu_instancing": {}}))),
            ("a larger node", node("scale", json!([1.01, 1.01, 1.01]))),
            ("a displaced node", node("translation", json!([0.0005, 0, 0]))),
            ("a rotated node", node("rotation", json!([0, 0, 0.01, 0.99995]))),
            ("a mirrored shape", node("scale", json!([-1, 1, 1]))),
            ("a stretched node", node("scale", json!([1, 1, 1.01]))),
            ("a node of zero size", node("scale", json!([0, 0, 0]))),
            ("an unreachable node", add("nodes", json!({}))),
            ("a node in a cycle", nodes(|| chain(1))),
            ("nodes in a cycle", nodes(|| chain(9))),
            ("2³⁰ paths to a node", nodes(doubled)),
            ("a missing child", node("children", json!([7]))),
            (
                "an unused mesh",
                json(|root| {
                    let mesh = root["meshes"][0].clone();
                    root["meshes"].as_array_mut().unwrap().push(mesh);
                }),
            ),
            (
                "a second material",
                json(|root| {
                    let material = root["materials"][0].clone();
                    root["materials"].as_array_mut().unwrap().push(material);
                }),
            ),
            ("a second image", add("images", json!({"mimeType": "image/png", "bufferView": 4}))),
            ("an external image", set("/images/0/uri", json!("http://example.org/a.png"))),
            ("an image of a different type", set("/images/0/mimeType", json!("image/jpeg"))),
            ("an external buffer", set("/buffers/0/uri", json!("a.bin"))),
            ("nearest-neighbour filtering", set("/samplers/0/magFilter", json!(9728))),
            ("a repeated texture", set("/samplers/0/wrapS", json!(10497))),
            ("a mirrored texture", set("/samplers/0/wrapT", json!(33648))),
            ("sparse values", set("/accessors/0/sparse", json!({"count": 1}))),
            ("normalised values", set("/accessors/2/normalized", json!(true))),
            ("strided values", set("/bufferViews/0/byteStride", json!(24))),
            ("bounds that exclude everything", set("/accessors/0/max", json!([0, 0, 0]))),
            ("more values than exist", set("/accessors/0/count", json!(1_000_000_000))),
            ("a view beyond the end", set("/bufferViews/0/byteLength", json!(1u64 << 62))),
            ("fewer normals", set("/accessors/1/count", json!(9))),
            ("fewer triangles", set("/accessors/3/count", json!(9))),
            ("an incomplete triangle", set("/accessors/3/count", json!(10))),
            ("unused values", {
                add(
                    "accessors",
                    json!({"bufferView": 1, "componentType": 5126, "count": 12, "type": "VEC3"}),
                )
            }),
            ("unused bytes", {
                add("bufferViews", json!({"buffer": 0, "byteOffset": 0, "byteLength": 0}))
            }),
            ("bytes before a view", set("/bufferViews/1/byteOffset", json!(4))),
            ("bytes after the views", binary(|binary| binary.extend([1; 8]))),
            ("bounds of normals", set("/accessors/1/max", json!([0, 0, 0]))),
            ("indices for positions", set("/bufferViews/0/target", json!(34963))),
            ("an image with a buffer target", set("/bufferViews/4/target", json!(34962))),
            ("a different generator", set("/asset/generator", json!("a program"))),
            ("the description of a different target", set("/asset/extras/spec/tiles", json!(8))),
            ("additional extras", set("/asset/extras/more", json!(1))),
            (
                "no extras",
                json(|root| {
                    root["asset"].as_object_mut().unwrap().remove("extras");
                }),
            ),
            ("a different name of the mesh", set("/meshes/0/name", json!("u"))),
            ("a different name of the material", material("name", json!("u"))),
            ("a node with extras", node("extras", json!({"a": 1}))),
            ("blanks in the JSON", words(swap("{", "{  "))),
            ("an escaped name", words(swap("\"name\":\"t\"", "\"name\":\"\\u0074\""))),
            (
                "a duplicate key in the extras",
                words(swap("\"tiles\":7", "\"tiles\":8,\"tiles\":7")),
            ),
            ("a texture with a different title", texture(swap("\0t", "\0u"))),
            ("a later version", set("/asset/version", json!("3.0"))),
            ("a minimum version", set("/asset/minVersion", json!("2.1"))),
            ("a container of a different version", byte(4, 3)),
            ("data after the end", append("PK")),
            ("a third chunk", third_chunk()),
            ("a truncated file", Box::new(|bytes| bytes[..bytes.len() / 2].to_vec())),
            ("lists in place of objects", words(swap("[{\"nodes\":[0]}]", "[[[0]]]"))),
            ("invalid JSON", words(swap("{", "x"))),
            ("a NaN position", float(0, 0, f32::NAN)),
            ("a displaced position", float(0, 0, 1.0)),
            ("a rotated normal", float(1, 0, -1.0)),
            ("texture coordinates beyond the texture", float(2, 0, 1.5)),
            ("displaced texture coordinates", float(2, 0, 0.02)),
            ("an index out of range", float(3, 0, f32::NAN)),
            (
                "a transparent texture",
                texture(png::pixels(|p| image::DynamicImage::from(p).to_luma_alpha8().into())),
            ),
            ("a texture with a gamma", texture(png::with_chunk(b"gAMA", &[0, 0, 0, 1]))),
            ("a spot on the texture", texture(png::square([0.33, 0.83], 30))),
        ],
    )
}
