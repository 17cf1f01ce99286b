//! The parts of a `.glb` that every viewer shows the same way: one scene, a tree of nodes, triangles with opaque,
//! unlit-white materials, and an embedded texture for each.

use std::collections::BTreeSet;

use glam::{DMat4, DQuat, DVec3};
use serde_json::Value;

use crate::syntax::findings::Findings;
use crate::syntax::meshes::glb_json::{Accessor, Node, Primitive, Root, Sampler, Surface};
use crate::syntax::png;
use crate::syntax::words::{Words, is_creator};
use deltille_core::reading::in_words;
use deltille_files::export::gltf::{
    ARRAY_BUFFER, CLAMP_TO_EDGE, ELEMENT_ARRAY_BUFFER, FLOAT, LINEAR, LINEAR_MIPMAP_LINEAR,
    UNSIGNED_SHORT, image_name,
};
use deltille_files::export::obj::material_name;
use deltille_files::export::texture::MAX_TEXTURES;
use deltille_files::limits::{Exceeded, Limits};

/// The mode of a triangle list in glTF.
const TRIANGLES: u32 = 4;

/// Relative tolerance by which the transform of a node may differ from a rotation with one scale for all axes: its
/// numbers are in single precision.
const SLACK: f64 = 1e-5;

/// Inspects a `.glb` for constructs that are not allowed.
///
/// # Errors
///
/// Returns an error if the file is not glTF, is truncated, or exceeds the limits.
pub(in crate::syntax) fn check(
    bytes: &[u8],
    words: &Words,
    limits: &Limits,
) -> Result<Findings, String> {
    let mut found = Findings::default();
    let Some(Chunks { json, binary }) = Chunks::read(bytes, &mut found)? else { return Ok(found) };
    let mut deserializer = serde_json::Deserializer::from_slice(json);
    let root: Root = match serde_path_to_error::deserialize(&mut deserializer) {
        Ok(root) => root,
        Err(error) => {
            let place = error.path().to_string();
            let inner = error.into_inner();
            if !inner.is_data() {
                return Err(format!("not glTF: {}", in_words(inner)));
            }
            let text = inner.to_string();
            let what = text.split(", expected").next().unwrap_or_default();
            found.add(place, what);
            return Ok(found);
        }
    };
    let value: Value =
        serde_json::from_slice(json).map_err(|error| format!("not glTF: {}", in_words(error)))?;
    if value.is_array() || !has_objects(&value) {
        found.add("the JSON", "an array in place of an object or within an array");
        return Ok(found);
    }
    // If a key is repeated or spelled with escapes, readers differ in which value they take. The
    // JSON must therefore equal its own values after they are written again.
    let rewritten = value.to_string();
    let filled = rewritten.len().next_multiple_of(4) == json.len();
    if !filled || json.trim_ascii_end() != rewritten.as_bytes() {
        let spelling = "blanks, a different spelling, or a duplicate key";
        found.add("the JSON", spelling);
    }
    let mut inspection = Inspection { root: &root, binary, words, found };
    inspection.counts();
    // References to missing objects are not followed.
    if inspection.found.0.is_empty() {
        inspection.sizes(limits).map_err(|exceeded| exceeded.to_string())?;
        inspection.nodes(limits).map_err(|exceeded| exceeded.to_string())?;
        inspection.primitives();
        inspection.sampler(&root.samplers[0]);
        for index in 0..root.materials.len() {
            inspection.material(index);
            inspection.texture(index, limits)?;
        }
        inspection.names();
        inspection.layout();
        inspection.unused();
    }
    Ok(inspection.found)
}

/// Whether all objects are written as objects. serde also reads a struct from a list of its values, which other
/// readers refuse.
fn has_objects(value: &Value) -> bool {
    const OBJECTS: [&str; 4] = ["asset", "attributes", "pbrMetallicRoughness", "baseColorTexture"];
    match value {
        Value::Array(list) => list.iter().all(|entry| !entry.is_array() && has_objects(entry)),
        Value::Object(object) => object.iter().all(|(key, value)| {
            let listed = value.is_array() && OBJECTS.contains(&key.as_str());
            key == "extras" || (!listed && has_objects(value))
        }),
        _ => true,
    }
}

