//! Resampling of images through a map of pixels, for example an undistortion. Colours and depth are kept.
//!
//! Interpolation is bicubic (Keys 1981). Where the map reduces the image, several samples are
//! averaged to avoid aliasing, up to a reduction by a factor of eight along each axis.

use image::{DynamicImage, ImageBuffer, Pixel};
use rayon::prelude::*;

use deltille_core::camera::PixelMap;

/// Maximum number of samples along each side of a pixel. A pixel that covers more source pixels is averaged over this number.
const MAX_POSITIONS: f32 = 8.0;

/// Parameter a of the cubic convolution of Keys (1981) that gives third-order accuracy.
const KEYS: f32 = -0.5;

/// Maximum number of channels of a pixel.
const MAX_CHANNELS: usize = 4;

/// Resamples `image` by bicubic interpolation at the positions of `map`, px in `image` for each pixel of the result. A pixel
/// that covers several source pixels is their mean. Pixels without a position are black. Depth and channels are kept, except
/// that floating-point images become 16-bit RGB.
pub fn remapped(image: &DynamicImage, map: &PixelMap) -> DynamicImage {
    use DynamicImage as D;
    match image {
        D::ImageLuma8(image) => of(image, map).into(),
        D::ImageLumaA8(image) => of(image, map).into(),
        D::ImageRgb8(image) => of(image, map).into(),
        D::ImageRgba8(image) => of(image, map).into(),
        D::ImageLuma16(image) => of(image, map).into(),
        D::ImageLumaA16(image) => of(image, map).into(),
        D::ImageRgb16(image) => of(image, map).into(),
        D::ImageRgba16(image) => of(image, map).into(),
        deep => of(&deep.to_rgb16(), map).into(),
    }
}

/// Values of pixels, row by row.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub struct Pixels<'a, T> {
    values: &'a [T],
    width: usize,
    channels: usize,
}

impl<'a, T: Depth> Pixels<'a, T> {
    /// Takes the values of an image with the given width, px, and number of channels, 1 to 4; `None` if they do not fill
    /// whole rows, or if there are none.
    pub fn new(values: &'a [T], width: usize, channels: usize) -> Option<Self> {
        let row = width.checked_mul(channels).filter(|row| *row > 0)?;
        let is_whole = !values.is_empty() && values.len().is_multiple_of(row);
        (is_whole && channels <= MAX_CHANNELS).then_some(Self { values, width, channels })
    }

    fn height(&self) -> usize {
        self.values.len() / (self.width * self.channels)
    }

    /// Resamples the image as [`remapped`] does. Floating-point values are interpolated in single precision.
    pub fn remapped(self, map: &PixelMap) -> Vec<T> {
        let mut pixels = vec![T::default(); map.width() * map.height() * self.channels];
        let rows = pixels.par_chunks_mut((map.width() * self.channels).max(1)).enumerate();
        rows.for_each(|(row, pixels)| {
            for (column, pixel) in pixels.chunks_mut(self.channels).enumerate() {
                let Some(light) = seen(self, map, [column, row]) else { continue };
                for (channel, light) in pixel.iter_mut().zip(light) {
                    *channel = Depth::of_light(light);
                }
            }
        });
        pixels
    }
}

/// The type of a channel.
#[doc(hidden)]
pub trait Depth: Copy + Default + Send + Sync {
    /// The value in single precision.
    fn light(self) -> f32;

    /// The nearest representable value.
    fn of_light(light: f32) -> Self;
}

impl Depth for u8 {
    fn light(self) -> f32 {
        f32::from(self)
    }

    fn of_light(light: f32) -> Self {
        // The conversion saturates.
        light.round() as u8
    }
}

impl Depth for u16 {
    fn light(self) -> f32 {
        f32::from(self)
    }

    fn of_light(light: f32) -> Self {
        light.round() as u16
    }
}

impl Depth for f32 {
    fn light(self) -> f32 {
        self
    }

    fn of_light(light: f32) -> Self {
        light
    }
}

impl Depth for f64 {
    fn light(self) -> f32 {
        self as f32
    }

    fn of_light(light: f32) -> Self {
        f64::from(light)
    }
}

