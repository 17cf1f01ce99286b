//! The readers by name, with a valid file and mutations for each.

use std::fs;

use tempfile::TempDir;

use super::dice::Dice;
use super::mutate::{self, Form};
use super::{good, read};

/// A file reader.
pub struct Reader {
    /// Name of the fuzz target.
    pub name: &'static str,
    /// File format, which determines the mutations.
    pub form: Form,
    /// Extension of its file names.
    extension: &'static str,
    good: fn() -> Vec<u8>,
    read: fn(read::File) -> bool,
}

/// All readers.
pub const READERS: &[Reader] = &[
    of("target", Form::Json, "json", good::target, read::target),
    of("detection", Form::Json, "json", good::detection, read::detection),
    of("sheet", Form::Json, "json", good::sheet, read::sheet),
    of("family", Form::Json, "json", good::family, read::family),
    of("camera", Form::Text, "yaml", good::camera, read::camera),
    of("template", Form::Text, "toml", good::template, read::template),
    of("csv", Form::Text, "csv", good::points, read::points),
    of("dsc", Form::Text, "dsc", good::dsc, read::dsc),
    of("mesh", Form::Text, "obj", good::obj, read::mesh),
    of("mesh_stl", Form::Bytes, "stl", good::stl, read::mesh),
    of("mesh_ply", Form::Text, "ply", good::ply, read::mesh),
    of("png", Form::Png, "png", good::photograph_png, read::photograph),
    of("jpeg", Form::Bytes, "jpg", good::photograph_jpeg, read::photograph),
    of("tiff", Form::Bytes, "tiff", good::photograph_tiff, read::photograph),
    of("webp", Form::Bytes, "webp", good::photograph_webp, read::photograph),
    of("bmp", Form::Bytes, "bmp", good::photograph_bmp, read::photograph),
    of("pnm", Form::Bytes, "ppm", good::photograph_pnm, read::photograph),
    of("y4m", Form::Bytes, "y4m", good::y4m, read::recording),
    of("mcap", Form::Bytes, "mcap", good::mcap, read::recording),
    of("rosbag1", Form::Bytes, "bag", good::rosbag1, read::recording),
    of("rosbag2", Form::Bytes, "db3", good::rosbag2, read::recording),
    of("verify_pdf", Form::Pdf, "pdf", good::pdf, read::page),
    of("verify_svg", Form::Text, "svg", good::svg, read::page),
    of("verify_png", Form::Png, "png", good::page_png, read::page),
    of("verify_dsc", Form::Text, "dsc", good::dsc, read::page),
    of("verify_glb", Form::Glb, "glb", good::glb, read::solid),
    of("verify_obj", Form::Text, "obj", good::obj, read::solid),
    of("verify_stl", Form::Bytes, "stl", good::stl, read::solid),
    of("verify_3mf", Form::Bytes, "3mf", good::threemf, read::page),
    of("verify_dxf", Form::Text, "dxf", good::dxf, read::solid),
    of("verify_laser", Form::Text, "svg", good::laser, read::page),
];

const fn of(
    name: &'static str,
    form: Form,
    extension: &'static str,
    good: fn() -> Vec<u8>,
    read: fn(read::File) -> bool,
) -> Reader {
    Reader { name, form, extension, good, read }
}

impl Reader {
    /// Returns a valid file.
    pub fn good(&self) -> Vec<u8> {
        (self.good)()
    }

    /// Reads a file, and returns whether the reader accepted it. Panics if a guarantee is violated.
    pub fn read(&self, bytes: &[u8]) -> bool {
        thread_local!(static FOLDER: TempDir = {
            let memory = std::path::Path::new("/dev/shm");
            let folder = if memory.is_dir() { TempDir::new_in(memory) } else { TempDir::new() };
            folder.expect("a folder for the files")
        });
        FOLDER.with(|folder| {
            let stem = match self.name {
                "verify_laser" => "b-laser",
                _ => good::stem(self.extension),
            };
            let path = folder.path().join(format!("{stem}.{}", self.extension));
            if self.name == "verify_obj" {
                for (name, bytes) in good::beside_mesh() {
                    fs::write(folder.path().join(name), bytes)
                        .expect("the files of a mesh are written");
                }
            }
            fs::write(&path, bytes).expect("the file is written");
            (self.read)(read::File { path: &path, bytes })
        })
    }

    /// Returns a mutated file. Occasionally, it starts again from a valid one.
    pub fn changed(&self, bytes: &[u8], dice: &mut Dice) -> Vec<u8> {
        let again = bytes.is_empty() || dice.below(50) == 0;
        let mut changed = if again { self.good() } else { bytes.to_vec() };
        for _ in 0..=dice.below(3) {
            // A file that has lost its format is replaced by a valid one.
            changed = match mutate::change(self.form, &changed, dice) {
                Some(changed) => changed,
                None => self.good(),
            };
        }
        changed
    }
}
