//! Nearest-code lookup compared with brute force, on families with many codes.
//!
//! `cargo bench --bench decode`; each figure is the time for one word. Words with the maximum correctable number of
//! misread cells are the worst valid tags; random words represent clutter.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use deltille::family::{Decoder, Family, TagWords};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn decode(criterion: &mut Criterion) {
    for name in ["delTag25h7", "d25h7", "d36h9", "d36h11", "d49h12", "d64h12"] {
        let family = Family::shipped(name).expect("a shipped family");
        let words = TagWords::new(family.dimension());
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let bits = family.dimension().bits();
        let misread: Vec<u64> = (0..1024)
            .map(|_| {
                let code = family.codes()[random.random_range(0..family.len())];
                let word = words.rotations(code)[random.random_range(0..3)];
                (0..family.correctable()).fold(word, |w, _| w ^ 1 << random.random_range(0..bits))
            })
            .collect();
        let clutter: Vec<u64> =
            (0..1024).map(|_| random.random::<u64>() & family.dimension().mask()).collect();

        let decoders = [
            ("blocks", Some(Decoder::by_blocks(&family))),
            ("syndromes", Decoder::by_syndromes(&family)),
        ];
        let mut group = criterion.benchmark_group(format!("{name}, {} codes", family.len()));
        for (kind, reads) in [("misread tag", &misread), ("random word", &clutter)] {
            for (method, decoder) in &decoders {
                let Some(decoder) = decoder else { continue };
                let mut next = reads.iter().cycle();
                group.bench_function(format!("{kind}, {method}"), |bencher| {
                    bencher.iter(|| {
                        let word = *next.next().expect("endless");
                        black_box(decoder.decode(word, family.correctable()))
                    });
                });
            }
            let mut next = reads.iter().cycle();
            group.bench_function(format!("{kind}, brute force"), |bencher| {
                bencher.iter(|| {
                    let rotations = words.rotations(*next.next().expect("endless"));
                    let distance =
                        |code: &u64| rotations.iter().map(|turn| (turn ^ code).count_ones()).min();
                    black_box(family.codes().iter().enumerate().min_by_key(|(_, c)| distance(c)))
                });
            });
        }
        group.finish();
    }
}

criterion_group!(benches, decode);
criterion_main!(benches);
