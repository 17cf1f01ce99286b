//! 3MF of two bodies, white and black, or of a skeleton, in millimetres. Uses only the core specification, with a base material
//! for each body.
//!
//! Two bodies are components of one object. Slicers that support parts treat them as parts; others treat them as two objects in
//! their positions.

use std::fmt::Write as _;

use glam::DVec3;

use super::inlay::{Body, InlaidBodies};
use crate::export::GENERATOR;
use crate::export::writing::zip::zip;
use deltille_core::targets::{ClosedMesh, ClosedMeshError, Target, triangles};
use deltille_layout::artwork::subject;

/// The part of the file that contains the bodies.
pub const MODEL: &str = "3D/3dmodel.model";

/// The other parts with their contents, which are the same in all files; the first contains the name of this program.
pub fn fixed_parts() -> [(&'static str, String); 2] {
    let head = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
    let types = format!(
        "{head}<!-- {GENERATOR} -->\n\
         <Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\">\n  \
         <Default Extension=\"rels\" ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/>\n  \
         <Default Extension=\"model\" ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/>\n\
         </Types>\n"
    );
    let relations = format!(
        "{head}<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">\n  \
         <Relationship Target=\"/{MODEL}\" Id=\"model\" \
         Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/>\n\
         </Relationships>\n"
    );
    [("[Content_Types].xml", types), ("_rels/.rels", relations)]
}

/// The names of the bodies of an inlay.
pub const INLAY: &[&str] = &["white", "black"];

/// The name of the one body of a skeleton.
pub const SKELETON: &[&str] = &["skeleton"];

/// The file name of the skeleton of a target with this name.
pub fn skeleton_name(name: &str) -> String {
    format!("{name}-skeleton.3mf")
}

/// The content of `<name>.3mf`; it is reproducible.
pub fn to_bytes(bodies: &InlaidBodies) -> Vec<u8> {
    let head = frame(&bodies.name, &bodies.subject, INLAY);
    packed(&model(&head, &[&bodies.white, &bodies.black]))
}

/// The content of `<name>-skeleton.3mf`, from the triangles of a skeleton, mm.
///
/// # Errors
/// Returns an error if the triangles are not one closed surface.
pub fn skeleton(target: &Target, triangles_mm: &[[DVec3; 3]]) -> Result<Vec<u8>, ClosedMeshError> {
    let corners: Vec<usize> = (0..3 * triangles_mm.len()).collect();
    let (mesh, _) = ClosedMesh::new(triangles_mm.as_flattened(), corners.as_chunks::<3>().0)?;
    let faces = mesh.faces().iter().flat_map(|face| triangles(face));
    let body = Body { vertices_mm: mesh.vertices().to_vec(), triangles: faces.collect() };
    let head = frame(&target.name, &subject(target), SKELETON);
    Ok(packed(&model(&head, &[&body])))
}

/// The file of a model.
fn packed(model: &str) -> Vec<u8> {
    let [types, relations] = fixed_parts();
    zip(&[
        (types.0, types.1.as_bytes(), false),
        (relations.0, relations.1.as_bytes(), false),
        (MODEL, model.as_bytes(), true),
    ])
}

/// The text of [`MODEL`], from its [`frame`].
fn model(head: &str, bodies: &[&Body]) -> String {
    let vertices = bodies.iter().flat_map(|body| &body.vertices_mm);
    // Printers need positive coordinates, so the target frame is shifted.
    let least = vertices.copied().reduce(DVec3::min).unwrap_or_default();
    let [x, y, z] = least.to_array().map(|mm| decimal(-mm));
    let place = format!("{TURN}{x} {y} {z}\"/>");
    let mut next = bodies.iter();
    let mut body = None;
    let mut text = String::new();
    for line in head.lines() {
        text += &line.replace(&format!("{TURN}\"/>"), &place);
        text.push('\n');
        match line.trim_start() {
            "<vertices>" => {
                body = next.next();
                body.iter().for_each(|body| vertices_of(body, &mut text));
            }
            "<triangles>" => body.iter().for_each(|body| triangles_of(body, &mut text)),
            _ => {}
        }
    }
    text
}

/// The identity rotation that precedes the three numbers of the position on the printer.
pub const TURN: &str = "transform=\"1 0 0 0 1 0 0 0 1 ";

/// The text of [`MODEL`] with bodies of these names, without their vertices and triangles, and without the position on the
/// printer.
pub fn frame(name: &str, subject: &str, bodies: &[&str]) -> String {
    let escaped = |text: &str| text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    let (name, subject) = (escaped(name), escaped(subject));
    let colours: String = bodies
        .iter()
        .map(|body| {
            let colour = if *body == "black" { "#000000" } else { "#FFFFFF" };
            format!("      <base name=\"{body}\" displaycolor=\"{colour}\"/>\n")
        })
        .collect();
    let objects: String = bodies
        .iter()
        .enumerate()
        .map(|(index, body)| {
            format!(
                "    <object id=\"{}\" type=\"model\" name=\"{body}\" pid=\"1\" pindex=\"{index}\">\n      <mesh>\n        \
                 <vertices>\n        </vertices>\n        <triangles>\n        </triangles>\n      </mesh>\n    </object>\n",
                FIRST_ID + index
            )
        })
        .collect();
    let components: String = (FIRST_ID..FIRST_ID + bodies.len())
        .map(|id| format!("        <component objectid=\"{id}\"/>\n"))
        .collect();
    let whole = FIRST_ID + bodies.len();
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <model unit=\"millimeter\" xml:lang=\"en-US\" \
         xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\">\n  \
         <metadata name=\"Title\">{name}</metadata>\n  \
         <metadata name=\"Description\">{subject}</metadata>\n  \
         <metadata name=\"Application\">{GENERATOR}</metadata>\n  \
         <resources>\n    <basematerials id=\"1\">\n{colours}    </basematerials>\n\
         {objects}    <object id=\"{whole}\" type=\"model\" name=\"{name}\">\n      \
         <components>\n{components}      </components>\n    </object>\n  \
         </resources>\n  <build>\n    <item objectid=\"{whole}\" {TURN}\"/>\n  </build>\n</model>\n"
    )
}

/// The id of the first body; the materials precede it.
const FIRST_ID: usize = 2;

fn vertices_of(body: &Body, text: &mut String) {
    for v in &body.vertices_mm {
        let [x, y, z] = v.to_array().map(decimal);
        // Writing to a string does not fail.
        let _ = writeln!(text, "          <vertex x=\"{x}\" y=\"{y}\" z=\"{z}\"/>");
    }
}

fn triangles_of(body: &Body, text: &mut String) {
    for [a, b, c] in &body.triangles {
        let _ = writeln!(text, "          <triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"/>");
    }
}

/// A length with at most nine decimals, without an exponent or a negative zero.
fn decimal(mm: f64) -> String {
    let text = format!("{mm:.9}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}
