//! Every texel that a mesh shows is compared, including the last one at the edges of its faces.

use std::collections::BTreeMap;

use deltille::artwork::subject;
use deltille::export::artifacts::{Making, What, make};
use deltille::lattice::GridKind;
use deltille::layout::Printing;
use deltille::targets::{BoardSpec, SolidShape, SolidSpec, TargetSpec};
use deltille::verify::{Artifact, Verifier};
use glam::DVec2;
use image::{GrayImage, Luma};

use crate::verify::damaged::{Damage, glb, png};

/// Paints on an image and keeps the rest of the file.
fn with_pixels(paint: impl Fn(&mut GrayImage) + 'static) -> Damage {
    png::pixels(move |mut picture| {
        paint(&mut picture);
        picture.into()
    })
}

/// A mesh in all formats, in memory.
struct Mesh {
    target: Printing,
    files: Vec<(String, Vec<u8>)>,
}

impl Mesh {
    fn new(spec: TargetSpec, textures: u32) -> Self {
        let target = Printing::new("m", spec).unwrap();
        let mut making = Making::default();
        making.mesh.textures = textures;
        // For MuJoCo, which also uses parts of it.
        let mut files = make(&target, What::Mjcf, making).unwrap();
        for what in [What::Sdf, What::Urdf, What::Usd, What::Gltf] {
            for (name, bytes) in make(&target, what, making).unwrap() {
                if !files.iter().any(|(known, _)| *known == name) {
                    files.push((name, bytes));
                }
            }
        }
        Self { target, files }
    }

    fn passes(&self, name: &str, files: &[(String, Vec<u8>)]) -> bool {
        let files: Vec<Artifact> =
            files.iter().map(|(name, bytes)| Artifact::new(name.clone(), bytes.clone())).collect();
        let verifier = Verifier::new(&self.target).unwrap();
        verifier.verify(name, &files).unwrap().passed
    }

    /// Returns the files with a changed texture.
    fn painted(
        &self,
        texture: &str,
        paint: impl Fn(&mut GrayImage) + 'static,
    ) -> Vec<(String, Vec<u8>)> {
        let damage = with_pixels(paint);
        let change = |(name, bytes): &(String, Vec<u8>)| {
            (name.clone(), if name == texture { damage(bytes) } else { bytes.clone() })
        };
        self.files.iter().map(change).collect()
    }

    /// Returns, for each edge between a face and its surroundings on a texture: the texture, the middle of the edge,
    /// and the direction into the face, texels.
    fn edges(&self) -> Vec<(String, DVec2, DVec2)> {
        let text = |end: &str| {
            let file = self.files.iter().find(|(name, _)| name.ends_with(end)).unwrap();
            String::from_utf8(file.1.clone()).unwrap()
        };
        let (mesh, library) = (text("m.obj"), text("m.mtl"));
        let textures: Vec<&str> =
            library.lines().filter_map(|line| line.strip_prefix("map_Kd ")).collect();
        let size = |texture: usize| {
            let file = self.files.iter().find(|(name, _)| name == textures[texture]).unwrap();
            let picture = image::load_from_memory(&file.1).unwrap();
            DVec2::new(picture.width().into(), picture.height().into())
        };
        let numbers = |line: &str| -> Vec<f64> {
            line.split(' ').skip(1).map(|word| word.parse().unwrap()).collect()
        };
        let uvs = mesh.lines().filter(|line| line.starts_with("vt ")).map(|line| {
            let [u, v] = numbers(line)[..] else { panic!("{line}") };
            DVec2::new(u, 1.0 - v)
        });
        let uvs: Vec<DVec2> = uvs.collect();
        let mut found = BTreeMap::new();
        let mut texture = None;
        for line in mesh.lines() {
            if line.starts_with("usemtl ") {
                texture = Some(texture.map_or(0, |before: usize| before + 1));
            }
            let Some(corners) = line.strip_prefix("f ") else { continue };
            let texture = texture.unwrap();
            let corner =
                |corner: &str| -> usize { corner.split('/').nth(1).unwrap().parse().unwrap() };
            let corners: Vec<usize> = corners.split(' ').map(corner).collect();
            let at = |index: usize| uvs[index - 1] * size(texture);
            let middle = corners.iter().map(|&index| at(index)).sum::<DVec2>() / 3.0;
            for (one, other) in [(0, 1), (1, 2), (2, 0)] {
                let [a, b] = [corners[one], corners[other]].map(at);
                if a.distance(b) < 1.0 {
                    continue;
                }
                let across = (b - a).perp().normalize();
                let inwards = if across.dot(middle - a) > 0.0 { across } else { -across };
                // The diagonal of a face belongs to two triangles.
                let key = (texture, ((a + b) * 50.0).as_ivec2().to_array());
                if found.remove(&key).is_none() {
                    found.insert(key, ((a + b) / 2.0, inwards));
                }
            }
        }
        let named = |((texture, _), (middle, inwards)): ((usize, _), _)| {
            (textures[texture].to_owned(), middle, inwards)
        };
        found.into_iter().map(named).collect()
    }
}

