//! Step-by-step instructions for the sheets of a target.

use crate::SheetLayout;
use crate::paper::{PaperSpec, SolidSheets};
use deltille_core::targets::format_mm;
use deltille_core::targets::{BoardSpec, SolidSpec, Target, TargetSpec};

/// Returns the instructions for the sheets of a target.
pub(super) fn steps(target: &Target, sheets: &[SheetLayout], paper: &PaperSpec) -> Vec<String> {
    let name = &target.name;
    let mut steps = vec![
        "Print at 100 %, without \"fit to page\", on matt paper. Measure both check bars on each sheet. If a \
         length is wrong, print again, or multiply all lengths by the ratio of measured to stated length."
            .to_owned(),
    ];
    match &target.spec {
        TargetSpec::Solid(spec) => steps.extend(steps_of_solid(spec, paper)),
        _ => steps.extend(steps_of_board(target, sheets)),
    }
    match &target.spec {
        TargetSpec::Circles(_) => steps.push(format!(
            "Keep {name}.json: target_mm contains the position of every circle, in the order of OpenCV's findCirclesGrid."
        )),
        TargetSpec::Solid(SolidSpec { tags: None, .. }) => steps.push(format!(
            "Keep {name}.json: target_mm contains the position of every corner. Faces without tags cannot be \
             distinguished. This command detects a grid on each face; assign each grid to its face before \
             calibration:\n\
             deltille detect photos --target {name}.json -o corners"
        )),
        _ => {
            steps.push(format!(
                "Keep {name}.json: it contains the position of every corner. To detect corners in photographs:\n\
                 deltille detect photos --target {name}.json -o corners"
            ));
            steps.push(format!(
                "Take ten or more photographs, with the board close, tilted and near the image edges. To calibrate the camera:\n\
                 deltille calibrate corners --target {name}.json --model auto --report camera.html"
            ));
        }
    }
    steps
}

fn steps_of_board(target: &Target, sheets: &[SheetLayout]) -> Vec<String> {
    let mut steps = Vec::new();
    if sheets.iter().any(|sheet| !sheet.pages.is_empty()) {
        let trim = "Trim each page along the lines at its left and upper edges. Align it with the crosses of the pages that are named on it.";
        steps.push(trim.to_owned());
    }
    if sheets.iter().any(|sheet| sheet.placements.len() > 1) {
        steps.push("Cut the boards apart along the lines; each has its own label.".to_owned());
    }
    let flat = "Check it with a straightedge: a smaller flat board is better than a larger one that bends by a millimetre.";
    steps.push(match &target.spec {
        TargetSpec::Board(BoardSpec { two_sided_mm: Some(mm), .. }) => format!(
            "Cut both sheets from mark to mark. Glue them without bubbles to the two sides of a rigid, flat \
             plate of the same size. The printed surfaces must be {} apart, including the paper. \
             Alternatively, print both sides on the plate, and flip it about its vertical edge in between. The \
             marks of both sides must coincide. {flat}",
            format_mm(*mm)
        ),
        _ => format!(
            "Glue it without bubbles to a rigid, flat plate, such as glass, aluminium composite or a stone \
             tile. The plate must extend beyond the board's tiles by a fifth of a tile edge on every side. \
             {flat}"
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
                    "Glue each panel to the seat with its number in the printed skeleton. Edges with the same \
                            number must meet."
                }
                None => {
                    "Glue each face at the position of its number in the picture. Edges with the same number must meet."
                }
            };
            steps.push(
                "Cut each face from mark to mark, with a ruler and a sharp knife.".to_owned(),
            );
            steps.push(onto.to_owned());
        }
        (_, skeleton) => {
            steps.push(
                "Cut along solid lines. Score dashed lines and fold them away from the print. Score \
                 dash-dotted lines on the back and fold them towards the print. Do not fold dotted lines."
                    .to_owned(),
            );
            steps.push(
                "Glue each tab under the face that it names. Edges with the same number must meet. Start at \
                 one vertex, and close the solid last at the face on which it stands."
                    .to_owned(),
            );
            if skeleton.is_some() {
                steps.push("Or cut the faces apart, and glue each to the seat with its number in the printed skeleton.".to_owned());
            }
        }
    }
    steps.push(
        "Compare with the pictures: face numbers have the same orientation as on the print, and arrows point to the top of each face."
            .to_owned(),
    );
    let by_hand = "Faces glued by hand are accurate to a few tenths of a millimetre.";
    steps.push(match spec.tags {
        Some(_) => format!(
            "{by_hand} With several cameras or many views, deltille rig --refine-target estimates their poses."
        ),
        None => by_hand.to_owned(),
    });
    steps
}
