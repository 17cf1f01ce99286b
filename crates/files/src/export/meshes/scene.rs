//! Targets as models for simulators: SDF (Gazebo), URDF (ROS), MJCF (MuJoCo) and USD (Isaac, Omniverse, Blender).
//!
//! SDF, URDF and MJCF refer to `<name>.obj`, which is in mm, with its materials and textures. USD contains the mesh and refers to
//! the textures. The frame of the model is the target frame; models are static.

use glam::{DVec2, DVec3};

use super::mesh::TexturedMesh;
use super::obj::{numbered, part_name, texture_name};
use crate::export::GENERATOR;

/// Metres per millimetre along each axis, in the syntax of the formats.
pub const SCALE: &str = "0.001 0.001 0.001";

/// `<name>.sdf`, a static model with one link.
pub fn sdf(name: &str) -> String {
    let model = model_name(name);
    let geometry = format!(
        "<geometry>\n          <mesh>\n            <uri>{name}.obj</uri>\n            <scale>{SCALE}</scale>\n          \
         </mesh>\n        </geometry>"
    );
    format!(
        "{}<sdf version=\"1.9\">\n  <model name=\"{model}\">\n    <static>true</static>\n    <link name=\"target\">\n      \
         <visual name=\"print\">\n        {geometry}\n      </visual>\n      <collision name=\"body\">\n        \
         {geometry}\n      </collision>\n    </link>\n  </model>\n</sdf>\n",
        head()
    )
}

/// `<name>.urdf`, a robot of one link without mass.
pub fn urdf(name: &str) -> String {
    let geometry = format!(
        "<geometry>\n        <mesh filename=\"{name}.obj\" scale=\"{SCALE}\"/>\n      </geometry>"
    );
    format!(
        "{}<robot name=\"{name}\">\n  <link name=\"target\">\n    <visual>\n      {geometry}\n    </visual>\n    \
         <collision>\n      {geometry}\n    </collision>\n  </link>\n</robot>\n",
        head()
    )
}

/// `<name>.xml` for MuJoCo, a body without joints. Materials have no gloss.
///
/// In MuJoCo, a mesh has one texture. With several textures, each has its own part of the mesh (see [`part_name`]) without
/// volume. Collisions use the whole mesh, which is in a hidden group.
pub fn mjcf(name: &str, textures: usize) -> String {
    let body = model_name(name);
    let mesh = format!("<mesh name=\"{name}\" file=\"{name}.obj\" scale=\"{SCALE}\"/>");
    let (assets, geoms) = match textures {
        1 => (
            format!("{}    {mesh}\n", mjcf_material(name, &texture_name(name, 0, 1))),
            format!("      <geom type=\"mesh\" mesh=\"{name}\" material=\"{name}\"/>\n"),
        ),
        _ => {
            let part = |texture: usize| {
                let (part, file) = (format!("{name}-{}", texture + 1), part_name(name, texture));
                let asset = mjcf_material(&part, &texture_name(name, texture, textures));
                (
                    format!(
                        "{asset}    <mesh name=\"{part}\" file=\"{file}\" scale=\"{SCALE}\" inertia=\"shell\"/>\n"
                    ),
                    format!(
                        "      <geom type=\"mesh\" mesh=\"{part}\" material=\"{part}\" contype=\"0\" \
                         conaffinity=\"0\" mass=\"0\"/>\n"
                    ),
                )
            };
            let (assets, geoms): (String, String) = (0..textures).map(part).unzip();
            (
                format!("{assets}    {mesh}\n"),
                format!("{geoms}      <geom type=\"mesh\" mesh=\"{name}\" group=\"3\"/>\n"),
            )
        }
    };
    format!(
        "{}<mujoco model=\"{name}\">\n  <asset>\n{assets}  </asset>\n  <worldbody>\n    <body name=\"{body}\">\n\
         {geoms}    </body>\n  </worldbody>\n</mujoco>\n",
        head()
    )
}

/// A texture and its material with the same name.
fn mjcf_material(name: &str, texture: &str) -> String {
    format!(
        "    <texture name=\"{name}\" type=\"2d\" file=\"{texture}\"/>\n    \
         <material name=\"{name}\" texture=\"{name}\" specular=\"0\" shininess=\"0\"/>\n"
    )
}

/// `<name>.usda`, a mesh in metres, z up, with a `UsdPreviewSurface`. With several textures, there
/// is one for each, on a subset of the faces. Triangles do not share corners, so normals are exact.
pub fn usda(mesh: &TexturedMesh) -> String {
    let count = mesh.textures.len();
    let faces = || (0..count).flat_map(|texture| mesh.faces_of(texture));
    let corners = || faces().flat_map(|face| (0..3).map(move |i| (face, i)));
    let metres: Vec<DVec3> = corners().map(|(face, i)| face.vertices_mm[i] / 1e3).collect();
    let triple = |v: DVec3| format!("({:.9}, {:.9}, {:.9})", v.x, v.y, v.z);
    let pair = |DVec2 { x: u, y: v }| format!("({u:.9}, {:.9})", 1.0 - v);
    let least = metres.iter().copied().reduce(DVec3::min).unwrap_or_default();
    let most = metres.iter().copied().reduce(DVec3::max).unwrap_or_default();
    let mut text = usda_frame(&mesh.name, count);
    let mut fill = |list: &str, values: Vec<String>| {
        let values = format!("{list} = [{}]", values.join(", "));
        text = text.replacen(&format!("{list} = []"), &values, 1);
    };
    for list in USD_LISTS {
        fill(
            list,
            match list {
                "float3[] extent" => [least, most].map(triple).to_vec(),
                "int[] faceVertexCounts" => faces().map(|_| "3".to_owned()).collect(),
                "int[] faceVertexIndices" => (0..metres.len()).map(|i| i.to_string()).collect(),
                "normal3f[] normals" => corners().map(|(face, _)| triple(face.normal)).collect(),
                "point3f[] points" => metres.iter().copied().map(triple).collect(),
                _ => corners().map(|(face, i)| pair(face.uv[i])).collect(),
            },
        );
    }
    let mut first = 0;
    for texture in (0..count).filter(|_| count > 1) {
        let end = first + mesh.faces_of(texture).count();
        fill(USD_SUBSET, (first..end).map(|face| face.to_string()).collect());
        first = end;
    }
    text
}

