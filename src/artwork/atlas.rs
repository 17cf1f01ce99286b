use std::f64::consts::PI;

use super::board::draw_panel;
use super::{ArtworkError, Sheet};
use crate::family::Family;
use crate::target::{Face, Placement, Target};

/// White between two faces, texels: more than any filter of the first mipmap levels reaches.
const PADDING_PX: f64 = 16.0;

/// All faces of a solid on one picture, the texture of its mesh.
///
/// ```text
///    ╱╲‾‾╱╲‾‾╱      Faces stand alternately upright and upside down in rows. Their own margins and
///   ╱__╲╱__╲╱       the padding are white, so that no filter takes anything from another face.
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Atlas {
    /// The picture; its sides are whole pixels.
    pub sheet: Sheet,
    /// Resolution, pixels per metre.
    pub px_per_m: u32,
    /// Width and height, px.
    pub size_px: [u32; 2],
    /// Vertices of each face on the sheet, mm.
    pub outlines_mm: Vec<[[f64; 2]; 3]>,
}

impl Atlas {
    /// Lays out the faces of a target, in the order of its panels.
    pub fn new(
        target: &Target,
        faces: &[Face],
        family: Option<&Family>,
        px_per_m: u32,
    ) -> Result<Atlas, ArtworkError> {
        let mm_per_px = 1e3 / f64::from(px_per_m);
        let padding = PADDING_PX * mm_per_px;
        let (mut width, mut height) = (0.0f64, 0.0f64);
        for face in faces {
            let [a, b, c] = face.outline_mm;
            width = width.max(b[0] - a[0]);
            height = height.max(c[1] - a[1]);
        }
        // Along the row the slanted edges keep the padding between them.
        let step = [width / 2.0 + padding / 0.75f64.sqrt(), height + padding];
        let size_of = |columns: usize| {
            let rows = faces.len().div_ceil(columns);
            let across = width + step[0] * (columns - 1) as f64 + 2.0 * padding;
            [across, step[1] * rows as f64 + padding]
        };
        let side = |columns: &usize| {
            let [w, h] = size_of(*columns);
            w.max(h)
        };
        let columns = (1..=faces.len()).min_by(|a, b| side(a).total_cmp(&side(b))).unwrap_or(1);
        let size_px = size_of(columns).map(|mm| (mm / mm_per_px).ceil());
        let [width_mm, height_mm] = size_px.map(|px| px * mm_per_px);

        let mut shapes = Vec::new();
        let mut outlines_mm = Vec::with_capacity(faces.len());
        for (index, (face, panel)) in faces.iter().zip(&target.panels).enumerate() {
            let (row, column) = (index / columns, index % columns);
            let left = padding + step[0] * column as f64;
            let lower = padding + step[1] * row as f64;
            let [[ax, ay], _, _] = face.outline_mm;
            let placement = if column % 2 == 0 {
                Placement { panel: panel.id, angle_rad: 0.0, origin_mm: [left - ax, lower - ay] }
            } else {
                let origin_mm = [left + width + ax, lower + height + ay];
                Placement { panel: panel.id, angle_rad: PI, origin_mm }
            };
            shapes.extend(draw_panel(target, panel, &placement, family)?);
            outlines_mm.push(face.outline_mm.map(|p| placement.page_from_panel(p)));
        }
        let sheet = Sheet { width_mm, height_mm, shapes };
        Ok(Atlas { sheet, px_per_m, size_px: size_px.map(|px| px as u32), outlines_mm })
    }
}