type Buffer<P> = ImageBuffer<P, Vec<<P as Pixel>::Subpixel>>;

fn of<P>(image: &Buffer<P>, map: &PixelMap) -> Buffer<P>
where
    P: Pixel,
    P::Subpixel: Depth,
{
    let channels = usize::from(P::CHANNEL_COUNT);
    let pixels = Pixels { values: image.as_raw(), width: image.width() as usize, channels };
    let pixels = pixels.remapped(map);
    let [width, height] = [map.width(), map.height()].map(|side| side as u32);
    ImageBuffer::from_raw(width, height, pixels)
        .expect("the buffer has one value per pixel and channel")
}

/// The mean of the source over a pixel of the result, for each channel; `None` if the pixel has no position.
fn seen<T: Depth>(
    image: Pixels<'_, T>,
    map: &PixelMap,
    [column, row]: [usize; 2],
) -> Option<[f32; MAX_CHANNELS]> {
    let place = |x: usize, y: usize| map.positions()[y * map.width() + x];
    let here = place(column, row);
    if here[0].is_nan() {
        return None;
    }
    // Derivative of the position from pixel to pixel.
    let along = |next: Option<[f32; 2]>, sign: f32| {
        next.filter(|next| !next[0].is_nan()).map(|next| [0, 1].map(|i| sign * (next[i] - here[i])))
    };
    let right = (column + 1 < map.width()).then(|| place(column + 1, row));
    let left = column.checked_sub(1).map(|x| place(x, row));
    let below = (row + 1 < map.height()).then(|| place(column, row + 1));
    let above = row.checked_sub(1).map(|y| place(column, y));
    let across = along(right, 1.0).or_else(|| along(left, -1.0)).unwrap_or_default();
    let down = along(below, 1.0).or_else(|| along(above, -1.0)).unwrap_or_default();
    let parts = |step: [f32; 2]| step[0].hypot(step[1]).round().clamp(1.0, MAX_POSITIONS);
    let [columns, rows] = [parts(across), parts(down)];
    let mut sum = [0.0; MAX_CHANNELS];
    for i in 0..rows as usize {
        for j in 0..columns as usize {
            let offset = |index: usize, of: f32| (index as f32 + 0.5) / of - 0.5;
            let (u, v) = (offset(j, columns), offset(i, rows));
            let at = [0, 1].map(|k| here[k] + u * across[k] + v * down[k]);
            for (sum, light) in sum.iter_mut().zip(cubic(image, at)) {
                *sum += light;
            }
        }
    }
    Some(sum.map(|sum| sum / (rows * columns)))
}

/// The weights of four pixels in a row for a position between the middle two.
fn weights(part: f32) -> [f32; 4] {
    let near = |d: f32| ((KEYS + 2.0) * d - (KEYS + 3.0)) * d * d + 1.0;
    let far = |d: f32| ((KEYS * d - 5.0 * KEYS) * d + 8.0 * KEYS) * d - 4.0 * KEYS;
    [far(1.0 + part), near(part), near(1.0 - part), far(2.0 - part)]
}

/// The interpolated value at a position in an image, px; beyond the border the outermost pixels are repeated.
fn cubic<T: Depth>(image: Pixels<'_, T>, [x, y]: [f32; 2]) -> [f32; MAX_CHANNELS] {
    let (by_column, by_row) = (weights(x - x.floor()), weights(y - y.floor()));
    let near = |at: f32, step: usize, side: usize| {
        (at.floor() as i64 + step as i64 - 1).clamp(0, side as i64 - 1) as usize
    };
    let columns: [usize; 4] = std::array::from_fn(|j| near(x, j, image.width));
    let height = image.height();
    let mut sum = [0.0; MAX_CHANNELS];
    for (i, by_row) in by_row.into_iter().enumerate() {
        let row = near(y, i, height);
        for (column, by_column) in columns.into_iter().zip(by_column) {
            let at = (row * image.width + column) * image.channels;
            let pixel = &image.values[at..at + image.channels];
            for (sum, channel) in sum.iter_mut().zip(pixel) {
                *sum += by_row * by_column * channel.light();
            }
        }
    }
    sum
}