/// The lists of numbers in a [`usda`], with their types.
pub const USD_LISTS: [&str; 6] = [
    "float3[] extent",
    "int[] faceVertexCounts",
    "int[] faceVertexIndices",
    "normal3f[] normals",
    "point3f[] points",
    "texCoord2f[] primvars:st",
];

/// The list of the faces of each texture, in order, if there are several textures.
pub const USD_SUBSET: &str = "int[] indices";

/// A [`usda`] with the given number of textures and empty lists.
pub fn usda_frame(name: &str, textures: usize) -> String {
    let prim = identifier(name);
    let binding = |texture: usize, indent: &str| {
        let material = numbered("material".to_owned(), "_", texture, textures);
        format!("{indent}rel material:binding = </{prim}/{material}>\n")
    };
    let subset = |texture: usize| {
        let (part, bound) = (texture + 1, binding(texture, "            "));
        format!(
            r#"
        def GeomSubset "print_{part}" (
            prepend apiSchemas = ["MaterialBindingAPI"]
        )
        {{
            uniform token elementType = "face"
            uniform token familyName = "materialBind"
            {USD_SUBSET} = []
{bound}        }}
"#
        )
    };
    let (schemas, bound, family, subsets) = match textures {
        1 => (MATERIAL_SCHEMA, binding(0, "        "), "", String::new()),
        _ => ("", String::new(), SUBSETS_COVER_ALL, (0..textures).map(subset).collect()),
    };
    let materials: String =
        (0..textures).map(|texture| usda_material(name, texture, textures)).collect();
    format!(
        r#"#usda 1.0
# {GENERATOR}
(
    defaultPrim = "{prim}"
    metersPerUnit = 1
    upAxis = "Z"
)

def Xform "{prim}" (
    kind = "component"
)
{{
    def Mesh "mesh"{schemas}
    {{
        float3[] extent = []
        int[] faceVertexCounts = []
        int[] faceVertexIndices = []
{bound}        normal3f[] normals = [] (
            interpolation = "faceVarying"
        )
        point3f[] points = []
        texCoord2f[] primvars:st = [] (
            interpolation = "faceVarying"
        )
        uniform token subdivisionScheme = "none"
{family}{subsets}    }}
{materials}}}
"#
    )
}

/// Declaration of a mesh with one material.
const MATERIAL_SCHEMA: &str = " (\n        prepend apiSchemas = [\"MaterialBindingAPI\"]\n    )";

/// Declaration of a mesh with several materials on subsets.
const SUBSETS_COVER_ALL: &str =
    "        uniform token subsetFamily:materialBind:familyType = \"partition\"\n";

/// A material with one of `textures` textures, counted from 0.
fn usda_material(name: &str, texture: usize, textures: usize) -> String {
    let (prim, file) = (identifier(name), texture_name(name, texture, textures));
    let material = numbered("material".to_owned(), "_", texture, textures);
    format!(
        r#"
    def Material "{material}"
    {{
        token outputs:surface.connect = </{prim}/{material}/surface.outputs:surface>

        def Shader "surface"
        {{
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor.connect = </{prim}/{material}/texture.outputs:rgb>
            float inputs:metallic = 0
            float inputs:roughness = 1
            token outputs:surface
        }}

        def Shader "texture"
        {{
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @{file}@
            float2 inputs:st.connect = </{prim}/{material}/st.outputs:result>
            token inputs:wrapS = "clamp"
            token inputs:wrapT = "clamp"
            color3f outputs:rgb
        }}

        def Shader "st"
        {{
            uniform token info:id = "UsdPrimvarReader_float2"
            string inputs:varname = "st"
            float2 outputs:result
        }}
    }}
"#
    )
}

/// The name of a model: that of the target, unless simulators reserve it.
fn model_name(name: &str) -> String {
    let is_kept = name == "world" || name.starts_with("__") && name.ends_with("__");
    if is_kept { format!("target-{name}") } else { name.to_owned() }
}

fn head() -> String {
    format!("<?xml version=\"1.0\"?>\n<!-- {GENERATOR} -->\n")
}

/// A valid name in USD: letters, digits and underscores.
pub fn identifier(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let name: String = name.chars().map(plain).collect();
    match name.starts_with(|first: char| first.is_ascii_digit()) {
        true => format!("_{name}"),
        false => name,
    }
}
