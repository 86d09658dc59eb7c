//! A picture laid over pages: maps of descending resolution for each page, filtered over all of the picture first and cut
//! into pages then.
//!
//! After M. Finch and L. Bishop, "Sorted Height Field Rendering" (1998), §4.8. Texels lie on a lattice, as heights do: a
//! map has 2^n + 1 texels along a side, and its first and last ones are those of the pages beside it, at every level. So
//! what a sampler makes of two maps of one level is the same along the edge between them, which filtering each page by
//! itself would break. A level keeps every other texel of the one before, weighted 1 : 2 : 1 with its neighbours, in
//! linear light.

use rayon::prelude::*;

/// Red, green and blue as sRGB codes, and opacity.
pub type Texel = [u8; 4];

/// A picture, row by row.
#[derive(Clone, Copy, Debug)]
pub struct Picture<'a> {
    /// Texels along (x, z), at least one.
    pub size: [u32; 2],
    /// Row by row.
    pub texels: &'a [Texel],
}

/// How pages lie under a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layout {
    /// Pages along (x, z).
    pub pages: [u32; 2],
    /// Pages that the picture's sides are long: fewer than `pages` where the last ones stick out of the field.
    pub extent: [f64; 2],
    /// True if the picture goes on from its start where it ends.
    pub repeats: [bool; 2],
}

/// A page's map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Map {
    /// The page's place (x, z).
    pub page: [u32; 2],
    /// 0 the finest.
    pub level: u32,
}

/// One level of all pages together.
struct MipLevel {
    size: [u32; 2],
    texels: Vec<Texel>,
}

/// All levels of all pages.
pub struct OverlayPyramid {
    layout: Layout,
    levels: Vec<MipLevel>,
}

/// The most cells along a side of a page's finest map.
const MAX_CELLS: u32 = 4096;

impl OverlayPyramid {
    /// Filters a picture. The finest maps are as fine as the picture, within 2^12 cells a side.
    ///
    /// # Panics
    /// If the picture or the layout is empty, or repeats after something else than whole pages.
    pub fn new(picture: Picture, layout: Layout) -> Self {
        assert_eq!(picture.texels.len(), picture.size[0] as usize * picture.size[1] as usize);
        for k in 0..2 {
            assert!(picture.size[k] > 0 && layout.pages[k] > 0 && layout.extent[k] > 0.0, "an empty picture");
            assert!(!layout.repeats[k] || layout.extent[k] == f64::from(layout.pages[k]), "repeats within a page");
        }
        let needed = (0..2).map(|k| f64::from(picture.size[k]) / layout.extent[k]).fold(1.0, f64::max);
        let cells = (needed.ceil().min(f64::from(MAX_CELLS)) as u32).next_power_of_two();
        let mut levels = vec![MipLevel::placed(picture, &layout, cells)];
        for _ in 0..cells.ilog2() {
            levels.extend(levels.last().map(|finer| finer.halved(layout.repeats)));
        }
        Self { layout, levels }
    }

    /// How pages lie.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// How many maps each page has; the coarsest is one cell.
    pub fn levels(&self) -> u32 {
        self.levels.len() as u32
    }

    /// Texels along a side of a map.
    pub fn side(&self, level: u32) -> u32 {
        self.cells(level) + 1
    }

    fn cells(&self, level: u32) -> u32 {
        1 << (self.levels() - 1 - level)
    }

    /// Bytes of a map.
    pub fn bytes(&self, level: u32) -> u64 {
        u64::from(self.side(level)).pow(2) * size_of::<Texel>() as u64
    }

    /// The texels of a map, row by row.
    ///
    /// # Panics
    /// If there is no such page or level.
    pub fn cut(&self, Map { page, level }: Map) -> Vec<Texel> {
        assert!((0..2).all(|k| page[k] < self.layout.pages[k]), "page {page:?}");
        let (of, side) = (&self.levels[level as usize], self.side(level) as usize);
        let [x, z] = page.map(|n| (n * self.cells(level)) as usize);
        let row = |j: usize| (z + j) * of.size[0] as usize + x;
        (0..side).flat_map(|j| &of.texels[row(j)..row(j) + side]).copied().collect()
    }

