//! Loaders for textured meshes: `.glb` and `.obj` through the gltf and tobj crates, as other programs load them, and
//! the lists of a `.usda`.
//!
//! All formats return positions in millimetres, and texture coordinates with the origin in the upper left corner. The
//! files have already been inspected, see [`syntax`], so every viewer interprets them as the code here does.
//!
//! [`syntax`]: crate::syntax

use std::collections::{BTreeMap, BTreeSet};
use std::io::Cursor;
use std::path::Path;

use glam::{DMat4, DVec2, DVec3, Vec2, Vec3};
use image::ImageDecoder as _;

use crate::model::mesh::{Model, Triangle};
use crate::reading::error::DocumentError;
use crate::reading::format::Format;
use crate::reading::reader::{Artifact, Reader};
use crate::syntax::meshes::usda::list;
use deltille_core::raster::Gray;
use deltille_files::export::scene::USD_SUBSET;
use deltille_files::limits::Limits;

/// Loads a `.glb`, or an `.obj` with its `parts`: material library and textures.
///
/// # Errors
///
/// Returns an error if the file cannot be read or exceeds the limits, its loader rejects it, a vertex lacks a normal
/// or texture coordinate, there are no triangles, or some have no texture.
pub(crate) fn load(
    reader: &Reader,
    path: &Path,
    parts: Vec<Artifact>,
) -> Result<Model, DocumentError> {
    let unreadable = |problem: String| DocumentError::unreadable(path, problem);
    let format = Format::of(path);
    let (bytes, limits) = (reader.read(path)?, reader.limits);
    let model = reader.run(path, move || match format {
        Some(Format::Obj) => obj(&bytes, &parts, &limits),
        Some(Format::Usda) => usda(&bytes, &parts, &limits),
        _ => glb(&bytes, &limits),
    })?;
    if model.triangles.is_empty() {
        return Err(unreadable("it has no triangles".to_owned()));
    }
    Ok(model)
}

/// Loads a `.glb`. Returns an error that describes its problem.
fn glb(bytes: &[u8], limits: &Limits) -> Result<Model, String> {
    let file = gltf::Gltf::from_slice(bytes).map_err(|error| format!("not glTF: {error}"))?;
    let blob = file.blob.as_deref().ok_or("it has no binary chunk")?;
    let mut triangles = Vec::new();
    // By index: the crate would search through all nodes for each child.
    let nodes: Vec<gltf::Node> = file.nodes().collect();
    let roots = file.default_scene().into_iter().flat_map(|scene| scene.nodes());
    // The inspection has shown that every node is reached once, so this ends.
    let mut open: Vec<(usize, DMat4)> = roots.map(|node| (node.index(), DMat4::IDENTITY)).collect();
    while let Some((index, parent)) = open.pop() {
        let here = visit(&nodes[index], parent, blob, &mut triangles)?;
        let children = file.as_json().nodes[index].children.iter().flatten();
        open.extend(children.map(|child| (child.value(), here)));
    }
    let textures = file.materials().map(|material| {
        let texture = material.pbr_metallic_roughness().base_color_texture()?;
        match texture.texture().source().source() {
            gltf::image::Source::View { view, .. } => {
                blob.get(view.offset()..view.offset() + view.length())
            }
            gltf::image::Source::Uri { .. } => None,
        }
    });
    model(triangles, textures, limits)
}

/// Adds the triangles of a node, converted from the metres of glTF to mm. Returns the transform from the node to the
/// scene.
fn visit(
    node: &gltf::Node,
    parent: DMat4,
    blob: &[u8],
    triangles: &mut Vec<Triangle>,
) -> Result<DMat4, String> {
    let columns = node.transform().matrix().map(|column| column.map(f64::from));
    let here = parent * DMat4::from_cols_array_2d(&columns);
    for primitive in node.mesh().iter().flat_map(gltf::Mesh::primitives) {
        let reader = primitive.reader(|_| Some(blob));
        let place = |v: [f32; 3]| here.transform_point3(Vec3::from(v).as_dvec3()) * 1e3;
        let turn =
            |v: [f32; 3]| here.transform_vector3(Vec3::from(v).as_dvec3()).normalize_or_zero();
        let positions: Vec<DVec3> =
            reader.read_positions().ok_or("it has no positions")?.map(place).collect();
        let normals: Vec<DVec3> =
            reader.read_normals().ok_or("it has no normals")?.map(turn).collect();
        let uvs = reader.read_tex_coords(0).ok_or("it has no texture coordinates")?;
        let uvs: Vec<DVec2> = uvs.into_f32().map(|uv| Vec2::from(uv).as_dvec2()).collect();
        let indices: Vec<u32> = match reader.read_indices() {
            Some(indices) => indices.into_u32().collect(),
            None => (0..positions.len() as u32).collect(),
        };
        let texture = primitive.material().index().ok_or("it has no texture")?;
        add(triangles, texture, &indices, &positions, (&indices, &normals), (&indices, &uvs))?;
    }
    Ok(here)
}

