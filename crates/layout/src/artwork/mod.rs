//! The drawing of a target in millimetres, independent of the file type.
//!
//! [`Printing::draw`] turns a target and its layout into sheets of shapes. Every exporter writes the same shapes. Text
//! is included as glyph outlines, so PDF, SVG and PNG show the same marks regardless of the reader's fonts.
//!
//! No two shapes overlap: a black tile is one path whose holes are the merged white cells of its tag, and white is bare
//! paper. Two tiles share only a vertex, so that no renderer shows a seam.
//!
//! 1. `board` draws panels, marks and texts, using `cells` (white of a tag), `check_bar`, `line` and `text`;
//! 2. `window` clips a sheet to pages; `gallery` shows single tags;
//! 3. `atlas` packs the faces of a solid on a texture;
//! 4. `cutting` and `laser` produce drawings for machines.
//!
//! Frame: the page frame of [`SheetLayout`](crate::SheetLayout), origin at the lower-left
//! corner of the page, x right, y up.

mod atlas;
mod board;
mod cells;
mod check_bar;
mod cutting;
mod gallery;
mod laser;
mod line;
pub mod text;
mod window;

use glam::DVec2;
use kurbo::{Affine, BezPath};

use crate::{Finish, LineKind, Placement, Printing, SheetText};
use deltille_core::lattice::GridKind;
use deltille_core::targets::{Panel, Target, UnknownCodes};
use deltille_core::words::counted;

pub use atlas::Atlas;
pub use board::drawn_lines;
pub use cells::white_outlines;
pub use check_bar::{STROKE_WIDTH_MM, outline as check_bar_outline};
pub use cutting::{CutDrawing, CutLayer, CutPath, CuttingError, net_to_cut, panels_to_cut};
pub use gallery::{GalleryTile, tag_gallery};
pub use laser::{LaserBoard, laser_boards, moved_inwards, to_laser};
pub use line::strokes_mm;

/// The drawing of one target: all its pages.
#[derive(Clone, Debug, PartialEq)]
pub struct Artwork {
    /// Title of the document: the target's name.
    pub title: String,
    /// One line that describes the target; see [`subject`].
    pub subject: String,
    /// The pages, in the order of the target's sheets and of the pages of each.
    pub sheets: Vec<Sheet>,
    /// Print finish. If the finish is mirrored, shapes are already mirrored. Formats with spot colours use its colours.
    pub finish: Finish,
}

/// One page with its shapes.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// Page width, mm.
    pub width_mm: f64,
    /// Page height, mm.
    pub height_mm: f64,
    /// Shapes, which do not overlap.
    pub shapes: Vec<Shape>,
}

impl Sheet {
    /// Mirrors the page left to right.
    fn mirror(&mut self) {
        let mirrored = Affine::new([-1.0, 0.0, 0.0, 1.0, self.width_mm, 0.0]);
        self.shapes.iter_mut().for_each(|shape| shape.path = mirrored * &shape.path);
    }
}

/// A mark in solid black.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Which mark it is, for file formats with names or layers.
    pub part: Part,
    /// How its path is painted.
    pub paint: Paint,
    /// The path in the page frame, mm.
    pub path: BezPath,
}

/// How a path is painted; always black.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Paint {
    /// Inside of all closed loops, by the even-odd rule.
    Fill,
    /// Along the path, with butt ends and mitred joins.
    Stroke {
        /// Width of the line, mm.
        width_mm: f64,
    },
}

/// Identifies the mark that a shape belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Part {
    /// A black tile of a panel with the holes of its tag, or a tag in a white square; named by
    /// panel id and lower-left lattice vertex.
    Tile {
        /// Panel id.
        panel: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
    },
    /// The black field of an inverted panel, with its white tiles as holes.
    Field {
        /// Panel id.
        panel: u32,
    },
    /// A check bar of the sheet, by index.
    CheckBar {
        /// Position in [`SheetLayout::check_bars`](crate::SheetLayout::check_bars).
        index: usize,
    },
    /// A line to cut or to fold along, by index.
    Line {
        /// Its purpose.
        kind: LineKind,
        /// Position in [`SheetLayout::lines`](crate::SheetLayout::lines), lines of a page
        /// after those of its sheet.
        index: usize,
    },
    /// A line of text.
    Label {
        /// Position among the texts of the sheet, those of a page after those of its sheet.
        index: usize,
    },
    /// The logo of the target.
    Logo {
        /// Position among the logos of the sheet, those of a page after those of its sheet.
        index: usize,
    },
}

