//! The area of a text in the image.

use glam::DVec2;
use kurbo::{Affine, Point, Rect, Shape as _};

use crate::document::page::Page;
use deltille_layout::SheetText;
use deltille_layout::artwork;

/// White margin that counts as part of a mark, px.
pub(crate) const BLANK_PX: f64 = 3.0;

/// Returns the corners of the rectangle around a text, including the margin that belongs to it, px; `None` if it has
/// no ink or cannot be rendered.
pub(super) fn rectangle_px(page: &Page, text: &SheetText) -> Option<[DVec2; 4]> {
    let path = artwork::text_outline(text).ok().filter(|path| !path.is_empty())?;
    let along = Affine::rotate(-text.angle_rad);
    let blank = BLANK_PX / page.px_per_mm;
    let Rect { x0, y0, x1, y1 } = (along * &path).bounding_box().inflate(blank, blank);
    let corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(Point::from);
    Some(corners.map(|corner| {
        let Point { x, y } = along.inverse() * corner;
        page.px_from_page(DVec2::new(x, y))
    }))
}
