//! The areas that an SVG paints, in painting order.

use i_overlay::core::fill_rule::FillRule;
use kurbo::{Affine, BezPath, Cap, Join, PathEl, Point, Rect, Shape, StrokeOpts};
use usvg::tiny_skia_path::PathSegment;
use usvg::{ClipPath, Color, Fill, Group, Node, Paint, PaintOrder, Path, Stroke, Transform, Tree};

use super::area::{Area, Straight, Tone};
use super::elements::{named, unnamed};
use super::{LogoError, crossings};

/// Maximum distance of straight lines from the curves that they replace, as a fraction of the height of the logo: 1.2 µm of
/// 12 mm.
const FLATNESS: f64 = 1e-4;

/// Maximum number of corners of all outlines before their union.
const MAX_CORNERS: usize = 20_000;

/// Maximum number of crossing lines: their union has a corner at each crossing.
const MAX_CROSSINGS: usize = 100_000;

/// Maximum number of dashes of a stroke.
const MAX_DASHES: usize = 2_000;

/// Returns the painted areas in painting order.
pub(super) fn of(tree: &Tree) -> Result<Vec<(Tone, Area)>, LogoError> {
    let mut found = Found::default();
    found.group(tree.root(), Affine::IDENTITY, &[])?;
    let height = found.black_around.map_or(1.0, |around| around.height().min(around.width()));
    let flatness = (FLATNESS * height).max(f64::MIN_POSITIVE);
    let mut corners = 0;
    let mut straight = |outline: &Outline| {
        let straight = outline.straight(flatness);
        corners += straight.outlines.iter().map(Vec::len).sum::<usize>();
        match corners > MAX_CORNERS {
            true => Err(LogoError::Much { what: "corners", most: MAX_CORNERS }),
            false => Ok(straight),
        }
    };
    // Counts are checked before anything is computed.
    let clips = found.clips.iter().map(|clip| clip.iter().map(&mut straight).collect());
    let clips: Vec<Vec<Straight>> = clips.collect::<Result<_, _>>()?;
    let items = found.items.iter().map(|item| straight(&item.outline));
    let items: Vec<Straight> = items.collect::<Result<_, _>>()?;
    if !crossings::are_at_most(MAX_CROSSINGS, clips.iter().flatten().chain(&items)) {
        return Err(LogoError::Much { what: "crossings of outlines", most: MAX_CROSSINGS });
    }
    let clips: Vec<Area> = clips
        .iter()
        .map(|clip| Area::union(&clip.iter().map(Straight::area).collect::<Vec<_>>()))
        .collect();
    let painted = found.items.iter().zip(&items).map(|(item, straight)| {
        let within = |area: Area, &clip: &usize| area.common(&clips[clip]);
        (item.tone, item.clips.iter().fold(straight.area(), within))
    });
    Ok(painted.collect())
}

/// The inside of a path, or the area that its stroke covers.
struct Outline {
    path: BezPath,
    rule: FillRule,
    stroke: Option<kurbo::Stroke>,
    drawing_from_path: Affine,
}

/// A painted outline.
struct Item {
    tone: Tone,
    outline: Outline,
    /// The indices of the clips that limit it.
    clips: Vec<usize>,
}

#[derive(Default)]
struct Found {
    items: Vec<Item>,
    /// Clips of one or more outlines each.
    clips: Vec<Vec<Outline>>,
    /// The bounding rectangle of the black outlines.
    black_around: Option<Rect>,
}

fn refused<T>(what: String, remedy: &'static str) -> Result<T, LogoError> {
    Err(LogoError::Element { what, remedy })
}

