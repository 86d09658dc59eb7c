//! An overlay image as mip levels per page: filtered over the whole image first, then cut into square pages.
//!
//! After M. Finch and L. Bishop, "Sorted Height Field Rendering" (1998), §4.8. Texels lie on a lattice, as heights
//! do: a page has 2^n + 1 texels along a side and shares its border texels with the adjacent pages, at every mip
//! level. Two pages of one level therefore sample equally along their common edge; filtering each page on its own
//! would break that. A level keeps every other texel of the finer one, weighted 1 : 2 : 1 with its neighbours, in
//! linear light.

use rayon::prelude::*;

/// Red, green and blue as sRGB codes, and linear opacity.
pub type Texel = [u8; 4];

/// An RGBA image in memory.
#[derive(Clone, Copy, Debug)]
pub struct Picture<'a> {
    /// Texels along (x, z), at least 1.
    pub size: [u32; 2],
    /// Texels, row by row.
    pub texels: &'a [Texel],
}

/// The grid of pages over an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PyramidLayout {
    /// Pages along (x, z).
    pub pages: [u32; 2],
    /// Length of the image's sides in pages. Less than `pages` where the last page extends beyond the image.
    pub extent: [f64; 2],
    /// True, per axis, if the image wraps around.
    pub repeats: [bool; 2],
}

/// One mip level of all pages in one image.
struct MipLevel {
    size: [u32; 2],
    texels: Vec<Texel>,
}

/// All mip levels of all pages.
pub struct OverlayPyramid {
    levels: Vec<MipLevel>,
}

/// Upper limit of cells along a side of a page at mip level 0.
const MAX_CELLS: u32 = 4096;

impl OverlayPyramid {
    /// Filters an image. Mip level 0 is at least as fine as the image, up to 2^12 cells along a side of a page.
    ///
    /// # Panics
    /// If the image or the layout is empty, or if the period along a repeating axis is not a whole number of pages.
    pub fn new(picture: Picture, layout: PyramidLayout) -> Self {
        assert_eq!(picture.texels.len(), picture.size[0] as usize * picture.size[1] as usize);
        for k in 0..2 {
            assert!(picture.size[k] > 0 && layout.pages[k] > 0 && layout.extent[k] > 0.0, "an empty picture");
            assert!(!layout.repeats[k] || layout.extent[k] == f64::from(layout.pages[k]), "repeats within a page");
        }
        let needed = (0..2).map(|k| f64::from(picture.size[k]) / layout.extent[k]).fold(1.0, f64::max);
        let cells = (needed.ceil().min(f64::from(MAX_CELLS)) as u32).next_power_of_two();
        let mut levels = vec![MipLevel::resampled(picture, &layout, cells)];
        for _ in 0..cells.ilog2() {
            levels.extend(levels.last().map(|finer| finer.halved(layout.repeats)));
        }
        Self { levels }
    }

    /// Returns the number of mip levels of a page. The coarsest is one cell, or 2 × 2 texels.
    pub fn levels(&self) -> u32 {
        self.levels.len() as u32
    }

    /// Returns the texels along a side of a page at a mip level.
    pub fn side(&self, level: u32) -> u32 {
        self.cells(level) + 1
    }

    /// Returns the cells along a side of a page at a mip level.
    fn cells(&self, level: u32) -> u32 {
        1 << (self.levels() - 1 - level)
    }

    /// Returns a tile of constant size at a mip level: `side(0)`² texels, which cover 2^level × 2^level pages. `at`
    /// is the index of that square of pages along (x, z). Beyond the last page its border texels repeat.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn tile(&self, level: u32, at: [u32; 2]) -> Vec<Texel> {
        let (of, cells) = (&self.levels[level as usize], self.cells(0));
        let along = |k: usize| (0..=cells).map(move |n| (at[k] * cells + n).min(of.size[k] - 1) as usize);
        along(1).flat_map(|z| along(0).map(move |x| of.texels[z * of.size[0] as usize + x])).collect()
    }
}

impl MipLevel {
    /// Resamples the image bilinearly to the lattice of mip level 0.
    fn resampled(picture: Picture, layout: &PyramidLayout, cells: u32) -> Self {
        let size = layout.pages.map(|n| n * cells + 1);
        // The two image texels around a lattice position, and the weight of the second.
        let between = |k: usize, n: usize| {
            let count = picture.size[k] as i64;
            let t = n as f64 / f64::from(cells) / layout.extent[k] * count as f64 - 0.5;
            let at = |n: i64| (if layout.repeats[k] { n.rem_euclid(count) } else { n.clamp(0, count - 1) }) as usize;
            (at(t.floor() as i64), at(t.floor() as i64 + 1), (t - t.floor()) as f32)
        };
        let columns: Vec<_> = (0..size[0] as usize).map(|n| between(0, n)).collect();
        let texel = |i: usize, j: usize| linear(picture.texels[j * picture.size[0] as usize + i]);
        let rows = (0..size[1] as usize).into_par_iter().flat_map_iter(|z| {
            let (north, south, v) = between(1, z);
            columns.iter().map(move |&(west, east, u)| {
                let row = |j: usize| mixed(texel(west, j), texel(east, j), u);
                coded(mixed(row(north), row(south), v))
            })
        });
        Self { size, texels: rows.collect() }
    }

