use std::path::Path;

use assert_cmd::Command;
use assert_cmd::assert::Assert;

/// Runs `deltille` in a folder, with arguments between which there are blanks.
pub fn deltille(folder: &Path, args: &str) -> Assert {
    let mut command = Command::cargo_bin("deltille").unwrap();
    command.current_dir(folder).args(args.split_whitespace()).assert()
}

/// Runs what has to be refused, in one line, and returns that.
pub fn refused(folder: &Path, args: &str) -> String {
    let result = deltille(folder, args).code(2);
    let said = String::from_utf8(result.get_output().stderr.clone()).unwrap();
    assert!(said.starts_with("error: ") && said.lines().count() == 1, "{args}: {said}");
    said
}
