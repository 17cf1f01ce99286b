//! The sizes of the textures of a mesh, and the faces on each texture.
//!
//! ```text
//! faces 0 1 2 3 4 5 6 7 8 in order, divided so that all textures have about the same area ╰──╮──╯
//! ╰─╮─╯ ╰╮╯ and the same sharpness texture 1 2 3
//! ```

use std::ops::Range;

use super::meshing::{MAX_TEXTURE_PX, MeshError, Resolution, TEXELS_PER_BIT};
use deltille_core::polygon::area;
use deltille_core::setting::Setting::MeshingTextures;
use deltille_core::targets::{Face, Panel};
use deltille_layout::artwork::Atlas;

/// Maximum number of textures of a mesh: readers keep all of them in memory.
pub const MAX_TEXTURES: u32 = 64;

/// The surface that carries boards: the faces of a solid, or the sides of a plate.
#[derive(Clone, Copy)]
pub(in crate::export) enum Surface<'a> {
    Faces(&'a [Face]),
    Plate(&'a [Panel]),
}

impl Surface<'_> {
    fn len(self) -> usize {
        match self {
            Self::Faces(faces) => faces.len(),
            Self::Plate(sides) => sides.len(),
        }
    }

    /// The areas of the faces, in any unit.
    fn areas(self) -> Vec<f64> {
        match self {
            Self::Faces(faces) => faces.iter().map(|face| area(&face.outline_mm)).collect(),
            Self::Plate(sides) => vec![1.0; sides.len()],
        }
    }

    fn atlas(self, share: Range<usize>, px_per_m: u32) -> Atlas {
        match self {
            Self::Faces(faces) => Atlas::of_faces(&faces[share], px_per_m),
            Self::Plate(sides) => Atlas::of_plate(&sides[share], px_per_m),
        }
    }
}

/// Some faces, by their numbers, and their arrangement on a texture.
pub(in crate::export) struct Picture {
    pub faces: Range<usize>,
    pub atlas: Atlas,
}

/// The smallest feature on a surface, which must be sharp.
#[derive(Clone, Copy)]
pub(in crate::export) struct Finest {
    /// Its name in messages.
    pub name: &'static str,
    /// Its edge, mm.
    pub mm: f64,
    /// Number of texels that it needs.
    pub needed: f64,
    /// The remedy if no texture is large enough.
    pub coarser: &'static str,
}

/// Returns the `count` textures of a surface at the requested resolution.
///
/// # Errors
/// Returns an error if there are fewer faces than textures, or if a texture would be too large or too coarse.
pub(in crate::export) fn pictures(
    surface: Surface,
    count: u32,
    resolution: Resolution,
    finest: Finest,
) -> Result<Vec<Picture>, MeshError> {
    let Finest { name: cell, mm: cell_mm, needed, coarser } = finest;
    let (faces, asked) = (surface.len(), count);
    let most = MAX_TEXTURES.min(faces as u32).max(1);
    if !(1..=most).contains(&asked) {
        return Err(MeshError::Textures { asked, faces, most });
    }
    // Pixels per metre for a number of texels per cell.
    let per_m = |texels: f64| (1e3 * texels / cell_mm).ceil().clamp(1.0, u32::MAX.into()) as u32;
    let set = Set { surface, shares: shares(&surface.areas(), count as usize) };
    let pictures = match resolution {
        Resolution::Usual => set.within(MAX_TEXTURE_PX, per_m(TEXELS_PER_BIT), false),
        Resolution::Dpi(dpi) => set.at((dpi / 0.0254).ceil().clamp(1.0, u32::MAX.into()) as u32),
        Resolution::Side(side) => set.within(side.min(MAX_TEXTURE_PX), per_m(TEXELS_PER_BIT), true),
    };
    // A resolution in whole dots per inch may be the rounded minimum.
    let texels =
        pictures.first().map_or(0.0, |first| f64::from(first.atlas.px_per_m) * cell_mm / 1e3);
    let is_unsharp = texels < needed * (1.0 - 1e-9);
    let side = longest(&pictures);
    if !is_unsharp && side <= MAX_TEXTURE_PX {
        return Ok(pictures);
    }
    // Number of textures of this size that would suffice, with spare pixels for the spaces, which are in px.
    let or_more = |side: u32, px_per_m: u32| {
        let enough = |&count: &u32| {
            let set = Set { surface, shares: shares(&surface.areas(), count as usize) };
            longest(&set.at(px_per_m)) <= side
        };
        let found = (count + 1..=most).find(enough);
        found.map_or(String::new(), |count| format!(", or {MeshingTextures} {count}"))
    };
    let sharp = per_m(SPARE * needed);
    Err(match resolution {
        Resolution::Usual => {
            let or_more = or_more(MAX_TEXTURE_PX, sharp);
            too_large(&set.at(per_m(needed)), format!("{coarser}{or_more}"))
        }
        Resolution::Side(asked) if is_unsharp => {
            let least = (f64::from(side) * SPARE * needed / texels).ceil();
            let or_more = or_more(asked.min(MAX_TEXTURE_PX), sharp);
            MeshError::Unsharp {
                cell,
                texels,
                needed,
                least: format!("{least:.0} px or more{or_more}"),
            }
        }
        Resolution::Dpi(_) if is_unsharp => {
            let least = (1e3 * needed / cell_mm * 0.0254).ceil();
            MeshError::Unsharp { cell, texels, needed, least: format!("{least:.0} dpi or more") }
        }
        _ => {
            let or_more = or_more(MAX_TEXTURE_PX, pictures[0].atlas.px_per_m);
            too_large(&pictures, format!("choose a lower resolution{or_more}"))
        }
    })
}