impl Found {
    fn group(
        &mut self,
        group: &Group,
        drawing_from_parent: Affine,
        clips: &[usize],
    ) -> Result<(), LogoError> {
        let what = || unnamed(group.id());
        if !group.filters().is_empty() {
            return refused(format!("{} has a filter", what()), "remove the filter");
        }
        if group.mask().is_some() {
            return refused(format!("{} has a mask", what()), "cut the paths instead");
        }
        if group.opacity().get() < 1.0 || group.blend_mode() != usvg::BlendMode::Normal {
            let remedy = "make it opaque, because only black is printed";
            return refused(format!("{} is transparent", what()), remedy);
        }
        let drawing_from_group = drawing_from_parent * affine(group.transform());
        let mut clips = clips.to_vec();
        let mut next = group.clip_path();
        while let Some(clip) = next {
            clips.push(self.clips.len());
            self.clips.push(outlines_of_clip(clip, drawing_from_group)?);
            next = clip.clip_path();
        }
        for node in group.children() {
            match node {
                Node::Group(group) => self.group(group, drawing_from_group, &clips)?,
                Node::Path(path) if path.is_visible() => {
                    self.path(path, drawing_from_group, &clips)?;
                }
                Node::Path(_) => {}
                Node::Image(_) => {
                    return refused("`image` cannot be printed".to_owned(), "trace it");
                }
                Node::Text(_) => {
                    return refused("`text` cannot be printed".to_owned(), "convert it to paths");
                }
            }
        }
        Ok(())
    }

    fn path(
        &mut self,
        path: &Path,
        drawing_from_path: Affine,
        clips: &[usize],
    ) -> Result<(), LogoError> {
        let data = bez_path(path);
        let what = unnamed(path.id());
        let outline =
            |rule, stroke| Outline { path: data.clone(), rule, stroke, drawing_from_path };
        let fill = path.fill().map(|fill| {
            let tone = tone(fill.paint(), fill.opacity().get(), &what)?;
            Ok::<_, LogoError>((tone, outline(rule(fill), None)))
        });
        let stroke = path.stroke().map(|stroke| {
            let tone = tone(stroke.paint(), stroke.opacity().get(), &what)?;
            let style = style(stroke, &data, &what)?;
            Ok::<_, LogoError>((tone, outline(FillRule::NonZero, Some(style))))
        });
        let [fill, stroke] = [fill.transpose()?, stroke.transpose()?];
        let both = match path.paint_order() {
            PaintOrder::FillAndStroke => [fill, stroke],
            PaintOrder::StrokeAndFill => [stroke, fill],
        };
        for (tone, outline) in both.into_iter().flatten() {
            if tone == Tone::Black {
                let reach = outline.stroke.as_ref().map_or(0.0, |stroke| stroke.width / 2.0);
                let around = data.bounding_box().inflate(reach, reach);
                let around = drawing_from_path.transform_rect_bbox(around);
                self.black_around = Some(self.black_around.map_or(around, |all| all.union(around)));
            }
            self.items.push(Item { tone, outline, clips: clips.to_vec() });
        }
        Ok(())
    }
}

/// The tone of a colour in print.
fn tone(paint: &Paint, opacity: f32, what: &str) -> Result<Tone, LogoError> {
    if opacity < 1.0 {
        let remedy = "make it opaque, because only black is printed";
        return refused(format!("{what} is transparent"), remedy);
    }
    match paint {
        Paint::Color(color) if *color == Color::white() => Ok(Tone::White),
        Paint::Color(_) => Ok(Tone::Black),
        Paint::LinearGradient(_) | Paint::RadialGradient(_) => {
            refused(format!("{what} is painted with a gradient"), "paint it with a plain colour")
        }
        Paint::Pattern(_) => {
            refused(format!("{what} is painted with a pattern"), "paint it with a plain colour")
        }
    }
}

fn rule(fill: &Fill) -> FillRule {
    match fill.rule() {
        usvg::FillRule::NonZero => FillRule::NonZero,
        usvg::FillRule::EvenOdd => FillRule::EvenOdd,
    }
}

