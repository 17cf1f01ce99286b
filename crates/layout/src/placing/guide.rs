//! The page that goes with a target: a picture of it, what to do with its sheets, and a ruler.
//!
//! ```text
//!   ┌──────────────────────┐
//!   │ name                 │   The picture shows what is to be built from outside, or the board on its
//!   │     ╱╲               │   plate: faces have their numbers, and an arrow towards their upper end.
//!   │    ╱ 3╲   z│         │   The axes are those of the target's description.
//!   │   ╱____╲   └─ x      │
//!   │ 1. Print …           │   All of it is lines and texts as on other sheets, so that it is proved
//!   │ 2. Cut …             │   like these.
//!   │ ├──┴──┴──┴──┤        │
//!   └──────────────────────┘
//! ```

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::arrangement::{Footprint, fit_upright};
use super::margin_marks::ADVANCE_CAPS;
use crate::paper::{Orientation, PaperSize, PaperSpec, SolidSheets};
use crate::{Label, LineKind, SheetLayout, SheetLine, SheetText};
use deltille_core::lattice::{GridKind, Tile};
use deltille_core::polygon::rectangle;
use deltille_core::setting::Setting::PaperMarginMm;
use deltille_core::targets::format_mm;
use deltille_core::targets::{
    BoardSpec, Corner, Incircle, Panel, Polyhedron, SolidSpec, Target, TargetError, TargetSpec,
};
use deltille_core::words::counted;

/// Sides of the paper that is taken as it is, mm: what is printed at a desk. Else the page is an A4.
const AT_A_DESK_MM: [f64; 2] = [140.0, 360.0];
/// Capital heights of the name, of the steps and of small words, mm.
const NAME_CAP_MM: f64 = 6.0;
const STEP_CAP_MM: f64 = 2.3;
const SMALL_CAP_MM: f64 = 1.8;
/// Distance of the base lines of a step, and what a new step adds, mm.
const LINE_SPACING_MM: f64 = 4.6;
const STEP_SPACING_MM: f64 = 1.8;
/// Where the words of a step begin, after its number, mm.
const INDENT_MM: f64 = 6.0;
/// Height of the ruler with its numbers, mm, and the length of its longest marks.
const RULER_MM: f64 = 9.0;
const MARK_MM: f64 = 4.0;
/// Blank between name, picture, steps and ruler, mm.
const BLANK_MM: f64 = 5.0;
/// Least share of the room between name and ruler that the picture takes, and the most.
const PICTURE_SHARE: (f64, f64) = (0.35, 0.62);
/// Width of lines of the picture and of marks of the ruler, mm.
const THICK_MM: f64 = 0.3;
const THIN_MM: f64 = 0.15;
/// Pieces of a line of which each is hidden as a whole, or not at all.
const PIECES: usize = 60;
/// Most tiles of a board that are drawn in the picture: beyond this they run together.
const MOST_TILES: usize = 250;
/// Thickness of the plate in the picture, in its diagonals.
const PLATE_PART: f64 = 0.02;
/// Sides of the polygon that stands for a circle.
const DISC_SIDES: usize = 24;
/// Heights of the lines by which a black tile is hatched, in its own.
const HATCHING: [f64; 6] = [0.0, 0.16, 0.32, 0.48, 0.64, 0.8];
/// Length of the axes in the picture, mm.
const AXIS_MM: f64 = 12.0;
/// Faces seen at a lower angle than this sine have no number.
const LEAST_SINE: f64 = 0.2;
/// Capital heights of the numbers of faces, mm.
const NUMBER_CAP_MM: std::ops::RangeInclusive<f64> = 1.5..=6.0;
/// From where solids are seen, and in the frame of its panel a board.
const SOLID_FROM: DVec3 = DVec3::new(0.55, -0.75, 0.42);
const BOARD_FROM: DVec3 = DVec3::new(-0.3, 0.4, 0.85);

