//! Generates the detail textures: four ground materials, each a square texture that tiles without seams.
//!
//! A texel is four bytes centred on 128: brightness, hue between the material's two colours, and the surface slopes
//! along x and z (±2 at the ends of the range). Each channel has mean 128. The coarsest mip level is therefore the
//! material's mean colour on smooth ground, so that mipmapping fades detail out with distance. Slopes replace a
//! normal map because they average as the surface does.

use rayon::prelude::*;

use super::noise::{nearest, octaves, values};

/// Texels along a side of the finest mip level, a power of two.
pub const SIDE: u32 = 512;

/// Names of the materials, in array layer order.
pub const MATERIALS: [&str; 4] = ["grass", "rock", "scree", "snow"];

/// Mip levels of each layer, down to a single texel.
pub const LEVELS: u32 = SIDE.ilog2() + 1;

/// Bytes per unit of slope.
const SLOPE: f32 = 64.0;

/// A texel: brightness, hue, slope along x, slope along z; 128 is the mean.
pub type Texel = [u8; 4];

/// Returns the device bytes of all layers with all mip levels.
pub fn bytes() -> u64 {
    let texels: u64 = (0..LEVELS).map(|level| u64::from(SIDE >> level).pow(2)).sum();
    texels * MATERIALS.len() as u64 * size_of::<Texel>() as u64
}

/// The surface of a material at a point of the unit square. Brightness and hue may have any mean; height is in units
/// of the square's side.
struct Surface {
    brightness: f32,
    hue: f32,
    height: f32,
}

/// Returns all mip levels of all layers: indexed by layer, then by level (finest first).
pub fn layers() -> Vec<Vec<Vec<Texel>>> {
    [grass, rock, scree, snow].iter().map(|material| levels(layer(*material))).collect()
}

/// Samples a material at each texel centre and encodes brightness, hue and slopes around their means.
fn layer(material: fn([f32; 2]) -> Surface) -> Vec<Texel> {
    let side = SIDE as usize;
    let place = |n: usize| (n as f32 + 0.5) / SIDE as f32;
    let surface: Vec<Surface> =
        (0..side * side).into_par_iter().map(|k| material([place(k % side), place(k / side)])).collect();
    let mean =
        |of: fn(&Surface) -> f32| (surface.iter().map(|g| f64::from(of(g))).sum::<f64>() / surface.len() as f64) as f32;
    let [brightness, hue] = [mean(|g| g.brightness), mean(|g| g.hue)];
    let around = |n: f32| (128.0 + n).clamp(0.0, 255.0).round() as u8;
    let texel = |k: usize| {
        let (x, z) = (k % side, k / side);
        let height = |x: usize, z: usize| surface[(z % side) * side + x % side].height;
        // Central difference over two texels; a texel is 1 / SIDE wide.
        let rise = |next: f32, last: f32| (next - last) * SIDE as f32 / 2.0;
        let slopes = [rise(height(x + 1, z), height(x + side - 1, z)), rise(height(x, z + 1), height(x, z + side - 1))];
        let [along_x, along_z] = slopes.map(|slope| around(SLOPE * slope));
        let Surface { brightness: bright, hue: of_hue, .. } = surface[k];
        [around(255.0 * (bright - brightness)), around(255.0 * (of_hue - hue)), along_x, along_z]
    };
    (0..side * side).map(texel).collect()
}

/// Builds the mip chain of a layer by averaging 2 × 2 texels.
fn levels(finest: Vec<Texel>) -> Vec<Vec<Texel>> {
    let mut levels = vec![finest];
    for level in 1..LEVELS {
        let (finer, side) = (&levels[level as usize - 1], (SIDE >> level) as usize);
        let texel = |k: usize| {
            let first = k / side * 2 * (2 * side) + k % side * 2;
            let four = [first, first + 1, first + 2 * side, first + 2 * side + 1].map(|k| finer[k]);
            // Rounds halves up and down in turn, so that each level keeps the mean of the finer one.
            std::array::from_fn(|c| {
                ((four.iter().map(|t| u32::from(t[c])).sum::<u32>() + 1 + (k % 2) as u32) / 4) as u8
            })
        };
        levels.push((0..side * side).map(texel).collect());
    }
    levels
}

/// Tufts in clumps.
fn grass(p: [f32; 2]) -> Surface {
    let clumps = octaves(p, 7, 4, 11);
    let tufts = nearest([p[0] + 0.012 * values(p, 40, 17), p[1] + 0.012 * values(p, 40, 18)], 52, 12);
    let blades = octaves(p, 96, 3, 15);
    let tuft = (1.0 - tufts.first).max(0.0);
    Surface {
        brightness: 0.22 * clumps + 0.20 * tuft * (0.6 + 0.4 * tufts.own) + 0.30 * blades,
        hue: 0.8 * octaves(p, 5, 4, 19) + 0.35 * tufts.own + 0.2 * blades,
        height: 0.012 * tuft + 0.006 * blades + 0.012 * clumps,
    }
}