    /// Filters with weights 1 : 2 : 1 along both axes and keeps every other texel.
    fn halved(&self, repeats: [bool; 2]) -> Self {
        let size = self.size.map(|n| n / 2 + 1);
        // Where the image wraps around, its last texel equals its first; elsewhere the border repeats.
        let beside = |k: usize, n: i64| {
            let last = i64::from(self.size[k]) - 1;
            (if repeats[k] { n.rem_euclid(last) } else { n.clamp(0, last) }) as usize
        };
        let texel = |i: usize, j: usize| linear(self.texels[j * self.size[0] as usize + i]);
        let weighted = |t: [[f32; 4]; 3]| std::array::from_fn(|c| t[0][c] * 0.25 + t[1][c] * 0.5 + t[2][c] * 0.25);
        let rows = (0..i64::from(size[1])).into_par_iter().flat_map_iter(|z| {
            let rows = [-1, 0, 1].map(|n| beside(1, 2 * z + n));
            (0..i64::from(size[0])).map(move |x| {
                let columns = [-1, 0, 1].map(|n| beside(0, 2 * x + n));
                coded(weighted(rows.map(|j| weighted(columns.map(|i| texel(i, j))))))
            })
        });
        Self { size, texels: rows.collect() }
    }
}

fn mixed(a: [f32; 4], b: [f32; 4], t: f32) -> [f32; 4] {
    std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t)
}

/// Linear light of each sRGB code (IEC 61966-2-1).
static LINEAR: std::sync::LazyLock<[f32; 256]> =
    std::sync::LazyLock::new(|| std::array::from_fn(|code| light(code as f32 / 255.0)));