/// Reason why a target cannot be drawn.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ArtworkError {
    /// The codes of its tags are unknown.
    #[error(transparent)]
    Family(#[from] UnknownCodes),
    /// A tag id is not in the family.
    #[error("tag {id} at row {row}, column {col} is not in family {family}, which has {len} codes")]
    NoSuchTag {
        /// The id asked for.
        id: u32,
        /// Lattice row of the tag.
        row: i32,
        /// Lattice column of the tag.
        col: i32,
        /// Name of the family.
        family: String,
        /// Number of its codes.
        len: usize,
    },
    /// A sheet shows a panel that the target does not have.
    #[error("sheet {sheet} shows panel {panel}, which the target does not have")]
    NoSuchPanel {
        /// Sheet, counted from 1.
        sheet: usize,
        /// Panel id.
        panel: u32,
    },
    /// A line of text contains a character that the built-in font lacks.
    #[error(transparent)]
    Text(#[from] text::MissingGlyph),
}

impl Printing {
    /// Draws every page of the target, in the page frame, mm.
    ///
    /// # Errors
    /// Returns an error if the family of the tags is unknown or lacks a code, a sheet shows an unknown panel,
    /// or the font lacks a character of a line of text.
    ///
    /// ```
    /// use deltille_layout::Printing;
    /// use deltille_core::targets::BoardSpec;
    ///
    /// let artwork = Printing::new("desk", BoardSpec::deltille(4, 5, 20.0))?.draw()?;
    /// assert_eq!(artwork.sheets.len(), 1);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn draw(&self) -> Result<Artwork, ArtworkError> {
        let mut sheets = Vec::with_capacity(self.page_count());
        for (index, layout) in self.sheets.iter().enumerate() {
            let sheet = board::sheet(self, index)?;
            if layout.pages.is_empty() {
                sheets.push(sheet);
                continue;
            }
            for page in &layout.pages {
                sheets.push(board::page(&sheet, self, layout, page)?);
            }
        }
        if self.finish.mirrored {
            sheets.iter_mut().for_each(Sheet::mirror);
        }
        let (title, subject) = (self.target.name.to_string(), subject(&self.target));
        Ok(Artwork { title, subject, sheets, finish: self.finish.clone() })
    }
}

/// Draws the tiles of one panel in the frame of the panel, mm.
///
/// # Errors
/// Returns an error if the family of its tags is unknown or lacks a code.
pub fn panel_shapes(target: &Target, panel: &Panel) -> Result<Vec<Shape>, ArtworkError> {
    let placement = Placement { panel: panel.id, angle_rad: 0.0, origin_mm: DVec2::ZERO };
    board::draw_panel(target, panel, &placement)
}

/// Returns the outline of a line of text in the frame of its page, mm; to be filled by the even-odd
/// rule.
///
/// # Errors
/// Returns an error if the font lacks a character of the text.
pub fn text_outline(text: &SheetText) -> Result<BezPath, text::MissingGlyph> {
    board::draw_text(text)
}

/// Describes a target in one line: kind, number of corners and tags, family with fingerprint.
pub fn subject(target: &Target) -> String {
    let corners: usize = target.panels.iter().map(|panel| panel.corners.len()).sum();
    let tags: usize = target.panels.iter().map(|panel| panel.tags.len()).sum();
    let what = match corners {
        0 => "single DelTags".to_owned(),
        _ if target.panels.iter().all(|panel| panel.discs_mm.is_some()) => {
            format!("calibration target of {corners} circles")
        }
        _ => {
            let kind = match target.panels.first().map(|panel| panel.kind) {
                Some(GridKind::Checker) => "checkerboard",
                _ => "deltille",
            };
            format!("{kind} calibration target, {corners} corners")
        }
    };
    let mut subject = format!("{what}, {}", counted(tags, "tag"));
    if let Some(family) = &target.family {
        subject += &format!(", family {}, fingerprint {}", family.name, family.fingerprint);
        if let Some(squares) = &family.squares {
            let (name, fingerprint) = (&squares.name, &squares.fingerprint);
            subject += &format!(", of squares {name}, fingerprint {fingerprint}");
        }
    }
    subject
}
