//! Pixel types.

/// Full scale of a pyramid's pixels: 10 bits leave room for sums of a dozen values in 16-bit arithmetic.
pub const PYRAMID_FULL_SCALE: f32 = 1023.0;

/// A pixel type: 8 or 16 bits, signed for intermediate results, or a float.
pub trait Intensity: Copy + Default + Send + Sync + PartialOrd + 'static {
    /// Value of white: 255, 65535, 1023 for pyramid levels, or 1.
    const FULL_SCALE: f32;

    /// Returns the value as a float, in units of the type.
    fn to_f32(self) -> f32;

    /// Returns the pixels as bytes if they are bytes, for faster algorithms.
    fn as_bytes(_pixels: &[Self]) -> Option<&[u8]> {
        None
    }
}

impl Intensity for u8 {
    const FULL_SCALE: f32 = 255.0;

    #[inline(always)]
    fn to_f32(self) -> f32 {
        f32::from(self)
    }

    fn as_bytes(pixels: &[Self]) -> Option<&[u8]> {
        Some(pixels)
    }
}

impl Intensity for u16 {
    const FULL_SCALE: f32 = 65535.0;

    #[inline(always)]
    fn to_f32(self) -> f32 {
        f32::from(self)
    }
}

/// Levels of a pyramid.
impl Intensity for i16 {
    const FULL_SCALE: f32 = PYRAMID_FULL_SCALE;

    #[inline(always)]
    fn to_f32(self) -> f32 {
        f32::from(self)
    }
}

impl Intensity for f32 {
    const FULL_SCALE: f32 = 1.0;

    #[inline(always)]
    fn to_f32(self) -> f32 {
        self
    }
}
