//! The columns of both tables.

use parquet::data_type::ByteArray;

/// The type of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// UTF-8.
    Text,
    /// A signed integer of 32 bits.
    Signed,
    /// An unsigned integer of 32 bits.
    Unsigned,
    /// A signed integer of 64 bits.
    Long,
    /// A double-precision number.
    Real,
    /// True or false.
    Flag,
}

impl Kind {
    /// The words for a value of this kind.
    pub(super) fn expected(self) -> &'static str {
        match self {
            Self::Text => "text",
            Self::Signed | Self::Unsigned | Self::Long => "an integer",
            Self::Real => "a number",
            Self::Flag => "true or false",
        }
    }
}

/// A column.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    pub name: &'static str,
    pub kind: Kind,
    /// Whether every row has a value.
    pub full: bool,
    /// Whether values repeat, so a dictionary is shorter.
    pub repeats: bool,
    /// Whether the reader requires it.
    pub needed: bool,
}

/// A value of a row.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Cell {
    None,
    Text(ByteArray),
    Whole(i64),
    Real(f64),
    Flag(bool),
}

const fn column(name: &'static str, kind: Kind) -> Column {
    Column { name, kind, full: true, repeats: true, needed: true }
}

impl Column {
    /// Allows rows without a value.
    const fn gaps(self) -> Self {
        Self { full: false, ..self }
    }

    /// Marks values that do not repeat.
    const fn varied(self) -> Self {
        Self { repeats: false, ..self }
    }

    /// Marks a column for users of the table; the reader does not require it.
    const fn extra(self) -> Self {
        Self { needed: false, ..self }
    }

    /// Returns the name of the column before version 0.1.
    pub(super) fn earlier_name(self) -> String {
        let name = self.name.replace("ink_images", "ink_pictures");
        name.strip_suffix("_sd").map_or(name.clone(), |stem| format!("{stem}_deviation"))
    }
}

/// A row for each corner.
pub(super) const CORNERS: [Column; 17] = [
    column("image", Kind::Text),
    column("grid", Kind::Signed),
    column("kind", Kind::Text),
    column("target", Kind::Text).gaps().extra(),
    column("panel", Kind::Unsigned).gaps(),
    column("mirrored", Kind::Flag).extra(),
    column("row", Kind::Signed),
    column("col", Kind::Signed),
    column("id", Kind::Unsigned).gaps(),
    column("x", Kind::Real).varied(),
    column("y", Kind::Real).varied(),
    column("cov_xx", Kind::Real).gaps().varied(),
    column("cov_xy", Kind::Real).gaps().varied(),
    column("cov_yy", Kind::Real).gaps().varied(),
    column("target_x_mm", Kind::Real).gaps().extra(),
    column("target_y_mm", Kind::Real).gaps().extra(),
    column("target_z_mm", Kind::Real).gaps().extra(),
];

/// A row for each image.
pub(super) const IMAGES: [Column; 27] = [
    column("image", Kind::Text),
    column("width", Kind::Signed).gaps(),
    column("height", Kind::Signed).gaps(),
    column("grids", Kind::Signed).gaps().extra(),
    column("corners", Kind::Signed).gaps().extra(),
    column("tags", Kind::Signed).gaps().extra(),
    column("why", Kind::Text).gaps().extra(),
    column("why_text", Kind::Text).gaps().extra(),
    column("reasons", Kind::Text).gaps().extra(),
    column("tone_black", Kind::Real).gaps().extra(),
    column("tone_white", Kind::Real).gaps().extra(),
    column("tone_kappa", Kind::Real).gaps().extra(),
    column("tone_kappa_sd", Kind::Real).gaps().extra(),
    column("tone_kappa_odd", Kind::Real).gaps().extra(),
    column("tone_used", Kind::Flag).gaps().extra(),
    column("ink_edges", Kind::Real).gaps(),
    column("ink_edges_sd", Kind::Real).gaps(),
    column("ink_um", Kind::Real).gaps(),
    column("ink_um_sd", Kind::Real).gaps(),
    column("ink_used", Kind::Flag).gaps(),
    column("ink_images", Kind::Signed).gaps(),
    column("exif_orientation", Kind::Signed).gaps().extra(),
    column("damage", Kind::Text).gaps().extra(),
    column("error", Kind::Text).gaps().extra(),
    column("targets", Kind::Text).gaps().extra(),
    column("time_ns", Kind::Long).gaps().extra(),
    column("camera", Kind::Text).gaps().extra(),
];