/// Loads an `.obj`, which is in mm, with its material library and textures from `parts`.
fn obj(bytes: &[u8], parts: &[Artifact], limits: &Limits) -> Result<Model, String> {
    let part = |name: &Path| parts.iter().find(|part| Path::new(part.name()) == name);
    let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
    let (models, materials) = tobj::load_obj_buf(&mut &*bytes, &options, |library| {
        let library = part(library).ok_or(tobj::LoadError::OpenFileFailed)?;
        tobj::load_mtl_buf(&mut library.bytes())
    })
    .map_err(|error| error.to_string())?;
    let materials = materials.map_err(|error| format!("its material library: {error}"))?;
    let mut triangles = Vec::new();
    for mesh in models.iter().map(|model| &model.mesh) {
        let points = |values: &[f64]| -> Vec<DVec3> {
            values.as_chunks::<3>().0.iter().copied().map(DVec3::from).collect()
        };
        // OBJ counts v upwards from the lower edge of the texture.
        let uvs = mesh.texcoords.as_chunks::<2>().0.iter();
        let uvs: Vec<DVec2> = uvs.map(|&[u, v]| DVec2::new(u, 1.0 - v)).collect();
        add(
            &mut triangles,
            mesh.material_id.ok_or("it has no texture")?,
            &mesh.indices,
            &points(&mesh.positions),
            (&mesh.normal_indices, &points(&mesh.normals)),
            (&mesh.texcoord_indices, &uvs),
        )?;
    }
    let textures = materials.iter().map(|material| {
        let name = material.diffuse_texture.as_ref()?;
        part(Path::new(name)).map(Artifact::bytes)
    });
    model(triangles, textures, limits)
}

/// Loads a `.usda`, which is in metres, with its textures in the order of its materials.
fn usda(bytes: &[u8], parts: &[Artifact], limits: &Limits) -> Result<Model, String> {
    let text = std::str::from_utf8(bytes).map_err(|error| error.to_string())?;
    let (subsets, lists): (Vec<_>, Vec<_>) =
        text.lines().filter_map(list).partition(|(name, _)| *name == USD_SUBSET);
    let mut lists: BTreeMap<&str, Vec<f64>> = lists.into_iter().collect();
    let mut take = |name: &str| lists.remove(name).ok_or_else(|| format!("it has no {name}"));
    let points = |values: Vec<f64>| -> Vec<DVec3> {
        values.as_chunks::<3>().0.iter().copied().map(DVec3::from).collect()
    };
    let metres = points(take("point3f[] points")?);
    let normals = points(take("normal3f[] normals")?);
    let extent = points(take("float3[] extent")?);
    let uvs = take("texCoord2f[] primvars:st")?;
    // USD counts v upwards from the lower edge of the texture.
    let uvs: Vec<DVec2> =
        uvs.as_chunks::<2>().0.iter().map(|&[u, v]| DVec2::new(u, 1.0 - v)).collect();
    if take("int[] faceVertexCounts")?.iter().any(|&count| count != 3.0) {
        return Err("a face that is not a triangle".to_owned());
    }
    let indices: Vec<u32> =
        take("int[] faceVertexIndices")?.into_iter().map(|index| index as u32).collect();
    let [least, most] = [DVec3::min, DVec3::max]
        .map(|pick| metres.iter().copied().reduce(pick).unwrap_or_default());
    if extent.len() != 2 || extent[0].distance(least) + extent[1].distance(most) > 1e-6 {
        return Err("an extent that does not match the points".to_owned());
    }
    let positions: Vec<DVec3> = metres.into_iter().map(|place| place * 1e3).collect();
    // Normals and texture coordinates belong to the corners of faces, in order.
    let corners: Vec<u32> = (0..indices.len() as u32).collect();
    let mut triangles = Vec::new();
    add(&mut triangles, 0, &indices, &positions, (&corners, &normals), (&corners, &uvs))?;
    if !subsets.is_empty() {
        of_subsets(&mut triangles, subsets.into_iter().map(|(_, faces)| faces))?;
    }
    model(triangles, parts.iter().map(|part| Some(part.bytes())), limits)
}