/// The two chunks of a `.glb`.
struct Chunks<'a> {
    json: &'a [u8],
    binary: &'a [u8],
}

impl<'a> Chunks<'a> {
    /// Returns the chunks of a file, or `None` with a finding if the container has another version.
    fn read(bytes: &'a [u8], found: &mut Findings) -> Result<Option<Self>, String> {
        let word = |at: usize| -> Option<u32> {
            bytes.get(at..at + 4)?.first_chunk::<4>().copied().map(u32::from_le_bytes)
        };
        if !bytes.starts_with(b"glTF") {
            return Err("not glTF: no glTF header".to_owned());
        }
        if word(4) != Some(2) {
            found.add("the header", "a version other than 2");
            return Ok(None);
        }
        let cut_off = || "not glTF: truncated".to_owned();
        let length = word(8).ok_or_else(cut_off)? as usize;
        found.unless(bytes.len() <= length, "the end", "data after the stated length");
        if bytes.len() < length {
            return Err(cut_off());
        }
        let mut at = 12;
        let mut chunk = |name: &[u8; 4]| -> Option<&'a [u8]> {
            let length = word(at)? as usize;
            let kind = bytes.get(at + 4..at + 8)?;
            let data = bytes.get(at + 8..)?.get(..length)?;
            at += 8 + length;
            (kind == name).then_some(data)
        };
        let json = chunk(b"JSON").ok_or_else(cut_off)?;
        let binary = chunk(b"BIN\0").ok_or("no binary chunk")?;
        found.unless(at >= length, "the end", "a third chunk");
        Ok(Some(Self { json, binary }))
    }
}

/// The inspection of a file that has only permitted JSON keys.
struct Inspection<'a> {
    root: &'a Root,
    binary: &'a [u8],
    words: &'a Words,
    found: Findings,
}

