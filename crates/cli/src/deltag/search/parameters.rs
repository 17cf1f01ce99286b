use std::str::FromStr;

use deltille::lattice::Dimension;

/// Bits and distance, written as d25h7.
#[derive(Clone, Copy)]
pub struct Parameters {
    pub dimension: Dimension,
    pub distance: u32,
}

impl FromStr for Parameters {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (bits, distance) = text
            .strip_prefix('d')
            .and_then(|rest| rest.split_once('h'))
            .and_then(|(b, h)| Some((b.parse().ok()?, h.parse().ok()?)))
            .ok_or("expected bits and distance, such as d25h7")?;
        if format!("d{bits}h{distance}") != text {
            return Err("expected bits and distance without signs or leading zeros, such as d25h7"
                .to_owned());
        }
        let dimension = Dimension::from_bits(bits).map_err(|e| e.to_string())?;
        if !(1..=bits).contains(&distance) {
            return Err(format!("the distance must be from 1 to {bits}, the number of bits"));
        }
        Ok(Self { dimension, distance })
    }
}
