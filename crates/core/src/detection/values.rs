use std::collections::BTreeMap;

use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::ink::InkEstimate;
use super::reason::Reason;
use super::tone::ToneEstimate;
use crate::lattice::GridKind;
use crate::quantity;
use crate::raster::{FileNotes, Pyramid};
use crate::statistics::median;
use crate::targets::TargetIdentity;

/// The detection result of one image.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Detection {
    /// File name of the image, or any name that the caller gave to it.
    pub image: String,
    /// Time stamp of a frame of a recording or video, ns: since 1970 or the start of a robot's clock, or since the start of
    /// the video.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_ns: Option<i64>,
    /// Width of the image, px.
    pub width: u32,
    /// Height of the image, px.
    pub height: u32,
    /// Metadata from the image file.
    #[serde(default, skip_serializing_if = "FileNotes::is_empty")]
    pub file: FileNotes,
    /// The targets searched for; empty if the corners belong to no target or an unknown one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub targets: Vec<TargetIdentity>,
    /// The grids found: labelled grids by panel id, then the others, largest first.
    pub grids: Vec<Grid>,
    /// The estimated tone curve of the camera, if requested.
    pub tone: Option<ToneEstimate>,
    /// The estimated ink spread of the print, if requested.
    pub ink: Option<InkEstimate>,
    /// Why there are no labels although they were requested, or why there are no grids.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub reasons: Vec<Reason>,
    /// Duration of each stage by its name, ms, if the detector has a clock. Files contain it only on request, because
    /// it differs between runs.
    #[serde(default)]
    pub timing_ms: BTreeMap<String, f64>,
}

impl Detection {
    /// Creates the result for an image of a width and height, px, from any detector.
    pub fn new(image: impl Into<String>, [width, height]: [u32; 2], grids: Vec<Grid>) -> Self {
        Self { image: image.into(), width, height, grids, ..Self::default() }
    }

    /// Treats the labels as those of the given targets, so that calibration accepts the detection with them. Each
    /// target that the detection names is replaced by the given one with the same tags. If the detection and `given`
    /// name one target each, that one is replaced even if its tags differ. If `given` is empty, as for an untagged
    /// grid, the detection names no targets afterwards. Returns each replaced target with its replacement.
    pub fn assume_targets(&mut self, given: &[TargetIdentity]) -> Vec<[TargetIdentity; 2]> {
        if given.is_empty() {
            self.targets.clear();
        }
        let only = given.first().filter(|_| given.len() == 1 && self.targets.len() == 1);
        let mut replaced = Vec::new();
        for own in &mut self.targets {
            let same = given.iter().find(|other| other.is_confusable(own)).or(only);
            if let Some(same) = same.filter(|_| !given.iter().any(|other| other.is_same_print(own)))
            {
                // Grids refer to the target by its name.
                replaced.push([own.clone(), same.clone()]);
                *own = TargetIdentity { name: own.name.clone(), ..same.clone() };
            }
        }
        replaced
    }

    /// Returns the identity of the target that a grid belongs to; `None` if the detection does not name it.
    pub fn target_of(&self, grid: &Grid) -> Option<&TargetIdentity> {
        match (&grid.target, self.targets.as_slice()) {
            (None, [only]) => Some(only),
            (None, _) => None,
            (Some(name), all) => all.iter().find(|target| *target.name == **name),
        }
    }
}

/// A connected piece of a tiling.
///
/// Rows and columns of a grid with `panel: None` are relative. They form a right-handed lattice with its own origin,
/// known up to a symmetry and shift of the lattice.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    /// The tiling: triangles or squares.
    pub kind: GridKind,
    /// Name of the target the grid belongs to, if several were searched for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// Id of the panel of the target; `None` if the grid has no labels.
    pub panel: Option<u32>,
    /// Whether the grid is mirrored in the image. Its labels, if any, are those of the print.
    #[serde(default, skip_serializing_if = "is_false")]
    pub mirrored: bool,
    /// The corners, ordered by row, then column.
    pub corners: Vec<GridCorner>,
    /// The tags that were decoded and agree with the labels.
    pub tags: Vec<DecodedTag>,
}