/// Layered rock with cracks.
fn rock(p: [f32; 2]) -> Surface {
    let bent = [0, 1].map(|k| p[k] + 0.06 * (octaves(p, 5, 4, 21 + k as u32) - 0.5));
    let ridge = |cells: i32, seed: u32| 1.0 - (2.0 * octaves(bent, cells, 5, seed) - 1.0).abs();
    let blocks = nearest(bent, 9, 31);
    let splits = nearest(bent, 23, 34);
    let crack = |gap: f32, width: f32| (gap / width).min(1.0);
    let cracks = crack(blocks.second - blocks.first, 0.10) * (0.55 + 0.45 * crack(splits.second - splits.first, 0.09));
    let ridges = 0.6 * ridge(4, 25) + 0.4 * ridge(11, 26);
    Surface {
        brightness: 0.35 * cracks + 0.30 * ridges + 0.12 * blocks.own + 0.10 * octaves(p, 80, 3, 29),
        hue: 0.7 * octaves(p, 4, 5, 27) + 0.3 * blocks.own,
        height: 0.030 * ridges + 0.016 * cracks + 0.012 * blocks.own + 0.004 * octaves(p, 64, 3, 28),
    }
}

/// Stones of three sizes on sand.
fn scree(p: [f32; 2]) -> Surface {
    let sand = octaves(p, 110, 2, 41);
    let mut surface = Surface { brightness: 0.25 + 0.2 * sand, hue: 0.5 * octaves(p, 6, 4, 42), height: 0.002 * sand };
    for (cells, seed, share) in [(58, 43, 0.75), (27, 47, 0.6), (11, 51, 0.4)] {
        let stone = nearest(p, cells, seed);
        let size = 0.30 + 0.28 * stone.own;
        let round = 1.0 - (stone.first / size) * (stone.first / size);
        if stone.own < share && round > 0.0 {
            let height = 0.002 + 0.45 * round.sqrt() * size / cells as f32;
            if height > surface.height {
                let face = octaves(p, 60, 3, seed + 9);
                let shade = 0.5 + 0.5 * round.sqrt();
                surface.height = height + 0.002 * face;
                surface.brightness = (0.34 + 0.30 * stone.own / share) * shade + 0.16 * face;
                surface.hue = 0.25 + 0.9 * stone.own / share;
            }
        }
    }
    surface
}

/// Wind-blown ripples.
fn snow(p: [f32; 2]) -> Surface {
    let bent = [p[0] + 0.10 * octaves(p, 4, 3, 61), p[1] + 0.10 * octaves(p, 4, 3, 62)];
    let drift = octaves(bent, 3, 4, 63);
    let ripple = 1.0 - (2.0 * octaves([bent[0], bent[1]], 16, 3, 65) - 1.0).abs();
    let grain = octaves(p, 128, 2, 67);
    Surface {
        brightness: 0.10 * drift + 0.08 * ripple + 0.10 * grain,
        hue: 0.5 * drift + 0.3 * ripple,
        height: 0.030 * drift + 0.010 * ripple + 0.0015 * grain,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn means(texels: &[Texel]) -> [f64; 4] {
        std::array::from_fn(|c| texels.iter().map(|t| f64::from(t[c])).sum::<f64>() / texels.len() as f64)
    }

    /// Generation is deterministic. A change to a material must change this checksum.
    #[test]
    fn generated_bytes_match_their_checksum() {
        let bytes = layers().into_iter().flatten().flatten().flatten();
        let sum = bytes.fold(0xcbf2_9ce4_8422_2325u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x100_0000_01b3));
        assert_eq!(sum, 6275573053617688208);
    }

    #[test]
    fn every_mip_level_has_mean_128() {
        let layers = layers();
        assert_eq!((layers.len(), bytes()), (4, 4 * layers.iter().flatten().map(|l| l.len() as u64).sum::<u64>()));
        for (name, levels) in MATERIALS.iter().zip(&layers) {
            assert_eq!(levels.len() as u32, LEVELS);
            for level in levels {
                assert!(means(level).iter().all(|mean| (mean - 128.0).abs() < 1.5), "{name}: {:?}", means(level));
            }
            let spread =
                |c: usize| levels[0].iter().map(|t| (f64::from(t[c]) - 128.0).powi(2)).sum::<f64>().sqrt() / 512.0;
            assert!((0..4).all(|c| spread(c) > 2.0), "{name} is plain: {:?}", [0, 1, 2, 3].map(spread));
        }
    }

    /// The difference between neighbouring texels across the wrap-around edge is no larger than inside.
    #[test]
    fn textures_tile_without_seams() {
        let side = SIDE as usize;
        for (name, levels) in MATERIALS.iter().zip(layers()) {
            let texel = |x: usize, z: usize| levels[0][z % side * side + x % side];
            let step = |a: Texel, b: Texel| (0..4).map(|c| f64::from(a[c].abs_diff(b[c]))).sum::<f64>();
            let mean = |steps: Vec<f64>| steps.iter().sum::<f64>() / steps.len() as f64;
            let across = |x: usize| mean((0..side).map(|z| step(texel(x, z), texel(x + 1, z))).collect());
            let along = |z: usize| mean((0..side).map(|x| step(texel(x, z), texel(x, z + 1))).collect());
            for line in [&across as &dyn Fn(usize) -> f64, &along] {
                let inside = (0..side - 1).map(line).fold(0.0, f64::max);
                assert!(
                    line(side - 1) <= inside,
                    "{name}: {} across the edge, at most {inside} inside",
                    line(side - 1)
                );
            }
        }
    }
}