impl Inspection<'_> {
    /// Checks that a list contains one entry if the reader uses only its first, that each texture
    /// has one material and one image, and that views and accessors lie within the binary chunk.
    fn counts(&mut self) {
        let root = self.root;
        let version = &root.asset.version;
        self.found.unless(version == "2.0", "asset", format!("version {version}"));
        let textures = root.textures.len().clamp(1, MAX_TEXTURES as usize);
        for (place, count, stated) in [
            ("scenes", root.scenes.len(), 1),
            ("materials", root.materials.len(), textures),
            ("textures", root.textures.len(), textures),
            ("samplers", root.samplers.len(), 1),
            ("images", root.images.len(), textures),
            ("buffers", root.buffers.len(), 1),
        ] {
            let problem = match stated {
                1 => format!("{count} entries instead of 1"),
                _ => format!("{count} instead of {stated} entries"),
            };
            self.found.unless(count == stated, place, problem);
        }
        self.found.unless(root.scene == 0, "scene", "a default scene that does not exist");
        for buffer in &root.buffers {
            // The chunk is padded to whole words.
            let whole = Some(self.binary.len()) == buffer.byte_length.checked_next_multiple_of(4);
            self.found.unless(whole, "buffers[0]", "a length other than that of the binary chunk");
        }
        for (i, view) in root.buffer_views.iter().enumerate() {
            let inside = view.buffer == 0
                && view
                    .byte_offset
                    .checked_add(view.byte_length)
                    .is_some_and(|end| end <= self.binary.len());
            let place = format!("bufferViews[{i}]");
            self.found.unless(inside, &place, "bytes outside the binary chunk");
        }
        for (i, accessor) in root.accessors.iter().enumerate() {
            let inside = self.bytes(accessor).is_some();
            self.found.unless(
                inside,
                format!("accessors[{i}]"),
                "values beyond the end of its view",
            );
        }
    }

    /// Returns the bytes of an accessor's values. Returns `None` if they exceed the view, or for a type that is not
    /// allowed.
    fn bytes(&self, accessor: &Accessor) -> Option<&[u8]> {
        let view = self.root.buffer_views.get(accessor.buffer_view)?;
        let components = match accessor.kind.as_str() {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            _ => return None,
        };
        let size = match accessor.component_type {
            FLOAT => 4,
            UNSIGNED_SHORT => 2,
            _ => return None,
        };
        let length = accessor.count.checked_mul(components * size)?;
        let view = self.binary.get(view.byte_offset..)?.get(..view.byte_length)?;
        view.get(..length)
    }

    /// Checks the number of nodes and triangles against the limits.
    fn sizes(&self, limits: &Limits) -> Result<(), Exceeded> {
        let root = self.root;
        let shapes = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
        let indices = shapes.filter_map(|shape| root.accessors.get(shape.indices));
        limits.check_nodes(root.nodes.len() + indices.map(|list| list.count / 3).sum::<usize>())
    }

    /// Checks that the scene is a tree of all nodes, without cycles and without a node shown twice, that all meshes
    /// are shown, and that transforms neither mirror nor skew.
    fn nodes(&mut self, limits: &Limits) -> Result<(), Exceeded> {
        let root = self.root;
        let mut parents = vec![0usize; root.nodes.len()];
        let mut open: Vec<(usize, usize)> =
            root.scenes[0].nodes.iter().map(|&node| (node, 1)).collect();
        while let Some((index, depth)) = open.pop() {
            let Some(node) = root.nodes.get(index) else {
                self.found.add("scene", "a node that does not exist");
                return Ok(());
            };
            limits.check_depth(depth)?;
            parents[index] += 1;
            if parents[index] > 1 {
                self.found.add(format!("nodes[{index}]"), "a node that is reached twice");
                return Ok(());
            }
            open.extend(node.children.iter().map(|&child| (child, depth + 1)));
        }
        for (index, (node, parents)) in root.nodes.iter().zip(parents).enumerate() {
            let place = format!("nodes[{index}]");
            self.found.unless(parents > 0, &place, "a node that the scene does not reach");
            let there = node.mesh.is_none_or(|mesh| mesh < root.meshes.len());
            self.found.unless(there, &place, "a mesh that does not exist");
            self.found.unless(keeps_shapes(node), &place, "a transform that mirrors or skews");
        }
        let shown = |mesh: usize| root.nodes.iter().any(|node| node.mesh == Some(mesh));
        for mesh in (0..root.meshes.len()).filter(|&mesh| !shown(mesh)) {
            self.found.add(format!("meshes[{mesh}]"), "a mesh that no node shows");
        }
        Ok(())
    }

    /// Checks that names and extras are those of the target.
    fn names(&mut self) {
        let (root, title) = (self.root, &self.words.title);
        self.found.unseen_unless(
            is_creator(&root.asset.generator),
            "asset",
            "a generator other than deltille",
        );
        let extras = self.words.are_extras(&root.asset.extras);
        self.found.unseen_unless(extras, "asset", "extras that do not describe the target");
        let count = root.materials.len();
        for (i, material) in root.materials.iter().enumerate() {
            let usual = material_name(i, count);
            let holds = material.name.as_ref().is_none_or(|name| *name == usual);
            let place = format!("materials[{i}]");
            self.found.unseen_unless(holds, place, format!("a name other than {usual}"));
        }
        let nodes = root.nodes.iter().map(|node| (&node.name, title.clone()));
        let meshes = root.meshes.iter().map(|mesh| (&mesh.name, title.clone()));
        let images = root.images.iter().enumerate();
        let images = images.map(|(i, image)| (&image.name, image_name(title, i, count)));
        for (name, usual) in nodes.chain(meshes).chain(images) {
            if let Some(name) = name.as_ref().filter(|name| **name != usual) {
                let problem = format!("{name:?} instead of the target's name");
                self.found.unseen_unless(false, "the names", problem);
            }
        }
    }

    /// Checks that views follow each other in the binary chunk, padded with zeros to four bytes, that there are no
    /// other bytes, that values fill their view, and that the stated target of a view fits its values. Nothing can
    /// then be hidden between the visible data.
    fn layout(&mut self) {
        let (root, binary) = (self.root, self.binary);
        let mut end = 0usize;
        for (i, view) in root.buffer_views.iter().enumerate() {
            let place = format!("bufferViews[{i}]");
            let follows = view.byte_offset == end.next_multiple_of(4);
            self.found.unless(
                follows,
                &place,
                "bytes that do not follow those of the previous view",
            );
            let filled = binary.get(end..view.byte_offset).unwrap_or_default();
            self.found.unless(
                filled.iter().all(|&byte| byte == 0),
                &place,
                "non-zero bytes before it",
            );
            end = view.byte_offset + view.byte_length;
        }
        let rest = binary.get(end..).unwrap_or_default();
        let ends = rest.len() < 4 && rest.iter().all(|&byte| byte == 0);
        self.found.unless(ends, "buffers[0]", "bytes outside all views");
        for (i, accessor) in root.accessors.iter().enumerate() {
            let place = format!("accessors[{i}]");
            let view = &root.buffer_views[accessor.buffer_view];
            let fill = self.bytes(accessor).is_some_and(|bytes| bytes.len() == view.byte_length);
            self.found.unless(fill, &place, "values that do not fill their view");
            let target = match accessor.component_type {
                UNSIGNED_SHORT => ELEMENT_ARRAY_BUFFER,
                _ => ARRAY_BUFFER,
            };
            let holds = view.target.is_none_or(|stated| stated == target);
            self.found.unless(holds, &place, "a view with a target for other values");
        }
        for (i, image) in root.images.iter().enumerate() {
            let picture = root.buffer_views.get(image.buffer_view);
            let bare = picture.is_some_and(|view| view.target.is_none());
            self.found.unless(bare, format!("images[{i}]"), "a view with a target");
        }
    }

    /// Checks that the visible scene uses every material, accessor and view.
    fn unused(&mut self) {
        let root = self.root;
        let primitives = || root.meshes.iter().flat_map(|mesh| &mesh.primitives);
        for i in 0..root.materials.len() {
            let is_used = primitives().any(|primitive| primitive.material == i);
            self.found.unless(is_used, format!("materials[{i}]"), "an unused material");
        }
        let accessors: BTreeSet<usize> = primitives()
            .flat_map(|Primitive { attributes: a, indices, .. }| {
                [a.position, a.normal, a.texcoord_0, *indices]
            })
            .collect();
        let views = accessors.iter().filter_map(|&i| Some(root.accessors.get(i)?.buffer_view));
        let pictures = root.images.iter().map(|image| image.buffer_view);
        let views: BTreeSet<usize> = views.chain(pictures).collect();
        for i in (0..root.accessors.len()).filter(|i| !accessors.contains(i)) {
            self.found.add(format!("accessors[{i}]"), "unused values");
        }
        for i in (0..root.buffer_views.len()).filter(|i| !views.contains(i)) {
            self.found.add(format!("bufferViews[{i}]"), "unused bytes");
        }
    }

    /// Checks the primitives of all meshes.
    fn primitives(&mut self) {
        let root = self.root;
        for (m, mesh) in root.meshes.iter().enumerate() {
            for (p, primitive) in mesh.primitives.iter().enumerate() {
                self.primitive(primitive, &format!("meshes[{m}].primitives[{p}]"));
            }
        }
    }

    /// Checks that a primitive is a triangle list with a material, that its attributes are finite floats of equal
    /// number, and that texture coordinates lie on the texture.
    fn primitive(&mut self, primitive: &Primitive, place: &str) {
        let mode = primitive.mode.unwrap_or(TRIANGLES);
        self.found.unless(mode == TRIANGLES, place, format!("mode {mode} instead of triangles"));
        let dressed = primitive.material < self.root.materials.len();
        self.found.unless(dressed, place, "a material that does not exist");
        let attributes = &primitive.attributes;
        let mut count = None;
        for (name, index, kind) in [
            ("POSITION", attributes.position, "VEC3"),
            ("NORMAL", attributes.normal, "VEC3"),
            ("TEXCOORD_0", attributes.texcoord_0, "VEC2"),
        ] {
            let Some(values) = self.floats(index, kind) else {
                self.found
                    .add(place, format!("attribute {name} other than {kind} of finite floats"));
                continue;
            };
            let own = self.root.accessors[index].count;
            let same = *count.get_or_insert(own) == own;
            self.found.unless(
                same,
                place,
                format!("attribute {name} with a different number of vertices"),
            );
            let (what, inside) =
                (format!("attribute {name} beyond the texture"), |v: &f32| (0.0..=1.0).contains(v));
            self.found.unless(kind != "VEC2" || values.iter().all(inside), place, what);
            let Accessor { min, max, .. } = &self.root.accessors[index];
            if name == "POSITION" {
                self.bounds(index, &values);
            } else if min.is_some() || max.is_some() {
                self.found.add(format!("accessors[{index}]"), "unused min and max");
            }
        }
        self.indices(primitive.indices, count.unwrap_or_default(), place);
    }

    /// Returns the values of an accessor of floats of this type. Returns `None` if it has another type, or if a value
    /// is not finite.
    fn floats(&self, index: usize, kind: &str) -> Option<Vec<f32>> {
        let accessor = self.root.accessors.get(index)?;
        if accessor.kind != kind || accessor.component_type != FLOAT {
            return None;
        }
        let words = self.bytes(accessor)?.as_chunks::<4>().0;
        let values: Vec<f32> = words.iter().copied().map(f32::from_le_bytes).collect();
        values.iter().all(|value| value.is_finite()).then_some(values)
    }

    /// Checks that the stated bounds of positions are correct: viewers skip geometry outside them.
    fn bounds(&mut self, index: usize, values: &[f32]) {
        let accessor = &self.root.accessors[index];
        let bound = |pick: fn(f32, f32) -> f32| -> Vec<f32> {
            let axis = |axis: usize| values.iter().skip(axis).step_by(3).copied();
            (0..3).filter_map(|i| axis(i).reduce(pick)).collect()
        };
        let same = accessor.min.as_ref() == Some(&bound(f32::min))
            && accessor.max.as_ref() == Some(&bound(f32::max));
        self.found.unless(
            same,
            format!("accessors[{index}]"),
            "min and max that do not match its values",
        );
    }

    /// Checks that the indices form whole triangles and refer to existing vertices.
    fn indices(&mut self, index: usize, vertices: usize, place: &str) {
        let accessor = self.root.accessors.get(index);
        let Some(accessor) =
            accessor.filter(|a| a.kind == "SCALAR" && a.component_type == UNSIGNED_SHORT)
        else {
            return self.found.add(place, "indices other than unsigned short");
        };
        let whole = accessor.count.is_multiple_of(3);
        self.found.unless(whole, place, "indices of an incomplete triangle");
        let bytes = self.bytes(accessor).unwrap_or_default();
        let mut all = bytes.as_chunks::<2>().0.iter().map(|&bytes| u16::from_le_bytes(bytes));
        let inside = all.all(|index| usize::from(index) < vertices);
        self.found.unless(inside, place, "an index out of range");
    }

    /// Checks that a material shows the texture of the same number unchanged, on opaque triangles that are visible
    /// only from outside.
    fn material(&mut self, index: usize) {
        let place = format!("materials[{index}]");
        let material = &self.root.materials[index];
        let Surface { base_color_texture, base_color_factor, metallic_factor, roughness_factor } =
            &material.pbr_metallic_roughness;
        let texture = base_color_texture;
        let checks = [
            (
                texture.index == index && texture.tex_coord.unwrap_or(0) == 0,
                "texCoord other than 0, or index other than its own",
            ),
            (
                base_color_factor.is_none_or(|factor| factor == [1.0; 4]),
                "baseColorFactor other than white",
            ),
            (*metallic_factor == 0.0, "metallicFactor other than 0"),
            (*roughness_factor == 1.0, "roughnessFactor other than 1"),
            (
                material.alpha_mode.as_ref().is_none_or(|mode| mode == "OPAQUE"),
                "alphaMode other than OPAQUE",
            ),
            (
                material.emissive_factor.is_none_or(|factor| factor == [0.0; 3]),
                "emissiveFactor other than 0",
            ),
            (material.double_sided != Some(true), "doubleSided"),
        ];
        for (holds, construct) in checks {
            self.found.unless(holds, &place, construct);
        }
    }

    /// Checks the sampler, which all textures share.
    fn sampler(&mut self, sampler: &Sampler) {
        let Sampler { mag_filter, min_filter, wrap_s, wrap_t } = *sampler;
        let filters = [mag_filter, min_filter] == [LINEAR, LINEAR_MIPMAP_LINEAR];
        self.found.unless(filters, "samplers[0]", "a filter other than linear");
        let wraps = [wrap_s, wrap_t] == [CLAMP_TO_EDGE; 2];
        self.found.unless(wraps, "samplers[0]", "a wrap mode other than clamping");
    }

    /// Checks a texture, and its image as a PNG. Returns an error if the image exceeds the limits.
    fn texture(&mut self, index: usize, limits: &Limits) -> Result<(), String> {
        let root = self.root;
        let (texture, image) = (&root.textures[index], &root.images[index]);
        let own = (texture.sampler, texture.source) == (0, index);
        let problem = "a wrong sampler or image";
        self.found.unless(own, format!("textures[{index}]"), problem);
        let (place, kind) = (format!("images[{index}]"), &image.mime_type);
        self.found.unless(kind == "image/png", &place, format!("mimeType {kind}"));
        let view = root.buffer_views.get(image.buffer_view);
        let bytes = view.and_then(|v| self.binary.get(v.byte_offset..)?.get(..v.byte_length));
        png::check_pixels(bytes.unwrap_or_default(), limits)
            .map_err(|exceeded| format!("its texture: {exceeded}"))?;
        match bytes.map(|bytes| png::check(bytes, &self.words.title, limits)) {
            Some(Ok(picture)) => self.found.add_of(&place, picture),
            Some(Err(problem)) => self.found.add(place, problem),
            None => self.found.add(place, "a view that does not exist"),
        }
        Ok(())
    }
}

