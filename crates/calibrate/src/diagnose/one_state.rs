//! Tests whether the camera had the same state in all views, and whether the board matches its
//! description.
//!
//! ```text
//!   change     views 1 … k | k + 1 … n     a focal length or principal point for each group; every k is tried
//!   shutter    a displacement of the board in every view while the rows are read
//!   stretch    x and y of the board in another ratio than described
//! ```
//!
//! Each is a score test on [`StateEquations`]. Standard deviations come from the scatter between
//! views, so that errors of the model and of the board, which differ between views, are not
//! mistaken for a change. Stretch, shear and bend of the board are unknowns of each test: a bent
//! board seen first from one side and later from the other is not a change of the camera. A change
//! is also not reported if a drift, or the tilt and the distance of the board, explain it equally
//! well: many image sequences begin with frontal views and end with oblique ones.

use crate::problem::whitening::OUTLIER_SIGMA;
use crate::uncertainty::state_equations::{
    Candidate, Column, Effect, Fit, StateEquations, significance,
};
use deltille_core::camera::Camera;
use deltille_core::statistics::f_p_value;

/// Significance level of each of the three tests, so that it is 1 % for all three together. In the
/// test for a change, it applies to the search over all k as a whole.
const SIGNIFICANT: f64 = 0.01 / 3.0;

/// Minimum number of views before and after a change: two, and one more to test them.
const MIN_VIEWS: usize = 3;

/// Maximum fraction of the squares that may remain after displacements during readout are modelled:
/// the residual must halve. Another lens model and a bent board leave most of their pattern in
/// other directions.
const MAX_LEFT: f64 = 0.25;

/// Minimum displacement at the edge of the image that counts as a change, in standard deviations of
/// a corner: the limit of an outlier. Smaller changes, such as those of a lens that warms up, are
/// covered by the uncertainties, see [`crate::uncertainty::split_halves`].
const MIN_CHANGE: f64 = OUTLIER_SIGMA;

/// Minimum stretch that implies another board or a print scaled to its page: printers feed paper
/// with errors of a few tenths of a per cent.
const MIN_STRETCH: f64 = 0.005;

/// Limit of the sum of three squares above which a single view shows a displacement. Noise exceeds
/// it in one of a thousand views.
const OF_VIEW: f64 = 16.27;

/// The intrinsic that changed between views. Zoom and focus change the focal length; stabilised and shifted lenses move
/// the principal point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChangedIntrinsic {
    /// The focal length.
    Focal,
    /// The principal point in x.
    CentreX,
    /// The principal point in y.
    CentreY,
}

impl ChangedIntrinsic {
    const ALL: [Self; 3] = [Self::Focal, Self::CentreX, Self::CentreY];

    /// Its value, px; for the focal length, that in x.
    pub(crate) fn of(self, camera: &Camera) -> f64 {
        match self {
            Self::Focal => camera.focal_px.x,
            Self::CentreX => camera.centre_px.x,
            Self::CentreY => camera.centre_px.y,
        }
    }

    /// Its index among the parameters of a camera.
    fn parameter(self) -> usize {
        match self {
            Self::Focal => 0,
            Self::CentreX => 2,
            Self::CentreY => 3,
        }
    }

    fn candidate(self) -> Candidate {
        match self {
            Self::Focal => Candidate::Focal,
            Self::CentreX => Candidate::CentreX,
            Self::CentreY => Candidate::CentreY,
        }
    }
}

/// A change of the camera between the first views and the others.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct CameraChange {
    /// The intrinsic that changed.
    pub intrinsic: ChangedIntrinsic,
    /// Name of the first view after the change.
    pub from_view: String,
    /// Numbers of views before and after the change.
    pub views: [usize; 2],
    /// The intrinsic before and after the change, px; for the focal length, that in x.
    pub value_px: [f64; 2],
    /// Standard deviation of their difference, px.
    pub sd_px: f64,
    /// Probability that an unchanged camera shows a difference at least this large at any view.
    pub significance: f64,
    /// RMS residual per axis with the change modelled, px.
    pub left_px: f64,
}

impl CameraChange {
    /// Returns the values before and after, px, if this intrinsic changed.
    pub fn of(&self, intrinsic: ChangedIntrinsic) -> Option<[f64; 2]> {
        (self.intrinsic == intrinsic).then_some(self.value_px)
    }
}

