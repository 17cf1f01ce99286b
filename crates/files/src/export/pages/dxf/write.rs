//! Writer of DXF.

use std::fmt::Write;

use glam::DVec2;

use super::{LAYERS, layer_name};
use crate::export::GENERATOR;
use deltille_layout::artwork::{CutDrawing, CutPath};

/// Returns the text of the `.dxf` file of a drawing, mm.
pub fn text(drawing: &CutDrawing) -> String {
    let [left, lower, right, upper] = drawing.bounds_mm().unwrap_or_default();
    let mut file = File::default();
    file.comment(&format!("{GENERATOR}, millimetres"));
    file.section("HEADER", |file| {
        file.tag(9, "$ACADVER").tag(1, "AC1009");
        // Millimetres, for readers that support this variable of later releases.
        file.tag(9, "$INSUNITS").tag(70, "4");
        file.tag(9, "$EXTMIN").point(10, DVec2::new(left, lower));
        file.tag(9, "$EXTMAX").point(10, DVec2::new(right, upper));
    });
    file.section("TABLES", |file| {
        file.tag(0, "TABLE").tag(2, "LTYPE").tag(70, "1");
        file.tag(0, "LTYPE").tag(2, "CONTINUOUS").tag(70, "0").tag(3, "Solid line");
        file.tag(72, "65").tag(73, "0").tag(40, "0.0").tag(0, "ENDTAB");
        file.tag(0, "TABLE").tag(2, "LAYER").tag(70, &LAYERS.len().to_string());
        for (_, name, colour) in LAYERS {
            file.tag(0, "LAYER").tag(2, name).tag(70, "0").tag(62, &colour.to_string());
            file.tag(6, "CONTINUOUS");
        }
        file.tag(0, "ENDTAB");
    });
    file.section("ENTITIES", |file| drawing.paths.iter().for_each(|path| file.path(path)));
    file.tag(0, "EOF");
    file.text
}

#[derive(Default)]
struct File {
    text: String,
}

impl File {
    /// Writes a group: its code and its value, one line each.
    fn tag(&mut self, code: u32, value: &str) -> &mut Self {
        // Writing to a string does not fail.
        let _ = writeln!(self.text, "{code:>3}\n{value}");
        self
    }

    fn comment(&mut self, words: &str) {
        self.tag(999, words);
    }

    /// Writes a point at z = 0; the codes of its coordinates differ by ten.
    fn point(&mut self, code: u32, DVec2 { x, y }: DVec2) -> &mut Self {
        for (code, mm) in [(code, x), (code + 10, y), (code + 20, 0.0)] {
            self.tag(code, &format!("{:.6}", mm + 0.0));
        }
        self
    }

    fn section(&mut self, name: &str, fill: impl FnOnce(&mut Self)) {
        self.tag(0, "SECTION").tag(2, name);
        fill(self);
        self.tag(0, "ENDSEC");
    }

    fn path(&mut self, path: &CutPath) {
        let layer = layer_name(path.layer);
        if !path.closed {
            for ends in path.points_mm.windows(2) {
                self.tag(0, "LINE").tag(8, layer).point(10, ends[0]).point(11, ends[1]);
            }
            return;
        }
        self.tag(0, "POLYLINE").tag(8, layer).tag(66, "1").point(10, DVec2::ZERO).tag(70, "1");
        for &point in &path.points_mm {
            self.tag(0, "VERTEX").tag(8, layer).point(10, point);
        }
        self.tag(0, "SEQEND").tag(8, layer);
    }
}