/// The page for a target that was laid out on `paper`.
pub(crate) fn sheet(
    title: &str,
    target: &Target,
    sheets: &[SheetLayout],
    paper: &PaperSpec,
) -> Result<SheetLayout, TargetError> {
    let paper = PaperSpec {
        size: Some(at_a_desk(paper)),
        orientation: Orientation::Portrait,
        ..paper.clone()
    };
    // Whatever room the bars along the margins leave; a board as small as this fits in any case.
    let small = Footprint {
        width: 50.0,
        height: 100.0,
        edge_blank: paper.margin_mm,
        mark_blank: BLANK_MM,
        is_centred: false,
    };
    let arrangement = fit_upright(&small, &paper)?.ok_or_else(|| {
        let problem =
            format!("{} leaves no room for the guide: take less", format_mm(paper.margin_mm));
        TargetError::invalid(PaperMarginMm, problem)
    })?;
    let mut sheet = arrangement.sheet(0, [0.0; 4], description(title, target));
    sheet.placements.clear();
    let [left, lower, right, upper] = arrangement.clear_mm();
    let (least, most) = (DVec2::new(left, lower + BLANK_MM), DVec2::new(right - BLANK_MM, upper));
    Ok(Page { sheet, least, most }.filled(target, sheets, &paper))
}

/// The paper itself where it is printed at a desk, else an A4.
fn at_a_desk(paper: &PaperSpec) -> PaperSize {
    let fits = |size: &&PaperSize| {
        let DVec2 { x, y } = size.portrait_mm();
        (AT_A_DESK_MM[0]..=AT_A_DESK_MM[1]).contains(&x) && y <= AT_A_DESK_MM[1]
    };
    let own = paper.size.as_ref().filter(fits).cloned();
    own.unwrap_or_else(|| PaperSize::automatic().next().expect("A4 is one of them"))
}

/// What the target is, in a line.
fn description(title: &str, target: &Target) -> String {
    let what = if matches!(target.spec, TargetSpec::Circles(_)) { "circle" } else { "corner" };
    let corners: usize = target.panels.iter().map(|panel| panel.corners.len()).sum();
    let mut parts = vec![title.to_owned(), "guide".to_owned(), counted(corners, what)];
    for kind in target.tilings() {
        if let Some((family, ids)) = target.tags_of_tiling(kind).filter(|(_, ids)| !ids.is_empty())
        {
            parts.push(format!("{} of {}", counted(ids.len(), "tag"), family.name));
        }
    }
    parts.push(format!("deltille {}", env!("CARGO_PKG_VERSION")));
    parts.join(" · ")
}

/// The page, and what of it is still free, mm.
struct Page {
    sheet: SheetLayout,
    least: DVec2,
    most: DVec2,
}

impl Page {
    fn filled(mut self, target: &Target, sheets: &[SheetLayout], paper: &PaperSpec) -> SheetLayout {
        self.most.y -= NAME_CAP_MM;
        self.text(target.name.to_string(), DVec2::new(self.least.x, self.most.y), NAME_CAP_MM);
        self.most.y -= BLANK_MM;
        self.ruler();
        let steps = self.wrapped(&steps(target, sheets, paper));
        let room = self.most.y - self.least.y;
        let height = (room - height(&steps) - BLANK_MM)
            .clamp(PICTURE_SHARE.0 * room, PICTURE_SHARE.1 * room);
        let lower = DVec2::new(self.least.x, self.most.y - height);
        self.pictures(target, [lower, self.most]);
        self.most.y -= height + BLANK_MM;
        self.steps(steps);
        self.sheet
    }

    fn text(&mut self, text: String, at_mm: DVec2, cap_height_mm: f64) {
        let max_width_mm = self.most.x - at_mm.x;
        let (text, angle_rad) = (Label::Words(text), 0.0);
        self.sheet.texts.push(SheetText { text, at_mm, angle_rad, cap_height_mm, max_width_mm });
    }

    /// A text whose middle is at a place.
    fn centred(&mut self, text: String, middle: DVec2, cap_mm: f64) {
        let width = text.chars().count() as f64 * ADVANCE_CAPS * cap_mm;
        self.text(text, middle - DVec2::new(width, cap_mm) / 2.0, cap_mm);
    }

