//! Binary glTF 2.0 (`.glb`): one mesh with its texture embedded, in metres, in the axes of the
//! target frame.

use std::borrow::Cow;
use std::path::Path;

use serde_json::json;

use super::atomic;
use super::mesh::TexturedMesh;

/// Component type `f32`. Like the constants below, a number of the glTF 2.0 specification.
pub const FLOAT: u32 = 5126;
/// Component type `u16`.
pub const UNSIGNED_SHORT: u32 = 5123;
/// A buffer of vertices.
pub const ARRAY_BUFFER: u32 = 34962;
/// A buffer of indices.
pub const ELEMENT_ARRAY_BUFFER: u32 = 34963;
/// Texture filter: linear.
pub const LINEAR: u32 = 9729;
/// Texture filter: linear, also between mipmaps.
pub const LINEAR_MIPMAP_LINEAR: u32 = 9987;
/// Texture wrapping: the outermost texels are repeated.
pub const CLAMP_TO_EDGE: u32 = 33071;

/// Name of the only material.
pub const MATERIAL: &str = "print";

/// Writes the mesh as a `.glb` file.
///
/// # Errors
/// When the file cannot be written.
pub fn write(mesh: &TexturedMesh, path: &Path) -> Result<(), atomic::WriteError> {
    let bytes = to_bytes(mesh);
    atomic::write(path, |file| file.write_all(&bytes))
}

/// The bytes of the mesh as a `.glb` file. Faces do not share vertices, so that normals are exact.
/// Indices have 16 bits, which suffice for the 20 000 triangles that a solid may have.
pub fn to_bytes(mesh: &TexturedMesh) -> Vec<u8> {
    let corners = || mesh.faces.iter().flat_map(|face| (0..3).map(move |i| (face, i)));
    let positions: Vec<[f32; 3]> =
        corners().map(|(face, i)| (face.vertices_mm[i] / 1e3).as_vec3().to_array()).collect();
    let normals: Vec<[f32; 3]> =
        corners().map(|(face, _)| face.normal.as_vec3().normalize().to_array()).collect();
    let uvs: Vec<[f32; 2]> = corners().map(|(face, i)| face.uv[i].as_vec2().to_array()).collect();
    let count = positions.len();
    let bound = |pick: fn(f32, f32) -> f32| {
        [0, 1, 2].map(|axis| positions.iter().map(|p| p[axis]).reduce(pick).unwrap_or_default())
    };
    let (least, most) = (bound(f32::min), bound(f32::max));

    let mut buffer = Vec::new();
    let mut views = Vec::new();
    let mut view = |bytes: Vec<u8>, target: Option<u32>| {
        let mut view = json!({"buffer": 0, "byteOffset": buffer.len(), "byteLength": bytes.len()});
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        views.push(view);
        buffer.extend(bytes);
        buffer.resize(buffer.len().next_multiple_of(4), 0);
    };
    view(floats(positions.as_flattened()), Some(ARRAY_BUFFER));
    view(floats(normals.as_flattened()), Some(ARRAY_BUFFER));
    view(floats(uvs.as_flattened()), Some(ARRAY_BUFFER));
    let indices = (0..count as u32).flat_map(|i| (i as u16).to_le_bytes()).collect();
    view(indices, Some(ELEMENT_ARRAY_BUFFER));
    view(mesh.texture_png.clone(), None);

    let document = json!({
        "asset": {"version": "2.0", "generator": mesh.extras["generator"], "extras": mesh.extras},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": mesh.name, "mesh": 0}],
        "meshes": [{"name": mesh.name, "primitives": [{
            "attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2},
            "indices": 3,
            "material": 0,
        }]}],
        "materials": [{"name": MATERIAL, "pbrMetallicRoughness": {
            "baseColorTexture": {"index": 0}, "metallicFactor": 0.0, "roughnessFactor": 1.0,
        }}],
        "textures": [{"sampler": 0, "source": 0}],
        "samplers": [{
            "magFilter": LINEAR, "minFilter": LINEAR_MIPMAP_LINEAR,
            "wrapS": CLAMP_TO_EDGE, "wrapT": CLAMP_TO_EDGE,
        }],
        "images": [{"name": mesh.name, "mimeType": "image/png", "bufferView": 4}],
        "accessors": [
            {"bufferView": 0, "componentType": FLOAT, "count": count, "type": "VEC3",
             "min": least, "max": most},
            {"bufferView": 1, "componentType": FLOAT, "count": count, "type": "VEC3"},
            {"bufferView": 2, "componentType": FLOAT, "count": count, "type": "VEC2"},
            {"bufferView": 3, "componentType": UNSIGNED_SHORT, "count": count, "type": "SCALAR"},
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": buffer.len()}],
    });
    let json = document.to_string().into_bytes();
    let glb = gltf::binary::Glb {
        // The length is filled in by the writer.
        header: gltf::binary::Header { magic: *b"glTF", version: 2, length: 0 },
        json: Cow::Owned(json),
        bin: Some(Cow::Owned(buffer)),
    };
    glb.to_vec().expect("a texture within its limits fits into a file")
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}
