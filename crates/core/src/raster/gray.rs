use super::{Intensity, View};

/// A grey image of `width × height` pixels, row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct Gray<T> {
    width: usize,
    height: usize,
    data: Vec<T>,
}

impl<T: Intensity> Gray<T> {
    /// Creates a black image.
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, data: vec![T::default(); width * height] }
    }

    /// Creates an image from its pixels; `None` unless there are `width · height` of them.
    pub fn from_vec(width: usize, height: usize, data: Vec<T>) -> Option<Self> {
        (data.len() == width * height).then_some(Self { width, height, data })
    }

    /// Creates an image whose pixel (x, y) is `pixel(x, y)`.
    pub fn from_fn(width: usize, height: usize, mut pixel: impl FnMut(usize, usize) -> T) -> Self {
        let data =
            (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| pixel(x, y));
        Self { width, height, data: data.collect() }
    }

    /// Returns the width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Returns the height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Returns all pixels, row by row.
    pub fn pixels(&self) -> &[T] {
        &self.data
    }

    /// Returns all pixels, row by row.
    pub fn pixels_mut(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// Returns one row.
    #[inline]
    pub fn row(&self, y: usize) -> &[T] {
        &self.data[y * self.width..(y + 1) * self.width]
    }

    /// Returns one row.
    pub fn row_mut(&mut self, y: usize) -> &mut [T] {
        &mut self.data[y * self.width..(y + 1) * self.width]
    }

    /// Returns the pixel at (x, y), which must lie in the image.
    #[inline]
    pub fn at(&self, x: usize, y: usize) -> T {
        self.data[y * self.width + x]
    }

    /// Returns a view of the image without a copy.
    #[inline]
    pub fn view(&self) -> View<'_, T> {
        View::of(self.width, self.height, &self.data)
    }

    /// Interpolates bilinearly at (x, y); positions outside get the nearest border value.
    ///
    /// An empty image gives 0.
    #[inline]
    pub fn bilinear(&self, x: f64, y: f64) -> f32 {
        self.view().bilinear(x, y)
    }

    /// [`Self::bilinear`] for a position known to lie in the image, excluding its last row and column.
    #[inline(always)]
    pub fn bilinear_inside(&self, x: f64, y: f64) -> f64 {
        self.view().bilinear_inside(x, y)
    }

    /// Converts the image to another pixel type.
    pub fn map<U: Intensity>(&self, f: impl Fn(T) -> U) -> Gray<U> {
        let data = self.data.iter().map(|&v| f(v)).collect();
        Gray { width: self.width, height: self.height, data }
    }
}
