//! Families found by searches, compared with proofs and bounds of the core.

use std::collections::HashSet;
use std::sync::atomic::{AtomicUsize, Ordering};

use deltille_core::family::algebra::Ranked;
use deltille_core::family::{
    Control, Decoder, Family, FreeCells, NaturalWords, Progress, Rules, bounds, certify,
};
use deltille_core::lattice::{Dimension, GridKind};
use deltille_search::algebra::{bch, residue};
use deltille_search::best::{Best, Budget};

/// At every distance, no bound is below a known code, and a bound missing because of rounding is reported as missing.
#[test]
fn bounds_of_64_cells_are_valid_or_missing() {
    let dimension = Dimension::from_bits(64).unwrap();
    for distance in 1..=64 {
        let bounds = bounds::bounds(GridKind::Deltille, dimension, distance);
        let known = bch::extended((distance - 1) / 2);
        let known = Ranked::new(bch::space(), &known).filter(|ranked| !ranked.is_empty());
        let known = known.map_or(0, |ranked| ranked.len());
        let least = bounds.linear_programming.min(bounds.sphere_packing);
        assert!(least >= known, "{distance}: {bounds:?}, {known}");
        let is_none = bounds.found_none();
        assert!(!is_none || (2..9).contains(&distance), "{distance}: {bounds:?}");
    }
}

/// Codes do not use the free cells, and decode regardless of their content; rates match enumeration.
#[test]
fn families_with_free_cells_decode_without_them() {
    let dimension = Dimension::from_bits(16).unwrap();
    let rules = Rules { free: Some(FreeCells::Centre), ..Rules::published(5) };
    let best = Best::new(dimension, 5, Budget::Work(1)).rules(rules);
    let reported = AtomicUsize::new(0);
    let report = |progress: Progress| {
        reported.fetch_max(progress.codes, Ordering::Relaxed);
    };
    let control = Control::default().report(&report);
    let family = best.family("holed", best.start(), control).unwrap();
    assert!(
        (1..=family.len()).contains(&reported.into_inner()),
        "progress counts only codes that were found"
    );
    let (free, certificate) = (family.free_cells(), certify(&family));
    assert!(certificate.is_valid(), "{:?}", certificate.failures);
    let of_all = bounds::bounds(family.kind(), dimension, 5).linear_programming;
    assert!(family.bounds().linear_programming < of_all, "fewer used cells distinguish fewer tags");
    assert!(family.len() >= 30 && family.codes().iter().all(|code| code & free == 0));
    assert_eq!(Family::from_json(&family.to_json()).unwrap(), family);
    assert_ne!(
        Family::from_json(&family.to_json().replace("\"free\"", "\"hollow\"")).ok(),
        Some(family.clone())
    );

    let (decoder, natural) = (Decoder::new(&family), NaturalWords::new(dimension));
    let (coins, rates) =
        (family.false_positive_rates(), family.natural_false_positive_rates().unwrap());
    for (errors, (coins, rate)) in (0..).zip(coins.into_iter().zip(rates)) {
        let taken: Vec<u64> =
            (0..1u64 << 16).filter(|&word| decoder.decode(word, errors).is_some()).collect();
        let sum: f64 = taken.iter().map(|&word| natural.probability(word)).sum();
        assert!((rate - sum).abs() < 1e-9 * sum, "{errors}: {rate}, {sum}");
        assert!((coins * 65536.0 - taken.len() as f64).abs() < 1e-6);
    }
}

#[test]
fn ranks_meet_every_orbit_once() {
    let (code, space) = (residue::extended(23), residue::space(23));
    let ranked = Ranked::new(space, &code).unwrap();
    let orbits: HashSet<u64> =
        (0..ranked.len()).map(|r| space.canonical(ranked.word(r).unwrap())).collect();
    assert_eq!((ranked.len(), orbits.len()), (1360, 1360));
    assert!(orbits.iter().all(|&w| code.contains(w) && space.rotate(w) != w));
    assert_eq!(ranked.word(ranked.len()), None);
    let large = Ranked::new(residue::space(47), &residue::extended(47)).unwrap();
    assert_eq!(large.len(), 5_592_320);
}
