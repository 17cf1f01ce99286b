use glam::DVec2;

use super::Gray;

/// Accumulates polygons in an image by the exact area that each pixel shares with them.
///
/// Every polygon edge adds its signed area to the pixels it crosses. A running sum along the row adds it to all
/// pixels to its right. The result of [`Self::finish`] is exact up to rounding. Pixels are unit squares around
/// integer coordinates. Polygons may extend beyond the image.
#[derive(Clone, Debug)]
pub struct Coverage {
    width: usize,
    height: usize,
    /// Differences along the rows; an extra column collects the contribution beyond the right border.
    steps: Vec<f32>,
}

impl Coverage {
    /// Creates an empty image.
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, steps: vec![0.0; (width + 1) * height] }
    }

    /// Adds `value` times the area of a closed polygon. The area is positive if the outline runs clockwise on the
    /// screen (y down), so holes run counterclockwise.
    pub fn add(&mut self, polygon: &[DVec2], value: f64) {
        for (i, &from) in polygon.iter().enumerate() {
            self.add_edge(from, polygon[(i + 1) % polygon.len()], value);
        }
    }

    /// Adds the area to the right of an edge.
    fn add_edge(&mut self, from: DVec2, to: DVec2, value: f64) {
        // From here on, pixel (i, j) is the square from (i, j) to (i+1, j+1).
        let (from, to) = (from + 0.5, to + 0.5);
        // An upward edge with the inside on its right is positive for a clockwise outline.
        let (sign, upper, lower) = if from.y > to.y { (1.0, to, from) } else { (-1.0, from, to) };
        if upper.y == lower.y {
            return;
        }
        let slope = (lower.x - upper.x) / (lower.y - upper.y);
        let top = upper.y.max(0.0);
        let bottom = lower.y.min(self.height as f64);
        let mut y = top;
        while y < bottom {
            let row = y as usize;
            let next = ((row + 1) as f64).min(bottom);
            let x = upper.x + slope * (y - upper.y);
            let x_next = upper.x + slope * (next - upper.y);
            self.add_in_row(row, [x, x_next], sign * value * (next - y));
            y = next;
        }
    }

    /// Adds the area to the right of an edge within one row, between two abscissas; `weight` is value times height.
    fn add_in_row(&mut self, row: usize, [a, b]: [f64; 2], weight: f64) {
        let width = self.width as f64;
        let (left, right) = (a.min(b), a.max(b));
        let steps = &mut self.steps[row * (self.width + 1)..][..self.width + 1];
        if left >= width {
            return;
        }
        if right <= 0.0 {
            steps[0] += weight as f32;
            return;
        }
        let length = right - left;
        if left.max(0.0).floor() == right.min(width).floor() && left >= 0.0 && right < width {
            // Within one pixel, the mean abscissa determines the area.
            let column = left as usize;
            let inside = (column + 1) as f64 - 0.5 * (left + right);
            steps[column] += (weight * inside) as f32;
            steps[column + 1] += (weight * (1.0 - inside)) as f32;
            return;
        }
        // Split at pixel boundaries. The part left of the image counts in full from column 0.
        if left < 0.0 {
            steps[0] += (weight * (-left / length)) as f32;
        }
        let mut x = left.max(0.0);
        let end = right.min(width);
        while x < end {
            let column = x as usize;
            let next = ((column + 1) as f64).min(end);
            let part = weight * ((next - x) / length);
            let inside = (column + 1) as f64 - 0.5 * (x + next);
            steps[column] += (part * inside) as f32;
            steps[column + 1] += (part * (1.0 - inside)) as f32;
            x = next;
        }
    }

    /// Returns the image: the sum of values times areas in every pixel.
    pub fn finish(self) -> Gray<f32> {
        let Self { width, height, steps } = self;
        let mut image = Gray::new(width, height);
        for y in 0..height {
            let mut sum = 0.0f64;
            let steps = &steps[y * (width + 1)..][..width];
            for (pixel, step) in image.row_mut(y).iter_mut().zip(steps) {
                sum += f64::from(*step);
                *pixel = sum as f32;
            }
        }
        image
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::polygon::area;

    prop_compose! {
        fn point(range: f64)(x in -range..range, y in -range..range) -> DVec2 {
            DVec2::new(x, y) + 8.0
        }
    }

    proptest! {
        #[test]
        fn the_total_is_the_area(a in point(8.0), b in point(8.0), c in point(8.0)) {
            let mut coverage = Coverage::new(17, 17);
            coverage.add(&[a, b, c], 1.0);
            let total: f64 = coverage.finish().pixels().iter().map(|&v| f64::from(v)).sum();
            prop_assert!((total - area(&[a, b, c])).abs() < 1e-4);
        }

        /// A triangle that extends beyond the image gives the same part as on a larger canvas.
        #[test]
        fn clipping_changes_nothing_inside(a in point(30.0), b in point(30.0), c in point(30.0)) {
            let mut small = Coverage::new(17, 17);
            small.add(&[a, b, c], 1.0);
            let mut large = Coverage::new(81, 81);
            large.add(&[a, b, c].map(|p| p + 32.0), 1.0);
            let (small, large) = (small.finish(), large.finish());
            for y in 0..17 {
                for x in 0..17 {
                    prop_assert!((small.at(x, y) - large.at(x + 32, y + 32)).abs() < 1e-4);
                }
            }
        }
    }

    #[test]
    fn a_square_covers_fractions_of_its_pixels() {
        let mut coverage = Coverage::new(4, 3);
        let square = [(0.75, 0.5), (2.5, 0.5), (2.5, 1.5), (0.75, 1.5)].map(DVec2::from);
        coverage.add(&square, 2.0);
        let image = coverage.finish();
        assert_eq!(image.row(0), [0.0; 4]);
        assert_eq!(image.row(1), [0.0, 1.5, 2.0, 0.0]);
    }
}
