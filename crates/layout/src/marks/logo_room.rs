//! Size of a logo in the margin of a sheet, and the check that it fits.

use glam::DVec2;

use super::logo::{SLIVER_MM, refused};
use crate::{PaperSpec, SheetLayout};
use deltille_core::setting::Setting::{PaperLogo, PaperLogoHeightMm, PaperSize};
use deltille_core::targets::{TargetError, format_mm};

/// Largest fraction of the length of a strip that a logo may take: the check bar beside it must stay long enough to
/// measure.
const MAX_PART: f64 = 0.3;

/// Fraction of the strip that a logo may take even if the label needs the space.
const MIN_PART: f64 = 0.15;

/// Gap between a logo and its neighbours, mm.
const BESIDE_MM: f64 = 2.0;

/// Allowed heights, mm: details of a smaller logo cannot be distinguished.
const HEIGHT_MM: std::ops::RangeInclusive<f64> = 3.0..=200.0;

/// Tolerance for missing space, mm: covers rounding.
const SLACK_MM: f64 = 1e-6;

/// Requested size of a logo.
#[derive(Clone, Copy)]
pub(crate) struct LogoSize {
    /// Width, in heights.
    width: f64,
    /// Requested height, mm.
    height_mm: Option<f64>,
}

impl LogoSize {
    /// Returns the requested size of the logo on a paper.
    pub(crate) fn of(paper: &PaperSpec) -> Option<Self> {
        let width = paper.logo.as_ref()?.width();
        Some(Self { width, height_mm: paper.logo_height_mm })
    }

    /// Returns the width, in heights.
    pub(crate) fn width(self) -> f64 {
        self.width
    }

    /// Returns the width and height of the logo in a strip of the given `length`, beside text of
    /// the length `words`. A requested height is limited to `most`. Otherwise the logo has the
    /// height `deep` of the strip, or less to leave room for the text.
    pub(crate) fn in_strip(self, [length, words]: [f64; 2], deep: f64, most: f64) -> DVec2 {
        let widest = MAX_PART * length;
        let height = match self.height_mm {
            Some(asked) => asked.min(most).min(widest / self.width),
            None => {
                let left = (length - Self::taken(words)).clamp(MIN_PART * length, widest);
                deep.min(left / self.width)
            }
        };
        DVec2::new(self.width * height, height)
    }

    /// Returns the length of a strip that a logo of that width takes, mm.
    pub(crate) fn taken(width_mm: f64) -> f64 {
        width_mm + BESIDE_MM
    }
}

/// Rejects a height without a logo, and a height out of range.
pub(crate) fn check(paper: &PaperSpec) -> Result<(), TargetError> {
    let refused = |problem| Err(TargetError::invalid(PaperLogoHeightMm, problem));
    match paper.logo_height_mm {
        Some(_) if paper.logo.is_none() => {
            refused(format!("needs a logo: add {PaperLogo}, or omit the height"))
        }
        Some(height) if !HEIGHT_MM.contains(&height) => {
            let [least, most] = [*HEIGHT_MM.start(), *HEIGHT_MM.end()].map(format_mm);
            refused(format!("{} is not between {least} and {most}", format_mm(height)))
        }
        _ => Ok(()),
    }
}

