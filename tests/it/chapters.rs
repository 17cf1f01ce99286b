//! Chapters of the source: modules import each other in one direction.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// A module by the names that lead to it.
type Module = Vec<String>;

/// Folders without circles: the sources of their crate, and the module.
const CHAPTERS: [[&str; 2]; 6] = [
    ["core", "calibrate"],
    ["core", "detect"],
    ["core", "family"],
    ["core", "layout"],
    ["core", "targets"],
    ["files", "export"],
];

#[test]
fn modules_do_not_import_in_a_circle() {
    let crates = Path::new(crate::common::REPOSITORY).join("crates");
    for [name, chapter] in CHAPTERS {
        let source = crates.join(name).join("src");
        let mut texts = BTreeMap::new();
        collect(&source.join(chapter), &vec![chapter.to_owned()], &mut texts);
        let imports: BTreeMap<&Module, BTreeSet<Module>> =
            texts.iter().map(|(module, text)| (module, imported(module, text, &texts))).collect();
        assert!(
            imports.values().map(BTreeSet::len).sum::<usize>() > texts.len() / 2,
            "none was read"
        );
        for module in texts.keys() {
            let mut path = Vec::new();
            let circle = circle(module, module, &imports, &mut BTreeSet::new(), &mut path);
            assert!(!circle, "imports in a circle: {}", path.join(" → "));
        }
    }
}

/// The text of all modules below a folder, without comments and tests; a `mod.rs` only lists what is in it.
fn collect(folder: &Path, module: &Module, texts: &mut BTreeMap<Module, String>) {
    for entry in fs::read_dir(folder).unwrap().flatten() {
        let path = entry.path();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let own: Module = module.iter().cloned().chain([name.clone()]).collect();
        if path.is_dir() {
            collect(&path, &own, texts);
        } else if name != "mod" {
            let text = fs::read_to_string(&path).unwrap();
            let text = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
            let code = text.lines().map(|line| line.split("//").next().unwrap_or_default());
            texts.insert(own, code.collect::<Vec<_>>().join(" "));
        }
    }
}

/// The modules that a text names by paths from `crate` or `super`.
fn imported(module: &Module, text: &str, texts: &BTreeMap<Module, String>) -> BTreeSet<Module> {
    let mut found = BTreeSet::new();
    for path in paths(text) {
        let mut base: Module = match path.split("::").next() {
            Some("crate") => Vec::new(),
            Some("super") => module[..module.len() - 1].to_vec(),
            _ => continue,
        };
        for name in path.split("::").skip(1).take_while(|name| !name.is_empty()) {
            base.push(name.to_owned());
            if base != *module && texts.contains_key(&base) {
                found.insert(base.clone());
            }
        }
    }
    found
}

/// All paths of a text; a group `a::{b, c}` is `a::b` and `a::c`.
fn paths(text: &str) -> Vec<String> {
    let is_of_path = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    let (mut paths, mut path, mut groups) = (Vec::new(), String::new(), Vec::<String>::new());
    for c in text.chars().chain([' ']) {
        match c {
            _ if is_of_path(c) => path.push(c),
            // Not only groups have braces; what stands before others is no path.
            '{' => {
                groups.push(if path.ends_with("::") { path.split_off(0) } else { String::new() })
            }
            _ if path.is_empty() => {}
            _ => paths.push(groups.concat() + &path),
        }
        if !is_of_path(c) {
            path.clear();
        }
        if c == '}' {
            groups.pop();
        }
    }
    paths
}

/// Whether imports lead from a module back to another; `path` is the way.
fn circle(
    from: &Module,
    to: &Module,
    imports: &BTreeMap<&Module, BTreeSet<Module>>,
    seen: &mut BTreeSet<Module>,
    path: &mut Vec<String>,
) -> bool {
    path.push(from.join("::"));
    for next in &imports[from] {
        if next == to || (seen.insert(next.clone()) && circle(next, to, imports, seen, path)) {
            return true;
        }
    }
    path.pop();
    false
}