    fn line(&mut self, from_mm: DVec2, to_mm: DVec2, width_mm: f64) {
        self.sheet.lines.push(SheetLine { kind: LineKind::Align, from_mm, to_mm, width_mm });
    }

    /// A ruler in centimetres and half centimetres, as long as finds room.
    fn ruler(&mut self) {
        let (base, start) = (self.least.y + SMALL_CAP_MM + 1.5, self.least.x + THIN_MM);
        let halves = ((self.most.x - start - SMALL_CAP_MM) / 5.0).floor() as u32;
        for half in 0..=halves {
            let foot = DVec2::new(start + 5.0 * f64::from(half), base);
            let is_whole = half.is_multiple_of(2);
            let height = if is_whole { MARK_MM } else { MARK_MM / 2.0 };
            self.line(foot, foot + height * DVec2::Y, THIN_MM);
            if is_whole {
                let below = foot - (1.2 + SMALL_CAP_MM / 2.0) * DVec2::Y;
                self.centred((half / 2).to_string(), below, SMALL_CAP_MM);
            }
        }
        let word = DVec2::new(start, base + MARK_MM + 1.2);
        self.text("Ruler, centimetres".to_owned(), word, SMALL_CAP_MM);
        self.least.y += RULER_MM + BLANK_MM;
    }

    /// The lines of each step, broken where the page ends.
    fn wrapped(&self, steps: &[String]) -> Vec<Vec<String>> {
        let room = self.most.x - self.least.x - INDENT_MM;
        let characters = (room / (ADVANCE_CAPS * STEP_CAP_MM)) as usize;
        let lines =
            |step: &String| step.lines().flat_map(|line| wrapped(line, characters)).collect();
        steps.iter().map(lines).collect()
    }

    /// The steps, numbered; smaller where the page would not take them.
    fn steps(&mut self, steps: Vec<Vec<String>>) {
        let scale = ((self.most.y - self.least.y) / height(&steps)).min(1.0);
        let mut y = self.most.y;
        for (step, lines) in steps.into_iter().enumerate() {
            let first = DVec2::new(self.least.x, y - scale * LINE_SPACING_MM);
            self.text(format!("{}.", step + 1), first, scale * STEP_CAP_MM);
            for line in lines {
                y -= scale * LINE_SPACING_MM;
                self.text(line, DVec2::new(self.least.x + INDENT_MM, y), scale * STEP_CAP_MM);
            }
            y -= scale * STEP_SPACING_MM;
        }
    }

    /// The target: a solid from two sides, of which one shows what the other hides.
    fn pictures(&mut self, target: &Target, [lower, upper]: [DVec2; 2]) {
        let front = Model::of(target);
        if front.numbers.is_empty() {
            self.picture(&front, [lower, upper]);
            return;
        }
        let middle = lower.midpoint(upper).x;
        self.picture(&front, [lower, DVec2::new(middle, upper.y)]);
        let back = Model { view: View::from(-front.view.towards, DVec3::Z), ..front };
        self.picture(&back, [DVec2::new(middle, lower.y), upper]);
    }

    /// What is to be built, as large as a rectangle takes it, and its axes.
    fn picture(&mut self, model: &Model, [lower, upper]: [DVec2; 2]) {
        let seen = model.faces.iter().flatten().map(|&point| model.view.projected(point));
        let seen: Vec<DVec2> = seen.collect();
        let bounds = [DVec2::min, DVec2::max]
            .map(|most| seen.iter().copied().reduce(most).unwrap_or_default());
        // The axes lie below a solid, which is seen twice, or at the left.
        let axes = match model.numbers.is_empty() {
            true => DVec2::new(2.0 * AXIS_MM, 0.0),
            false => DVec2::new(0.0, 2.0 * AXIS_MM),
        };
        let room = upper - lower - axes - BLANK_MM;
        let size = bounds[1] - bounds[0];
        let scale = (room.x / size.x).min(room.y / size.y);
        let middle = (lower + axes).midpoint(upper);
        let on_page = |point: DVec2| middle + scale * (point - bounds[0].midpoint(bounds[1]));
        for (line, width) in &model.lines {
            for [from, to] in model.seen_of(*line) {
                self.line(on_page(from), on_page(to), *width);
            }
        }
        for (face, number) in model.numbers.iter().enumerate() {
            self.number(model, face, number, scale, on_page);
        }
        let origin = lower + DVec2::splat(1.2 * AXIS_MM);
        for (axis, name) in [(DVec3::X, "x"), (DVec3::Y, "y"), (DVec3::Z, "z")] {
            let way = AXIS_MM * model.view.projected(axis);
            self.arrow(origin, origin + way, THICK_MM);
            let beside = origin + way + 2.5 * way.normalize_or_zero();
            self.centred(name.to_owned(), beside, STEP_CAP_MM);
        }
    }

