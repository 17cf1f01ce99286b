//! Mutations of the grammar of text formats: none may pass.
//!
//! `tests/independent/mutants.py` checks the mutants that do pass with other programs.

use deltille::export::artifacts::{Making, What, make};
use deltille::export::dsc::Dialect;
use deltille::family::Family;
use deltille::lattice::GridKind;
use deltille::layout::{PaperSpec, Printing};
use deltille::targets::{BoardSpec, TargetSpec};
use deltille::verify::{Artifact, Verifier};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Number of mutants of each file.
const MUTANTS: usize = 40;

/// Characters of the grammars. A DXF contains them only in its comment.
const STRUCTURE: &[u8] = b"()[]{}<>\"',=/:#";

/// Returns the bytes with one grammar character deleted, doubled, moved or replaced by another.
fn mutant(bytes: &[u8], random: &mut ChaCha8Rng) -> (String, Vec<u8>) {
    let marks: Vec<usize> = (0..bytes.len()).filter(|&at| STRUCTURE.contains(&bytes[at])).collect();
    // Those at the beginning and end, and any in between, which mostly belong to lists of numbers.
    let at = match random.random_range(0..3) {
        0 => marks[random.random_range(0..marks.len().min(60))],
        1 => marks[marks.len() - 1 - random.random_range(0..marks.len().min(60))],
        _ => marks[random.random_range(0..marks.len())],
    };
    let (mark, mut found) = (bytes[at], bytes.to_vec());
    let how = ["deleted", "doubled", "moved", "exchanged"][random.random_range(0..4)];
    match how {
        "deleted" => drop(found.remove(at)),
        "doubled" => found.insert(at, mark),
        "moved" => {
            found.remove(at);
            found.insert(random.random_range(0..found.len()), mark);
        }
        _ => found[at] = STRUCTURE[random.random_range(0..STRUCTURE.len())],
    }
    (format!("{} at {at} {how}", char::from(mark)), found)
}

#[test]
fn files_that_break_a_grammar_are_rejected() {
    let family = Family::shipped("delTag25h7").unwrap();
    let spec = TargetSpec::Board(BoardSpec::new(GridKind::Deltille, 4, 5, 20.0));
    let target = Printing::build("g", &spec, Some(&family), Some(&PaperSpec::default())).unwrap();
    let verifier = Verifier::new(&target).unwrap();
    let formats = [
        What::Svg,
        What::Dsc(Dialect::Fork),
        What::Obj,
        What::Sdf,
        What::Urdf,
        What::Mjcf,
        What::Usd,
        What::LaserSvg,
    ];
    let mut random = ChaCha8Rng::seed_from_u64(14);
    for what in formats {
        let made = make(&target, what, Making::default()).unwrap();
        let is_text = |name: &str| !name.ends_with(".png");
        let shared = [".obj", ".mtl"].map(str::to_owned);
        for (file, bytes) in made.iter().filter(|(name, _)| is_text(name)) {
            let is_shared = shared.iter().any(|end| file.ends_with(end));
            if is_shared && what != What::Obj {
                continue;
            }
            let named = file.replace(".mtl", ".obj");
            let passes = |bytes: Vec<u8>| {
                let files: Vec<Artifact> = (made.iter())
                    .map(|(name, good)| {
                        let content = if name == file { &bytes } else { good };
                        Artifact::new(name.clone(), content.clone())
                    })
                    .collect();
                verifier.verify(&named, &files).is_ok_and(|verdict| verdict.passed)
            };
            assert!(passes(bytes.clone()), "{file}");
            for _ in 0..MUTANTS {
                let (how, damaged) = mutant(bytes, &mut random);
                assert!(damaged == *bytes || !passes(damaged), "{file}: {how}");
            }
        }
    }
}
