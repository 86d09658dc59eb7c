//! Builds mip levels of images of any size, area-filtered in linear light.

use rayon::prelude::*;

use super::overlay_pyramid::{Picture, Texel, coded, linear};

/// The texels along an axis that one texel of the next level covers: index of the first, and a weight for each.
#[derive(Clone, Copy)]
struct Covered {
    first: usize,
    weights: [f32; 4],
}

/// Returns the next mip level: size and texels. Sides are halved and rounded down, at least 1. A texel is the mean of
/// the area it covers; where a side is odd, texels on the border of that area count in part.
pub fn halved(picture: Picture) -> ([u32; 2], Vec<Texel>) {
    let size = picture.size.map(|n| (n / 2).max(1));
    let [columns, rows] = [0, 1].map(|k| covered(picture.size[k], size[k]));
    let width = picture.size[0] as usize;
    let texels = rows.into_par_iter().flat_map_iter(|row| {
        let columns = &columns;
        columns.iter().map(move |column| {
            let mut sum = [0.0; 4];
            for (j, v) in row.each() {
                for (i, u) in column.each() {
                    let light = linear(picture.texels[j * width + i]);
                    (0..4).for_each(|c| sum[c] += u * v * light[c]);
                }
            }
            coded(sum)
        })
    });
    (size, texels.collect())
}

/// Returns the coverage of `count` texels by each of `fewer` texels; the weights of each add up to 1.
fn covered(count: u32, fewer: u32) -> Vec<Covered> {
    let length = f64::from(count) / f64::from(fewer);
    let of = |n: u32| {
        let (start, end) = (f64::from(n) * length, f64::from(n + 1) * length);
        let first = start.floor();
        let weight = |k: usize| {
            let at = first + k as f64;
            ((end.min(at + 1.0) - start.max(at)).max(0.0) / length) as f32
        };
        Covered { first: first as usize, weights: std::array::from_fn(weight) }
    };
    (0..fewer).map(of).collect()
}

impl Covered {
    fn each(&self) -> impl Iterator<Item = (usize, f32)> {
        (self.first..).zip(self.weights).filter(|(_, weight)| *weight > 1e-6)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_texel_has_weight_proportional_to_its_area() {
        for count in [1, 2, 3, 5, 6, 7, 100, 1531, 14_001] {
            let fewer = (count / 2).max(1);
            let mut counted = vec![0.0; count as usize];
            for texel in covered(count, fewer) {
                assert!((texel.weights.iter().sum::<f32>() - 1.0).abs() < 1e-5);
                texel.each().for_each(|(k, weight)| counted[k] += f64::from(weight));
            }
            let share = f64::from(fewer) / f64::from(count);
            assert!(counted.iter().all(|c| (c - share).abs() < 1e-4), "{count}: {counted:?}");
        }
    }

    /// A checkerboard of black and white averages to 188 of 255 in sRGB: half in linear light.
    #[test]
    fn a_checkerboard_averages_to_linear_grey() {
        for size in [[64, 64], [61, 37], [3, 5], [2, 1]] {
            let colour = |k: u32| if (k % size[0] + k / size[0]).is_multiple_of(2) { [255; 4] } else { [0, 0, 0, 255] };
            let mut level = (size, (0..size[0] * size[1]).map(colour).collect::<Vec<Texel>>());
            level = halved(Picture { size: level.0, texels: &level.1 });
            assert_eq!(level.0, size.map(|n| (n / 2).max(1)));
            // Where three texels become one, one or two of them are white.
            let slack = if size[0].is_multiple_of(2) { 0 } else { 35 };
            assert!(
                level.1.iter().all(|t| t[0].abs_diff(188) <= slack && t[3] == 255),
                "{size:?}: {:?}",
                &level.1[..1]
            );
        }
    }

    #[test]
    fn a_uniform_image_stays_uniform() {
        let texels = vec![[200, 17, 90, 128]; 50 * 31];
        let (size, next) = halved(Picture { size: [50, 31], texels: &texels });
        assert_eq!((size, next.len()), ([25, 15], 375));
        assert!(next.iter().all(|texel| *texel == texels[0]));
    }
}