    /// The number of a face, and an arrow towards its upper end, where it is seen well.
    fn number(
        &mut self,
        model: &Model,
        face: usize,
        number: &str,
        scale: f64,
        on_page: impl Fn(DVec2) -> DVec2,
    ) {
        let circle = Incircle::of(&model.faces[face]);
        let sine = circle.normal.dot(model.view.towards);
        if sine < LEAST_SINE || model.is_hidden(circle.centre, Some(face)) {
            return;
        }
        let cap = (0.5 * sine * circle.radius * scale).min(*NUMBER_CAP_MM.end());
        if cap < *NUMBER_CAP_MM.start() {
            return;
        }
        let along = circle.radius * model.up[face];
        let place = |share: f64| on_page(model.view.projected(circle.centre + share * along));
        self.centred(number.to_owned(), place(-0.15), cap);
        self.arrow(place(0.42), place(0.85), THIN_MM);
    }

    fn arrow(&mut self, from: DVec2, to: DVec2, width_mm: f64) {
        self.line(from, to, width_mm);
        let barb = (from - to).normalize_or_zero() * 1.8;
        for turn in [-0.45, 0.45] {
            self.line(to, to + DVec2::from_angle(turn).rotate(barb), width_mm);
        }
    }
}

/// How much the lines of the steps take, mm.
fn height(steps: &[Vec<String>]) -> f64 {
    let lines: usize = steps.iter().map(Vec::len).sum();
    lines as f64 * LINE_SPACING_MM + steps.len() as f64 * STEP_SPACING_MM
}

/// From where a model is seen, by parallel light.
#[derive(Clone, Copy)]
struct View {
    right: DVec3,
    up: DVec3,
    towards: DVec3,
}

impl View {
    /// Seen from a direction, the axis `upwards` upright in the picture.
    fn from(direction: DVec3, upwards: DVec3) -> Self {
        let towards = direction.normalize();
        let right = upwards.cross(towards).normalize();
        Self { right, up: towards.cross(right), towards }
    }

    fn projected(&self, point: DVec3) -> DVec2 {
        DVec2::new(point.dot(self.right), point.dot(self.up))
    }
}

/// What the picture shows, in the target frame, mm.
struct Model {
    view: View,
    /// The faces that hide what is behind them; of a solid those with numbers.
    faces: Vec<Vec<DVec3>>,
    /// Where the upper end of each of these is.
    up: Vec<DVec3>,
    numbers: Vec<String>,
    /// Lines with their widths on the page.
    lines: Vec<([DVec3; 2], f64)>,
}

impl Model {
    fn of(target: &Target) -> Self {
        match (&target.spec, target.panels.first()) {
            (TargetSpec::Solid(spec), _) => Self::of_solid(&spec.polyhedron(), &target.panels),
            (_, Some(panel)) => Self::of_board(panel),
            (_, None) => Self::blank(BOARD_FROM, DVec3::Y),
        }
    }

    fn blank(from: DVec3, upwards: DVec3) -> Self {
        let view = View::from(from, upwards);
        let (faces, up, numbers) = (Vec::new(), Vec::new(), Vec::new());
        Self { view, faces, up, numbers, lines: Vec::new() }
    }

