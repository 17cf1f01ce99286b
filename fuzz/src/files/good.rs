//! Small valid files.

use std::io::Cursor;
use std::sync::LazyLock;

use deltille::detect::{Detector, DetectorConfig};
use deltille::export::dsc::{self, Dialect};
use deltille::export::inlay::InlaidBodies;
use deltille::export::mesh::{Meshing, TexturedMesh};
use deltille::export::{
    detection, dxf, gltf, laser_svg, obj as obj_writer, pdf as pdf_writer, png, stl as stl_writer,
    svg as svg_writer, threemf,
};
use deltille::family::Family;
use deltille::lattice::GridKind;
use deltille::layout::{PaperSpec, Printing};
use deltille::raster::{AnyGray, Gray};
use deltille::targets::{BoardSpec, SolidShape, SolidSpec, TargetSpec};
use deltille::{artwork, photograph};
use image::{DynamicImage, GrayImage, ImageFormat};
use tempfile::TempDir;

/// The family of the tags.
pub static FAMILY: LazyLock<Family> = LazyLock::new(|| Family::shipped("delTag16h5").unwrap());

/// A board that is printed on pages.
pub static BOARD: LazyLock<Printing> = LazyLock::new(|| {
    let mut spec = BoardSpec::new(GridKind::Deltille, 3, 4, 9.0);
    if let Some(tags) = &mut spec.tags {
        tags.family = "delTag16h5".to_owned();
    }
    let paper = PaperSpec { size: Some("74x52mm".parse().unwrap()), ..PaperSpec::default() };
    Printing::build("b", &TargetSpec::Board(spec), Some(&FAMILY), Some(&paper)).unwrap()
});

/// A solid that has meshes.
pub static SOLID: LazyLock<Printing> = LazyLock::new(|| {
    let mut spec = SolidSpec {
        edge_mm: 60.0,
        tiles: 6,
        margin_mm: 3.0,
        ..SolidSpec::new(SolidShape::Tetrahedron)
    };
    if let Some(tags) = &mut spec.tags {
        tags.family = "delTag16h5".to_owned();
        // Wider bits make the texture smaller.
        tags.border_bits = 0.6;
    }
    Printing::build("t", &TargetSpec::Solid(spec), Some(&FAMILY), Some(&PaperSpec::default()))
        .unwrap()
});

static MESH: LazyLock<TexturedMesh> =
    LazyLock::new(|| TexturedMesh::new(&SOLID.target, Meshing::default()).unwrap());

/// Returns the stem of file names with an extension. It determines which kind of artifact the verifier expects.
pub fn stem(extension: &str) -> &'static str {
    match extension {
        "dxf" => "t-panels",
        "glb" | "obj" | "stl" => "t",
        _ => "b",
    }
}

/// Returns the files that a mesh refers to.
pub fn beside_mesh() -> [(&'static str, Vec<u8>); 2] {
    [
        ("t.mtl", obj_writer::material(&MESH).into_bytes()),
        ("t-texture.png", MESH.textures[0].png.clone()),
    ]
}

pub fn target() -> Vec<u8> {
    BOARD.to_json().into_bytes()
}

pub fn detection() -> Vec<u8> {
    static TEXT: LazyLock<String> = LazyLock::new(|| {
        let detector = Detector::for_target(&BOARD.target, DetectorConfig::default()).unwrap();
        detection::write(&detector.detect(&photograph(), "b.png"))
    });
    TEXT.clone().into_bytes()
}

pub fn sheet() -> Vec<u8> {
    br#"{"schema": "deltille/calibration/1", "print_scale": [1.001, 0.999], "board_shape": {"middle_mm": [30, 20, 0],
"reach_mm": 25, "coefficients_mm": [0.1, 0.2, 0, 0, 0, 0, 0, 0.01, 0]}}"#
        .to_vec()
}

pub fn family() -> Vec<u8> {
    FAMILY.to_json().into_bytes()
}

pub fn camera() -> Vec<u8> {
    b"width: 640\nheight: 480\nfocal_px: [500, 501.5]\ncentre_px: [320, 240]\nmodel: pinhole\n\
      distortion: [-0.1, 0.02, 0.001, -0.001, 0.003]\n"
        .to_vec()
}

pub fn template() -> Vec<u8> {
    b"command = \"board\"\nrows = 10\ncols = 11\nedge = \"20mm\"\nfamily = \"d25h7\"\ntag-spacing = 3\n\
      tag-border = 1.5\nfirst-id = 4\nboard-id = 2\nboards = 2\npaper = \"a3\"\norientation = \"landscape\"\n\
      margin = \"0.5in\"\npdf = true\ndsc = true\ndsc-dialect = \"original\"\nname = \"pair\"\n"
        .to_vec()
}

