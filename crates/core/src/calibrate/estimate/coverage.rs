//! How many corners a camera saw in each part of its image: what is left of them where they are not listed.

use glam::DVec2;

use super::values::CameraEstimate;

/// Cells along the longer side of the image.
const CELLS: f64 = 40.0;

/// Corners in each cell of an image, outliers left out.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Coverage {
    columns: usize,
    rows: usize,
    counts: Vec<u32>,
}

impl Coverage {
    /// Of counts row by row from the top; `None` where these are not one for each cell.
    pub fn new(columns: usize, rows: usize, counts: Vec<u32>) -> Option<Self> {
        let is_whole = columns.checked_mul(rows) == Some(counts.len());
        is_whole.then_some(Self { columns, rows, counts })
    }

    /// Where a camera saw corners: those of its views, else what is known of it without them.
    pub fn of(camera: &CameraEstimate) -> Self {
        let size = size_px(camera);
        let cells = (size * CELLS / size.max_element()).round().max(DVec2::ONE);
        let (columns, rows) = (cells.x as usize, cells.y as usize);
        let mut counts = vec![0; columns * rows];
        let corners = camera.corners().filter(|corner| !corner.outlier);
        for at in corners.map(|corner| (corner.pixel + 0.5) / size * cells) {
            let [column, row] = [(at.x.max(0.0), columns), (at.y.max(0.0), rows)]
                .map(|(at, cells)| (at as usize).min(cells - 1));
            counts[row * columns + column] += 1;
        }
        match &camera.coverage {
            Some(known) if camera.corners().next().is_none() => known.clone(),
            _ => Self { columns, rows, counts },
        }
    }

    /// Cells along a row, and rows.
    pub fn cells(&self) -> [usize; 2] {
        [self.columns, self.rows]
    }

    /// Corners in each cell, row by row from the top.
    pub fn counts(&self) -> &[u32] {
        &self.counts
    }

    /// The middle of each cell in which there are corners, px, and how many these are.
    pub(in crate::calibrate) fn places(
        &self,
        camera: &CameraEstimate,
    ) -> impl Iterator<Item = (DVec2, u32)> {
        let step = size_px(camera) / DVec2::new(self.columns as f64, self.rows as f64);
        let seen = self.counts.iter().enumerate().filter(|(_, count)| **count > 0);
        seen.map(move |(index, &count)| {
            let (row, column) = (index / self.columns, index % self.columns);
            (step * (DVec2::new(column as f64, row as f64) + 0.5) - 0.5, count)
        })
    }
}

fn size_px(camera: &CameraEstimate) -> DVec2 {
    DVec2::new(camera.camera.width.into(), camera.camera.height.into()).max(DVec2::ONE)
}