/// Whether the transform of a node consists of a rotation, a translation and one scale for all axes, without
/// mirroring: only such a transform preserves the shapes of tiles.
fn keeps_shapes(node: &Node) -> bool {
    let parts = node.translation.is_some() || node.rotation.is_some() || node.scale.is_some();
    let matrix = match node.matrix {
        Some(_) if parts => return false,
        Some(matrix) => DMat4::from_cols_array(&matrix),
        None => {
            let rotation = DQuat::from_array(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
            if (rotation.length() - 1.0).abs() > SLACK {
                return false;
            }
            let scale = DVec3::from(node.scale.unwrap_or([1.0; 3]));
            let translation = DVec3::from(node.translation.unwrap_or_default());
            DMat4::from_scale_rotation_translation(scale, rotation, translation)
        }
    };
    let [x, y, z] = [0, 1, 2].map(|axis| matrix.col(axis).truncate());
    let scale = x.length();
    let off = [
        x.dot(y),
        y.dot(z),
        z.dot(x),
        y.length_squared() - scale * scale,
        z.length_squared() - scale * scale,
    ];
    matrix.row(3) == DVec3::ZERO.extend(1.0)
        && scale > 0.0
        && x.cross(y).dot(z) > 0.0
        && off.iter().all(|value| value.abs() < SLACK * scale * scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(json: &str) -> Node {
        serde_json::from_str(json).unwrap()
    }

    #[test]
    fn rigid_motions_preserve_shapes_and_reflections_do_not() {
        for json in [
            "{}",
            r#"{"translation": [1, 2, 3], "rotation": [0, 0, 1, 0], "scale": [2, 2, 2]}"#,
            r#"{"matrix": [0,1,0,0, -1,0,0,0, 0,0,1,0, 5,6,7,1]}"#,
        ] {
            assert!(keeps_shapes(&node(json)), "{json}");
        }
        for json in [
            r#"{"scale": [-1, 1, 1]}"#,
            r#"{"scale": [1, 1, 2]}"#,
            r#"{"scale": [0, 0, 0]}"#,
            r#"{"rotation": [0, 0, 0, 2]}"#,
            r#"{"matrix": [1,0,0,0, 0,1,0,0, 0,0,1,1, 0,0,0,1]}"#,
            r#"{"matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1], "scale": [1, 1, 1]}"#,
        ] {
            assert!(!keeps_shapes(&node(json)), "{json}");
        }
    }
}
