//! The JSON of a `.glb` that every viewer shows the same way, as types: a key without a field here is rejected.
//!
//! Names and meanings are those of glTF 2.0. A number that refers to another object is its index in the list of that
//! kind in [`Root`]. Optional fields may be missing because every viewer assumes their default. [`glb`](super::glb)
//! checks the values.

use serde::Deserialize;
use serde_json::Value;

/// The whole file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
pub(super) struct Root {
    pub asset: Asset,
    pub scene: usize,
    pub scenes: Vec<Scene>,
    pub nodes: Vec<Node>,
    pub meshes: Vec<Mesh>,
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub samplers: Vec<Sampler>,
    pub images: Vec<Image>,
    pub accessors: Vec<Accessor>,
    pub buffer_views: Vec<BufferView>,
    pub buffers: Vec<Buffer>,
}

/// Version of glTF, writer, and facts about the target.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
pub(super) struct Asset {
    pub version: String,
    pub generator: String,
    pub extras: Value,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
pub(super) struct Scene {
    pub nodes: Vec<usize>,
}

/// A node with its transform to its parent: either a matrix in column order, or a translation in metres, a rotation
/// as a quaternion x, y, z, w, and a scale.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
pub(super) struct Node {
    pub name: Option<String>,
    pub mesh: Option<usize>,
    #[serde(default)]
    pub children: Vec<usize>,
    pub matrix: Option<[f64; 16]>,
    pub translation: Option<[f64; 3]>,
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
pub(super) struct Mesh {
    pub name: Option<String>,
    pub primitives: Vec<Primitive>,
}

/// Triangles with one material.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
pub(super) struct Primitive {
    pub attributes: Attributes,
    pub indices: usize,
    pub material: usize,
    pub mode: Option<u32>,
}

/// The accessors of the vertex attributes. All three are required; colours, tangents and a second set of texture
/// coordinates are not allowed.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "SCREAMING_SNAKE_CASE")]
pub(super) struct Attributes {
    pub position: usize,
    pub normal: usize,
    #[serde(rename = "TEXCOORD_0")]
    pub texcoord_0: usize,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
pub(super) struct Material {
    pub name: Option<String>,
    pub pbr_metallic_roughness: Surface,
    pub alpha_mode: Option<String>,
    pub emissive_factor: Option<[f64; 3]>,
    pub double_sided: Option<bool>,
}

/// The surface of the metallic-roughness model.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
pub(super) struct Surface {
    pub base_color_texture: TextureInfo,
    pub base_color_factor: Option<[f64; 4]>,
    pub metallic_factor: f64,
    pub roughness_factor: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
pub(super) struct TextureInfo {
    pub index: usize,
    pub tex_coord: Option<u32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
pub(super) struct Texture {
    pub sampler: usize,
    pub source: usize,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
pub(super) struct Sampler {
    pub mag_filter: u32,
    pub min_filter: u32,
    pub wrap_s: u32,
    pub wrap_t: u32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
pub(super) struct Image {
    pub name: Option<String>,
    pub mime_type: String,
    pub buffer_view: usize,
}

/// Typed values from the beginning of a view.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
pub(super) struct Accessor {
    pub buffer_view: usize,
    pub component_type: u32,
    pub count: usize,
    #[serde(rename = "type")]
    pub kind: String,
    pub min: Option<Vec<f32>>,
    pub max: Option<Vec<f32>>,
}

/// A range of bytes of the buffer, without a stride.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
pub(super) struct BufferView {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub byte_length: usize,
    pub target: Option<u32>,
}

/// The binary chunk.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
pub(super) struct Buffer {
    pub byte_length: usize,
}
