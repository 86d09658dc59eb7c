//! Noise: functions over the unit square whose opposite edges meet, and over the plane. Additions, multiplications and
//! square roots only, which every machine rounds alike.

/// A whole number's bits mixed up, as a number from 0 up to 1.
fn hashed(x: i32, y: i32, seed: u32) -> f32 {
    let mut k =
        (x as u32).wrapping_mul(0x9e37_79b1) ^ (y as u32).wrapping_mul(0x85eb_ca77) ^ seed.wrapping_mul(0xc2b2_ae3d);
    k = (k ^ (k >> 15)).wrapping_mul(0x2c1b_3c6d);
    k = (k ^ (k >> 12)).wrapping_mul(0x297a_2d39);
    ((k ^ (k >> 15)) >> 8) as f32 / (1 << 24) as f32
}

/// From 0 to 1 with both ends level, twice differentiable (Perlin 2002).
fn faded(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// Values on a lattice of `cells` × `cells` and smooth between them: 0 to 1.
pub fn values(p: [f32; 2], cells: i32, seed: u32) -> f32 {
    let [x, y] = p.map(|n| n * cells as f32);
    let (i, j) = (x.floor(), y.floor());
    let at = |di: i32, dj: i32| hashed((i as i32 + di).rem_euclid(cells), (j as i32 + dj).rem_euclid(cells), seed);
    between([x - i, y - j], at)
}

/// The same over the plane, its lattice 1 apart, up to 2^31 from the middle.
pub fn open_values(p: [f64; 2], seed: u32) -> f32 {
    let [i, j] = p.map(f64::floor);
    let at = |di: i32, dj: i32| hashed((i as i32).wrapping_add(di), (j as i32).wrapping_add(dj), seed);
    between([(p[0] - i) as f32, (p[1] - j) as f32], at)
}

/// Between the values at four corners.
fn between(inside: [f32; 2], at: impl Fn(i32, i32) -> f32) -> f32 {
    let [u, v] = inside.map(faded);
    let row = |dj: i32| at(0, dj) + (at(1, dj) - at(0, dj)) * u;
    row(0) + (row(1) - row(0)) * v
}

/// Octaves of [`values`], each of twice the cells and half the height of the one before: 0 to 1.
pub fn octaves(p: [f32; 2], cells: i32, count: u32, seed: u32) -> f32 {
    let (mut sum, mut whole, mut part) = (0.0, 0.0, 1.0);
    for k in 0..count {
        sum += part * values(p, cells << k, seed.wrapping_add(k));
        whole += part;
        part *= 0.5;
    }
    sum / whole
}

/// One random point in each cell (Worley 1996).
pub struct Nearest {
    /// Distance to the nearest point, in cells.
    pub first: f32,
    /// Distance to the second nearest.
    pub second: f32,
    /// A number from 0 to 1 that all places with the same nearest point share.
    pub own: f32,
}

/// The points nearest a place, one in each of `cells` × `cells` cells.
pub fn nearest(p: [f32; 2], cells: i32, seed: u32) -> Nearest {
    let place = p.map(|n| n * cells as f32);
    nearest_of(place, place.map(|n| n.floor() as i32), seed, |cell| cell.map(|n| n.rem_euclid(cells)))
}

/// The same over the plane, cells 1 wide, up to 2^31 from the middle.
pub fn open_nearest(p: [f64; 2], seed: u32) -> Nearest {
    let first = p.map(f64::floor);
    let inside = [0, 1].map(|k| (p[k] - first[k]) as f32);
    nearest_of(inside, [0; 2], seed, |cell| [0, 1].map(|k| (first[k] as i32).wrapping_add(cell[k])))
}

/// Of a place in a cell; `named` says which cell one is.
fn nearest_of(place: [f32; 2], first: [i32; 2], seed: u32, named: impl Fn([i32; 2]) -> [i32; 2]) -> Nearest {
    let mut found = Nearest { first: f32::MAX, second: f32::MAX, own: 0.0 };
    for (di, dj) in (-1..=1).flat_map(|dj| (-1..=1).map(move |di| (di, dj))) {
        let here = [first[0] + di, first[1] + dj];
        let cell = named(here);
        let point = [0, 1].map(|k: u32| hashed(cell[0], cell[1], seed.wrapping_add(k)));
        let [dx, dy] = [0, 1].map(|k: usize| here[k] as f32 + point[k] - place[k]);
        let distance = (dx * dx + dy * dy).sqrt();
        if distance < found.first {
            let own = hashed(cell[0], cell[1], seed.wrapping_add(2));
            found = Nearest { first: distance, second: found.first, own };
        } else {
            found.second = found.second.min(distance);
        }
    }
    found
}
