//! The pixels of a `sensor_msgs/Image` as grey values.
//!
//! Colours become grey as those of photographs do. A Bayer mosaic contains the values that the sensor measured; red and
//! blue are brought to the level of green. Of YUV, luma is used, as of videos. Source: `sensor_msgs/image_encodings.hpp` of ROS.

use deltille_core::raster::{AnyGray, Colours, Gray, Intensity};
use deltille_core::words::quoted;
use deltille_files::limits::Limits;

use crate::problem::Problem;

/// The supported encodings, as part of messages.
const SUPPORTED: &str = "mono8, mono16, rgb8, bgr8, rgba8, bgra8, bayer_*8, bayer_*16, yuv422, yuv422_yuy2, uyvy, yuyv, nv12, nv21, \
                         nv24, 8UC1, 16UC1";

/// The image of a message.
pub(crate) struct RawImage {
    width: usize,
    height: usize,
    encoding: Encoding,
    is_big_endian: bool,
    /// Bytes of a row.
    step: usize,
    data: Vec<u8>,
}

#[derive(Clone, Copy)]
enum Encoding {
    /// A grey value of 8 bits: bytes of a pixel, and the position of the value among them.
    Luma8(usize, usize),
    Mono16,
    /// Values of a pixel, of 8 bits; the index of red; and the step to green and to blue.
    Colours(usize, usize, isize),
    /// Column and row of red in the mosaic.
    Bayer8([usize; 2]),
    Bayer16([usize; 2]),
}

impl Encoding {
    fn of(name: &str) -> Option<Self> {
        Some(match name {
            // The colours of nv12 and its relatives follow the plane of luma.
            "mono8" | "8UC1" | "nv12" | "nv21" | "nv24" => Self::Luma8(1, 0),
            "yuv422_yuy2" | "yuyv" => Self::Luma8(2, 0),
            "yuv422" | "uyvy" => Self::Luma8(2, 1),
            "mono16" | "16UC1" => Self::Mono16,
            "rgb8" => Self::Colours(3, 0, 1),
            "bgr8" => Self::Colours(3, 2, -1),
            "rgba8" => Self::Colours(4, 0, 1),
            "bgra8" => Self::Colours(4, 2, -1),
            _ => {
                let mosaic = name.strip_prefix("bayer_")?;
                let (order, bits) = mosaic.split_at_checked(4)?;
                let red = order
                    .find('r')
                    .filter(|_| ["rggb", "grbg", "gbrg", "bggr"].contains(&order))?;
                let red = [red % 2, red / 2];
                match bits {
                    "8" => Self::Bayer8(red),
                    "16" => Self::Bayer16(red),
                    _ => return None,
                }
            }
        })
    }

    fn bytes_per_pixel(self) -> usize {
        match self {
            Self::Luma8(bytes, _) => bytes,
            Self::Bayer8(_) => 1,
            Self::Mono16 | Self::Bayer16(_) => 2,
            Self::Colours(channels, ..) => channels,
        }
    }
}

impl RawImage {
    /// Checks that the rows are complete. `step` is the number of bytes of a row.
    pub(crate) fn new(
        [width, height]: [u32; 2],
        encoding: &str,
        is_big_endian: bool,
        step: u32,
        data: Vec<u8>,
        limits: &Limits,
    ) -> Result<Self, Problem> {
        limits.check_pixels(width, height)?;
        let unknown = || {
            let encoding = quoted(encoding);
            Problem::Unsupported(format!(
                "encoding {encoding} is not supported (known: {SUPPORTED})"
            ))
        };
        let encoding = Encoding::of(encoding).ok_or_else(unknown)?;
        let [width, height, step] = [width, height, step].map(|number| number as usize);
        let row = width * encoding.bytes_per_pixel();
        let needed = height.checked_sub(1).and_then(|rows| (rows * step).checked_add(row));
        if width == 0 || step < row || needed.is_none_or(|needed| data.len() < needed) {
            return Err(Problem::Damaged(format!(
                "an image of {width} × {height} pixels with {} bytes",
                data.len()
            )));
        }
        Ok(Self { width, height, encoding, is_big_endian, step, data })
    }

    /// Returns the number of pixels.
    pub(crate) fn pixels(&self) -> u64 {
        self.width as u64 * self.height as u64
    }

    /// Returns the grey values.
    pub(crate) fn grey(&self) -> Result<AnyGray, Problem> {
        let (width, height) = (self.width, self.height);
        let grey = match self.encoding {
            Encoding::Luma8(bytes, place) => {
                let values = self.rows().flat_map(|row| row.iter().skip(place).step_by(bytes));
                Gray::from_vec(width, height, values.copied().collect()).map(AnyGray::U8)
            }
            Encoding::Mono16 => Gray::from_vec(width, height, self.words()).map(AnyGray::U16),
            Encoding::Colours(channels, red, along) => {
                let strides = [self.step.cast_signed(), channels.cast_signed(), along];
                let colours = Colours::with_strides(width, height, red, strides, &self.data);
                colours.map(|colours| AnyGray::U8(colours.grey()))
            }
            Encoding::Bayer8(red) => {
                let values: Vec<u8> = self.rows().flatten().copied().collect();
                self.of_mosaic(&values, red).map(AnyGray::U8)
            }
            Encoding::Bayer16(red) => self.of_mosaic(&self.words(), red).map(AnyGray::U16),
        };
        grey.ok_or_else(Problem::cut_off)
    }

