//! Extended BCH codes of length 64 and their symmetry of order three.
//!
//! Positions are the elements of the field of 64 elements, and α is one whose powers are all but 0. The binary words
//! on the powers of α that vanish, as polynomials, at α, α², …, α^2t make a cyclic code of distance 2t + 1 or more (Bose,
//! Ray-Chaudhuri & Hocquenghem; MacWilliams & Sloane, chapters 7 and 9); a parity bit at 0 adds one. Multiplication by α²¹, a
//! third root of unity, is a shift of that code: it fixes 0 alone, and moves the other positions in 21 cycles of three, as a
//! turn moves the cells of a tag of 64 bits.

use deltille_core::family::algebra::{CycleSpace, Span};

/// Elements of the field other than 0.
const POWERS: u32 = 63;

/// The extended code that corrects `errors` cells, in cycle coordinates: of distance 2·`errors` + 2 or more.
pub fn extended(errors: u32) -> Span {
    let field = Field::new();
    let zeros = zeros(errors);
    // The product of x − α^i over all zeros has coefficients 0 and 1.
    let mut generator = vec![1u8];
    for &zero in &zeros {
        let mut next = vec![0u8; generator.len() + 1];
        for (power, &coefficient) in generator.iter().enumerate() {
            next[power + 1] ^= coefficient;
            next[power] ^= field.times_power(coefficient, zero);
        }
        generator = next;
    }
    let shifts = 0..POWERS + 1 - generator.len() as u32;
    Span::of(shifts.map(|shift| {
        let word = (shift..).zip(&generator).filter(|&(_, &bit)| bit == 1);
        let word = word.fold(0, |word, (power, _)| word | 1u64 << bit_of(power));
        word | u64::from(word.count_ones() % 2) << POWERS
    }))
}

/// The space of these words: 21 cycles, and the central bit.
pub fn space() -> CycleSpace {
    CycleSpace { cycles: POWERS / 3, centre: true }
}

/// Exponents at which the code vanishes, with those that squaring makes of them.
fn zeros(errors: u32) -> Vec<u32> {
    let mut zeros: Vec<u32> = Vec::new();
    for first in (1..2 * errors).step_by(2) {
        let mut exponent = first % POWERS;
        while !zeros.contains(&exponent) {
            zeros.push(exponent);
            exponent = 2 * exponent % POWERS;
        }
    }
    zeros
}

/// The bit of α^`power`: cycle c holds α^c, α^(c + 21) and α^(c + 42).
fn bit_of(power: u32) -> u32 {
    let third = POWERS / 3;
    3 * (power % third) + power / third
}

/// The field of 64 elements, polynomials in α with α⁶ = α + 1.
struct Field {
    powers: Vec<u8>,
}

impl Field {
    fn new() -> Self {
        let next = |&element: &u8| {
            let doubled = element << 1;
            Some(if doubled & 0x40 == 0 { doubled } else { doubled ^ 0b100_0011 })
        };
        Self { powers: std::iter::successors(Some(1), next).take(POWERS as usize).collect() }
    }

    /// An element times α^`power`.
    fn times_power(&self, element: u8, power: u32) -> u8 {
        let log = self.powers.iter().position(|&other| other == element);
        log.map_or(0, |log| self.powers[(log + power as usize) % POWERS as usize])
    }
}

#[cfg(test)]
mod tests {
    use deltille_core::family::algebra::{Ranked, weights};

    use super::*;

    /// Dimensions and distances are those of MacWilliams & Sloane, figure 9.1, a parity bit added; all words are weighed, of
    /// the code or of its dual.
    #[test]
    fn codes_have_their_dimension_distance_and_symmetry() {
        let told = [(1, 57, 4), (2, 51, 6), (3, 45, 8), (4, 39, 10), (5, 36, 12), (7, 24, 16)];
        for (errors, dimension, distance) in told.into_iter().chain([(10, 18, 22), (11, 16, 24)]) {
            let (code, space) = (extended(errors), space());
            assert_eq!(code.dimension(), dimension);
            assert!(code.rows().iter().all(|&row| code.contains(space.turn(row))));
            let weights = weights(&code, 64).unwrap();
            let lightest = weights.iter().skip(1).position(|&words| words > 0).unwrap() + 1;
            assert_eq!(lightest, distance, "{errors} errors");
        }
        let weights = weights(&extended(5), 64).unwrap();
        assert_eq!((weights[12], weights[14], weights[32]), (30_240, 354_816, 13_547_993_382));
    }

    #[test]
    fn orbits_of_a_code_that_nobody_lists_are_numbered() {
        let (code, space) = (extended(5), space());
        let ranked = Ranked::new(space, &code).unwrap();
        assert_eq!(ranked.len(), 22_906_490_880);
        for rank in [0, 1, 4095, 5_592_405, 12_345_678_901, ranked.len() - 1] {
            let word = ranked.word(rank).unwrap();
            assert!(code.contains(word) && space.turn(word) != word);
        }
        assert_eq!(ranked.word(ranked.len()), None);
    }
}
