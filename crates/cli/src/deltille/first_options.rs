//! The options that `-h` lists for commands with many; `--help` lists all.

use clap::Command;

/// Commands with many options, and the ids of those that most users need.
const FIRST: [(&[&str], &[&str]); 8] = [
    (
        &["board", "checkerboard"],
        &[
            "rows", "cols", "edge", "family", "paper", "poster", "svg", "png", "threemf", "name",
            "output",
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
            "svg",
            "png",
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
    (
        &["detect"],
        &["images", "target", "grid", "rows", "cols", "format", "overlay", "topic", "output"],
    ),
    (
        &["calibrate"],
        &[
            "inputs", "target", "model", "measured", "holdout", "report", "format", "topic",
            "output",
        ],
    ),
    (
        &["rig"],
        &["inputs", "camera", "topic", "target", "model", "measured", "known", "report", "output"],
    ),
    (
        &["check", "accept", "pose", "handeye"],
        &[
            "calibration",
            "images",
            "inputs",
            "camera",
            "topic",
            "target",
            "limit",
            "lengths",
            "temperature",
            "robot",
            "eye_to_hand",
            "report",
            "output",
        ],
    ),
    (
        &["guide"],
        &["folder", "target", "model", "nearest", "farthest", "until", "once", "picture", "output"],
    ),
];

/// Returns a program whose commands list only these options after `-h`, and say how to list all.
pub fn with_short_help(program: Command) -> Command {
    let name = program.get_name().to_owned();
    program.mut_subcommands(|command| {
        let of_command = command.get_name().to_owned();
        let Some((_, first)) = FIRST.iter().find(|(names, _)| names.contains(&of_command.as_str()))
        else {
            return command;
        };
        let is_hidden = |id: &str| !first.contains(&id);
        let count = command.get_arguments().filter(|argument| !argument.is_hide_set()).count();
        let examples = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        let rest = format!("All {count} options: {name} {of_command} --help");
        let command = command.mut_args(|argument| {
            let is_hidden = is_hidden(argument.get_id().as_str());
            argument.hide_short_help(is_hidden)
        });
        command.after_help(format!("{rest}\n\n{examples}")).after_long_help(examples)
    })
}
