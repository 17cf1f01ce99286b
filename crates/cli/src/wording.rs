//! Names of library settings in terms of command-line options.
//!
//! Messages of the library name a [`Setting`]. On the command line, it is an option of the running command, or of
//! another command.

use std::sync::OnceLock;

use clap::{ArgMatches, Command};
use deltille::setting::{self, Setting};

/// Returns a command that has the setting, and its option; the option is empty if the message
/// should name only the command.
const fn named(setting: Setting) -> (&'static str, &'static str) {
    match setting {
        Setting::AprilGridGap => ("deltille aprilgrid", "--gap"),
        Setting::AprilGridTagMm => ("deltille aprilgrid", "--edge"),
        Setting::AprilGridTags => ("deltille aprilgrid", "--tags"),
        Setting::BoardBoardId => ("deltille board", "--board-id"),
        Setting::BoardBoards => ("deltille board", "--boards"),
        Setting::BoardCols => ("deltille board", "--cols"),
        Setting::BoardEdgeMm => ("deltille board", "--edge"),
        Setting::BoardRows => ("deltille board", "--rows"),
        Setting::BoardTags => ("deltille board", "--untagged"),
        Setting::BoardTwoSidedMm => ("deltille board", "--two-sided"),
        Setting::CalibrateModel => ("deltille calibrate", "--model"),
        Setting::CalibrationBoardShape => ("deltille calibrate", "--board-shape"),
        Setting::CalibrationCompensatedForTiming => ("deltille calibrate", "--estimate-timing"),
        Setting::CalibrationMeasureTarget => ("deltille calibrate", "--measure-target"),
        Setting::CalibrationRefinePanels => ("deltille rig", "--refine-target"),
        Setting::CalibrationWrite => ("deltille calibrate", ""),
        Setting::CharucoDictionary => ("deltille charuco", "--dictionary"),
        Setting::CharucoLegacy => ("deltille charuco", "--legacy"),
        Setting::CharucoMarkerMm => ("deltille charuco", "--marker"),
        Setting::CharucoSquareMm => ("deltille charuco", "--edge"),
        Setting::CharucoSquares => ("deltille charuco", "--squares"),
        Setting::CirclesCircles => ("deltille circles", "--circles"),
        Setting::CirclesDiameterMm => ("deltille circles", "--diameter"),
        Setting::CirclesSpacingMm => ("deltille circles", "--spacing"),
        Setting::CompareBoardsAssumeTarget => ("deltille compare", "--assume-target"),
        Setting::DetectionAssumeTargets => ("deltille calibrate", "--assume-target"),
        Setting::DetectionWrite => ("deltille detect", ""),
        Setting::DialectFork => ("deltille board", "--dsc-dialect fork"),
        Setting::FamilyShippedNames => ("deltag list", ""),
        Setting::FamilyToJson => ("deltag gen-family", ""),
        Setting::FinishContour => ("deltille board", "--contour"),
        Setting::FinishWhite => ("deltille board", "--white"),
        Setting::FrameOptionsTopic => ("deltille detect", "--topic"),
        Setting::ImportBits => ("deltag import", "--bits"),
        Setting::ImportDistance => ("deltag import", "--distance"),
        Setting::ImportKind => ("deltag import", "--shape"),
        Setting::LimitsMaxBytes => ("deltille verify", "--max-bytes"),
        Setting::LimitsMaxDepth => ("deltille verify", "--max-depth"),
        Setting::LimitsMaxNodes => ("deltille verify", "--max-nodes"),
        Setting::LimitsMaxPixels => ("deltille verify", "--max-pixels"),
        Setting::LimitsMaxPixelsPerByte => ("deltille verify", "--max-pixels-per-byte"),
        Setting::LimitsMaxSeconds => ("deltille verify", "--max-seconds"),
        Setting::MeshingTextures => ("deltille icosahedron", "--textures"),
        Setting::PaperGuidePage => ("deltille board", "--guide-page"),
        Setting::PaperLogo => ("deltille board", "--logo"),
        Setting::PaperLogoHeightMm => ("deltille board", "--logo-height"),
        Setting::PaperMarginMm => ("deltille board", "--margin"),
        Setting::PaperNote => ("deltille board", "--note"),
        Setting::PaperPacked => ("deltille board", "--pack"),
        Setting::PaperPages => ("deltille icosahedron", "--pages"),
        Setting::PaperPoster => ("deltille board", "--poster"),
        Setting::PaperSize => ("deltille board", "--paper"),
        Setting::PaperTagIds => ("deltille board", "--tag-ids"),
        Setting::PhotographReadWithNotes => ("deltille detect", "--accept-damaged"),
        Setting::PrintScale => ("deltille calibrate", "--print-scale"),
        Setting::RegionImage => ("deltille compare", "--region image"),
        Setting::RigWrite => ("deltille rig", ""),
        Setting::SightingBend => ("deltille calibrate", "--shape"),
        Setting::SightingStretch => ("deltille calibrate", "--measured"),
        Setting::SkeletonPanelThicknessMm => ("deltille icosahedron", "--panel-thickness"),
        Setting::SkeletonRibMm => ("deltille icosahedron", "--rib"),
        Setting::SkeletonWallMm => ("deltille icosahedron", "--wall"),
        Setting::SolidBoardId => ("deltille icosahedron", "--board-id"),
        Setting::SolidEdgeMm => ("deltille icosahedron", "--edge"),
        Setting::SolidMarginMm => ("deltille icosahedron", "--face-margin"),
        Setting::SolidShapeCuboid => ("deltille cuboid", "--size"),
        Setting::SolidShapeMesh => ("deltille solid", "--mesh"),
        Setting::SolidSheetsPerFace => ("deltille icosahedron", "--per-face"),
        Setting::SolidSheetsSeamedNet => ("deltille icosahedron", "--allow-seams"),
        Setting::SolidSkeleton => ("deltille icosahedron", "--skeleton"),
        Setting::SolidSquareTags => ("deltille solid", "--square-family"),
        Setting::SolidSquareTagsFamily => ("deltille solid", "--square-family"),
        Setting::SolidSquareTagsFirstId => ("deltille solid", "--first-square-id"),
        Setting::SolidTiles => ("deltille icosahedron", "--tiles"),
        Setting::TagBorderBits => ("deltille board", "--tag-border"),
        Setting::TagFamily => ("deltille board", "--family"),
        Setting::TagFirstId => ("deltille board", "--first-id"),
        Setting::TagHoleMm => ("deltille board", "--hole"),
        Setting::TagSheetBorderBits => ("deltag sheet", "--tag-border"),
        Setting::TagSheetEdgeMm => ("deltag sheet", "--edge"),
        Setting::TagSheetFamily => ("deltag sheet", "<FAMILY>"),
        Setting::TagSheetIds => ("deltag sheet", "--ids"),
        Setting::TagSpacing => ("deltille board", "--tag-spacing"),
        Setting::TagTagsIn => ("deltille checkerboard", "--tags-in"),
        Setting::TagsInBlack => ("deltille checkerboard", "--tags-in black"),
        Setting::TargetName => ("deltille board", "--name"),
        Setting::TargetToJson => ("deltille board", ""),
        Setting::TargetSetFamily => ("deltille detect", "--family"),
        Setting::UntaggedGridEdgeMm => ("deltille calibrate", "--edge"),
        Setting::UntaggedGridKind => ("deltille calibrate", "--grid"),
        Setting::UntaggedGridSize => ("deltille calibrate", "--rows and --cols"),
    }
}

