//! Value noise and cellular noise, tiling over the unit square or unbounded over the plane.
//!
//! Only additions, multiplications and square roots are used: IEEE 754 rounds them alike on every machine.

/// Hashes a lattice point and a seed to a number in [0, 1).
fn hash_unit(x: i32, y: i32, seed: u32) -> f32 {
    let mut k =
        (x as u32).wrapping_mul(0x9e37_79b1) ^ (y as u32).wrapping_mul(0x85eb_ca77) ^ seed.wrapping_mul(0xc2b2_ae3d);
    k = (k ^ (k >> 15)).wrapping_mul(0x2c1b_3c6d);
    k = (k ^ (k >> 12)).wrapping_mul(0x297a_2d39);
    ((k ^ (k >> 15)) >> 8) as f32 / (1 << 24) as f32
}

/// Quintic interpolant from 0 to 1 with zero first and second derivatives at both ends (Perlin 2002).
fn fade(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// Value noise over the unit square on a wrapping lattice of `cells` × `cells`; 0 to 1.
pub fn values(p: [f32; 2], cells: i32, seed: u32) -> f32 {
    let [x, y] = p.map(|n| n * cells as f32);
    let (i, j) = (x.floor(), y.floor());
    let at = |di: i32, dj: i32| hash_unit((i as i32 + di).rem_euclid(cells), (j as i32 + dj).rem_euclid(cells), seed);
    between([x - i, y - j], at)
}

/// Value noise over the plane with a lattice spacing of 1; 0 to 1. Valid up to 2^31 from the origin.
pub fn plane_values(p: [f64; 2], seed: u32) -> f32 {
    let [i, j] = p.map(f64::floor);
    let at = |di: i32, dj: i32| hash_unit((i as i32).wrapping_add(di), (j as i32).wrapping_add(dj), seed);
    between([(p[0] - i) as f32, (p[1] - j) as f32], at)
}

/// Interpolates the values at the four corners of a cell.
fn between(inside: [f32; 2], at: impl Fn(i32, i32) -> f32) -> f32 {
    let [u, v] = inside.map(fade);
    let row = |dj: i32| at(0, dj) + (at(1, dj) - at(0, dj)) * u;
    row(0) + (row(1) - row(0)) * v
}

/// Sum of octaves of [`values`], each with twice the cells and half the amplitude of the previous one; normalised to
/// 0 to 1.
pub fn octaves(p: [f32; 2], cells: i32, count: u32, seed: u32) -> f32 {
    let (mut sum, mut whole, mut part) = (0.0, 0.0, 1.0);
    for k in 0..count {
        sum += part * values(p, cells << k, seed.wrapping_add(k));
        whole += part;
        part *= 0.5;
    }
    sum / whole
}

/// Result of cellular noise with one random feature point per cell (Worley 1996).
pub struct Nearest {
    /// Distance to the nearest feature point, in cells.
    pub first: f32,
    /// Distance to the second nearest, in cells.
    pub second: f32,
    /// A random number, 0 to 1, of the nearest feature point.
    pub own: f32,
}

/// Cellular noise over the unit square on a wrapping grid of `cells` × `cells`.
pub fn nearest(p: [f32; 2], cells: i32, seed: u32) -> Nearest {
    let place = p.map(|n| n * cells as f32);
    nearest_of(place, place.map(|n| n.floor() as i32), seed, |cell| cell.map(|n| n.rem_euclid(cells)))
}

/// Cellular noise over the plane with cells 1 wide. Valid up to 2^31 from the origin.
pub fn plane_nearest(p: [f64; 2], seed: u32) -> Nearest {
    let first = p.map(f64::floor);
    let inside = [0, 1].map(|k| (p[k] - first[k]) as f32);
    nearest_of(inside, [0; 2], seed, |cell| [0, 1].map(|k| (first[k] as i32).wrapping_add(cell[k])))
}

/// Searches the 3 × 3 cells around a point; `cell_id` maps a neighbour to the cell that seeds it.
fn nearest_of(place: [f32; 2], first: [i32; 2], seed: u32, cell_id: impl Fn([i32; 2]) -> [i32; 2]) -> Nearest {
    let mut found = Nearest { first: f32::MAX, second: f32::MAX, own: 0.0 };
    for (di, dj) in (-1..=1).flat_map(|dj| (-1..=1).map(move |di| (di, dj))) {
        let here = [first[0] + di, first[1] + dj];
        let cell = cell_id(here);
        let point = [0, 1].map(|k: u32| hash_unit(cell[0], cell[1], seed.wrapping_add(k)));
        let [dx, dy] = [0, 1].map(|k: usize| here[k] as f32 + point[k] - place[k]);
        let distance = (dx * dx + dy * dy).sqrt();
        if distance < found.first {
            let own = hash_unit(cell[0], cell[1], seed.wrapping_add(2));
            found = Nearest { first: distance, second: found.first, own };
        } else {
            found.second = found.second.min(distance);
        }
    }
    found
}