impl Grid {
    /// Returns the median distance of adjacent corners in a row or column, px; `None` if there are no adjacent
    /// corners.
    pub fn edge_px(&self) -> Option<f64> {
        let places: BTreeMap<(i32, i32), DVec2> =
            self.corners.iter().map(|c| ((c.row, c.col), c.position())).collect();
        let edges = self.corners.iter().flat_map(|c| {
            let next = [(c.row, c.col + 1), (c.row + 1, c.col)];
            let edges = next.into_iter().filter_map(|v| Some(c.position() - places.get(&v)?));
            edges.map(|edge| edge.x.hypot(edge.y))
        });
        median(edges.collect())
    }

    /// Converts positions to pixels of a pyramid level.
    #[doc(hidden)]
    pub fn moved_to_level(&mut self, level: usize) {
        for corner in &mut self.corners {
            corner.move_to(Pyramid::from_level_0(level, corner.position()));
        }
    }

    /// Reverses [`Self::moved_to_level`], and scales the covariances.
    #[doc(hidden)]
    pub fn moved_from_level(&mut self, level: usize) {
        let area = 4f64.powi(level as i32);
        for corner in &mut self.corners {
            corner.move_to(Pyramid::to_level_0(level, corner.position()));
            corner.cov = corner.cov.map(|cov| cov.map(|entry| area * entry));
        }
    }
}

fn is_false(value: &bool) -> bool {
    !value
}

/// A corner in the image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GridCorner {
    /// Lattice row: on the panel, or relative if the grid has no labels.
    #[serde(deserialize_with = "quantity::place_in_lattice::de")]
    pub row: i32,
    /// Lattice column, with the same meaning as `row`.
    #[serde(deserialize_with = "quantity::place_in_lattice::de")]
    pub col: i32,
    /// Id of the corner in the target; `None` if the grid has no labels.
    pub id: Option<u32>,
    /// Horizontal position, px, to the right; pixel centres at integers.
    #[serde(deserialize_with = "quantity::place_px::de")]
    pub x: f64,
    /// Vertical position, px, downwards; pixel centres at integers.
    #[serde(deserialize_with = "quantity::place_px::de")]
    pub y: f64,
    /// Covariance xx, xy, yy of the position, px²; `None` if the method provides none.
    pub cov: Option<[f64; 3]>,
}

impl GridCorner {
    /// Returns the position, px; x right, y down, pixel centres at integers.
    pub fn position(&self) -> DVec2 {
        DVec2::new(self.x, self.y)
    }

    /// Sets the position, px.
    #[doc(hidden)]
    pub fn move_to(&mut self, position: DVec2) {
        (self.x, self.y) = position.into();
    }
}

/// A decoded tag in the image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DecodedTag {
    /// Id of the tag: the index of its code in the family.
    pub id: u32,
    /// Name of the family, such as `delTag25h7`.
    pub family: String,
    /// Row of the tile's lower-left vertex, in the grid's rows.
    #[serde(deserialize_with = "quantity::place_in_lattice::de")]
    pub row: i32,
    /// Column of the tile's lower-left vertex.
    #[serde(deserialize_with = "quantity::place_in_lattice::de")]
    pub col: i32,
    /// Number of corrected bit errors.
    pub errors: u32,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::targets::{BoardSpec, Target};

    #[test]
    fn assumed_targets_replace_those_with_the_same_tags() {
        let board = |name, cols, edge_mm| {
            Target::new(name, BoardSpec::deltille(7, cols, edge_mm)).unwrap().identity()
        };
        let (small, large, wide) =
            (board("desk", 8, 20.0), board("other", 8, 25.0), board("wall", 12, 30.0));
        let of = |targets: &[&TargetIdentity]| {
            let targets = targets.iter().map(|&target| target.clone()).collect();
            Detection { targets, ..Detection::default() }
        };
        let mut both = of(&[&small, &wide]);
        let replaced = both.assume_targets(&[wide.clone(), large.clone()]);
        assert_eq!(replaced, vec![[small.clone(), large.clone()]]);
        assert_eq!(both.targets[0].fingerprint, large.fingerprint);
        assert_eq!(both.targets[0].name, small.name, "grids refer to it by its name");
        assert_eq!(both.targets[1], wide);
        let only = std::slice::from_ref(&wide);
        assert_eq!(of(&[&small]).assume_targets(only), vec![[small.clone(), wide.clone()]]);
        assert!(of(&[&small, &wide]).assume_targets(only).is_empty());
        let mut without = of(&[&small]);
        without.assume_targets(&[]);
        assert!(without.targets.is_empty());
    }
}