    fn of_solid(solid: &Polyhedron, panels: &[Panel]) -> Self {
        let edges = solid
            .edges()
            .into_iter()
            .map(|ends| (ends.map(|end| solid.vertices_mm[end]), THICK_MM));
        Self {
            faces: (0..solid.faces.len()).map(|face| solid.corners_mm(face)).collect(),
            up: panels.iter().map(|panel| panel.pose.matrix().y_axis).collect(),
            numbers: (0..panels.len()).map(|face| face.to_string()).collect(),
            lines: edges.collect(),
            ..Self::blank(SOLID_FROM, DVec3::Z)
        }
    }

    /// A board on its plate, with its black tiles.
    fn of_board(panel: &Panel) -> Self {
        let at = |point: DVec2| panel.pose.target_from_panel(point);
        let plate = rectangle(panel.field_mm()).map(at);
        let front = panel.pose.matrix();
        let depth = PLATE_PART * plate[0].distance(plate[2]);
        let behind = plate.map(|corner| corner - depth * panel.pose.matrix().z_axis);
        let next = |i: usize| (i + 1) % 4;
        let rims = (0..4).map(|i| vec![plate[next(i)], plate[i], behind[i], behind[next(i)]]);
        let edges = (0..4).flat_map(|i| {
            [[plate[i], plate[next(i)]], [plate[i], behind[i]], [behind[i], behind[next(i)]]]
        });
        let tiles = tile_lines(panel).into_iter().map(|line| (line.map(at), THIN_MM));
        Self {
            faces: [plate.to_vec()].into_iter().chain(rims).collect(),
            lines: edges.map(|edge| (edge, THICK_MM)).chain(tiles).collect(),
            ..Self::blank(front * BOARD_FROM, front * DVec3::Y)
        }
    }

    /// The pieces of a line that no face hides, in the picture.
    fn seen_of(&self, [from, to]: [DVec3; 2]) -> Vec<[DVec2; 2]> {
        let at = |share: f64| from.lerp(to, share / PIECES as f64);
        let mut pieces: Vec<[usize; 2]> = Vec::new();
        for piece in (0..PIECES).filter(|&piece| !self.is_hidden(at(piece as f64 + 0.5), None)) {
            match pieces.last_mut() {
                Some([_, end]) if *end == piece => *end = piece + 1,
                _ => pieces.push([piece, piece + 1]),
            }
        }
        let ends = |piece: [usize; 2]| piece.map(|end| self.view.projected(at(end as f64)));
        pieces.into_iter().map(ends).collect()
    }

    /// Whether a face other than `own` is between a point and the eye.
    fn is_hidden(&self, point: DVec3, own: Option<usize>) -> bool {
        let others = self.faces.iter().enumerate().filter(|(index, _)| Some(*index) != own);
        others.into_iter().any(|(_, face)| self.hides(face, point))
    }

    /// Whether a flat, convex face hides a point: whether the ray from there to the eye passes through its inside.
    fn hides(&self, face: &[DVec3], point: DVec3) -> bool {
        let normal = (1..face.len() - 1)
            .map(|i| (face[i] - face[0]).cross(face[i + 1] - face[0]))
            .sum::<DVec3>()
            .normalize_or_zero();
        let slope = normal.dot(self.view.towards);
        let reach = face[0].distance(face[1]);
        let distance = normal.dot(face[0] - point) / slope;
        // Not what lies in the face itself, or in one seen edge-on.
        if slope.abs() < 1e-9 || distance < 1e-6 * reach {
            return false;
        }
        let through = point + distance * self.view.towards;
        (0..face.len()).all(|i| {
            let (a, b) = (face[i], face[(i + 1) % face.len()]);
            normal.cross(b - a).normalize_or_zero().dot(through - a) > 1e-6 * reach
        })
    }
}

