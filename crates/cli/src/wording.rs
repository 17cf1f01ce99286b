//! What the library calls its settings, in words of the command line.
//!
//! Messages of the library name a field, a method or a choice as Rust has it, such as
//! `` `BoardSpec::rows` ``. Whoever runs a command sets it by an option: everything that a program
//! tells or writes of such messages goes through [`in_options`].

use std::sync::OnceLock;

use clap::{ArgMatches, Command};

/// A name in messages of the library.
struct Named {
    setting: &'static str,
    /// A command that sets it.
    command: &'static str,
    /// How; a command without options is the whole answer.
    option: &'static str,
}

/// Everything that messages of the library name.
const NAMED: &[Named] = &[
    named("AprilGridSpec::gap", "deltille aprilgrid", "--gap"),
    named("AprilGridSpec::tag_mm", "deltille aprilgrid", "--edge"),
    named("AprilGridSpec::tags", "deltille aprilgrid", "--tags"),
    named("BoardSpec::board_id", "deltille board", "--board-id"),
    named("BoardSpec::boards", "deltille board", "--boards"),
    named("BoardSpec::cols", "deltille board", "--cols"),
    named("BoardSpec::edge_mm", "deltille board", "--edge"),
    named("BoardSpec::rows", "deltille board", "--rows"),
    named("BoardSpec::tags", "deltille board", "--untagged"),
    named("BoardSpec::two_sided_mm", "deltille board", "--two-sided"),
    named("Calibration::board_shape", "deltille calibrate", "--board-shape"),
    named("Calibration::measure_target", "deltille calibrate", "--measure-target"),
    named("Calibration::refine_panels", "deltille rig", "--refine-target"),
    named("CharucoSpec::dictionary", "deltille charuco", "--dictionary"),
    named("CharucoSpec::marker_mm", "deltille charuco", "--marker"),
    named("CharucoSpec::square_mm", "deltille charuco", "--edge"),
    named("CharucoSpec::squares", "deltille charuco", "--squares"),
    named("CirclesSpec::circles", "deltille circles", "--circles"),
    named("CirclesSpec::diameter_mm", "deltille circles", "--diameter"),
    named("CirclesSpec::spacing_mm", "deltille circles", "--spacing"),
    named("Detection::assume_targets", "deltille calibrate", "--assume-target"),
    named("Dialect::Fork", "deltille board", "--dsc-dialect fork"),
    named("Family::to_json", "deltag gen-family", ""),
    named("Finish::contour", "deltille board", "--contour"),
    named("Finish::white", "deltille board", "--white"),
    named("ImportSpec::bits", "deltag import", "--bits"),
    named("ImportSpec::distance", "deltag import", "--distance"),
    named("ImportSpec::kind", "deltag import", "--shape"),
    named("Limits::max_bytes", "deltille verify", "--max-bytes"),
    named("Limits::max_depth", "deltille verify", "--max-depth"),
    named("Limits::max_nodes", "deltille verify", "--max-nodes"),
    named("Limits::max_pixels", "deltille verify", "--max-pixels"),
    named("Limits::max_pixels_per_byte", "deltille verify", "--max-pixels-per-byte"),
    named("Limits::max_seconds", "deltille verify", "--max-seconds"),
    named("Meshing::textures", "deltille icosahedron", "--textures"),
    named("PaperSpec::guide_page", "deltille board", "--guide-page"),
    named("PaperSpec::logo", "deltille board", "--logo"),
    named("PaperSpec::logo_height_mm", "deltille board", "--logo-height"),
    named("PaperSpec::margin_mm", "deltille board", "--margin"),
    named("PaperSpec::note", "deltille board", "--note"),
    named("PaperSpec::packed", "deltille board", "--pack"),
    named("PaperSpec::poster", "deltille board", "--poster"),
    named("PaperSpec::size", "deltille board", "--paper"),
    named("PaperSpec::tag_ids", "deltille board", "--tag-ids"),
    named("Print::scale", "deltille calibrate", "--print-scale"),
    named("Region::Image", "deltille compare", "--region image"),
    named("Sighting::bend", "deltille calibrate", "--shape"),
    named("Sighting::stretch", "deltille calibrate", "--print-scale"),
    named("SkeletonSpec::panel_thickness_mm", "deltille icosahedron", "--panel-thickness"),
    named("SkeletonSpec::rib_mm", "deltille icosahedron", "--rib"),
    named("SkeletonSpec::wall_mm", "deltille icosahedron", "--wall"),
    named("SolidShape::Cuboid", "deltille cuboid", "--size"),
    named("SolidShape::Mesh", "deltille solid", "--mesh"),
    named("SolidSheets::PerFace", "deltille icosahedron", "--per-face"),
    named("SolidSheets::SeamedNet", "deltille icosahedron", "--allow-seams"),
    named("SolidSpec::board_id", "deltille icosahedron", "--board-id"),
    named("SolidSpec::edge_mm", "deltille icosahedron", "--edge"),
    named("SolidSpec::margin_mm", "deltille icosahedron", "--face-margin"),
    named("SolidSpec::skeleton", "deltille icosahedron", "--skeleton"),
    named("SolidSpec::square_tags", "deltille solid", "--square-family"),
    named("SolidSpec::square_tags::family", "deltille solid", "--square-family"),
    named("SolidSpec::square_tags::first_id", "deltille solid", "--first-square-id"),
    named("SolidSpec::tiles", "deltille icosahedron", "--tiles"),
    named("TagSheetSpec::border_bits", "deltag sheet", "--tag-border"),
    named("TagSheetSpec::edge_mm", "deltag sheet", "--edge"),
    named("TagSheetSpec::family", "deltag sheet", "<FAMILY>"),
    named("TagSheetSpec::ids", "deltag sheet", "--ids"),
    named("TagSpec::border_bits", "deltille board", "--tag-border"),
    named("TagSpec::family", "deltille board", "--family"),
    named("TagSpec::first_id", "deltille board", "--first-id"),
    named("TagSpec::hole_mm", "deltille board", "--hole"),
    named("TagSpec::spacing", "deltille board", "--tag-spacing"),
    named("TagSpec::tags_in", "deltille checkerboard", "--tags-in"),
    named("TagsIn::Black", "deltille checkerboard", "--tags-in black"),
    named("Target::name", "deltille board", "--name"),
    named("Target::to_json", "deltille board", ""),
    named("UntaggedGrid::edge_mm", "deltille calibrate", "--edge"),
    named("UntaggedGrid::kind", "deltille calibrate", "--grid"),
    named("UntaggedGrid::size", "deltille calibrate", "--rows and --cols"),
    named("calibrate::Model", "deltille calibrate", "--model"),
    named("calibration::write", "deltille calibrate", ""),
    named("compare_boards::assume_target", "deltille compare", "--assume-target"),
    named("detection::write", "deltille detect", ""),
    named("family::shipped_names", "deltag list", ""),
    named("photograph::read_with_notes", "deltille detect", "--accept-damaged"),
    named("rig::write", "deltille rig", ""),
];

