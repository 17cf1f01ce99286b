//! What a calibration that does not fit may come from, in words, for a page and for a terminal.

use deltille_core::calibrate::{
    Instead, Misfit, Model, PanelRef, Remedy, RigCamera, RigSolution, Solution,
};

/// Corners are found to a few hundredths of a pixel; a camera that leaves more than this does not
/// have the lens of the model.
const POOR_RMS_PX: f64 = 1.0;

/// What was given and not found, which may be at fault.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Given {
    /// The model of the lens; `None` where the camera was given.
    pub model: Option<Model>,
    /// How the print came out, where that was given.
    pub print_scale: Option<[f64; 2]>,
    /// What makes it fit.
    pub remedy: Option<Remedy>,
}

/// Why residuals are no noise: a sentence for each cause, without capital and full stop; none where
/// nothing speaks for one.
pub fn causes(solution: &Solution, given: Given) -> Vec<String> {
    let of_target = |misfit: &&Misfit| matches!(misfit, Misfit::Target { .. });
    let of_panels = given.remedy.is_some_and(|remedy| remedy.instead == Instead::Panels);
    // Where panels are moved their corners tell most of it.
    let told: Vec<&Misfit> = match of_panels {
        true => solution.misfits.iter().filter(of_target).collect(),
        false => solution.misfits.iter().collect(),
    };
    if let Some(Remedy { instead, rms_px }) = given.remedy
        && (!of_panels || told.is_empty())
    {
        let (cause, found) = match instead {
            Instead::Shape => (board(false, given), "the shape of the board".to_owned()),
            Instead::Panels => (moved_panels(None), "the place of every panel".to_owned()),
            Instead::Camera => (GIVEN_CAMERA.to_owned(), "the camera".to_owned()),
            Instead::Model(other) => match given.model {
                Some(model) => (
                    format!("the lens is not one of `{model}`: take --model {other}"),
                    format!("a lens of `{other}`"),
                ),
                None => (GIVEN_CAMERA.to_owned(), format!("a lens of `{other}`")),
            },
        };
        return vec![format!(
            "corners are off by {:.3} px, and by {rms_px:.3} px where {found} is found: {cause}",
            solution.inlier_rms_px()
        )];
    }
    let is_solid = solution.views.iter().any(|view| {
        let mut panels = view.corners.iter().map(|corner| corner.panel);
        let first = panels.next();
        panels.any(|panel| Some(panel) != first)
    });
    let cause = |misfit: &Misfit| match *misfit {
        Misfit::Lens { rms_px, .. } => {
            format!(
                "residuals leave a pattern of {rms_px:.3} px over the image: {}",
                lens(given.model)
            )
        }
        Misfit::Target { rms_px, rms_mm, panel } if is_solid => {
            format!("{}: {}", beside(rms_px, rms_mm), moved_panels(Some(panel)))
        }
        Misfit::Target { rms_px, rms_mm, .. } => {
            format!("{}: {}", beside(rms_px, rms_mm), board(solution.shape.is_some(), given))
        }
    };
    let mut causes: Vec<String> = told.into_iter().map(cause).collect();
    // A few wild corners are no fault of the model.
    let rms_px = solution.inlier_rms_px();
    if rms_px > POOR_RMS_PX && causes.is_empty() {
        causes.push(format!(
            "corners are off by {rms_px:.1} px: {}, or labels are wrong",
            lens(given.model)
        ));
    }
    causes
}

