//! Measures the difference of a picture from a reference picture: RMSE, PSNR, SSIM and FLIP.
//!
//! - SSIM: Z. Wang, A. Bovik, H. Sheikh and E. Simoncelli, "Image Quality Assessment: From Error Visibility to
//!   Structural Similarity" (2004), eq. 13, with the constants and the Gaussian window of section III.C. It is computed
//!   on luma (Rec. 601, not rounded) and averaged over all windows that lie inside the picture.
//! - FLIP: P. Andersson et al., "FLIP: A Difference Evaluator for Alternating Images" (2020), by the authors'
//!   implementation, at [`PIXELS_PER_DEGREE`].

use image::RgbImage;
use nv_flip::{FlipImageRgb8, flip as authors_flip, magma_lut};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::extended::{self, Extended};

/// Viewing condition of FLIP, pixels per degree: a screen 0.7 m wide with 3840 pixels, seen from 0.7 m.
pub const PIXELS_PER_DEGREE: f32 = nv_flip::DEFAULT_PIXELS_PER_DEGREE;

/// Pixels along a side of SSIM's window.
const WINDOW: usize = 11;
/// Standard deviation of SSIM's Gaussian weights, pixels.
const SIGMA: f64 = 1.5;

/// Differences of several pictures from their references.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ImageError {
    /// Root mean square difference of colour channels over all pictures, as a share of the full range, 0 to 1.
    #[schemars(range(min = 0.0))]
    pub rmse: f64,
    /// Peak signal-to-noise ratio of that difference, decibels; infinite for equal pictures.
    #[serde(with = "extended")]
    #[schemars(with = "Extended")]
    pub psnr: f64,
    /// Mean structural similarity (SSIM); 1 for equal pictures.
    pub ssim: f64,
    /// Mean FLIP, 0 to 1; 0 for equal pictures.
    #[schemars(range(min = 0.0))]
    pub flip: f64,
}

impl ImageError {
    /// Combines the differences of pictures; `None` without pictures.
    pub fn mean(pictures: &[Difference]) -> Option<Self> {
        let mean = |of: fn(&Difference) -> Option<f64>| {
            let values: Vec<f64> = pictures.iter().filter_map(of).collect();
            (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
        };
        let noise = mean(|d| Some(d.rmse * d.rmse))?;
        Some(Self {
            rmse: noise.sqrt() / 255.0,
            psnr: if noise > 0.0 { 10.0 * (255.0 * 255.0 / noise).log10() } else { f64::INFINITY },
            ssim: mean(|d| d.ssim).unwrap_or(1.0),
            flip: mean(|d| Some(d.flip_mean))?,
        })
    }
}

/// Difference of one picture from its reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Root mean square difference over all pixels and channels, 0 to 255.
    pub rmse: f64,
    /// Peak signal-to-noise ratio, decibels; `None` for equal pictures.
    pub psnr_db: Option<f64>,
    /// Mean structural similarity; 1 for equal pictures, `None` if the picture is smaller than the window.
    pub ssim: Option<f64>,
    /// Mean FLIP over all pixels, 0 to 1; 0 for equal pictures.
    pub flip_mean: f64,
    /// Largest FLIP of a pixel, 0 to 1.
    pub flip_max: f64,
}

/// Error: the pictures differ in size.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("compared pictures: size: expected {0} × {1} pixels as the reference has, found {2} × {3}", .reference.0, .reference.1, .picture.0, .picture.1)]
pub struct SizesDiffer {
    /// Width and height of the picture.
    pub picture: (u32, u32),
    /// Width and height of the reference.
    pub reference: (u32, u32),
}

/// Compares a picture with its reference. Also returns a picture of FLIP with the paper's colours, from black (equal)
/// to pale yellow.
///
/// # Errors
/// If the pictures differ in size.
pub fn compare(picture: &RgbImage, reference: &RgbImage) -> Result<(Difference, RgbImage), SizesDiffer> {
    if picture.dimensions() != reference.dimensions() {
        return Err(SizesDiffer { picture: picture.dimensions(), reference: reference.dimensions() });
    }
    let rmse = rmse(picture, reference);
    let (flip, flipped) = flip(picture, reference);
    let difference = Difference {
        rmse,
        psnr_db: (rmse > 0.0).then(|| 20.0 * (255.0 / rmse).log10()),
        ssim: ssim(picture, reference),
        flip_mean: flip.iter().map(|&f| f64::from(f)).sum::<f64>() / flip.len().max(1) as f64,
        flip_max: f64::from(flip.iter().copied().fold(0.0, f32::max)),
    };
    Ok((difference, flipped))
}

