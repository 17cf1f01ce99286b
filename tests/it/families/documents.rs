//! The numbers in the guides are those of the family files.

use std::collections::HashSet;
use std::path::Path;

use deltille::family::{Family, TagWords, certify};
use deltille::lattice::Dimension;

fn read(path: &str) -> String {
    std::fs::read_to_string(Path::new(crate::common::REPOSITORY).join(path)).unwrap()
}

fn found(name: &str) -> Family {
    Family::from_json(&read(&format!("families/found/{name}.json"))).unwrap()
}

/// Formats a number as in the guides: 1208, and 20,140.
fn written(number: usize) -> String {
    match number {
        10_000.. => format!("{},{:03}", number / 1000, number % 1000),
        _ => number.to_string(),
    }
}

/// Returns the cells of the table row that begins with a word.
fn row<'a>(text: &'a str, first: &str) -> Vec<&'a str> {
    let lines = text.lines().filter(|line| line.starts_with('|'));
    let mut rows = lines.map(|line| line.trim_matches('|').split('|').map(str::trim).collect());
    rows.find(|cells: &Vec<&str>| cells[0] == first).unwrap_or_else(|| panic!("no row {first}"))
}

#[test]
fn the_guide_has_the_sizes_of_the_shipped_families() {
    let guide = read("docs/families.md");
    let (_, sizes) = guide.split_once("\n## Sizes\n").unwrap();
    for name in ["d16h5", "d25h7", "d25h9", "d36h9", "d36h11", "d49h12", "d64h12"] {
        let codes = written(Family::shipped(name).unwrap().len());
        let cell = row(sizes, name)[2];
        assert_eq!(cell.split(' ').next(), Some(codes.as_str()), "{name}: {cell}");
        let natural = guide.split_once("\n## False positives\n").unwrap().1;
        let rates = Family::shipped(name).unwrap().natural_false_positive_rates().unwrap();
        let cells = row(natural, name);
        for (rate, cell) in rates.iter().zip(&cells[2..]) {
            let stated = stated(cell);
            assert!((stated / rate).ln().abs() < 0.15, "{name}: {cell} for {rate:e}");
        }
    }
}

/// Parses a rate as in the guides: 4.5·10⁻⁴, or 1.3 %.
fn stated(cell: &str) -> f64 {
    if let Some(percent) = cell.strip_suffix(" %") {
        return percent.parse::<f64>().unwrap() / 100.0;
    }
    let (digits, power) = cell.split_once("·10⁻").unwrap_or_else(|| panic!("{cell}"));
    let power = power.chars().map(|c| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().position(|d| d == c).unwrap());
    let power = power.fold(0, |sum, digit| 10 * sum + digit as i32);
    digits.parse::<f64>().unwrap() * 10f64.powi(-power)
}

#[test]
fn the_guide_lists_families_that_do_not_ship() {
    let guide = read("docs/families.md");
    for name in ["d25h7", "d36h10"] {
        let family = found(name);
        assert!(certify(&family).is_valid(), "{name}");
        let codes = format!("{} codes", written(family.len()));
        let told = guide
            .lines()
            .any(|line| line.contains(&format!("gen-family {name} ")) && line.contains(&codes));
        assert!(told, "{name}: {codes}");
    }
}

/// Ids are positions in the list: the shipped family stays until a larger one begins with it.
#[test]
fn the_larger_d25h7_does_not_extend_the_shipped_one() {
    let words = TagWords::new(Dimension::from_bits(25).unwrap());
    let least = |&code: &u64| words.canonical(code);
    let (shipped, larger) = (Family::shipped("d25h7").unwrap(), found("d25h7"));
    let tags: HashSet<u64> = larger.codes().iter().map(least).collect();
    let common = shipped.codes().iter().map(least).filter(|tag| tags.contains(tag)).count();
    assert!(larger.len() > shipped.len() && common < shipped.len());
    let told = format!("{common} of the {}", shipped.len());
    assert!(read("docs/families.md").contains(&told), "{told}");
}