/// The style of a stroke along a path.
fn style(stroke: &Stroke, path: &BezPath, what: &str) -> Result<kurbo::Stroke, LogoError> {
    let width = f64::from(stroke.width().get());
    let join = match stroke.linejoin() {
        usvg::LineJoin::Miter | usvg::LineJoin::MiterClip => Join::Miter,
        usvg::LineJoin::Round => Join::Round,
        usvg::LineJoin::Bevel => Join::Bevel,
    };
    let cap = match stroke.linecap() {
        usvg::LineCap::Butt => Cap::Butt,
        usvg::LineCap::Round => Cap::Round,
        usvg::LineCap::Square => Cap::Square,
    };
    let limit = f64::from(stroke.miterlimit().get());
    let style = kurbo::Stroke::new(width).with_join(join).with_caps(cap).with_miter_limit(limit);
    let Some(dashes) = stroke.dasharray() else { return Ok(style) };
    let dashes: Vec<f64> = dashes.iter().map(|&length| f64::from(length)).collect();
    let period: f64 = dashes.iter().sum();
    let length = path.perimeter(width.max(f64::MIN_POSITIVE));
    let count = length / period * dashes.len() as f64;
    if count.is_nan() || count > MAX_DASHES as f64 {
        let what = format!("{what} has more than {MAX_DASHES} dashes");
        return refused(what, "use fewer, or convert strokes to paths");
    }
    Ok(style.with_dashes(f64::from(stroke.dashoffset()), dashes))
}

/// The outlines of a clip.
fn outlines_of_clip(clip: &ClipPath, drawing_from_user: Affine) -> Result<Vec<Outline>, LogoError> {
    let mut outlines = Vec::new();
    let mut groups = vec![(clip.root(), drawing_from_user * affine(clip.transform()))];
    while let Some((group, drawing_from_parent)) = groups.pop() {
        if group.clip_path().is_some() {
            let what = format!("{} is itself clipped", named("clipPath", clip.id()));
            return refused(what, "release one of the clips");
        }
        let drawing_from_group = drawing_from_parent * affine(group.transform());
        for node in group.children() {
            match node {
                Node::Group(group) => groups.push((group, drawing_from_group)),
                Node::Path(path) if path.is_visible() => outlines.push(Outline {
                    path: bez_path(path),
                    rule: path.fill().map_or(FillRule::NonZero, rule),
                    stroke: None,
                    drawing_from_path: drawing_from_group,
                }),
                _ => {}
            }
        }
    }
    Ok(outlines)
}

impl Outline {
    /// The outline in the frame of the drawing, with curves replaced by straight lines.
    fn straight(&self, flatness: f64) -> Straight {
        let scale = self.drawing_from_path.determinant().abs().sqrt();
        let path = match &self.stroke {
            Some(style) if scale > 0.0 => {
                kurbo::stroke(&self.path, style, &StrokeOpts::default(), flatness / scale)
            }
            _ => self.path.clone(),
        };
        let mut outlines: Vec<Vec<[f64; 2]>> = Vec::new();
        kurbo::flatten(self.drawing_from_path * path, flatness, |element| {
            match (element, outlines.last_mut()) {
                (PathEl::MoveTo(p), _) => outlines.push(vec![[p.x, p.y]]),
                (PathEl::LineTo(p), Some(outline)) => outline.push([p.x, p.y]),
                _ => {}
            }
        });
        let is_finite = |outline: &[[f64; 2]]| outline.iter().flatten().all(|v| v.is_finite());
        outlines.retain(|outline| outline.len() > 2 && is_finite(outline));
        Straight { outlines, rule: self.rule }
    }
}

fn affine(t: Transform) -> Affine {
    Affine::new([t.sx, t.ky, t.kx, t.sy, t.tx, t.ty].map(f64::from))
}

fn bez_path(path: &Path) -> BezPath {
    let point = |p: usvg::tiny_skia_path::Point| Point::new(f64::from(p.x), f64::from(p.y));
    let element = |segment| match segment {
        PathSegment::MoveTo(to) => PathEl::MoveTo(point(to)),
        PathSegment::LineTo(to) => PathEl::LineTo(point(to)),
        PathSegment::QuadTo(a, to) => PathEl::QuadTo(point(a), point(to)),
        PathSegment::CubicTo(a, b, to) => PathEl::CurveTo(point(a), point(b), point(to)),
        PathSegment::Close => PathEl::ClosePath,
    };
    path.data().segments().map(element).collect()
}