/// Rows displaced relative to each other, for example by a rolling shutter while the board moves.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct RollingShutter {
    /// Displacement between the first and the last row of the image, px; the RMS over the views.
    pub shear_px: f64,
    /// Number of views that show it individually.
    pub views: usize,
    /// Probability that noise alone makes residuals agree this well with displacements of rows.
    pub significance: f64,
    /// RMS residual per axis with the displacements modelled, px.
    pub left_px: f64,
}

/// A board stretched in one direction relative to its description.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct BoardStretch {
    /// Length along x over length along y, each relative to the description; less than 1 if the board is longer along
    /// y.
    pub ratio: f64,
    /// Standard deviation of the ratio.
    pub sd: f64,
    /// Probability that a board that matches its description shows a ratio at least this extreme.
    pub significance: f64,
    /// RMS residual per axis with the stretch modelled, px.
    pub left_px: f64,
}

/// The changes of state that the views of a camera show.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct State {
    pub change: Option<CameraChange>,
    pub shutter: Option<RollingShutter>,
    pub stretch: Option<BoardStretch>,
}

impl State {
    /// Tests the views of a camera; `name` gives the name of a frame.
    pub(crate) fn of(
        equations: &StateEquations,
        camera: &Camera,
        name: impl Fn(usize) -> String,
    ) -> Self {
        let stretch = stretch(equations);
        let step = step(equations);
        let change = step.as_ref().and_then(|step| {
            let &Step { intrinsic, first, effect, significance, ref fit } = step;
            let left_px = equations.px() * fit.variance().sqrt();
            // Units: relative for the focal length, px for the principal point; and px at the edge of the image.
            let (scale, at_edge) = match intrinsic {
                ChangedIntrinsic::Focal => (camera.focal_px.x, f64::from(camera.width) / 2.0),
                ChangedIntrinsic::CentreX | ChangedIntrinsic::CentreY => (1.0, 1.0),
            };
            if at_edge * effect.value.abs() < MIN_CHANGE * left_px {
                return None;
            }
            // The fit describes the camera of the first group.
            let parameter = intrinsic.parameter();
            let change_px = equations.change_px(fit, parameter, intrinsic.candidate(), scale);
            let before = intrinsic.of(camera) + change_px;
            Some(CameraChange {
                intrinsic,
                from_view: name(equations.views.get(first)?.frame),
                views: [first, equations.count() - first],
                value_px: [before, before + scale * effect.value],
                sd_px: scale * effect.sd,
                significance,
                left_px,
            })
        });
        // One linear step leaves a part of a stretch, which may be mistaken for a rolling shutter.
        // Several displacements by a shutter may be mistaken for a stretch.
        let shutter = shutter(equations, step.as_ref());
        let (stretch, shutter) = match (stretch, shutter) {
            (Some((stretch, true)), Some(_)) => (Some(stretch), None),
            (Some((_, false)), Some(shutter)) => (None, Some(shutter)),
            (stretch, shutter) => (stretch.map(|(stretch, _)| stretch), shutter),
        };
        Self { change, shutter, stretch }
    }
}

/// The columns of the camera and of the board.
fn base(equations: &StateEquations) -> Vec<Column> {
    let mut columns = equations.camera();
    if equations.is_of_one_panel {
        columns.extend(Candidate::SHEET.map(|candidate| equations.column(candidate)));
    }
    columns
}

/// A change at a view.
struct Step {
    intrinsic: ChangedIntrinsic,
    first: usize,
    effect: Effect,
    significance: f64,
    fit: Fit,
}

impl Step {
    fn column(intrinsic: ChangedIntrinsic, first: usize, equations: &StateEquations) -> Column {
        equations.weighted(intrinsic.candidate(), after(first, equations.count()))
    }
}

pub(crate) fn after(first: usize, count: usize) -> Vec<f64> {
    (0..count).map(|view| f64::from(u8::from(view >= first))).collect()
}