const fn named(setting: &'static str, command: &'static str, option: &'static str) -> Named {
    Named { setting, command, option }
}

/// The options of the command that runs.
static OPTIONS: OnceLock<Vec<String>> = OnceLock::new();

/// Says which command of a program runs.
pub fn runs(program: &Command, matches: &ArgMatches) {
    let (mut command, mut matches) = (program, matches);
    while let Some((name, inner)) = matches.subcommand() {
        let Some(found) = command.find_subcommand(name) else { break };
        (command, matches) = (found, inner);
    }
    // Only one command runs in a process.
    let _ = OPTIONS.set(options(command));
}

/// What a command is told by: its options with their dashes, under all their names, and other arguments
/// as its usage shows them.
fn options(command: &Command) -> Vec<String> {
    let names = command.get_arguments().flat_map(|argument| {
        let aliases = argument.get_all_aliases().unwrap_or_default();
        let long = argument.get_long().into_iter().chain(aliases).map(|long| format!("--{long}"));
        long.chain(argument.is_positional().then(|| argument.to_string())).collect::<Vec<_>>()
    });
    names.collect()
}

/// A text in which settings of the library are options: of the command that runs, or with the name of
/// one that has them.
pub fn in_options(text: &str) -> String {
    translated(text, OPTIONS.get().map_or(&[], Vec::as_slice))
}

