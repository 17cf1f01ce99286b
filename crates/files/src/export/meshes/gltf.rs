//! Binary glTF 2.0 (`.glb`): one mesh with its textures embedded, in metres, in the axes of the
//! target frame.

use std::borrow::Cow;
use std::path::Path;

use serde_json::{Value, json};

use super::mesh::TexturedMesh;
use super::obj::{material_name, numbered};
use crate::export::writing::atomic;

/// Component type `f32`. This and the constants below are numbers of the glTF 2.0 specification.
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
/// Texture wrapping: repeats the outermost texels.
pub const CLAMP_TO_EDGE: u32 = 33071;

/// Writes the mesh as a `.glb` file.
///
/// # Errors
/// Returns an error if the file cannot be written.
pub fn write(mesh: &TexturedMesh, path: &Path) -> Result<(), atomic::WriteError> {
    let bytes = to_bytes(mesh);
    atomic::write(path, |file| file.write_all(&bytes))
}

/// Returns the bytes of the mesh as a `.glb` file, with a list of triangles and a material for each texture. Faces do not share
/// vertices, so normals are exact. Indices have 16 bits, enough for the maximum of 20 000 triangles.
pub fn to_bytes(mesh: &TexturedMesh) -> Vec<u8> {
    let count = mesh.textures.len();
    let mut binary = Binary::default();
    let mut accessors = Vec::new();
    let primitives: Vec<Value> = (0..count)
        .map(|texture| {
            let first = accessors.len();
            accessors.extend(binary.triangles(mesh, texture));
            json!({
                "attributes": {"POSITION": first, "NORMAL": first + 1, "TEXCOORD_0": first + 2},
                "indices": first + 3,
                "material": texture,
            })
        })
        .collect();
    let image = |texture: usize| {
        let view = binary.view(mesh.textures[texture].png.clone(), None);
        json!({"name": image_name(&mesh.name, texture, count), "mimeType": "image/png", "bufferView": view})
    };
    let images: Vec<Value> = (0..count).map(image).collect();
    let material = |texture: usize| {
        json!({"name": material_name(texture, count), "pbrMetallicRoughness": {
            "baseColorTexture": {"index": texture}, "metallicFactor": 0.0, "roughnessFactor": 1.0,
        }})
    };
    let texture = |texture: usize| json!({"sampler": 0, "source": texture});

    let document = json!({
        "asset": {"version": "2.0", "generator": mesh.extras["generator"], "extras": mesh.extras},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": mesh.name, "mesh": 0}],
        "meshes": [{"name": mesh.name, "primitives": primitives}],
        "materials": (0..count).map(material).collect::<Vec<_>>(),
        "textures": (0..count).map(texture).collect::<Vec<_>>(),
        "samplers": [{
            "magFilter": LINEAR, "minFilter": LINEAR_MIPMAP_LINEAR,
            "wrapS": CLAMP_TO_EDGE, "wrapT": CLAMP_TO_EDGE,
        }],
        "images": images,
        "accessors": accessors,
        "bufferViews": binary.views,
        "buffers": [{"byteLength": binary.bytes.len()}],
    });
    let json = document.to_string().into_bytes();
    let glb = gltf::binary::Glb {
        // The length is filled in by the writer.
        header: gltf::binary::Header { magic: *b"glTF", version: 2, length: 0 },
        json: Cow::Owned(json),
        bin: Some(Cow::Owned(binary.bytes)),
    };
    glb.to_vec().expect("a texture within its limits fits into a file")
}

/// Name of the image of one of `count` textures, counted from 0, of a target with this name.
pub fn image_name(name: &str, texture: usize, count: usize) -> String {
    numbered(name.to_owned(), "-texture-", texture, count)
}

/// The binary part and its views.
#[derive(Default)]
struct Binary {
    bytes: Vec<u8>,
    views: Vec<Value>,
}

impl Binary {
    /// Adds bytes and returns the index of their view.
    fn view(&mut self, bytes: Vec<u8>, target: Option<u32>) -> usize {
        let mut view =
            json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()});
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.views.push(view);
        self.bytes.extend(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.len() - 1
    }

    /// Adds the triangles of a texture, and returns the accessors of positions, normals, texture coordinates and
    /// indices.
    fn triangles(&mut self, mesh: &TexturedMesh, texture: usize) -> [Value; 4] {
        let faces = || mesh.faces_of(texture);
        let corners = || faces().flat_map(|face| (0..3).map(move |i| (face, i)));
        let positions: Vec<[f32; 3]> =
            corners().map(|(face, i)| (face.vertices_mm[i] / 1e3).as_vec3().to_array()).collect();
        let normals: Vec<[f32; 3]> =
            corners().map(|(face, _)| face.normal.as_vec3().normalize().to_array()).collect();
        let uvs: Vec<[f32; 2]> =
            corners().map(|(face, i)| face.uv[i].as_vec2().to_array()).collect();
        let count = positions.len();
        let bound = |pick: fn(f32, f32) -> f32| {
            [0, 1, 2].map(|axis| positions.iter().map(|p| p[axis]).reduce(pick).unwrap_or_default())
        };
        let (least, most) = (bound(f32::min), bound(f32::max));
        let mut floats = |values: &[f32]| {
            let bytes = values.iter().flat_map(|v| v.to_le_bytes()).collect();
            self.view(bytes, Some(ARRAY_BUFFER))
        };
        let position = floats(positions.as_flattened());
        let normal = floats(normals.as_flattened());
        let uv = floats(uvs.as_flattened());
        let indices = (0..count as u32).flat_map(|i| (i as u16).to_le_bytes()).collect();
        let index = self.view(indices, Some(ELEMENT_ARRAY_BUFFER));
        [
            json!({"bufferView": position, "componentType": FLOAT, "count": count, "type": "VEC3",
                   "min": least, "max": most}),
            json!({"bufferView": normal, "componentType": FLOAT, "count": count, "type": "VEC3"}),
            json!({"bufferView": uv, "componentType": FLOAT, "count": count, "type": "VEC2"}),
            json!({"bufferView": index, "componentType": UNSIGNED_SHORT, "count": count,
                   "type": "SCALAR"}),
        ]
    }
}