/// Rejects sheets on which the logo has too little space.
pub(crate) fn check_sheets(sheets: &[SheetLayout], paper: &PaperSpec) -> Result<(), TargetError> {
    let pages = sheets.iter().flat_map(|sheet| {
        let pages = sheet.pages.iter().map(|page| &page.marks);
        std::iter::once(sheet).chain(pages)
    });
    let places = pages.flat_map(|page| &page.logos);
    let smallest = places.min_by(|a, b| a.height_mm.total_cmp(&b.height_mm));
    let (Some(place), Some(logo)) = (smallest, &paper.logo) else { return Ok(()) };
    let least = place.height_mm;
    if logo.outlines_mm(place).is_empty() {
        let width = format_mm(SLIVER_MM);
        return refused(format!(
            "all lines of the logo are thinner than {width}: use thicker lines"
        ));
    }
    let fitting = format_mm((10.0 * least).floor() / 10.0);
    match paper.logo_height_mm {
        Some(asked) if least < asked - SLACK_MM => {
            let remedy = if least < *HEIGHT_MM.start() {
                format!("use a larger {PaperSize}")
            } else {
                format!("use at most {fitting}, or a larger {PaperSize}")
            };
            let problem = format!(
                "a logo {} high does not fit beside the other marks: {remedy}",
                format_mm(asked)
            );
            Err(TargetError::invalid(PaperLogoHeightMm, problem))
        }
        None if least < *HEIGHT_MM.start() => refused(format!(
            "the aspect ratio of the logo is {:.1}, so its height could be only {fitting}, less than {}: use a larger \
             {PaperSize}, or a narrower logo",
            logo.width(),
            format_mm(*HEIGHT_MM.start()),
        )),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use kurbo::Shape;
    use proptest::prelude::*;

    use super::*;
    use crate::artwork;
    use crate::{CHECK_BAR_STROKE_MM, SolidSheets};
    use crate::{Logo, LogoPlacement, Printing};
    use deltille_core::family::Family;
    use deltille_core::lattice::GridKind;
    use deltille_core::targets::{BoardSpec, CirclesSpec, SolidShape, SolidSpec, TargetSpec};

    /// A frame that is `width` times as wide as high.
    fn frame(width: f64) -> Logo {
        let rectangle = |inside: f64| {
            let (x, y) = (width - inside, 1.0 - inside);
            [(inside, inside), (x, inside), (x, y), (inside, y)].map(DVec2::from).to_vec()
        };
        let mut hole = rectangle(0.1 * width.min(1.0));
        hole.reverse();
        Logo::from_outlines(&[rectangle(0.0), hole]).unwrap()
    }

    fn build(spec: &TargetSpec, paper: &PaperSpec) -> Result<Printing, TargetError> {
        let family = spec.family().map(|name| Family::shipped(name).unwrap());
        Printing::build("target", spec, family.as_ref(), Some(paper))
    }

    fn rectangle_of(points: &[DVec2]) -> [DVec2; 2] {
        let end = |of: fn(DVec2, DVec2) -> DVec2| points.iter().copied().reduce(of).unwrap();
        [end(DVec2::min), end(DVec2::max)]
    }

    fn apart([a, b]: [DVec2; 2], [c, d]: [DVec2; 2], blank: f64) -> bool {
        (b + blank).cmple(c + SLACK_MM).any() || (d + blank).cmple(a + SLACK_MM).any()
    }

    /// Checks that logos overlap nothing, and that nothing else moved.
    fn check_place(spec: &TargetSpec, paper: &PaperSpec) -> Result<(), TestCaseError> {
        let plain = PaperSpec { logo: None, logo_height_mm: None, ..paper.clone() };
        let (Ok(plain), Ok(target)) = (build(spec, &plain), build(spec, paper)) else {
            return Ok(());
        };
        prop_assert_eq!(&Printing::from_json(&target.to_json()).unwrap(), &target);
        prop_assert_eq!(&plain.target.panels, &target.target.panels);
        let logo = target.logo.as_ref().unwrap();
        for (sheet, plain) in target.sheets.iter().zip(&plain.sheets) {
            prop_assert_eq!(&sheet.placements, &plain.placements);
            prop_assert_eq!(&sheet.lines, &plain.lines);
            prop_assert!(!sheet.logos.is_empty() || !sheet.pages.is_empty());
            for page in std::iter::once(sheet).chain(sheet.pages.iter().map(|page| &page.marks)) {
                for place in &page.logos {
                    let points: Vec<DVec2> = logo.outlines_mm(place).concat();
                    let around = rectangle_of(&points);
                    let margin = if paper.packed { 0.0 } else { paper.margin_mm };
                    let end = DVec2::new(page.width_mm, page.height_mm) - margin + SLACK_MM;
                    prop_assert!(around[0].cmpge(DVec2::splat(margin - SLACK_MM)).all());
                    prop_assert!(around[1].cmple(end).all());
                    for bar in &page.check_bars {
                        let bar = rectangle_of(&[bar.from_mm, bar.to_mm]);
                        prop_assert!(apart(around, bar, CHECK_BAR_STROKE_MM / 2.0), "{bar:?}");
                    }
                    for text in &page.texts {
                        let ink = artwork::text_outline(text).unwrap().bounding_box();
                        let ink = [DVec2::new(ink.x0, ink.y0), DVec2::new(ink.x1, ink.y1)];
                        prop_assert!(apart(around, ink, 0.3), "{around:?} meets {text:?}");
                    }
                    for line in &page.lines {
                        let line = rectangle_of(&[line.from_mm, line.to_mm]);
                        prop_assert!(apart(around, line, 0.0), "{around:?} meets {line:?}");
                    }
                    for placement in &page.placements {
                        let panel =
                            &target.target.panels[usize::try_from(placement.panel).unwrap()];
                        let quiet = if panel.inverted { 0.0 } else { panel.quiet_zone_mm() };
                        let [x0, y0, x1, y1] =
                            if panel.inverted { panel.field_mm() } else { panel.bounds_mm() };
                        let ends = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)];
                        let ends = ends.map(|end| placement.page_from_panel(end.into()));
                        let ink = rectangle_of(&ends);
                        prop_assert!(apart(around, ink, quiet), "{around:?} meets {ink:?}");
                    }
                }
            }
        }
        Ok(())
    }

    proptest! {
        #[test]
        fn a_logo_moves_nothing_and_overlaps_nothing(
            rows in 3u32..12, cols in 3u32..12, edge in 10.0f64..40.0, width in 0.1f64..12.0,
            height in 3.0f64..30.0, free: bool, checker: bool, inverted: bool, kind in 0usize..4,
            size in 0usize..4,
        ) {
            let grid = if checker { GridKind::Checker } else { GridKind::Deltille };
            let board = BoardSpec { inverted, boards: 3, ..BoardSpec::new(grid, rows, cols, edge) };
            let paper = PaperSpec {
                size: [None, Some("A4"), Some("A3"), Some("A5")][size].map(|size| size.parse().unwrap()),
                logo: Some(frame(width)),
                logo_height_mm: (!free).then_some(height),
                packed: kind == 1,
                poster: kind == 2,
                guide_page: kind == 3,
                ..PaperSpec::default()
            };
            let two_sided_mm = (kind == 3).then_some(3.0);
            check_place(&BoardSpec { two_sided_mm, ..board }.into(), &paper)?;
        }
    }

    #[test]
    fn solids_and_other_targets_have_room_for_a_logo() {
        let solid = TargetSpec::from(SolidSpec::new(SolidShape::Icosahedron));
        let circles = CirclesSpec {
            circles: [7, 5],
            spacing_mm: 20.0,
            diameter_mm: 10.0,
            asymmetric: false,
            board_id: 0,
        };
        for (spec, solids) in [
            (solid.clone(), SolidSheets::Net),
            (solid.clone(), SolidSheets::SeamedNet),
            (solid, SolidSheets::PerFace),
            (circles.into(), SolidSheets::Net),
        ] {
            let size = Some("A3".parse().unwrap());
            let paper = PaperSpec { size, solids, logo: Some(frame(2.5)), ..PaperSpec::default() };
            let target = build(&spec, &paper).unwrap();
            assert!(
                target
                    .sheets
                    .iter()
                    .all(|sheet| !sheet.logos.is_empty() || !sheet.pages.is_empty())
            );
            check_place(&spec, &paper).unwrap();
        }
    }

    #[test]
    fn sizes_that_do_not_fit_are_refused() {
        let said = |logo: Option<Logo>, logo_height_mm: Option<f64>, size: &str| {
            let size = Some(size.parse().unwrap());
            let paper = PaperSpec { size, logo, logo_height_mm, ..PaperSpec::default() };
            let board = BoardSpec::deltille(10, 11, 20.0);
            build(&board.into(), &paper).map(|_| ()).map_err(|error| error.to_string())
        };
        let logo = || Some(frame(2.0));
        assert_eq!(said(logo(), None, "A4"), Ok(()));
        assert_eq!(said(logo(), Some(12.0), "A3"), Ok(()));
        let refused = |found: Result<(), String>| found.unwrap_err();
        let error = refused(said(logo(), Some(25.0), "A4"));
        let most = error.split("at most ").nth(1).and_then(|e| e.split(' ').next()).unwrap();
        let most: f64 = most.parse().unwrap();
        assert_eq!(said(logo(), Some(most), "A4"), Ok(()));
        assert!(said(logo(), Some(most + 0.11), "A4").is_err());
        assert!(refused(said(None, Some(9.0), "A4")).contains("needs a logo"));
        assert!(refused(said(logo(), Some(2.0), "A4")).contains("between 3 mm and 200 mm"));
        let narrow = BoardSpec::deltille(4, 4, 5.0);
        let paper = PaperSpec {
            size: Some("60x60mm".parse().unwrap()),
            logo: Some(frame(25.0)),
            ..PaperSpec::default()
        };
        let error = build(&narrow.into(), &paper).unwrap_err().to_string();
        assert!(error.contains("less than 3 mm"), "{error}");
    }

    #[test]
    fn outlines_too_thin_for_some_viewers_are_omitted() {
        let rectangle = |x0: f64, x1: f64| {
            [(x0, 0.0), (x1, 0.0), (x1, 1.0), (x0, 1.0)].map(DVec2::from).to_vec()
        };
        let logo = Logo::from_outlines(&[rectangle(0.0, 0.001), rectangle(0.5, 1.0)]).unwrap();
        let outlines = |height_mm: f64| {
            let place = LogoPlacement { at_mm: DVec2::ZERO, angle_rad: 0.0, height_mm };
            logo.outlines_mm(&place).len()
        };
        assert_eq!([outlines(9.0), outlines(30.0)], [1, 2]);
        let logo = Logo::from_outlines(&[rectangle(0.0, 0.001), rectangle(0.9, 0.901)]).unwrap();
        let paper = PaperSpec { logo: Some(logo), ..PaperSpec::default() };
        let error = build(&BoardSpec::deltille(5, 6, 20.0).into(), &paper).unwrap_err().to_string();
        assert!(error.contains("thinner than 0.02 mm"), "{error}");
    }

    #[test]
    fn files_accept_outlines_and_nothing_else() {
        let read = |text: &str| Logo::try_from(text.to_owned());
        let logo = read("M0 0L20000 0L20000 10000L0 10000Z").unwrap();
        assert_eq!((logo.width(), read(&logo.to_string())), (2.0, Ok(logo)));
        for wrong in [
            "",
            "x",
            "M0 0L9 9Z",
            "M0 0L20000 0L20000 9000L0 9000Z",
            "M0 0L2.5 0L0 10000Z",
            "M0 0C1 1 2 2 20000 0L0 10000Z",
            "M1 0L20000 0L20000 10000Z",
            "M0 0L9 0L0 10000Z",
            "M0 0L1e20 0L0 10000Z",
            "M-1 0L20000 0L0 10000Z",
        ] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
        assert!(read(&"M0 0".repeat(20_000)).is_err());
    }
}