fn rmse(picture: &RgbImage, reference: &RgbImage) -> f64 {
    let square = |(&a, &b): (&u8, &u8)| u64::from(a.abs_diff(b)).pow(2);
    let sum: u64 = picture.as_raw().iter().zip(reference.as_raw()).map(square).sum();
    (sum as f64 / picture.as_raw().len().max(1) as f64).sqrt()
}

/// Returns FLIP of each pixel, and a picture of it.
fn flip(picture: &RgbImage, reference: &RgbImage) -> (Vec<f32>, RgbImage) {
    let (width, height) = picture.dimensions();
    let [picture, reference] = [picture, reference].map(|p| FlipImageRgb8::with_data(width, height, p));
    let map = authors_flip(reference, picture, PIXELS_PER_DEGREE);
    let colours = map.apply_color_lut(&magma_lut()).to_vec();
    (map.to_vec(), RgbImage::from_raw(width, height, colours).expect("three bytes a pixel"))
}

/// A single-channel picture, row by row.
struct Plane {
    width: usize,
    values: Vec<f64>,
}

impl Plane {
    /// Returns the luma of a picture (Rec. 601), 0 to 255.
    fn luma(picture: &RgbImage) -> Self {
        let luma = |p: &image::Rgb<u8>| 0.299 * f64::from(p[0]) + 0.587 * f64::from(p[1]) + 0.114 * f64::from(p[2]);
        Self { width: picture.width() as usize, values: picture.pixels().map(luma).collect() }
    }

    /// Returns the product of two planes, pixel by pixel.
    fn product(&self, other: &Plane) -> Self {
        let values = self.values.iter().zip(&other.values).map(|(a, b)| a * b).collect();
        Self { width: self.width, values }
    }

    /// Returns the weighted mean of every window that lies inside. The weights are those along one axis.
    fn windowed(&self, weights: &[f64; WINDOW]) -> Vec<f64> {
        let height = self.values.len() / self.width;
        let mean = |start: usize, stride: usize, values: &[f64]| -> f64 {
            weights.iter().enumerate().map(|(k, weight)| weight * values[start + k * stride]).sum()
        };
        let inner = self.width + 1 - WINDOW;
        let along: Vec<f64> = (0..inner * height)
            .into_par_iter()
            .map(|k| mean(k / inner * self.width + k % inner, 1, &self.values))
            .collect();
        (0..inner * (height + 1 - WINDOW)).into_par_iter().map(|k| mean(k, inner, &along)).collect()
    }
}

/// Returns the mean SSIM over all windows; `None` if the picture is smaller than a window.
fn ssim(picture: &RgbImage, reference: &RgbImage) -> Option<f64> {
    if (picture.width().min(picture.height()) as usize) < WINDOW {
        return None;
    }
    let weights = gaussian();
    let (x, y) = (Plane::luma(picture), Plane::luma(reference));
    let means = [&x, &y, &x.product(&x), &y.product(&y), &x.product(&y)].map(|plane| plane.windowed(&weights));
    let count = means[0].len();
    let similar = |k: usize| similarity(means.each_ref().map(|plane| plane[k]));
    Some((0..count).map(similar).sum::<f64>() / count as f64)
}

/// Returns the SSIM of two windows with pixels x and y from the means of x, y, x², y² and x·y.
fn similarity([x, y, xx, yy, xy]: [f64; 5]) -> f64 {
    let (c1, c2) = ((0.01f64 * 255.0).powi(2), (0.03f64 * 255.0).powi(2));
    let numerator = (2.0 * x * y + c1) * (2.0 * (xy - x * y) + c2);
    numerator / ((x * x + y * y + c1) * (xx - x * x + yy - y * y + c2))
}