pub fn points() -> Vec<u8> {
    b"x,y\n12.5,13.25\n100,  1e2\n-3.0,4\n".to_vec()
}

pub fn dsc() -> Vec<u8> {
    dsc::write(&BOARD.target, Dialect::Fork).unwrap().into_bytes()
}

pub fn obj() -> Vec<u8> {
    obj_writer::text(&MESH).into_bytes()
}

pub fn glb() -> Vec<u8> {
    gltf::to_bytes(&MESH)
}

pub fn stl() -> Vec<u8> {
    let TargetSpec::Solid(spec) = &SOLID.target.spec else { unreachable!("it was built as one") };
    stl_writer::to_bytes("t", &spec.polyhedron().triangles_mm())
}

pub fn ply() -> Vec<u8> {
    let TargetSpec::Solid(spec) = &SOLID.target.spec else { unreachable!("it was built as one") };
    let triangles = spec.polyhedron().triangles_mm();
    let vertices = triangles.iter().flatten().map(|v| format!("{} {} {}\n", v.x, v.y, v.z));
    let faces = (0..triangles.len()).map(|i| format!("3 {} {} {}\n", 3 * i, 3 * i + 1, 3 * i + 2));
    let head = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        3 * triangles.len(),
        triangles.len()
    );
    (head + &vertices.chain(faces).collect::<String>()).into_bytes()
}

pub fn threemf() -> Vec<u8> {
    threemf::to_bytes(&InlaidBodies::new(&BOARD.target, Meshing::default()).unwrap())
}

pub fn dxf() -> Vec<u8> {
    dxf::text(&artwork::panels_to_cut(&SOLID.target).unwrap()).into_bytes()
}

pub fn laser() -> Vec<u8> {
    let drawing = artwork::to_laser(&BOARD, 0.1).unwrap();
    laser_svg::text(&drawing, "b", &artwork::subject(&BOARD.target)).into_bytes()
}

pub fn pdf() -> Vec<u8> {
    pdf_writer::to_bytes(&BOARD.draw().unwrap())
}

pub fn svg() -> Vec<u8> {
    written("b.svg", |artwork, path| svg_writer::write(artwork, 0, path).unwrap())
}

pub fn page_png() -> Vec<u8> {
    written("b.png", |artwork, path| {
        png::write(&artwork.sheets[0], &artwork.title, path, 300.0).unwrap()
    })
}

fn written(name: &str, write: impl Fn(&artwork::Artwork, &std::path::Path)) -> Vec<u8> {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join(name);
    write(&BOARD.draw().unwrap(), &path);
    std::fs::read(path).unwrap()
}

/// Returns the page of the board as an image.
fn photograph() -> Gray<u8> {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("b.png");
    std::fs::write(&path, page_png()).unwrap();
    match photograph::read(&path).unwrap() {
        AnyGray::U8(image) => image,
        AnyGray::U16(_) => unreachable!("pages have 8 bits"),
    }
}

/// Returns a part of the page in an image format.
fn part_as(format: ImageFormat) -> Vec<u8> {
    let page = photograph();
    let (width, height) = (page.width() as u32, page.height() as u32);
    let page = GrayImage::from_raw(width, height, page.pixels().to_vec()).unwrap();
    let part = DynamicImage::ImageLuma8(page).crop_imm(200, 200, 48, 40).to_rgb8();
    let mut bytes = Cursor::new(Vec::new());
    part.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

pub fn y4m() -> Vec<u8> {
    include_bytes!("../../../tests/recordings/run.y4m").to_vec()
}

pub fn mcap() -> Vec<u8> {
    include_bytes!("../../../tests/recordings/run.mcap").to_vec()
}

pub fn rosbag1() -> Vec<u8> {
    include_bytes!("../../../tests/recordings/run.bag").to_vec()
}

pub fn rosbag2() -> Vec<u8> {
    include_bytes!("../../../tests/recordings/run.db3").to_vec()
}

pub fn photograph_png() -> Vec<u8> {
    part_as(ImageFormat::Png)
}

pub fn photograph_jpeg() -> Vec<u8> {
    part_as(ImageFormat::Jpeg)
}

pub fn photograph_tiff() -> Vec<u8> {
    part_as(ImageFormat::Tiff)
}

pub fn photograph_webp() -> Vec<u8> {
    part_as(ImageFormat::WebP)
}

pub fn photograph_bmp() -> Vec<u8> {
    part_as(ImageFormat::Bmp)
}

pub fn photograph_pnm() -> Vec<u8> {
    part_as(ImageFormat::Pnm)
}
