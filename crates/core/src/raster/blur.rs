use super::Gray;

/// Half-width of the kernel in standard deviations; beyond it, a step of full scale contributes 6·10⁻⁵.
const REACH_SIGMAS: f64 = 4.0;

/// Applies a Gaussian blur with standard deviation `sigma_px` and repeated borders; 0 leaves the image unchanged.
pub fn gaussian(image: &Gray<f32>, sigma_px: f64) -> Gray<f32> {
    let (width, height) = (image.width(), image.height());
    if sigma_px <= 0.0 || width == 0 || height == 0 {
        return image.clone();
    }
    let reach = (REACH_SIGMAS * sigma_px).ceil() as usize;
    let weight = |k: usize| (-0.5 * ((k as f64 - reach as f64) / sigma_px).powi(2)).exp();
    let total: f64 = (0..=2 * reach).map(weight).sum();
    let kernel: Vec<f32> = (0..=2 * reach).map(|k| (weight(k) / total) as f32).collect();

    let mut across: Gray<f32> = Gray::new(width, height);
    let mut padded = vec![0.0f32; width + 2 * reach];
    for y in 0..height {
        let row = image.row(y);
        padded[..reach].fill(row[0]);
        padded[reach..reach + width].copy_from_slice(row);
        padded[reach + width..].fill(row[width - 1]);
        for (k, &w) in kernel.iter().enumerate() {
            for (sum, value) in across.row_mut(y).iter_mut().zip(&padded[k..]) {
                *sum += w * value;
            }
        }
    }
    let mut out: Gray<f32> = Gray::new(width, height);
    for y in 0..height {
        for (k, &w) in kernel.iter().enumerate() {
            let from = (y + k).saturating_sub(reach).min(height - 1);
            for (sum, value) in out.row_mut(y).iter_mut().zip(across.row(from)) {
                *sum += w * value;
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_becomes_a_gaussian_of_the_same_sum() {
        let mut point = Gray::<f32>::new(41, 41);
        point.row_mut(20)[20] = 1.0;
        let blurred = gaussian(&point, 2.0);
        let moment = |f: fn(f64) -> f64| -> f64 {
            let columns = (0..41).map(|x| (0..41).map(|y| f64::from(blurred.at(x, y))).sum());
            columns.enumerate().map(|(x, sum): (usize, f64)| f(x as f64 - 20.0) * sum).sum()
        };
        assert!((moment(|_| 1.0) - 1.0).abs() < 1e-5);
        assert!(moment(|x| x).abs() < 1e-5);
        assert!((moment(|x| x * x) - 4.0).abs() < 0.02);
    }

    #[test]
    fn zero_blur_and_empty_images_are_accepted() {
        let image = Gray::from_fn(3, 3, |x, y| (x + y) as f32);
        assert_eq!(gaussian(&image, 0.0), image);
        assert_eq!(gaussian(&Gray::new(0, 0), 1.0), Gray::new(0, 0));
    }
}