/// Outlines and hatching of the black tiles of a panel, in its frame, mm; none where they are too many to be seen.
fn tile_lines(panel: &Panel) -> Vec<[DVec2; 2]> {
    let tiles = panel.dark_tiles();
    if tiles.len().max(panel.corners.len()) > MOST_TILES || panel.corners.is_empty() {
        return Vec::new();
    }
    if let Some(diameter) = panel.discs_mm {
        let rim = |corner: &Corner, n: usize| {
            let angle = TAU * n as f64 / DISC_SIDES as f64;
            corner.panel_mm + diameter / 2.0 * DVec2::from_angle(angle)
        };
        let of_disc = |corner| (0..DISC_SIDES).map(move |n| [rim(corner, n), rim(corner, n + 1)]);
        return panel.corners.iter().flat_map(of_disc).collect();
    }
    let of_tile = |tile: Tile| {
        let [a, b, c] = tile.frame().map(|vertex| panel.lattice_mm(vertex));
        let last = match panel.kind {
            GridKind::Deltille => c,
            GridKind::Checker => b + c - a,
        };
        let sides = [[a, c], [b, last]];
        // Of a triangle it is a point.
        let top = (panel.kind == GridKind::Checker).then_some([c, last]);
        let hatched = HATCHING.map(|part| sides.map(|[foot, top]| foot.lerp(top, part)));
        sides.into_iter().chain(top).chain(hatched)
    };
    tiles.into_iter().flat_map(of_tile).collect()
}

/// What to do with the sheets of a target.
fn steps(target: &Target, sheets: &[SheetLayout], paper: &PaperSpec) -> Vec<String> {
    let name = &target.name;
    let mut steps = vec![
        "Print at 100 %, without \"fit to page\", on matt paper. Measure the lines of stated length on each sheet, \
         across and along: if they are off, print again, or multiply all lengths by what you found."
            .to_owned(),
    ];
    match &target.spec {
        TargetSpec::Solid(spec) => steps.extend(steps_of_solid(spec, paper)),
        _ => steps.extend(steps_of_board(target, sheets)),
    }
    match &target.spec {
        TargetSpec::Circles(_) => steps.push(format!(
            "Keep {name}.json: target_mm says where every circle is, in the order in which OpenCV's findCirclesGrid finds them."
        )),
        TargetSpec::Solid(SolidSpec { tags: None, .. }) => steps.push(format!(
            "Keep {name}.json: target_mm says where every corner is. Without tags faces look alike: this finds their corners as \
             grids, and which face a grid is must be told by other means before a camera can be made of it:\n\
             deltille detect photos --target {name}.json -o corners"
        )),
        _ => {
            steps.push(format!(
                "Keep {name}.json: it says where every corner is. To find corners in photographs:\n\
                 deltille detect photos --target {name}.json -o corners"
            ));
            steps.push(format!(
                "Ten photographs or more, near, tilted and to the rims, make a camera:\n\
                 deltille calibrate corners --target {name}.json --model auto --report camera.html"
            ));
        }
    }
    steps
}

fn steps_of_board(target: &Target, sheets: &[SheetLayout]) -> Vec<String> {
    let mut steps = Vec::new();
    if sheets.iter().any(|sheet| !sheet.pages.is_empty()) {
        let trim = "Trim pages along the line at their left and upper end, and lay them on the crosses of the pages that they name.";
        steps.push(trim.to_owned());
    }
    if sheets.iter().any(|sheet| sheet.placements.len() > 1) {
        steps.push("Cut the boards apart along the lines; each has a label of its own.".to_owned());
    }
    let flat = "Lay a straightedge on it: what bends by a millimetre is worth less than a smaller board that does not.";
    steps.push(match &target.spec {
        TargetSpec::Board(BoardSpec { two_sided_mm: Some(mm), .. }) => format!(
            "Cut both sides from mark to mark and glue them without bubbles on the two sides of a plate that stays flat and is as \
             large, so that they are {} apart with their paper; or print them on the plate, turned about its upright edge. The \
             marks of one side lie behind those of the other. {flat}",
            format_mm(*mm)
        ),
        _ => format!(
            "Glue it without bubbles on a plate that stays flat: glass, aluminium composite or a stone tile, larger than the \
             tiles by a fifth of an edge all around. {flat}"
        ),
    });
    steps
}