    /// As many texels as a page's finest map has, of a coarser level: those of 2^level × 2^level pages, from the `at`-th such
    /// square on along each axis. Beyond the last page its last texels go on.
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
    /// The picture at the lattice of the finest level, bilinearly between its texels' centres.
    fn placed(picture: Picture, layout: &Layout, cells: u32) -> Self {
        let size = layout.pages.map(|n| n * cells + 1);
        // Between which two texels of the picture, and how far.
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

    /// Every other texel, weighted 1 : 2 : 1 with those beside it along both axes.
    fn halved(&self, repeats: [bool; 2]) -> Self {
        let size = self.size.map(|n| n / 2 + 1);
        // The last texel is the first one again where the picture repeats, and has no other beyond it elsewhere.
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

/// Linear light by code (IEC 61966-2-1).
static LINEAR: std::sync::LazyLock<[f32; 256]> =
    std::sync::LazyLock::new(|| std::array::from_fn(|code| light(code as f32 / 255.0)));

fn light(c: f32) -> f32 {
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// Linear light, and opacity.
pub(super) fn linear([r, g, b, a]: Texel) -> [f32; 4] {
    let light = |code: u8| LINEAR[usize::from(code)];
    [light(r), light(g), light(b), f32::from(a) / 255.0]
}

/// Light halfway between a code and the next one, by code.
static HALFWAY: std::sync::LazyLock<[f32; 255]> =
    std::sync::LazyLock::new(|| std::array::from_fn(|code| light((code as f32 + 0.5) / 255.0)));

/// The nearest codes.
pub(super) fn coded([r, g, b, a]: [f32; 4]) -> Texel {
    let code = |light: f32| HALFWAY.partition_point(|end| *end <= light) as u8;
    [code(r), code(g), code(b), (a * 255.0).round() as u8]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Neighbouring texels have nothing to do with each other.
    fn noise(size: [u32; 2]) -> Vec<Texel> {
        (0..size[0] * size[1]).map(|k| (k.wrapping_mul(0x9e37_79b1) ^ k << 7).to_le_bytes()).collect()
    }

    fn maps(size: [u32; 2], layout: Layout) -> OverlayPyramid {
        OverlayPyramid::new(Picture { size, texels: &noise(size) }, layout)
    }

    fn whole(pages: [u32; 2], repeats: bool) -> Layout {
        Layout { pages, extent: pages.map(f64::from), repeats: [repeats; 2] }
    }

    fn column(texels: &[Texel], side: u32, n: u32) -> Vec<Texel> {
        texels.iter().skip(n as usize).step_by(side as usize).copied().collect()
    }

    fn row(texels: &[Texel], side: u32, n: u32) -> Vec<Texel> {
        texels[(n * side) as usize..((n + 1) * side) as usize].to_vec()
    }

    /// Maps of pages side by side have the same texels along the edge between them; around the end too, if the
    /// picture repeats.
    #[test]
    fn edges_are_equal_at_every_level() {
        for repeats in [false, true] {
            let maps = maps([61, 37], whole([4, 3], repeats));
            assert_eq!((maps.levels(), maps.side(0)), (5, 17));
            let last = if repeats { [4, 3] } else { [3, 2] };
            for level in 0..maps.levels() {
                let side = maps.side(level);
                for (x, z) in (0..4).flat_map(|x| (0..3).map(move |z| (x, z))) {
                    let own = maps.cut(Map { page: [x, z], level });
                    assert_eq!(own.len() as u64 * 4, maps.bytes(level));
                    if x < last[0] {
                        let east = maps.cut(Map { page: [(x + 1) % 4, z], level });
                        assert_eq!(column(&own, side, side - 1), column(&east, side, 0), "{x}, {z} at {level}");
                    }
                    if z < last[1] {
                        let south = maps.cut(Map { page: [x, (z + 1) % 3], level });
                        assert_eq!(row(&own, side, side - 1), row(&south, side, 0), "{x}, {z} at {level}");
                    }
                }
            }
        }
    }

    /// Pages or one page over all: cutting changes nothing.
    #[test]
    fn maps_are_the_filtered_picture_cut() {
        for repeats in [false, true] {
            let (one, many) = (maps([64, 64], whole([1, 1], repeats)), maps([64, 64], whole([4, 4], repeats)));
            for level in 0..many.levels() {
                let (whole, cells, side) = (one.cut(Map { page: [0, 0], level }), many.cells(level), one.side(level));
                for page in (0..16).map(|k| [k % 4, k / 4]) {
                    let map = many.cut(Map { page, level });
                    let around = |n: u32| [page[0] * cells + n % (cells + 1), page[1] * cells + n / (cells + 1)];
                    let expected = (0..map.len() as u32).map(around).map(|[x, z]| whole[(z * side + x) as usize]);
                    assert!(expected.eq(map), "page {page:?} at level {level}");
                }
            }
        }
    }

    /// A square of pages is their coarser maps side by side; those beside each other end in the same texels.
    #[test]
    fn a_tile_is_the_maps_of_its_pages() {
        let maps = maps([61, 37], whole([4, 3], false));
        let side = maps.side(0);
        for level in 0..3u32 {
            let cells = maps.cells(level);
            for (x, z) in (0..4 >> level).flat_map(|x| (0..3u32.div_ceil(1 << level)).map(move |z| (x, z))) {
                let tile = maps.tile(level, [x, z]);
                for page in (0..4u32 << (2 * level) >> 2).map(|k| [k % (1 << level), k >> level]) {
                    let at = [(x << level) + page[0], (z << level) + page[1]];
                    if at[1] >= 3 {
                        continue;
                    }
                    let map = maps.cut(Map { page: at, level });
                    let of_tile = |n: usize| {
                        let (i, j) = (n as u32 % (cells + 1), n as u32 / (cells + 1));
                        tile[((page[1] * cells + j) * side + page[0] * cells + i) as usize]
                    };
                    assert!((0..map.len()).all(|n| of_tile(n) == map[n]), "page {at:?} at level {level}");
                }
                if level < 2 && x + 1 < 4 >> level {
                    assert_eq!(column(&tile, side, side - 1), column(&maps.tile(level, [x + 1, z]), side, 0));
                }
            }
        }
    }

    /// What filtering each page by itself does at its edges would show here.
    #[test]
    fn a_bright_texel_reaches_the_page_beside_it() {
        let mut texels = vec![[0, 0, 0, 255]; 64 * 64];
        // Just east of the edge between pages, at whose lattice nothing of it is seen at level 1 without neighbours.
        for z in 0..64 {
            texels[z * 64 + 33] = [255; 4];
        }
        let maps = OverlayPyramid::new(Picture { size: [64, 64], texels: &texels }, whole([2, 2], false));
        for level in 1..4 {
            let west = maps.cut(Map { page: [0, 0], level });
            let at = column(&west, maps.side(level), maps.side(level) - 1);
            assert!(at.iter().all(|texel| texel[0] > 40), "level {level}: {at:?}");
        }
    }

    /// One colour stays that colour: the picture's sides and what sticks out of it weigh nothing.
    #[test]
    fn a_plain_picture_stays_plain() {
        for extent in [[3.0, 2.0], [2.4, 1.3]] {
            let texels = vec![[200, 17, 90, 128]; 50 * 31];
            let layout = Layout { pages: [3, 2], extent, repeats: [false; 2] };
            let maps = OverlayPyramid::new(Picture { size: [50, 31], texels: &texels }, layout);
            let all = maps.levels.iter().flat_map(|level| &level.texels);
            assert!(all.into_iter().all(|texel| *texel == texels[0]));
        }
    }
}