fn translated(text: &str, options: &[String]) -> String {
    let (mut told, mut rest) = (String::with_capacity(text.len()), text);
    while let Some((before, after)) = rest.split_once('`') {
        told += before;
        let found = NAMED.iter().find_map(|named| {
            let after = after.strip_prefix(named.setting)?.strip_prefix('`')?;
            Some((named.told(options), after))
        });
        let (word, after) = found.unwrap_or_else(|| ("`".to_owned(), after));
        told += &word;
        rest = after;
    }
    told + rest
}

impl Named {
    fn told(&self, options: &[String]) -> String {
        match self.option {
            "" => format!("`{}`", self.command),
            option if self.is_among(options) => option.to_owned(),
            option => format!("`{} {option}`", self.command),
        }
    }

    /// Whether a command of these options has this one, or both that it takes.
    fn is_among(&self, options: &[String]) -> bool {
        let mut own = self.option.split(' ').filter(|word| word.starts_with(['-', '<']));
        own.all(|option| options.iter().any(|of_command| of_command == option))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::Path;

    use clap::CommandFactory;

    use super::*;
    use crate::{deltag::Deltag, deltille::Deltille};

    /// The options of a command such as `deltille board`.
    fn options_of(command: &str) -> Vec<String> {
        let programs = [Deltille::command(), Deltag::command()];
        let (program, name) = command.split_once(' ').unwrap();
        let program = programs.iter().find(|found| found.get_name() == program).unwrap();
        options(program.find_subcommand(name).unwrap_or_else(|| panic!("no {command}")))
    }

    #[test]
    fn every_command_has_the_option_that_it_is_said_to_have() {
        for named in NAMED {
            let options = options_of(named.command);
            assert!(named.is_among(&options), "{} {}", named.command, named.option);
        }
    }

    /// What stands in literals of the library between backquotes, or alone, and has a path.
    fn settings_of(folder: &Path, found: &mut BTreeSet<String>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                settings_of(&path, found);
            } else if path.extension().is_some_and(|end| end == "rs") {
                let text = std::fs::read_to_string(path).unwrap();
                // Attributes of serde name functions.
                let is_said = |line: &&str| !line.starts_with("//") && !line.contains("serializ");
                let lines = text.lines().map(str::trim).filter(is_said);
                let words = lines.flat_map(|line| line.split(['`', '"']).skip(1));
                let is_setting = |word: &&str| {
                    let is_name = |c: char| c.is_ascii_alphanumeric() || "_:".contains(c);
                    word.contains("::") && word.chars().all(is_name)
                };
                found.extend(words.filter(is_setting).map(str::to_owned));
            }
        }
    }

    #[test]
    fn everything_that_the_library_names_is_known_and_nothing_else() {
        let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let mut found = BTreeSet::new();
        for name in ["calibrate", "core", "detect", "files", "layout", "search", "verify"] {
            settings_of(&crates.join(name).join("src"), &mut found);
        }
        let known: BTreeSet<String> = NAMED.iter().map(|n| n.setting.to_owned()).collect();
        assert_eq!(found, known);
    }

    #[test]
    fn settings_become_options_of_the_command_that_runs_and_values_stay() {
        let told = |text: &str, command: &str| translated(text, &options_of(command));
        let text = "`BoardSpec::rows`: not `radtan`, nor field `edge`: ` `` `";
        assert_eq!(told(text, "deltille board"), "--rows: not `radtan`, nor field `edge`: ` `` `");
        let text = "`Calibration::refine_panels` finds where they are";
        assert_eq!(told(text, "deltille rig"), "--refine-target finds where they are");
        let elsewhere = "`deltille rig --refine-target` finds where they are";
        assert_eq!(told(text, "deltille calibrate"), elsewhere);
        assert_eq!(told("take `TagsIn::Black`", "deltille checkerboard"), "take --tags-in black");
        assert_eq!(told("of `family::shipped_names`", "deltag plan"), "of `deltag list`");
    }
}
