//! Gradient noise that every machine computes alike: an integer hash, and + − × ÷ floor of f64 in the order written.
//!
//! Perlin, "Improving Noise" (2002), with 16 rational gradients instead of 12; the ridged sum follows Musgrave in
//! Ebert et al., "Texturing & Modeling" (2003).

/// Unit vectors with rational coordinates (3-4-5, 5-12-13) and the axes.
const GRADIENTS: [[f64; 2]; 16] = [
    [1.0, 0.0],
    [12.0 / 13.0, 5.0 / 13.0],
    [0.8, 0.6],
    [0.6, 0.8],
    [0.0, 1.0],
    [-5.0 / 13.0, 12.0 / 13.0],
    [-0.6, 0.8],
    [-0.8, 0.6],
    [-1.0, 0.0],
    [-12.0 / 13.0, -5.0 / 13.0],
    [-0.8, -0.6],
    [-0.6, -0.8],
    [0.0, -1.0],
    [5.0 / 13.0, -12.0 / 13.0],
    [0.6, -0.8],
    [0.8, -0.6],
];

/// 32 well-mixed bits of a lattice point and a seed.
pub fn hash(x: i64, z: i64, seed: u64) -> u32 {
    let seed = (seed as u32).wrapping_mul(0xC2B2_AE3D) ^ ((seed >> 32) as u32).wrapping_mul(0x27D4_EB2F);
    let mut h = (x as u32).wrapping_mul(0x9E37_79B1) ^ (z as u32).wrapping_mul(0x85EB_CA77) ^ seed;
    h = (h ^ h >> 15).wrapping_mul(0x2C1B_3C6D);
    h = (h ^ h >> 12).wrapping_mul(0x297A_2D39);
    h ^ h >> 15
}

/// The hash as a number in [−1, 1).
pub fn white(x: i64, z: i64, seed: u64) -> f64 {
    f64::from(hash(x, z, seed)) / 2_147_483_648.0 - 1.0
}

/// Gradient noise of wavelength 1, about [−1, 1].
pub fn gradient(x: f64, z: f64, seed: u64) -> f64 {
    let (cell_x, cell_z) = (x.floor(), z.floor());
    let (ix, iz) = (cell_x as i64, cell_z as i64);
    let (rx, rz) = (x - cell_x, z - cell_z);
    let fade = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let (tx, tz) = (fade(rx), fade(rz));
    let corner = |dx: i64, dz: i64| {
        let [gx, gz] = GRADIENTS[(hash(ix + dx, iz + dz, seed) & 15) as usize];
        gx * (rx - dx as f64) + gz * (rz - dz as f64)
    };
    let (a, b, c, d) = (corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1));
    let ab = a + (b - a) * tx;
    let cd = c + (d - c) * tx;
    (ab + (cd - ab) * tz) * 1.5
}

/// Turned by the 3-4-5 angle and doubled in frequency, so that no two octaves share their lattice lines.
pub fn next_octave([x, z]: [f64; 2]) -> [f64; 2] {
    [(x * 0.8 - z * 0.6) * 2.0 + 0.37, (x * 0.6 + z * 0.8) * 2.0 + 0.71]
}

/// Sum of `octaves` octaves, each of half the amplitude of the one before; about [−1, 1].
pub fn fractal(p: [f64; 2], octaves: u32, seed: u64) -> f64 {
    sum(p, octaves, seed, |n| n)
}

/// As [`fractal`], of octaves folded to crests: 1 on the zero lines of each octave; about [−1, 1].
pub fn ridged(p: [f64; 2], octaves: u32, seed: u64) -> f64 {
    sum(p, octaves, seed, |n| 1.0 - 2.0 * n.abs())
}

fn sum(mut p: [f64; 2], octaves: u32, seed: u64, shape: impl Fn(f64) -> f64) -> f64 {
    let (mut total, mut norm, mut amplitude) = (0.0, 0.0, 1.0);
    for octave in 0..octaves {
        total += shape(gradient(p[0], p[1], seed.wrapping_add(u64::from(octave)))) * amplitude;
        norm += amplitude;
        amplitude *= 0.5;
        p = next_octave(p);
    }
    total / norm
}

/// `p` moved by a smooth vector field of wavelength 1, up to about `strength`.
pub fn warped([x, z]: [f64; 2], strength: f64, seed: u64) -> [f64; 2] {
    let by = |salt: u64| fractal([x, z], 3, seed.wrapping_add(salt)) * strength;
    [x + by(0x51), z + by(0xA7)]
}
