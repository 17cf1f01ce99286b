//! Structure of the source: modules have no circular imports, and `docs/architecture.md` names only
//! existing modules.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// The path of a module or of an item in it, name by name.
type Module = Vec<String>;

/// Sources without circular imports between modules, including imports through the re-exports of a
/// `mod.rs` or `lib.rs`.
const SOURCES: [&str; 12] = [
    "crates/calibrate/src",
    "crates/cli/src",
    "crates/core/src",
    "crates/detect/src",
    "crates/files/src",
    "crates/frames/src",
    "crates/lab/src",
    "crates/layout/src",
    "crates/search/src",
    "crates/verify/src",
    "fuzz/src",
    "python/src",
];

#[test]
fn modules_have_no_circular_imports() {
    for source in SOURCES {
        let source = Path::new(crate::common::REPOSITORY).join(source);
        let (mut texts, mut heads) = (BTreeMap::new(), BTreeMap::new());
        collect(&source, &Module::new(), &mut texts, &mut heads);
        let names = reexported(&heads, &texts);
        let imports: BTreeMap<&Module, BTreeSet<Module>> = texts
            .iter()
            .map(|(module, text)| (module, imported(module, text, &texts, &names)))
            .collect();
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

/// Collects the text of all modules below a folder, without comments and tests. The texts of
/// `mod.rs` and `lib.rs`, which re-export items of their submodules, go to `heads`.
fn collect(
    folder: &Path,
    module: &Module,
    texts: &mut BTreeMap<Module, String>,
    heads: &mut BTreeMap<Module, String>,
) {
    for entry in fs::read_dir(folder).unwrap().flatten() {
        let path = entry.path();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let own: Module = module.iter().cloned().chain([name.clone()]).collect();
        if path.is_dir() {
            collect(&path, &own, texts, heads);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = fs::read_to_string(&path).unwrap();
            let text = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
            let code = text.lines().map(|line| line.split("//").next().unwrap_or_default());
            let code = code.collect::<Vec<_>>().join(" ");
            match name.as_str() {
                "mod" | "lib" => heads.insert(module.clone(), code),
                _ => texts.insert(own, code),
            };
        }
    }
}

/// The items that heads re-export: their public path, and the path of their definition.
fn reexported(
    heads: &BTreeMap<Module, String>,
    texts: &BTreeMap<Module, String>,
) -> BTreeMap<Module, Module> {
    let mut names = BTreeMap::new();
    for (folder, text) in heads {
        for path in paths(text) {
            let child: Module =
                folder.iter().cloned().chain(path.split("::").take(1).map(Into::into)).collect();
            let is_child = texts.contains_key(&child) || heads.contains_key(&child);
            let path = if is_child { format!("self::{path}") } else { path };
            let Some(place) = absolute(folder, &path) else { continue };
            let Some(last) = place.last() else { continue };
            let name: Module = folder.iter().chain([last]).cloned().collect();
            // A function may have the name of the module that defines it.
            if !place.starts_with(&name) {
                names.insert(name, place);
            }
        }
    }
    names
}

/// The absolute path for a path from `crate`, `self` or `super` in a module.
fn absolute(module: &Module, path: &str) -> Option<Module> {
    let mut names = path.split("::").filter(|name| !name.is_empty());
    let base = match names.next()? {
        "crate" => &[],
        "self" => module.as_slice(),
        "super" => &module[..module.len().saturating_sub(1)],
        _ => return None,
    };
    Some(base.iter().cloned().chain(names.map(str::to_owned)).collect())
}

/// The modules that a text imports by paths from `crate` or `super`, including imports through the
/// re-exports of a head.
fn imported(
    module: &Module,
    text: &str,
    texts: &BTreeMap<Module, String>,
    names: &BTreeMap<Module, Module>,
) -> BTreeSet<Module> {
    let mut found = BTreeSet::new();
    for mut place in paths(text).iter().filter_map(|path| absolute(module, path)) {
        while let Some((length, at)) =
            (1..=place.len()).find_map(|length| Some((length, names.get(&place[..length])?)))
        {
            place = at.iter().chain(&place[length..]).cloned().collect();
        }
        let modules = (1..=place.len()).map(|length| place[..length].to_vec());
        found.extend(modules.filter(|other| other != module && texts.contains_key(other)));
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
            // Braces also occur outside groups; the text before those is not a path.
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

/// Whether a chain of imports leads from a module to another; `path` is the chain so far.
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

/// Names of crates whose sources are in `crates`.
const CRATES: [&str; 9] =
    ["calibrate", "cli", "core", "detect", "files", "lab", "layout", "search", "verify"];

/// Files such as `detect/labels/why.rs`, and modules such as `calibrate::start::consensus` or items
/// in them.
#[test]
fn the_architecture_page_names_only_existing_modules() {
    let root = Path::new(crate::common::REPOSITORY);
    let text = fs::read_to_string(root.join("docs/architecture.md")).unwrap();
    let is_there = |names: &[&str]| {
        let at = names[1..]
            .iter()
            .fold(root.join("crates").join(names[0]).join("src"), |at, name| at.join(name));
        at.exists() || at.with_extension("rs").exists()
    };
    let mut count = 0;
    for word in text.split('`').skip(1).step_by(2) {
        let is_path = word.contains('/') && !word.contains([' ', ':']);
        let names: Vec<&str> = word.split(if is_path { "/" } else { "::" }).collect();
        if names.len() < 2 || !CRATES.contains(&names[0]) {
            continue;
        }
        count += 1;
        // A path may end in a type or a function, which the head of its module may re-export.
        let modules = names.iter().take_while(|name| name.starts_with(char::is_lowercase)).count();
        let is_named = modules < 3 || is_there(&names[..modules - 1]);
        assert!(is_there(&names[..modules]) || !is_path && is_named, "{word}");
    }
    assert!(count > 60, "{count} were read");
}
