use deltille_core::calibrate::{Finding, Moved, Shared};
use deltille_core::words::counted;

/// Names that findings are told with.
#[derive(Clone, Copy, Debug)]
pub struct Named<'a> {
    /// Name of every camera of a rig; empty for a single camera.
    pub cameras: &'a [&'a str],
}

/// A panel that is turned by less looks only moved.
const TURNED_DEG: f64 = 0.05;

impl Named<'_> {
    /// What outliers share, as a sentence without capital and full stop.
    pub fn sentence(self, finding: &Finding) -> String {
        let Finding { shared, outliers, corners, left_out } = finding;
        let of = |camera: &usize, what: String| match self.cameras.get(*camera) {
            Some(name) => format!("camera {name}, {what}"),
            None => what,
        };
        let count = match outliers {
            1 => format!("1 of {} is an outlier", counted(*corners, "corner")),
            n => format!("{n} of {} are outliers", counted(*corners, "corner")),
        };
        let text = match shared {
            Shared::Beyond { camera, view } => {
                let far = counted(*outliers, "corner");
                let who = of(camera, format!("view {view}"));
                return format!("{who}: {far} of {corners} far outside the picture, left out");
            }
            Shared::Panel { panel, moved } => {
                let why = match moved {
                    Some(Moved { by_mm, turned_rad }) => {
                        let degrees = turned_rad.to_degrees();
                        let turned = match degrees >= TURNED_DEG {
                            true => format!(" and turned by {degrees:.1}°"),
                            false => String::new(),
                        };
                        format!(
                            "it seems displaced by {by_mm:.2} mm{turned} from where the target's file has \
                             it (`deltille rig --refine-target` finds where panels are)"
                        )
                    }
                    None => {
                        "no place of it explains them: wrong labels, a sheet that is not flat, or \
                             another print"
                            .to_owned()
                    }
                };
                format!("panel {panel}: {count}: {why}")
            }
            Shared::PanelInView { panel, camera, view, off_px } => {
                let who = of(camera, format!("view {view}, panel {panel}"));
                format!(
                    "{who}: its corners are off by {off_px:.1} px where the view's others fit: wrong labels"
                )
            }
            Shared::View { camera, view } => {
                format!("{}: {count}: look at the picture", of(camera, format!("view {view}")))
            }
            Shared::Region { camera, from_px: [left, top], to_px: [right, bottom] } => {
                let where_ = format!("x {left:.0} to {right:.0}, y {top:.0} to {bottom:.0} px");
                format!(
                    "{}: {count}, in several views: the lens is not one of the model there, or \
                     something is before it",
                    of(camera, where_)
                )
            }
            Shared::Camera { camera } => {
                format!("{}: {count}", of(camera, "all views".to_owned()))
            }
        };
        if *left_out { text + "; left out" } else { text }
    }
}