/// Returns the weights of a window along one axis; their sum is 1.
fn gaussian() -> [f64; WINDOW] {
    let weight = |k: usize| (-((k as f64 - (WINDOW / 2) as f64) / SIGMA).powi(2) / 2.0).exp();
    let sum: f64 = (0..WINDOW).map(weight).sum();
    std::array::from_fn(|k| weight(k) / sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture([w, h]: [u32; 2], colour: impl Fn(u32, u32) -> [u8; 3]) -> RgbImage {
        RgbImage::from_fn(w, h, |x, y| image::Rgb(colour(x, y)))
    }

    fn speckled(seed: u32, strength: u32) -> RgbImage {
        picture([40, 30], |x, y| {
            let noise =
                (x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca77) ^ seed).wrapping_mul(0x2c1b_3c6d) >> 16;
            let grey = 60 + 3 * x + noise % (strength + 1);
            [grey as u8, (grey / 2) as u8, (255 - grey) as u8]
        })
    }

    #[test]
    fn equal_pictures_do_not_differ() {
        let (figures, difference) = compare(&speckled(1, 9), &speckled(1, 9)).unwrap();
        assert_eq!((figures.rmse, figures.psnr_db, figures.flip_mean, figures.flip_max), (0.0, None, 0.0, 0.0));
        assert!((figures.ssim.unwrap() - 1.0).abs() < 1e-12);
        assert!(difference.pixels().all(|p| p == difference.get_pixel(0, 0)) && difference.dimensions() == (40, 30));
    }

    #[test]
    fn sizes_must_be_equal() {
        let error = compare(&picture([4, 5], |_, _| [0; 3]), &picture([5, 4], |_, _| [0; 3])).unwrap_err();
        let text = "compared pictures: size: expected 5 × 4 pixels as the reference has, found 4 × 5";
        assert_eq!(error.to_string(), text);
    }

    #[test]
    fn rmse_and_psnr_by_hand() {
        let black = picture([12, 12], |_, _| [0; 3]);
        // One channel of half the pixels is 30 off: mean square 900 / 6.
        let half = picture([12, 12], |x, _| [if x < 6 { 30 } else { 0 }, 0, 0]);
        let (figures, _) = compare(&half, &black).unwrap();
        assert!((figures.rmse - 150f64.sqrt()).abs() < 1e-12);
        assert!((figures.psnr_db.unwrap() - 10.0 * (255.0 * 255.0 / 150f64).log10()).abs() < 1e-12);
    }

    /// Of plain pictures, SSIM compares only the means.
    #[test]
    fn ssim_of_plain_pictures_by_hand() {
        let (a, b) = (picture([16, 11], |_, _| [100; 3]), picture([16, 11], |_, _| [140; 3]));
        let c1 = 2.55f64 * 2.55;
        let expected = (2.0 * 100.0 * 140.0 + c1) / (100.0 * 100.0 + 140.0 * 140.0 + c1);
        assert!((compare(&a, &b).unwrap().0.ssim.unwrap() - expected).abs() < 1e-9);
        for size in [[10, 40], [40, 10], [1, 1]] {
            let small = picture(size, |_, _| [0; 3]);
            assert_eq!(compare(&small, &small).unwrap().0.ssim, None);
        }
    }

    /// SSIM of a single window, with variances computed by their definition instead of means of squares.
    #[test]
    fn ssim_of_one_window_by_its_definition() {
        let whole = |seed| picture([11, 11], |x, y| [speckled(seed, 60).get_pixel(x, y)[0]; 3]);
        let (a, b) = (whole(1), whole(2));
        let weight = |x: u32, y: u32| (-(f64::from(x) - 5.0).powi(2) / 4.5 - (f64::from(y) - 5.0).powi(2) / 4.5).exp();
        let all: Vec<(u32, u32)> = (0..121).map(|k| (k % 11, k / 11)).collect();
        let total: f64 = all.iter().map(|&(x, y)| weight(x, y)).sum();
        let mean = |f: &dyn Fn(u32, u32) -> f64| all.iter().map(|&(x, y)| weight(x, y) * f(x, y)).sum::<f64>() / total;
        let grey = |picture: &RgbImage, x, y| f64::from(picture.get_pixel(x, y)[0]);
        let (ma, mb) = (mean(&|x, y| grey(&a, x, y)), mean(&|x, y| grey(&b, x, y)));
        let covariance = mean(&|x, y| (grey(&a, x, y) - ma) * (grey(&b, x, y) - mb));
        let variance = [(&a, ma), (&b, mb)].map(|(p, m)| mean(&|x, y| (grey(p, x, y) - m).powi(2)));
        let (c1, c2) = (6.5025, 58.5225);
        let expected = (2.0 * ma * mb + c1) * (2.0 * covariance + c2)
            / ((ma * ma + mb * mb + c1) * (variance[0] + variance[1] + c2));
        let found = compare(&a, &b).unwrap().0.ssim.unwrap();
        assert!((found - expected).abs() < 1e-9 && found < 0.9, "{found} against {expected}");
    }

    #[test]
    fn more_noise_is_worse_by_every_figure() {
        let reference = speckled(1, 0);
        let [slight, strong] = [8, 60].map(|strength| compare(&speckled(1, strength), &reference).unwrap().0);
        assert!(slight.rmse < strong.rmse && slight.psnr_db > strong.psnr_db);
        assert!(slight.ssim > strong.ssim && slight.flip_mean < strong.flip_mean && slight.flip_mean > 0.0);
    }

    /// FLIP of plain pictures by the paper's formulas. Without edges, it is the remapped HyAB distance of the
    /// Hunt-adjusted colours.
    #[test]
    fn flip_of_plain_pictures_by_hand() {
        let colours = [[0, 0, 0], [255, 255, 255], [200, 30, 60], [190, 40, 60], [0, 255, 0], [0, 0, 255]];
        for (a, b) in colours.iter().flat_map(|a| colours.iter().map(move |b| (*a, *b))) {
            let (figures, _) = compare(&picture([24, 24], |_, _| a), &picture([24, 24], |_, _| b)).unwrap();
            let expected = flip_of_colours(a, b);
            assert!((figures.flip_mean - expected).abs() < 2e-3, "{a:?} and {b:?}: {figures:?}, expected {expected}");
            assert!((figures.flip_max - figures.flip_mean).abs() < 2e-3, "everywhere the same");
        }
    }

    fn flip_of_colours(a: [u8; 3], b: [u8; 3]) -> f64 {
        let distance = |a, b| hyab(hunt_adjusted(a), hunt_adjusted(b)).powf(0.7);
        // The paper's remapping: the largest distance is that of green and blue, and 40 % of it maps to 0.95.
        let (largest, found) = (distance([0, 255, 0], [0, 0, 255]), distance(a, b));
        let knee = 0.4 * largest;
        if found < knee { found / knee * 0.95 } else { 0.95 + (found - knee) / (largest - knee) * 0.05 }
    }

    fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
        (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
    }

    /// CIELAB (D65), a* and b* scaled by L*/100.
    fn hunt_adjusted(colour: [u8; 3]) -> [f64; 3] {
        let [r, g, b] = colour.map(|c| {
            let c = f64::from(c) / 255.0;
            if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        });
        let xyz = |r: f64, g: f64, b: f64| {
            [
                0.412_390_8 * r + 0.357_584_3 * g + 0.180_480_8 * b,
                0.212_639_0 * r + 0.715_168_7 * g + 0.072_192_3 * b,
                0.019_330_8 * r + 0.119_194_8 * g + 0.950_532_2 * b,
            ]
        };
        let (point, white) = (xyz(r, g, b), xyz(1.0, 1.0, 1.0));
        let f = |t: f64| if t > 216.0 / 24389.0 { t.cbrt() } else { t * 841.0 / 108.0 + 4.0 / 29.0 };
        let [x, y, z] = [0, 1, 2].map(|k| f(point[k] / white[k]));
        let lightness = 116.0 * y - 16.0;
        [lightness, 5.0 * (x - y) * lightness, 2.0 * (y - z) * lightness]
    }
}
