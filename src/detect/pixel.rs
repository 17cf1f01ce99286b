use super::detection::Detection;
use super::detector::Detector;
use super::refine::{Refined, Refiner};
use crate::raster::{Gray, Intensity};

/// A type of the pixels of pictures in which corners are looked for: 8 or 16 bits, or a float.
///
/// Detectors and refiners are compiled here for each of them, once, and not in every crate that uses one.
pub trait Pixel: Intensity {
    /// [`Detector::detect`].
    #[doc(hidden)]
    fn detect(detector: &Detector, image: &Gray<Self>, name: &str) -> Detection;

    /// [`Refiner::refine_all`].
    #[doc(hidden)]
    fn refine_all(refiner: &Refiner, image: &Gray<Self>, starts: &[[f64; 2]]) -> Vec<Refined>;
}

macro_rules! pixels {
    ($($pixel:ty),*) => {$(
        impl Pixel for $pixel {
            fn detect(detector: &Detector, image: &Gray<Self>, name: &str) -> Detection {
                detector.detect_in(image, name)
            }

            fn refine_all(refiner: &Refiner, image: &Gray<Self>, starts: &[[f64; 2]]) -> Vec<Refined> {
                refiner.refine_in(image, starts)
            }
        }
    )*};
}

pixels!(u8, u16, f32);