fn steps_of_solid(spec: &SolidSpec, paper: &PaperSpec) -> Vec<String> {
    let mut steps = Vec::new();
    match (paper.solids, &spec.skeleton) {
        (SolidSheets::PerFace, skeleton) => {
            let onto = match skeleton {
                Some(_) => {
                    "Glue each panel on the seat of its number in the printed skeleton, its edges as numbered: edges of \
                            the same number meet."
                }
                None => {
                    "Glue each face where the picture has its number, its edges as numbered: edges of the same number meet."
                }
            };
            steps.push(
                "Cut each face from mark to mark, with a ruler and a sharp knife.".to_owned(),
            );
            steps.push(onto.to_owned());
        }
        (_, skeleton) => {
            steps.push(
                "Cut along lines that are drawn through. Score dashed lines and fold them away from the print; score dash-dotted \
                 ones from behind and fold them towards it; leave dotted ones."
                    .to_owned(),
            );
            steps.push(
                "Glue tabs under the faces that they name: edges of the same number meet. Begin with one vertex and close \
                 the solid last where it stands."
                    .to_owned(),
            );
            if skeleton.is_some() {
                steps.push("Or cut the faces apart, and glue each on the seat of its number in the printed skeleton.".to_owned());
            }
        }
    }
    steps.push(
        "Compare with the pictures: numbers run as printed, arrows show the upper end of each face."
            .to_owned(),
    );
    let by_hand = "By hand faces come to lie within some tenths of a millimetre.";
    steps.push(match spec.tags {
        Some(_) => format!(
            "{by_hand} With several cameras or many views, deltille rig --refine-target measures where they are."
        ),
        None => by_hand.to_owned(),
    });
    steps
}

/// A text in lines of at most so many characters, broken at blanks.
fn wrapped(text: &str, most: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= most => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Printing;
    use deltille_core::targets::SolidShape;

    fn guide(spec: impl Into<TargetSpec>) -> SheetLayout {
        let target = Printing::new("target", spec).unwrap();
        sheet("target", &target.target, &target.sheets, &PaperSpec::default()).unwrap()
    }

    /// Of an icosahedron that hides nothing but its own back, every edge of a face towards the eye is seen, whole, and
    /// no other.
    #[test]
    fn a_convex_solid_shows_the_faces_towards_the_eye() {
        let solid = SolidSpec::new(SolidShape::Icosahedron);
        let target = Printing::new("target", solid.clone()).unwrap();
        let model = Model::of(&target.target);
        let (polyhedron, edges) = (solid.polyhedron(), solid.polyhedron().edges());
        let is_front = |face: usize| polyhedron.normal(face).dot(model.view.towards) > 0.0;
        for (edge, (line, _)) in edges.iter().zip(&model.lines) {
            let mut faces =
                (0..20).filter(|&f| edge.iter().all(|v| polyhedron.faces[f].contains(v)));
            let seen = model.seen_of(*line);
            assert_eq!(!seen.is_empty(), faces.any(is_front), "{edge:?}");
            let length: f64 = seen.iter().map(|[a, b]| a.distance(*b)).sum();
            let [a, b] = line.map(|end| model.view.projected(end));
            assert!(seen.is_empty() || (length - a.distance(b)).abs() < 1e-9, "{edge:?}");
        }
    }

    #[test]
    fn everything_lies_on_the_page_and_says_what_to_do() {
        let board = guide(BoardSpec::deltille(10, 11, 20.0));
        let solid = guide(SolidSpec::new(SolidShape::Cube));
        let bare = guide(SolidSpec { tags: None, ..SolidSpec::new(SolidShape::Cube) });
        for (sheet, words) in
            [(&board, "bubbles"), (&solid, "Score dashed"), (&bare, "faces look alike")]
        {
            assert_eq!((sheet.width_mm, sheet.height_mm), (210.0, 297.0));
            let on_page =
                |p: DVec2| p.cmpge(DVec2::splat(5.0)).all() && p.x <= 205.0 && p.y <= 292.0;
            assert!(sheet.lines.iter().all(|line| on_page(line.from_mm) && on_page(line.to_mm)));
            let says = |words| sheet.texts.iter().any(|t| t.text.to_string().contains(words));
            assert!(says(words));
            // What cannot label bare faces is not proposed for them.
            let is_bare = std::ptr::eq(sheet, &bare);
            assert_eq!(says("deltille calibrate"), !is_bare);
            assert!(!(is_bare && says("deltille rig")));
        }
    }
}