/// Decodes an sRGB component, 0 to 1, to linear light.
fn light(c: f32) -> f32 {
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// Decodes a texel to linear light and opacity, 0 to 1.
pub(super) fn linear([r, g, b, a]: Texel) -> [f32; 4] {
    let light = |code: u8| LINEAR[usize::from(code)];
    [light(r), light(g), light(b), f32::from(a) / 255.0]
}

/// Linear light at the midpoint between each sRGB code and the next: the rounding thresholds.
static HALFWAY: std::sync::LazyLock<[f32; 255]> =
    std::sync::LazyLock::new(|| std::array::from_fn(|code| light((code as f32 + 0.5) / 255.0)));

/// Encodes linear light and opacity to the nearest texel.
pub(super) fn coded([r, g, b, a]: [f32; 4]) -> Texel {
    let code = |light: f32| HALFWAY.partition_point(|end| *end <= light) as u8;
    [code(r), code(g), code(b), (a * 255.0).round() as u8]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uncorrelated texels.
    fn noise(size: [u32; 2]) -> Vec<Texel> {
        (0..size[0] * size[1]).map(|k| (k.wrapping_mul(0x9e37_79b1) ^ k << 7).to_le_bytes()).collect()
    }

    fn pyramid(size: [u32; 2], layout: PyramidLayout) -> OverlayPyramid {
        OverlayPyramid::new(Picture { size, texels: &noise(size) }, layout)
    }

    fn whole(pages: [u32; 2], repeats: bool) -> PyramidLayout {
        PyramidLayout { pages, extent: pages.map(f64::from), repeats: [repeats; 2] }
    }

    /// Returns the texels of a page at a mip level, row by row.
    fn page_texels(pyramid: &OverlayPyramid, page: [u32; 2], level: u32) -> Vec<Texel> {
        let (of, side) = (&pyramid.levels[level as usize], pyramid.side(level) as usize);
        assert!((0..2).all(|k| page[k] < (of.size[k] - 1) / pyramid.cells(level)), "page {page:?}");
        let [x, z] = page.map(|n| (n * pyramid.cells(level)) as usize);
        let row = |j: usize| (z + j) * of.size[0] as usize + x;
        (0..side).flat_map(|j| &of.texels[row(j)..row(j) + side]).copied().collect()
    }

    fn column(texels: &[Texel], side: u32, n: u32) -> Vec<Texel> {
        texels.iter().skip(n as usize).step_by(side as usize).copied().collect()
    }

    fn row(texels: &[Texel], side: u32, n: u32) -> Vec<Texel> {
        texels[(n * side) as usize..((n + 1) * side) as usize].to_vec()
    }

    /// Adjacent pages have the same texels on their common edge; also around the end, if the image wraps around.
    #[test]
    fn adjacent_pages_share_edge_texels_at_every_mip_level() {
        for repeats in [false, true] {
            let pyramid = pyramid([61, 37], whole([4, 3], repeats));
            assert_eq!((pyramid.levels(), pyramid.side(0)), (5, 17));
            let last = if repeats { [4, 3] } else { [3, 2] };
            for level in 0..pyramid.levels() {
                let side = pyramid.side(level);
                for (x, z) in (0..4).flat_map(|x| (0..3).map(move |z| (x, z))) {
                    let own = page_texels(&pyramid, [x, z], level);
                    assert_eq!(own.len(), side.pow(2) as usize);
                    if x < last[0] {
                        let east = page_texels(&pyramid, [(x + 1) % 4, z], level);
                        assert_eq!(column(&own, side, side - 1), column(&east, side, 0), "{x}, {z} at {level}");
                    }
                    if z < last[1] {
                        let south = page_texels(&pyramid, [x, (z + 1) % 3], level);
                        assert_eq!(row(&own, side, side - 1), row(&south, side, 0), "{x}, {z} at {level}");
                    }
                }
            }
        }
    }

    /// Dividing the image into pages does not change its filtered texels.
    #[test]
    fn pages_equal_the_filtered_image() {
        for repeats in [false, true] {
            let (one, many) = (pyramid([64, 64], whole([1, 1], repeats)), pyramid([64, 64], whole([4, 4], repeats)));
            for level in 0..many.levels() {
                let (whole, cells, side) = (page_texels(&one, [0, 0], level), many.cells(level), one.side(level));
                for page in (0..16).map(|k| [k % 4, k / 4]) {
                    let mip = page_texels(&many, page, level);
                    let around = |n: u32| [page[0] * cells + n % (cells + 1), page[1] * cells + n / (cells + 1)];
                    let expected = (0..mip.len() as u32).map(around).map(|[x, z]| whole[(z * side + x) as usize]);
                    assert!(expected.eq(mip), "page {page:?} at level {level}");
                }
            }
        }
    }

    /// A tile consists of the coarser mips of its pages side by side; adjacent tiles share their edge texels.
    #[test]
    fn a_tile_consists_of_its_pages_at_its_mip_level() {
        let pyramid = pyramid([61, 37], whole([4, 3], false));
        let side = pyramid.side(0);
        for level in 0..3u32 {
            let cells = pyramid.cells(level);
            for (x, z) in (0..4 >> level).flat_map(|x| (0..3u32.div_ceil(1 << level)).map(move |z| (x, z))) {
                let tile = pyramid.tile(level, [x, z]);
                for page in (0..4u32 << (2 * level) >> 2).map(|k| [k % (1 << level), k >> level]) {
                    let at = [(x << level) + page[0], (z << level) + page[1]];
                    if at[1] >= 3 {
                        continue;
                    }
                    let mip = page_texels(&pyramid, at, level);
                    let of_tile = |n: usize| {
                        let (i, j) = (n as u32 % (cells + 1), n as u32 / (cells + 1));
                        tile[((page[1] * cells + j) * side + page[0] * cells + i) as usize]
                    };
                    assert!((0..mip.len()).all(|n| of_tile(n) == mip[n]), "page {at:?} at level {level}");
                }
                if level < 2 && x + 1 < 4 >> level {
                    assert_eq!(column(&tile, side, side - 1), column(&pyramid.tile(level, [x + 1, z]), side, 0));
                }
            }
        }
    }

    /// Fails if each page were filtered on its own.
    #[test]
    fn filtering_crosses_page_edges() {
        let mut texels = vec![[0, 0, 0, 255]; 64 * 64];
        // A bright column just east of a page edge: at mip level 1 the edge sees it only through its neighbours.
        for z in 0..64 {
            texels[z * 64 + 33] = [255; 4];
        }
        let pyramid = OverlayPyramid::new(Picture { size: [64, 64], texels: &texels }, whole([2, 2], false));
        for level in 1..4 {
            let west = page_texels(&pyramid, [0, 0], level);
            let at = column(&west, pyramid.side(level), pyramid.side(level) - 1);
            assert!(at.iter().all(|texel| texel[0] > 40), "level {level}: {at:?}");
        }
    }

    /// Image borders and the part of pages beyond the image do not change a uniform colour.
    #[test]
    fn a_uniform_image_stays_uniform() {
        for extent in [[3.0, 2.0], [2.4, 1.3]] {
            let texels = vec![[200, 17, 90, 128]; 50 * 31];
            let layout = PyramidLayout { pages: [3, 2], extent, repeats: [false; 2] };
            let pyramid = OverlayPyramid::new(Picture { size: [50, 31], texels: &texels }, layout);
            let all = pyramid.levels.iter().flat_map(|level| &level.texels);
            assert!(all.into_iter().all(|texel| *texel == texels[0]));
        }
    }
}