/// The same of a rig: which cameras were given, which of them are wrong, and whether panels were moved.
pub fn causes_of_rig(
    solution: &RigSolution,
    model: Model,
    is_given: impl Fn(&str) -> bool,
    wrong: &[usize],
    refined: bool,
) -> Vec<String> {
    let model_of = |name: &str| (!is_given(name)).then_some(model);
    let cause = |misfit: &Misfit| match *misfit {
        Misfit::Lens { camera, rms_px } => {
            let name = &solution.cameras[camera].name;
            format!(
                "camera {name}: residuals leave a pattern of {rms_px:.3} px over the image: {}",
                lens(model_of(name))
            )
        }
        Misfit::Target { rms_px, rms_mm, panel } => {
            let advice = match (solution.panels.len(), refined) {
                (1, _) => "the board is not flat or not printed as stated: take the .json of \
                           `calibrate --board-shape` as --shape"
                    .to_owned(),
                (_, false) => format!(
                    "panels are not where the target's file has them, most of all panel {panel}: \
                     try --refine-target"
                ),
                (_, true) => format!(
                    "panels are not flat or not printed as stated, most of all panel {panel}"
                ),
            };
            format!("{}: {advice}", beside(rms_px, rms_mm))
        }
    };
    let of_wrong = wrong.iter().map(|&camera| {
        let RigCamera { name, inlier_rms_px, .. } = &solution.cameras[camera];
        format!("camera {name}: corners are off by {inlier_rms_px:.3} px: {GIVEN_CAMERA}")
    });
    let mut causes: Vec<String> = of_wrong.collect();
    // A wrong camera moves everything else with it.
    if causes.is_empty() {
        causes.extend(solution.misfits.iter().map(cause));
    }
    let named = |camera: usize| {
        let of_camera = |m: &Misfit| matches!(m, Misfit::Lens { camera: c, .. } if *c == camera);
        wrong.contains(&camera) || solution.misfits.iter().any(of_camera)
    };
    for (index, camera) in solution.cameras.iter().enumerate() {
        if camera.inlier_rms_px > POOR_RMS_PX && !named(index) {
            causes.push(format!(
                "camera {}: corners are off by {:.1} px: {}, or labels are wrong",
                camera.name,
                camera.inlier_rms_px,
                lens(model_of(&camera.name))
            ));
        }
    }
    causes
}

/// What follows from parameters that the views leave open; `sufficient` is a smaller model that holds
/// the lens as well.
pub fn cannot_tell_apart(parameters: &[String], sufficient: Option<Model>) -> String {
    let advice = match sufficient {
        Some(model) => format!("take --model {model}, which holds this lens as well"),
        None => "fill the corners of the image, or choose a model with fewer parameters".to_owned(),
    };
    format!(
        "the views cannot tell apart {}: their numbers mean nothing by themselves; where corners were \
         seen the camera is right, beyond them it may not be; {advice}",
        parameters.join(", ")
    )
}

fn beside(rms_px: f64, rms_mm: f64) -> String {
    format!(
        "corners lie {rms_mm:.2} mm beside their places on the target, in all views alike ({rms_px:.3} px)"
    )
}

fn moved_panels(most: Option<PanelRef>) -> String {
    let most = most.map_or(String::new(), |panel| format!(", most of all panel {panel}"));
    format!(
        "panels are not where the target's file has them{most}: `deltille rig --refine-target` finds where \
         they are"
    )
}

const GIVEN_CAMERA: &str =
    "the camera that was given is another one, or has changed since (lens, focus, zoom, crop)";

fn lens(model: Option<Model>) -> String {
    let Some(model) = model else {
        return GIVEN_CAMERA.to_owned();
    };
    match model.richer().iter().map(|model| format!("`{model}`")).collect::<Vec<_>>().as_slice() {
        [] => format!("the lens is not one of `{model}`, nor of any richer model here"),
        models => format!("the lens is not one of `{model}`: try --model {}", models.join(" or ")),
    }
}

fn board(shape_found: bool, given: Given) -> String {
    let scale = match given.print_scale {
        Some([across, up]) => format!("--print-scale {across},{up} is not how it was printed, or "),
        None => String::new(),
    };
    let bars = match given.print_scale {
        Some(_) => "measure its check bars again",
        None => "measure its check bars for --print-scale",
    };
    match (shape_found, given.model) {
        (true, _) => format!(
            "{scale}the board is bent in more ways than --board-shape describes, or not the same in all \
             views: glue it on something flat, {bars}"
        ),
        (false, Some(_)) => format!(
            "{scale}the board is not flat or not printed as stated: try --board-shape, {bars}"
        ),
        (false, None) => format!(
            "{scale}the board is not flat or not printed as stated, or the camera that was given is \
             another one: take the .json of `calibrate --board-shape` as --shape, {bars}"
        ),
    }
}
