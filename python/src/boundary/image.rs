//! Converts arrays to images, without a copy if their layout allows.

use deltille::limits::Limits;
use deltille::raster::{AnyGray, Colours, Gray, ImageView, Intensity, View};
use numpy::ndarray::{ArrayView, ArrayView2, ArrayView3, ArrayViewMut2, Axis, Dimension};
use numpy::{
    Element, PyArray2, PyArray3, PyArrayDescrMethods, PyArrayMethods, PyReadonlyArray2,
    PyUntypedArray, PyUntypedArrayMethods, dtype,
};
use pyo3::prelude::*;

use super::arrays::shape_in_words;
use super::errors::{self, Raise, raised};

/// An image borrowed from Python, or a copy of it.
pub enum Picture<'py> {
    /// 8 bits.
    U8(PyReadonlyArray2<'py, u8>),
    /// 16 bits.
    U16(PyReadonlyArray2<'py, u16>),
    /// Floats from 0 to 1.
    F32(PyReadonlyArray2<'py, f32>),
    /// Grey values of a colour image, or a copy in another layout.
    Grey(Gray<u8>),
    /// A copy in another layout.
    Deep(Gray<u16>),
    /// A copy in another layout.
    Float(Gray<f32>),
}

/// The supported arrays, as part of messages.
const WANTED: &str = "expected an image of H × W with dtype uint8, uint16, float32 or float64 (0 to 1), or of H × W × 3 with dtype uint8 (RGB)";

impl<'py> Picture<'py> {
    /// Reads an image from an array with any strides.
    ///
    /// # Errors
    /// Returns an error if the shape or type of the array is not supported.
    pub fn of(array: &Bound<'py, PyAny>, limits: &Limits) -> PyResult<Self> {
        let refused = |what: String| raised::ImageError::new_err(format!("{what}: {WANTED}"));
        let Ok(found) = array.cast::<PyUntypedArray>() else {
            let kind = array.get_type().qualname()?;
            return Err(refused(format!("{kind} is not a numpy array")));
        };
        let shape = found.shape().to_vec();
        if shape.contains(&0) {
            return Err(refused(format!("an array of {} has no pixels", shape_in_words(&shape))));
        }
        let [height, width] = match shape.as_slice() {
            [height, width] | [height, width, 3] => [*height, *width],
            _ => {
                return Err(refused(format!(
                    "an array of {} is not an image",
                    shape_in_words(&shape)
                )));
            }
        };
        let side = |side: usize| u32::try_from(side).unwrap_or(u32::MAX);
        let (wide, high) = (side(width), side(height));
        limits.check_pixels(wide, high).raise(errors::image)?;
        let kind = found.dtype();
        let is = |of: Bound<'py, numpy::PyArrayDescr>| kind.is_equiv_to(&of);
        let py = array.py();
        if shape.len() == 3 {
            if !is(dtype::<u8>(py)) {
                return Err(refused(format!("unsupported dtype {kind} for colours")));
            }
            let colours = array.cast::<PyArray3<u8>>()?.try_readonly()?;
            let grey = grey_of(&colours.as_array());
            return Ok(Self::Grey(grey.ok_or_else(|| refused("unsupported strides".to_owned()))?));
        }
        // Arrays with another byte order have to be copied first.
        let native = || array.call_method1("astype", (kind.call_method1("newbyteorder", ("=",))?,));
        match (kind.kind(), kind.itemsize()) {
            _ if is(dtype::<u8>(py)) => Self::grey((array, limits), Self::U8, Self::Grey),
            _ if is(dtype::<u16>(py)) => Self::grey((array, limits), Self::U16, Self::Deep),
            _ if is(dtype::<f32>(py)) => {
                let picture = Self::grey((array, limits), Self::F32, Self::Float)?;
                picture.check_range().map_err(refused)?;
                Ok(picture)
            }
            (b'u', 2) | (b'f', 4) => Self::of(&native()?, limits),
            (b'f', 8) => Self::of(&array.call_method1("astype", (dtype::<f32>(py),))?, limits),
            _ => Err(refused(format!("unsupported dtype {kind}"))),
        }
    }

    /// Borrows the array if its rows are contiguous, otherwise copies it.
    fn grey<T: Element + Intensity>(
        (array, limits): (&Bound<'py, PyAny>, &Limits),
        borrowed: fn(PyReadonlyArray2<'py, T>) -> Self,
        copied: fn(Gray<T>) -> Self,
    ) -> PyResult<Self> {
        let pixels = array.cast::<PyArray2<T>>()?;
        if !pixels.is_aligned() {
            return Self::of(&array.call_method0("copy")?, limits);
        }
        let pixels = pixels.try_readonly()?;
        if rows(&pixels.as_array()).is_some() {
            return Ok(borrowed(pixels));
        }
        Ok(copied(copy_of(&pixels.as_array())))
    }

    /// Rejects NaN and floats outside 0 to 1, such as images scaled to 255.
    fn check_range(&self) -> Result<(), String> {
        let Some(ImageView::F32(image)) = self.view() else { return Ok(()) };
        let is_valid = |value: &f32| (*value >= 0.0) & (*value <= 1.0);
        let mut rows = (0..image.height()).map(|y| image.row(y));
        // Without a branch per value, which would prevent vector instructions.
        let wrong = rows.find(|row| !row.iter().fold(true, |all, value| all & is_valid(value)));
        let value = wrong.and_then(|row| row.iter().find(|value| !is_valid(value)));
        value.map_or(Ok(()), |value| {
            Err(format!(
                "float images range from 0 (black) to 1 (white), but this one contains {value}"
            ))
        })
    }

    /// Returns the view that detectors take.
    ///
    /// # Errors
    /// Returns an error if the memory layout of the array is not supported.
    pub fn viewed(&self) -> PyResult<ImageView<'_>> {
        let unsupported = "the memory layout of the array is not supported";
        self.view().ok_or_else(|| raised::ImageError::new_err(unsupported))
    }

    /// Returns a copy of the grey values, those of floats with 16 bits.
    ///
    /// # Errors
    /// See [`viewed`](Self::viewed).
    pub fn grey_values(&self) -> PyResult<AnyGray> {
        Ok(match self.viewed()? {
            ImageView::U8(image) => AnyGray::U8(mapped(image, |value| value)),
            ImageView::U16(image) => AnyGray::U16(mapped(image, |value| value)),
            ImageView::F32(image) => {
                AnyGray::U16(mapped(image, |value| (value * 65535.0 + 0.5) as u16))
            }
            _ => return Err(errors::image("the values of the image are not grey".to_owned())),
        })
    }

    fn view(&self) -> Option<ImageView<'_>> {
        Some(match self {
            Self::U8(pixels) => rows(&pixels.as_array())?.into(),
            Self::U16(pixels) => rows(&pixels.as_array())?.into(),
            Self::F32(pixels) => rows(&pixels.as_array())?.into(),
            Self::Grey(pixels) => pixels.into(),
            Self::Deep(pixels) => pixels.into(),
            Self::Float(pixels) => pixels.into(),
        })
    }
}

/// Returns an image with every value converted.
fn mapped<T: Intensity, U: Intensity>(image: View<'_, T>, convert: impl Fn(T) -> U) -> Gray<U> {
    let mut copy = Gray::new(image.width(), image.height());
    let rows = copy.pixels_mut().chunks_mut(image.width());
    for (y, row) in rows.enumerate() {
        for (to, &from) in row.iter_mut().zip(image.row(y)) {
            *to = convert(from);
        }
    }
    copy
}

/// Width of the blocks of a copy, px: in a transposed array, as many rows share the same cache lines.
const BLOCK_PX: usize = 64;

/// Returns a copy with contiguous rows.
fn copy_of<T: Intensity>(pixels: &ArrayView2<'_, T>) -> Gray<T> {
    let (height, width) = pixels.dim();
    let mut copy = Gray::new(width, height);
    let mut all = ArrayViewMut2::from_shape((height, width), copy.pixels_mut())
        .expect("the image has the size of the array");
    let blocks = all.axis_chunks_iter_mut(Axis(1), BLOCK_PX);
    for (mut block, pixels) in blocks.zip(pixels.axis_chunks_iter(Axis(1), BLOCK_PX)) {
        block.assign(&pixels);
    }
    copy
}

/// Returns the grey values of colours.
fn grey_of(colours: &ArrayView3<'_, u8>) -> Option<Gray<u8>> {
    let ((height, width, _), (first, bytes)) = (colours.dim(), memory(colours)?);
    let strides = colours.strides().try_into().ok()?;
    Some(Colours::with_strides(width, height, first, strides, bytes)?.grey())
}

/// Returns the array as rows of pixels if its memory layout allows: contiguous rows, from the top.
fn rows<'a, T: Intensity>(pixels: &ArrayView2<'a, T>) -> Option<View<'a, T>> {
    let (height, width) = pixels.dim();
    let [down, across] = pixels.strides().try_into().ok()?;
    // The stride of an axis with one element is meaningless.
    let stride = if height == 1 { width } else { usize::try_from(down).ok()? };
    if width > 1 && across != 1 {
        return None;
    }
    View::new(width, height, stride, memory(pixels)?.1)
}

/// Returns the memory from the lowest to the highest element of an array that is not empty, and the index of its first
/// element there.
#[allow(unsafe_code, reason = "ndarray has no slice of an array with gaps between its elements")]
fn memory<'a, T, D: Dimension>(array: &ArrayView<'a, T, D>) -> Option<(usize, &'a [T])> {
    let (mut before, mut after) = (0usize, 0usize);
    for (&count, &stride) in array.shape().iter().zip(array.strides()) {
        let reach = stride.unsigned_abs().checked_mul(count.checked_sub(1)?)?;
        let side = if stride < 0 { &mut before } else { &mut after };
        *side = side.checked_add(reach)?;
    }
    let count = before.checked_add(after)?.checked_add(1)?;
    // SAFETY: the array is not empty, and its first element is at `as_ptr`. The lowest one is `before` elements earlier,
    // and the highest one `after` elements later, in the same allocation. The gaps between elements belong to that
    // allocation too, and contain plain numbers. The array is borrowed for as long as the slice.
    Some((before, unsafe { std::slice::from_raw_parts(array.as_ptr().sub(before), count) }))
}