    /// Iterates over the rows, without the bytes after the last pixel.
    fn rows(&self) -> impl Iterator<Item = &[u8]> {
        let row = self.width * self.encoding.bytes_per_pixel();
        (0..self.height).map(move |y| &self.data[y * self.step..][..row])
    }

    fn words(&self) -> Vec<u16> {
        let word = if self.is_big_endian { u16::from_be_bytes } else { u16::from_le_bytes };
        self.rows().flat_map(|row| row.as_chunks::<2>().0).map(|pair| word(*pair)).collect()
    }

    /// Returns the values of a mosaic at the level of green. Each pixel takes the other colours from its square of four.
    fn of_mosaic<T: Intensity + TryFrom<u32> + Ord>(
        &self,
        mosaic: &[T],
        red: [usize; 2],
    ) -> Option<Gray<T>> {
        let (width, height) = (self.width, self.height);
        let beside = |at: usize, parity: usize, side: usize| {
            let there = (at & !1) + parity;
            if there < side { there } else { there.saturating_sub(2) }
        };
        let colours =
            (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).flat_map(|(x, y)| {
                let of = |[column, row]: [usize; 2]| {
                    mosaic[beside(y, row, height) * width + beside(x, column, width)]
                };
                let is_green = (x % 2 == red[0]) != (y % 2 == red[1]);
                let green = if is_green { mosaic[y * width + x] } else { of([1 - red[0], red[1]]) };
                [of(red), green, of([1 - red[0], 1 - red[1]])]
            });
        let colours: Vec<T> = colours.collect();
        Some(Colours::new(width, height, 3, &colours)?.levelled(red))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(size: [u32; 2], encoding: &str, step: u32, data: &[u8]) -> Result<RawImage, Problem> {
        RawImage::new(size, encoding, true, step, data.to_vec(), &Limits::default())
    }

    #[test]
    fn rows_may_have_gaps() {
        let grey = |encoding, step, data: &[u8]| {
            image([2, 2], encoding, step, data).unwrap().grey().unwrap()
        };
        let expected = AnyGray::U8(Gray::from_vec(2, 2, vec![1, 2, 3, 4]).unwrap());
        assert_eq!(grey("mono8", 3, &[1, 2, 0, 3, 4]), expected);
        assert_eq!(grey("yuyv", 5, &[1, 9, 2, 9, 0, 3, 9, 4, 9]), expected);
        assert_eq!(grey("uyvy", 4, &[9, 1, 9, 2, 9, 3, 9, 4]), expected);
        assert_eq!(grey("nv12", 2, &[1, 2, 3, 4, 9, 9]), expected);
        assert_eq!(
            grey("bgra8", 9, &[1, 1, 1, 0, 2, 2, 2, 0, 9, 3, 3, 3, 0, 4, 4, 4, 0]),
            expected
        );
        let expected = AnyGray::U16(Gray::from_vec(2, 2, vec![257, 2, 3, 4]).unwrap());
        assert_eq!(grey("mono16", 4, &[1, 1, 0, 2, 0, 3, 0, 4]), expected);
    }

    #[test]
    fn mosaics_are_brought_to_the_level_of_green() {
        for (order, red) in [("rggb", [0, 0]), ("grbg", [1, 0]), ("gbrg", [0, 1]), ("bggr", [1, 1])]
        {
            // An odd width and height, red at half and blue at a quarter of the level.
            let values =
                (0..35 * 33).map(|i: usize| match [i % 35 % 2 == red[0], i / 35 % 2 == red[1]] {
                    [true, true] => 80,
                    [false, false] => 40,
                    _ => 160,
                });
            let values: Vec<u8> = values.collect();
            let found = image([35, 33], &format!("bayer_{order}8"), 35, &values).unwrap().grey();
            assert_eq!(found.unwrap(), AnyGray::U8(Gray::from_fn(35, 33, |_, _| 160)), "{order}");
        }
    }

    #[test]
    fn incomplete_and_unknown_images_are_refused() {
        assert!(image([2, 2], "mono8", 2, &[0; 3]).is_err());
        assert!(image([2, 2], "rgb8", 2, &[0; 12]).is_err());
        assert!(image([0, 0], "mono8", 0, &[]).is_err());
        assert!(image([2, 2], "bayer_rgbg8", 2, &[0; 4]).is_err());
        assert!(image([u32::MAX, u32::MAX], "mono8", u32::MAX, &[]).is_err());
    }
}
