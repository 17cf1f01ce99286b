use std::path::Path;

use assert_cmd::Command;
use assert_cmd::assert::Assert;

/// Runs `deltille` in a folder, with arguments separated by spaces.
pub fn deltille(folder: &Path, args: &str) -> Assert {
    let mut command = Command::cargo_bin("deltille").unwrap();
    command.current_dir(folder).args(args.split_whitespace()).assert()
}