fn board(edit: impl Fn(&mut BoardSpec)) -> TargetSpec {
    let mut spec = BoardSpec::new(GridKind::Deltille, 4, 5, 20.0);
    edit(&mut spec);
    TargetSpec::Board(spec)
}

fn solid(inverted: bool) -> TargetSpec {
    let spec = SolidSpec {
        edge_mm: 60.0,
        tiles: 7,
        margin_mm: 6.0,
        inverted,
        ..SolidSpec::new(SolidShape::Tetrahedron)
    };
    TargetSpec::Solid(spec)
}

#[test]
fn a_wrong_texel_at_any_edge_of_a_face_is_found() {
    // The field of an inverted plate ends with its face, and texels crossed by its edge are grey.
    let cases = [
        (board(|_| {}), 1, 0.6),
        (board(|spec| spec.inverted = true), 1, 2.5),
        (board(|spec| spec.two_sided_mm = Some(3.0)), 2, 0.6),
        (solid(false), 2, 0.6),
        (solid(true), 1, 0.6),
    ];
    for (spec, textures, depth) in cases {
        let mesh = Mesh::new(spec, textures);
        let what = subject(&mesh.target.target);
        assert!(mesh.passes("m.obj", &mesh.files), "{what}");
        let edges = mesh.edges();
        assert!(edges.len() >= 4, "{what}: {}", edges.len());
        for (texture, middle, inwards) in edges {
            let at = (middle + depth * inwards).floor().as_uvec2();
            let painted = mesh.painted(&texture, move |picture| {
                let pixel = &mut picture.get_pixel_mut(at.x, at.y).0[0];
                *pixel = 255 - *pixel;
            });
            assert!(!mesh.passes("m.obj", &painted), "{what}: {texture}, {at}");
        }
    }
}

#[test]
fn strips_at_edges_are_found_in_every_format() {
    let mesh = Mesh::new(board(|_| {}), 1);
    for name in ["m.glb", "m.obj", "m.usda", "m.sdf", "m.urdf", "m.xml"] {
        assert!(mesh.passes(name, &mesh.files), "{name}");
    }
    let glb = &mesh.files.iter().find(|(name, _)| name == "m.glb").unwrap().1;
    let painted_glb = |damage| vec![("m.glb".to_owned(), glb::texture(damage)(glb))];
    assert!(mesh.passes("m.glb", &painted_glb(Box::new(<[u8]>::to_vec))));
    for (texture, middle, inwards) in mesh.edges() {
        let strip = move |picture: &mut GrayImage| {
            for (i, j) in (-200..200).flat_map(|i| (0..20).map(move |j| (i, j))) {
                let at = middle + f64::from(i) * inwards.perp() + (f64::from(j) + 0.6) * inwards;
                picture.put_pixel(at.x as u32, at.y as u32, Luma([0]));
            }
        };
        let painted = mesh.painted(&texture, strip);
        for name in ["m.obj", "m.usda", "m.sdf", "m.urdf", "m.xml"] {
            assert!(!mesh.passes(name, &painted), "{name}: {middle}");
        }
        assert!(!mesh.passes("m.glb", &painted_glb(with_pixels(strip))), "glb: {middle}");
    }
}

#[test]
fn ink_that_no_face_shows_is_found() {
    let mesh = Mesh::new(board(|_| {}), 1);
    for at in [[0, 0], [2, 2], [700, 5]] {
        let painted = mesh
            .painted("m-texture.png", move |picture| picture.put_pixel(at[0], at[1], Luma([0])));
        assert!(!mesh.passes("m.obj", &painted), "{at:?}");
    }
}
