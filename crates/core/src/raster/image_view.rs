//! Borrowed images of any depth.

use multiversion::multiversion;

use super::{AnyGray, Gray, Intensity, View};

/// A borrowed grey image of any depth: the input of detectors and refiners.
///
/// ```
/// use deltille_core::raster::{ImageView, View};
///
/// // The left half of an image of 640 × 480 pixels, without a copy.
/// let pixels = vec![0u8; 640 * 480];
/// let half = ImageView::from(View::new(320, 480, 640, &pixels).expect("enough pixels"));
/// assert_eq!((half.width(), half.height()), (320, 480));
/// ```
#[derive(Clone, Copy, Debug)]
pub enum ImageView<'a> {
    /// 8 bits.
    U8(View<'a, u8>),
    /// 16 bits.
    U16(View<'a, u16>),
    /// Levels of a pyramid.
    I16(View<'a, i16>),
    /// Floats from 0, black, to 1, white.
    F32(View<'a, f32>),
}

/// Applies an expression to a view of any depth.
#[doc(hidden)]
#[macro_export]
macro_rules! of_any {
    ($image:expr, $view:ident => $body:expr) => {
        match $image {
            $crate::raster::ImageView::U8($view) => $body,
            $crate::raster::ImageView::U16($view) => $body,
            $crate::raster::ImageView::I16($view) => $body,
            $crate::raster::ImageView::F32($view) => $body,
        }
    };
}
pub use of_any;

impl ImageView<'_> {
    /// Returns the width in pixels.
    #[inline]
    pub fn width(&self) -> usize {
        of_any!(self, view => view.width())
    }

    /// Returns the height in pixels.
    #[inline]
    pub fn height(&self) -> usize {
        of_any!(self, view => view.height())
    }

    /// Returns the value of white.
    pub fn full_scale(&self) -> f32 {
        fn of<T: Intensity>(_: &View<T>) -> f32 {
            T::FULL_SCALE
        }
        of_any!(self, view => of(view))
    }

    /// Returns the standard deviation of rounding to whole values, as a fraction of white; 0 for floats.
    pub fn rounding_sd(&self) -> f64 {
        match self {
            Self::F32(_) => 0.0,
            _ => 1.0 / (12f64.sqrt() * f64::from(self.full_scale())),
        }
    }

    /// Interpolates bilinearly at (x, y); positions outside get the nearest border value. An empty image gives 0.
    #[inline]
    pub fn bilinear(&self, x: f64, y: f64) -> f32 {
        of_any!(self, view => view.bilinear(x, y))
    }

    /// [`Self::bilinear`] for a position known to lie in the image, excluding its last row and column.
    #[inline]
    pub fn bilinear_inside(&self, x: f64, y: f64) -> f64 {
        of_any!(self, view => view.bilinear_inside(x, y))
    }

    /// Reads pixels of row `y` from `x` on, scaled so that white is 1; `None` if they exceed the image.
    pub fn read_row(&self, x: usize, y: usize, out: &mut [f32]) -> Option<()> {
        fn read<T: Intensity>(view: &View<T>, x: usize, y: usize, out: &mut [f32]) -> Option<()> {
            let shown = (y < view.height()).then(|| view.row(y).get(x..x + out.len()))??;
            to_white_as_one(shown, out);
            Some(())
        }
        of_any!(self, view => read(view, x, y, out))
    }
}

/// Converts pixels to floats, scaled so that white is 1.
#[multiversion(targets("x86_64+avx2"))]
fn to_white_as_one<T: Intensity>(pixels: &[T], out: &mut [f32]) {
    let to_one = 1.0 / T::FULL_SCALE;
    for i in 0..pixels.len().min(out.len()) {
        out[i] = pixels[i].to_f32() * to_one;
    }
}

macro_rules! views {
    ($($variant:ident $pixel:ty),*) => {$(
        impl<'a> From<View<'a, $pixel>> for ImageView<'a> {
            fn from(view: View<'a, $pixel>) -> Self {
                Self::$variant(view)
            }
        }

        impl<'a> From<&'a Gray<$pixel>> for ImageView<'a> {
            fn from(image: &'a Gray<$pixel>) -> Self {
                Self::$variant(image.view())
            }
        }
    )*};
}

views!(U8 u8, U16 u16, I16 i16, F32 f32);

impl<'a> From<&'a AnyGray> for ImageView<'a> {
    fn from(image: &'a AnyGray) -> Self {
        match image {
            AnyGray::U8(image) => image.into(),
            AnyGray::U16(image) => image.into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_need_disjoint_complete_rows() {
        let pixels: Vec<u8> = (0..20).collect();
        let view = View::new(3, 3, 7, &pixels).unwrap();
        assert_eq!(view.row(2), [14, 15, 16]);
        assert_eq!(ImageView::from(view).bilinear(1.5, 0.5), 0.25 * (1.0 + 2.0 + 8.0 + 9.0));
        assert!(View::new(7, 3, 7, &pixels).is_none());
        assert!(View::new(7, 2, 6, &pixels).is_none());
        assert!(View::new(0, 0, 0, &pixels[..0]).is_some());
        assert!(View::new(usize::MAX, 2, usize::MAX, &pixels).is_none());
    }

    #[test]
    fn rows_are_read_with_white_as_one() {
        let image = Gray::from_vec(2, 2, vec![0u16, 65535, 13107, 0]).unwrap();
        let mut row = [0.0; 2];
        assert!(ImageView::from(&image).read_row(0, 1, &mut row).is_some());
        assert!((row[0] - 0.2).abs() < 1e-6 && row[1] == 0.0, "{row:?}");
        assert!(ImageView::from(&image).read_row(1, 0, &mut row).is_none());
        assert!(ImageView::from(&image).read_row(0, 2, &mut row).is_none());
    }
}