/// The options of the running command.
static OPTIONS: OnceLock<Vec<String>> = OnceLock::new();

/// Makes messages name settings by options: by those of the running command as soon as it is known, see [`set_command`].
pub fn install() {
    setting::speak(|setting| worded(setting, OPTIONS.get().map_or(&[], Vec::as_slice)));
}

/// Records which command of a program is running.
pub fn set_command(program: &Command, matches: &ArgMatches) {
    let (mut command, mut matches) = (program, matches);
    while let Some((name, inner)) = matches.subcommand() {
        let Some(found) = command.find_subcommand(name) else { break };
        (command, matches) = (found, inner);
    }
    // Only one command runs per process.
    let _ = OPTIONS.set(options(command));
}

/// Returns the arguments of a command: options with dashes, under all their names, and positional arguments as in the
/// usage.
fn options(command: &Command) -> Vec<String> {
    let names = command.get_arguments().flat_map(|argument| {
        let aliases = argument.get_all_aliases().unwrap_or_default();
        let long = argument.get_long().into_iter().chain(aliases).map(|long| format!("--{long}"));
        long.chain(argument.is_positional().then(|| argument.to_string())).collect::<Vec<_>>()
    });
    names.collect()
}

/// Names a setting for a command with these options.
fn worded(setting: Setting, options: &[String]) -> String {
    match named(setting) {
        (command, "") => format!("`{command}`"),
        (_, option) if is_among(option, options) => option.to_owned(),
        (command, option) => format!("`{command} {option}`"),
    }
}

/// Whether a command with these options has this one, or both parts of a pair.
fn is_among(option: &str, options: &[String]) -> bool {
    let mut own = option.split(' ').filter(|word| word.starts_with(['-', '<']));
    own.all(|option| options.iter().any(|of_command| of_command == option))
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;
    use crate::{deltag::Deltag, deltille::Deltille};

    /// Returns the options of a command such as `deltille board`.
    fn options_of(command: &str) -> Vec<String> {
        let programs = [Deltille::command(), Deltag::command()];
        let (program, name) = command.split_once(' ').unwrap();
        let program = programs.iter().find(|found| found.get_name() == program).unwrap();
        options(program.find_subcommand(name).unwrap_or_else(|| panic!("no {command}")))
    }

    #[test]
    fn every_setting_names_an_existing_option() {
        for &setting in Setting::ALL {
            let (command, option) = named(setting);
            assert!(is_among(option, &options_of(command)), "{command} {option}");
        }
    }

    #[test]
    fn settings_are_named_by_options_of_the_running_command_first() {
        let worded = |setting, command| worded(setting, &options_of(command));
        assert_eq!(worded(Setting::BoardRows, "deltille board"), "--rows");
        assert_eq!(worded(Setting::CalibrationRefinePanels, "deltille rig"), "--refine-target");
        let elsewhere = "`deltille rig --refine-target`";
        assert_eq!(worded(Setting::CalibrationRefinePanels, "deltille calibrate"), elsewhere);
        assert_eq!(worded(Setting::TagsInBlack, "deltille checkerboard"), "--tags-in black");
        assert_eq!(worded(Setting::FamilyShippedNames, "deltag plan"), "`deltag list`");
    }
}
