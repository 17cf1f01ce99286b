//! The area of a text in the image.

use glam::DVec2;
use kurbo::{Affine, Point, Rect, Shape as _};

use crate::document::page::Page;
use deltille_layout::SheetText;
use deltille_layout::artwork;

/// White margin that counts as part of a mark, px.
pub(crate) const BLANK_PX: f64 = 3.0;

/// The rectangle around a text in the image, including the margin that belongs to it.
pub(crate) struct TextArea {
    /// Corners, px; counter-clockwise on the page, and therefore clockwise in the image.
    corners: [DVec2; 4],
    /// Directions of the sides that begin there.
    along: [DVec2; 4],
}

impl TextArea {
    /// Returns `None` if the text has no ink or cannot be rendered.
    pub(super) fn of(page: &Page, text: &SheetText) -> Option<Self> {
        let path = artwork::text_outline(text).ok().filter(|path| !path.is_empty())?;
        let along = Affine::rotate(-text.angle_rad);
        let blank = BLANK_PX / page.px_per_mm;
        let Rect { x0, y0, x1, y1 } = (along * &path).bounding_box().inflate(blank, blank);
        let corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(Point::from);
        let corners = corners.map(|corner| {
            let Point { x, y } = along.inverse() * corner;
            page.px_from_page(DVec2::new(x, y))
        });
        let side = |i: usize| (corners[(i + 1) % 4] - corners[i]).normalize_or_zero();
        Some(Self { corners, along: [0, 1, 2, 3].map(side) })
    }

    /// Whether the text lies within `near_px` of a pixel.
    pub(super) fn is_near(&self, px: DVec2, near_px: f64) -> bool {
        (self.corners.iter().zip(self.along))
            .all(|(&corner, along)| along.perp_dot(px - corner) <= near_px)
    }

    /// Whether the text may reach into a rectangle.
    pub(super) fn is_within(&self, low: DVec2, high: DVec2) -> bool {
        let [a, b, c, d] = self.corners;
        let (least, most) = (a.min(b).min(c).min(d), a.max(b).max(c).max(d));
        least.cmple(high).all() && most.cmpge(low).all()
    }
}
