//! Documents, comments and messages use the field's terms: `docs/glossary.md` lists words to avoid and what to write instead.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Words of the glossary's list that are wrong in any sentence of this project.
const AVOID: [&str; 21] = [
    "a-posteriori",
    "anew",
    "by itself",
    "find a camera",
    "gross error",
    "gross errors",
    "half a turn",
    "lie about",
    "loose parameters",
    "nor",
    "of no use",
    "of which",
    "projections are known",
    "rms a coordinate",
    "smallest that holds",
    "speaks for",
    "stranger",
    "told",
    "told apart",
    "take part",
    "took part",
];

/// How often each occurs today. Counts may fall and not rise; a word that is missing here must not occur.
const RECORD: &str = "tests/snapshots/words-to-avoid.txt";

#[test]
fn no_new_words_to_avoid() {
    let root = Path::new(crate::common::REPOSITORY);
    let mut counts: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for path in sources(root) {
        let text = fs::read_to_string(&path).unwrap();
        for (number, line) in text.lines().enumerate() {
            let words = words(&prose(&path, line));
            for avoid in AVOID {
                let found = words.matches(&format!(" {avoid} ")).count();
                let place = format!("{}:{}: {}", path.display(), number + 1, line.trim());
                counts.entry(avoid).or_default().extend(std::iter::repeat_n(place, found));
            }
        }
    }
    let record = fs::read_to_string(root.join(RECORD)).unwrap();
    let allowed: BTreeMap<&str, usize> = record
        .lines()
        .filter_map(|line| line.split_once(' '))
        .map(|(count, word)| (word, count.parse().unwrap()))
        .collect();
    let mut new = Vec::new();
    for (word, places) in counts {
        let allowed = allowed.get(word).copied().unwrap_or(0);
        if places.len() > allowed {
            new.push(format!(
                "\"{word}\" {} times, {allowed} allowed:\n  {}",
                places.len(),
                places.join("\n  ")
            ));
        }
    }
    assert!(new.is_empty(), "see \"Words to avoid\" in docs/glossary.md\n{}", new.join("\n"));
}

/// Files with sentences: sources, the guide, the Python package and the page.
fn sources(root: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders: Vec<PathBuf> = [
        "crates",
        "src",
        "examples",
        "docs",
        "python/src",
        "python/deltille",
        "web/src",
        "web/wasm",
    ]
    .map(|folder| root.join(folder))
    .to_vec();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let entry = entry.unwrap();
            let (path, is_folder) = (entry.path(), entry.file_type().unwrap().is_dir());
            let extension = path.extension().unwrap_or_default();
            if is_folder {
                folders.push(path);
            } else if ["rs", "md", "py", "pyi", "ts"].iter().any(|kind| extension == *kind) {
                found.push(path);
            }
        }
    }
    found.retain(|path| !path.ends_with("docs/glossary.md"));
    found.extend(["README.md", "CONTRIBUTING.md", "SECURITY.md"].map(|name| root.join(name)));
    found.sort();
    found
}

/// The comments and strings of a line of code, or a whole line of a document.
fn prose(path: &Path, line: &str) -> String {
    if path.extension().is_some_and(|kind| kind != "rs") {
        return line.to_owned();
    }
    let (code, comment) = line.split_once("//").unwrap_or((line, ""));
    let strings = code.split('"').skip(1).step_by(2).collect::<Vec<_>>().join(" ");
    format!("{strings} {comment}")
}

/// The words of a text in lower case, with one blank before, between and after them.
fn words(text: &str) -> String {
    let lower = text.to_lowercase();
    let words =
        lower.split(|c: char| !(c.is_alphanumeric() || c == '-')).filter(|word| !word.is_empty());
    format!(" {} ", words.collect::<Vec<_>>().join(" "))
}
