//! Targets as models for simulators: SDF (Gazebo), URDF (ROS), MJCF (MuJoCo) and USD (Isaac, Omniverse, Blender).
//!
//! SDF, URDF and MJCF name the mesh in `<name>.obj`, which is in mm, with its material and texture; USD holds the mesh and
//! names the texture. The frame of the model is the target frame; models are fixed where they are put.

use glam::{DVec2, DVec3};

use super::GENERATOR;
use super::mesh::TexturedMesh;
use super::obj::texture_name;

/// Metres per millimetre, along each axis, as the formats have it.
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

/// `<name>.xml` for MuJoCo, a body without joints. The texture is seen as it is, without gloss.
pub fn mjcf(name: &str) -> String {
    let body = model_name(name);
    let texture = texture_name(name);
    format!(
        "{}<mujoco model=\"{name}\">\n  <asset>\n    <texture name=\"{name}\" type=\"2d\" file=\"{texture}\"/>\n    \
         <material name=\"{name}\" texture=\"{name}\" specular=\"0\" shininess=\"0\"/>\n    \
         <mesh name=\"{name}\" file=\"{name}.obj\" scale=\"{SCALE}\"/>\n  </asset>\n  <worldbody>\n    \
         <body name=\"{body}\">\n      <geom type=\"mesh\" mesh=\"{name}\" material=\"{name}\"/>\n    </body>\n  \
         </worldbody>\n</mujoco>\n",
        head()
    )
}

/// `<name>.usda`, a mesh in metres, z up, with a `UsdPreviewSurface`. Corners of triangles are not shared, so that
/// normals are exact.
pub fn usda(mesh: &TexturedMesh) -> String {
    let corners = || mesh.faces.iter().flat_map(|face| (0..3).map(move |i| (face, i)));
    let metres: Vec<DVec3> = corners().map(|(face, i)| face.vertices_mm[i] / 1e3).collect();
    let triple = |v: DVec3| format!("({:.9}, {:.9}, {:.9})", v.x, v.y, v.z);
    let pair = |DVec2 { x: u, y: v }| format!("({u:.9}, {:.9})", 1.0 - v);
    let least = metres.iter().copied().reduce(DVec3::min).unwrap_or_default();
    let most = metres.iter().copied().reduce(DVec3::max).unwrap_or_default();
    let values = USD_LISTS.map(|list| match list {
        "float3[] extent" => listed([least, most].map(triple)),
        "int[] faceVertexCounts" => listed(mesh.faces.iter().map(|_| "3".to_owned())),
        "int[] faceVertexIndices" => listed((0..metres.len()).map(|index| index.to_string())),
        "normal3f[] normals" => listed(corners().map(|(face, _)| triple(face.normal))),
        "point3f[] points" => listed(metres.iter().copied().map(triple)),
        _ => listed(corners().map(|(face, i)| pair(face.uv[i]))),
    });
    let mut text = usda_frame(&mesh.name);
    for (list, values) in USD_LISTS.into_iter().zip(values) {
        text = text.replacen(&format!("{list} = []"), &format!("{list} = {values}"), 1);
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

/// A [`usda`] whose [`USD_LISTS`] are empty.
pub fn usda_frame(name: &str) -> String {
    let texture = texture_name(name);
    let prim = identifier(name);
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
    def Mesh "mesh" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {{
        float3[] extent = []
        int[] faceVertexCounts = []
        int[] faceVertexIndices = []
        rel material:binding = </{prim}/material>
        normal3f[] normals = [] (
            interpolation = "faceVarying"
        )
        point3f[] points = []
        texCoord2f[] primvars:st = [] (
            interpolation = "faceVarying"
        )
        uniform token subdivisionScheme = "none"
    }}

    def Material "material"
    {{
        token outputs:surface.connect = </{prim}/material/surface.outputs:surface>

        def Shader "surface"
        {{
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor.connect = </{prim}/material/texture.outputs:rgb>
            float inputs:metallic = 0
            float inputs:roughness = 1
            token outputs:surface
        }}

        def Shader "texture"
        {{
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @{texture}@
            float2 inputs:st.connect = </{prim}/material/st.outputs:result>
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
}}
"#
    )
}

/// The name of a model: that of the target, unless simulators keep that for themselves.
fn model_name(name: &str) -> String {
    let is_kept = name == "world" || name.starts_with("__") && name.ends_with("__");
    if is_kept { format!("target-{name}") } else { name.to_owned() }
}

fn head() -> String {
    format!("<?xml version=\"1.0\"?>\n<!-- {GENERATOR} -->\n")
}

/// A name as USD has it: letters, digits and underscores.
pub fn identifier(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let name: String = name.chars().map(plain).collect();
    match name.starts_with(|first: char| first.is_ascii_digit()) {
        true => format!("_{name}"),
        false => name,
    }
}

fn listed(values: impl IntoIterator<Item = String>) -> String {
    format!("[{}]", values.into_iter().collect::<Vec<_>>().join(", "))
}
