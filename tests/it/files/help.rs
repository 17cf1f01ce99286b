//! The help texts of both programs.

use crate::common::page::Page;

#[test]
fn help_texts() {
    let folder = tempfile::tempdir().unwrap();
    for (program, first) in [("deltille", "board"), ("deltag", "gen-family")] {
        let mut page = Page::default();
        let help = page.run(folder.path(), &format!("{program} --help"));
        let help = String::from_utf8(help.stdout).unwrap();
        // Names of commands are what begins, two blanks in, the lines below this one.
        let lines = help.lines().skip_while(|line| *line != "Commands:").skip(1);
        let commands = lines.map_while(|line| line.strip_prefix("  ")?.split(' ').next());
        let commands: Vec<&str> =
            commands.filter(|name| !name.is_empty() && *name != "help").collect();
        assert!(commands.contains(&first), "{commands:?}");
        for command in commands {
            page.run(folder.path(), &format!("{program} {command} --help"));
        }
        page.is(&format!("help-{program}"));
    }
}