/// Spare factor for the spaces between faces.
const SPARE: f64 = 1.02;

fn too_large(pictures: &[Picture], instead: String) -> MeshError {
    let sizes = pictures.iter().map(|picture| picture.atlas.size_px);
    let [width, height] = sizes.max_by_key(|size| size[0].max(size[1])).unwrap_or_default();
    MeshError::Texture { width, height, instead }
}

/// The longest side of all textures, px.
fn longest(pictures: &[Picture]) -> u32 {
    pictures.iter().flat_map(|picture| picture.atlas.size_px).max().unwrap_or(1)
}

/// A surface whose faces are divided among textures.
struct Set<'a> {
    surface: Surface<'a>,
    shares: Vec<Range<usize>>,
}

impl Set<'_> {
    fn at(&self, px_per_m: u32) -> Vec<Picture> {
        let picture = |faces: &Range<usize>| {
            let (faces, atlas) = (faces.clone(), self.surface.atlas(faces.clone(), px_per_m));
            Picture { faces, atlas }
        };
        self.shares.iter().map(picture).collect()
    }

    /// The finest textures with sides of at most `side` px. Unless they should be `filled`, the usual resolution is not
    /// exceeded. Space between faces is in px, so sizes are not exactly proportional to the resolution.
    fn within(&self, side: u32, usual_px_per_m: u32, filled: bool) -> Vec<Picture> {
        let mut px_per_m = usual_px_per_m;
        let mut found = self.at(px_per_m);
        if !filled && longest(&found) <= side {
            return found;
        }
        for _ in 0..MAX_ATTEMPTS {
            let is = longest(&found);
            if is <= side && f64::from(is) > CLOSE * f64::from(side) {
                break;
            }
            let part = CLOSE.midpoint(1.0) * f64::from(side) / f64::from(is);
            px_per_m = (f64::from(px_per_m) * part).max(1.0) as u32;
            found = self.at(px_per_m);
        }
        found
    }
}

/// Fraction of the maximum side at which a texture counts as filled.
const CLOSE: f64 = 0.99;

/// Maximum number of attempts; each reduces the error by the fraction of the side that spaces take up.
const MAX_ATTEMPTS: usize = 12;

/// Divides the faces into `count` non-empty runs of about the same area; there are at least `count` faces.
fn shares(areas: &[f64], count: usize) -> Vec<Range<usize>> {
    let mut left: f64 = areas.iter().sum();
    let mut end = 0;
    let share = |index: usize| {
        let (start, after) = (end, count - 1 - index);
        let aim = left / (after + 1) as f64;
        let mut taken = 0.0;
        // A face belongs to the share that contains its middle. Later shares need one face each; the last takes the rest.
        while end < areas.len() - after
            && (end == start || after == 0 || taken + areas[end] / 2.0 <= aim)
        {
            taken += areas[end];
            end += 1;
        }
        left -= taken;
        start..end
    };
    (0..count).map(share).collect()
}

#[cfg(test)]
mod tests {
    use super::shares;

    #[test]
    fn textures_share_faces_by_area_and_none_is_empty() {
        assert_eq!(shares(&[1.0; 10], 3), [0..3, 3..7, 7..10]);
        assert_eq!(shares(&[1.0; 320], 4), [0..80, 80..160, 160..240, 240..320]);
        assert_eq!(shares(&[9.0, 1.0, 1.0, 1.0], 2), [0..1, 1..4]);
        assert_eq!(shares(&[1.0, 1.0, 1.0, 9.0], 2), [0..3, 3..4]);
        assert_eq!(shares(&[1.0, 1.0, 9.0], 3), [0..1, 1..2, 2..3]);
        assert_eq!(shares(&[1.0; 5], 1)[0], 0..5);
    }
}