/// The most significant change, if it is significant.
///
/// The standard deviation of a change needs a fit without each view in turn. It is at least that from noise, whose
/// significance therefore bounds that of the change, and follows from sums over the views before and after it.
fn step(equations: &StateEquations) -> Option<Step> {
    let count = equations.count();
    let tried = ((count + 1).saturating_sub(2 * MIN_VIEWS) * ChangedIntrinsic::ALL.len()) as f64;
    let corrected = |effect: Effect| (tried * significance(effect)).min(1.0);
    let mut all: Vec<(f64, usize, ChangedIntrinsic)> = Vec::new();
    for intrinsic in ChangedIntrinsic::ALL {
        let effects = equations.changes_from_noise(&base(equations), intrinsic.candidate());
        for (first, effect) in effects.into_iter().enumerate() {
            let is_place = first >= MIN_VIEWS && first + MIN_VIEWS <= count;
            if let (true, Some(effect)) = (is_place, effect) {
                all.push((corrected(effect), first, intrinsic));
            }
        }
    }
    // Of equally significant changes, the first is reported.
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut best: Option<Step> = None;
    for (bound, first, intrinsic) in all {
        if bound >= best.as_ref().map_or(SIGNIFICANT, |best| best.significance) {
            break;
        }
        let mut columns = base(equations);
        columns.push(Step::column(intrinsic, first, equations));
        let Some(fit) = equations.fit(&columns) else { continue };
        // One degree of freedom for the mean of each group.
        let Some(effect) = fit.effect(columns.len() - 1, 2.0) else { continue };
        let significance = corrected(effect);
        if best.as_ref().is_none_or(|best| significance < best.significance) {
            best = Some(Step { intrinsic, first, effect, significance, fit });
        }
    }
    let best = best.filter(|best| best.significance < SIGNIFICANT)?;
    let smooth = smooth(best.intrinsic, equations)?;
    (best.fit.left < smooth.left).then_some(best)
}

/// The fit of an intrinsic that drifts from the first view to the last, and follows the tilt and the distance of the
/// board. A lens that warms up drifts; errors of the model or of the measured board follow tilt and distance.
fn smooth(intrinsic: ChangedIntrinsic, equations: &StateEquations) -> Option<Fit> {
    let views = equations.views.iter().enumerate();
    let of_view = views.map(|(i, view)| [i as f64, view.obliquity, view.log_distance]);
    let of_view: Vec<[f64; 3]> = of_view.collect();
    let mut columns = base(equations);
    columns.extend((0..3).map(|of| {
        let weights = of_view.iter().map(|values| values[of]).collect();
        equations.weighted(intrinsic.candidate(), weights)
    }));
    equations.fit(&columns)
}

fn shutter(equations: &StateEquations, changed: Option<&Step>) -> Option<RollingShutter> {
    let columns = || {
        let step = changed.map(|step| Step::column(step.intrinsic, step.first, equations));
        base(equations).into_iter().chain(step).collect::<Vec<Column>>()
    };
    let plain = equations.fit(&columns())?;
    let moving = equations.fit_with_each(&columns(), &Candidate::SHUTTER)?;
    let unknowns = (Candidate::SHUTTER.len() * equations.count()) as f64;
    if moving.freedom <= 0.0 {
        return None;
    }
    let f_ratio = (plain.left - moving.left) / unknowns / moving.variance();
    let significance = f_p_value(f_ratio, unknowns, moving.freedom);
    if significance > SIGNIFICANT || moving.variance() > MAX_LEFT * plain.variance() {
        return None;
    }
    let moves = equations.each(&columns(), &moving, &Candidate::SHUTTER)?;
    let shears = equations
        .views
        .iter()
        .zip(&moves)
        .map(|(view, (by_mm, _))| (view.px_per_mm * by_mm[0].hypot(by_mm[1])).powi(2));
    let shear_px = (shears.sum::<f64>() / moves.len().max(1) as f64).sqrt();
    let of_view = |(_, squares): &&(Vec<f64>, f64)| *squares > OF_VIEW * moving.variance();
    let views = moves.iter().filter(of_view).count();
    let left_px = equations.px() * moving.variance().sqrt();
    Some(RollingShutter { shear_px, views, significance, left_px })
}

/// The stretch, and whether the columns of the board explain most of the squares.
fn stretch(equations: &StateEquations) -> Option<(BoardStretch, bool)> {
    if !equations.is_of_one_panel || equations.count() < MIN_VIEWS {
        return None;
    }
    let columns = base(equations);
    let fit = equations.fit(&columns)?;
    // The stretch is the first of the board's columns.
    let effect = fit.effect(columns.len() - Candidate::SHEET.len(), 1.0)?;
    let significance = significance(effect);
    let ratio = (1.0 + effect.value) / (1.0 - effect.value);
    let is_large = (ratio - 1.0).abs() > MIN_STRETCH;
    let plain = equations.fit(&equations.camera())?;
    let is_most = fit.variance() < MAX_LEFT * plain.variance();
    let left_px = equations.px() * fit.variance().sqrt();
    let found = BoardStretch { ratio, sd: 2.0 * effect.sd, significance, left_px };
    (significance < SIGNIFICANT && is_large).then_some((found, is_most))
}
