//! Step-by-step instructions for the sheets of a target.

use crate::SheetLayout;
use crate::paper::{PaperSpec, SolidSheets};
use deltille_core::targets::format_mm;
use deltille_core::targets::{BoardSpec, SolidSpec, Target, TargetSpec};

/// Returns the instructions for the sheets of a target.
pub(super) fn steps(target: &Target, sheets: &[SheetLayout], paper: &PaperSpec) -> Vec<String> {
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