/// Assigns each triangle the texture of its subset; each must be in exactly one.
fn of_subsets(
    triangles: &mut [Triangle],
    subsets: impl Iterator<Item = Vec<f64>>,
) -> Result<(), String> {
    let mut left: BTreeSet<usize> = (0..triangles.len()).collect();
    for (texture, faces) in subsets.enumerate() {
        for face in faces {
            let face = face as usize;
            if !left.remove(&face) {
                return Err("a face that is in two subsets or does not exist".to_owned());
            }
            triangles[face].texture = texture;
        }
    }
    if left.is_empty() { Ok(()) } else { Err("a face in no subset".to_owned()) }
}

/// Creates a model with decoded textures; together they have no more pixels than one image may have.
fn model<'a>(
    triangles: Vec<Triangle>,
    pictures: impl Iterator<Item = Option<&'a [u8]>>,
    limits: &Limits,
) -> Result<Model, String> {
    let mut textures = Vec::new();
    let mut pixels = 0;
    for picture in pictures {
        textures.push(image(picture.ok_or("it has no texture")?, &mut pixels, limits)?);
    }
    match triangles.iter().all(|triangle| triangle.texture < textures.len()) {
        true => Ok(Model { triangles, textures }),
        false => Err("it has no texture".to_owned()),
    }
}

/// Adds the triangles of a texture from indexed lists: three indices each into positions, mm, and three into normals
/// and texture coordinates.
fn add(
    triangles: &mut Vec<Triangle>,
    texture: usize,
    indices: &[u32],
    positions: &[DVec3],
    normals: (&[u32], &[DVec3]),
    uvs: (&[u32], &[DVec2]),
) -> Result<(), String> {
    fn pick<T: Copy>(list: &[T], at: Option<&u32>) -> Result<T, String> {
        let found = at.and_then(|&at| list.get(at as usize)).copied();
        found.ok_or_else(|| "an index is out of range".to_owned())
    }
    for first in (0..indices.len() / 3).map(|i| 3 * i) {
        let three = [first, first + 1, first + 2];
        let mut triangle = Triangle {
            vertices_mm: [DVec3::ZERO; 3],
            normals: [DVec3::ZERO; 3],
            uv: [DVec2::ZERO; 3],
            texture,
        };
        for (i, at) in three.into_iter().enumerate() {
            triangle.vertices_mm[i] = pick(positions, indices.get(at))?;
            triangle.normals[i] = pick(normals.1, normals.0.get(at))?;
            triangle.uv[i] = pick(uvs.1, uvs.0.get(at))?;
        }
        triangles.push(triangle);
    }
    Ok(())
}

/// Decodes a texture to grey values; `before` counts the pixels of all textures so far.
fn image(bytes: &[u8], before: &mut u64, limits: &Limits) -> Result<Gray<u8>, String> {
    let broken = |error: &dyn std::fmt::Display| format!("its texture: {error}");
    // The inspection accepts only PNG.
    let mut reader = image::ImageReader::with_format(Cursor::new(bytes), image::ImageFormat::Png);
    reader.no_limits();
    let decoder = reader.into_decoder().map_err(|error| broken(&error))?;
    let (width, height) = decoder.dimensions();
    *before += u64::from(width) * u64::from(height);
    limits.check_all_pixels(*before).map_err(|error| broken(&error))?;
    let decoded = image::DynamicImage::from_decoder(decoder).map_err(|error| broken(&error))?;
    let grey = decoded.into_luma8();
    let (width, height) = (grey.width() as usize, grey.height() as usize);
    Gray::from_vec(width, height, grey.into_raw()).ok_or_else(|| "its texture is empty".to_owned())
}
