//! The options that `-h` lists for commands with many; `--help` lists all.

use clap::{Arg, Command};

use crate::deltille::files::limits;

/// Commands with many options, and the ids of those that most users need.
const FIRST: [(&[&str], &[&str]); 8] = [
    (
        &["board", "checkerboard"],
        &[
            "rows", "cols", "edge", "family", "paper", "poster", "pdf", "svg", "png", "threemf",
            "laser", "name", "output",
        ],
    ),
    (
        &["charuco", "aprilgrid", "circles"],
        &[
            "squares",
            "tags",
            "circles",
            "edge",
            "spacing",
            "marker",
            "gap",
            "dictionary",
            "family",
            "asymmetric",
            "diameter",
            "paper",
            "pdf",
            "svg",
            "png",
            "laser",
            "name",
            "output",
        ],
    ),
    (
        &["tetrahedron", "octahedron", "icosahedron", "cube", "cuboid", "solid"],
        &[
            "size", "mesh", "scale", "edge", "tiles", "family", "paper", "pages", "per_face",
            "pdf", "gltf", "threemf", "name", "output",
        ],
    ),
    (&["detect"], &["target", "grid", "rows", "cols", "format", "overlay", "topic", "output"]),
    (
        &["calibrate"],
        &["target", "model", "measured", "holdout", "report", "format", "topic", "output"],
    ),
    (&["rig"], &["camera", "topic", "target", "model", "measured", "known", "report", "output"]),
    (
        &["check", "accept", "pose", "handeye"],
        &[
            "camera",
            "topic",
            "target",
            "measured",
            "limit",
            "lengths",
            "temperature",
            "robot",
            "eye_to_hand",
            "report",
            "output",
        ],
    ),
    (&["guide"], &["target", "model", "nearest", "farthest", "until", "once", "picture", "output"]),
];

/// Returns a program whose commands list only these options after `-h`, and say how to list all. Limits of input files are
/// listed by no command. Only examples with listed options are shown.
pub fn with_short_help(program: Command) -> Command {
    let name = program.get_name().to_owned();
    program.mut_subcommands(|command| {
        let of_command = command.get_name().to_owned();
        let first = FIRST.iter().find(|(names, _)| names.contains(&of_command.as_str()));
        let is_listed = |argument: &Arg| {
            let id = argument.get_id().as_str();
            let is_first = first.is_none_or(|(_, first)| first.contains(&id));
            argument.is_positional()
                || (is_first && argument.get_help_heading() != Some(limits::HEADING))
        };
        let options = || command.get_arguments().filter(|argument| !argument.is_hide_set());
        let (count, listed) = (options().count(), options().filter(|one| is_listed(one)));
        let listed: Vec<String> =
            listed.filter_map(|one| Some(format!("--{}", one.get_long()?))).collect();
        if listed.len() + 1 >= count {
            return command;
        }
        let examples = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        let is_of_listed = |line: &&str| {
            let mut options = line.split([' ', '=']).filter(|word| word.starts_with("--"));
            options.all(|option| listed.iter().any(|one| one == option))
        };
        let short: Vec<&str> = examples.lines().filter(is_of_listed).collect();
        let short =
            format!("All {count} options: {name} {of_command} --help\n\n{}", short.join("\n"));
        let command = command.mut_args(|argument| {
            let is_listed = is_listed(&argument);
            argument.hide_short_help(!is_listed)
        });
        command.after_help(short).after_long_help(examples)
    })
}
