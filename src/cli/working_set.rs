//! `cuesta info --working-set`: draws a map of the virtual texture tiles that a view needs. The virtual texture covers
//! the whole field. A node is a tile of its quadtree; level 0 is the root.

use std::path::Path;

use anyhow::{Result, ensure};
use image::{Rgba, RgbaImage};
use serde::Serialize;

use super::report::save;
use crate::draw::DrawList;
use crate::height::{Error, Field};
use crate::lod::Technique;
use crate::texture::resolution::texture_area;
use crate::texture::virtual_ground::{GroundSet, MAX_SLOTS, TILE_LEVEL, VirtualGroundLayout};
use crate::texture::wedges;
use crate::texture::working_set::{TileId, WorkingSet};
use crate::view::View;

/// Width and height of the picture, pixels.
const SIDE_PX: u32 = 1024;

/// The nodes that a view needs, and their memory.
#[derive(Serialize)]
pub struct Needed {
    /// Texels of the whole virtual texture.
    map_texels: f64,
    /// Number of front-facing triangles in view, as wedges of a binary triangle tree. The nodes follow from them.
    wedges: usize,
    /// Number of nodes.
    nodes: usize,
    /// Number of nodes that the texture memory can hold.
    slots: u32,
    /// Device memory of the nodes, bytes.
    bytes: u64,
    /// Largest length of a texel on the screen, pixels: 1, or more if the memory does not suffice.
    texel_px: f64,
    /// Texels needed.
    texels: f64,
    /// Texels needed per pixel of the picture.
    texels_a_pixel: f64,
    /// Number of nodes by level, from the root on.
    levels: Vec<usize>,
    /// Square of the field that the picture shows, samples: its north-western corner (x, z), and its side.
    shown: [f64; 3],
}

/// A square part of the virtual texture, as shares of its root square.
struct Window {
    /// North-western corner (x, z).
    first: [f64; 2],
    side: f64,
}

/// Finds the nodes that a view needs within `texture_bytes`, and writes a picture of them. The hue shows the level;
/// nodes that need fewer texels are darker, those not needed are grey. The picture shows the smallest square around all
/// nodes below the root.
///
/// # Errors
/// If the path does not end in `.png`, the memory is too small for a virtual texture, or the file cannot be written.
pub fn draw(
    field: &Field,
    technique: &mut dyn Technique,
    view: &View,
    texture_bytes: u64,
    path: &Path,
) -> Result<Needed> {
    let is_png = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png"));
    ensure!(is_png, Error::new(path.display().to_string(), "extension", "expected .png"));
    let layout = VirtualGroundLayout::new(field, texture_bytes, MAX_SLOTS as u32).map_err(anyhow::Error::msg)?;
    let mut list = DrawList::default();
    technique.select(view, &mut list);
    let wedges = wedges::from_draw_list(field, view, technique.resident(), &list);
    let mut needed = GroundSet::new(layout);
    needed.update(view, &wedges);
    let set = needed.set();
    let mut levels = Vec::new();
    for (node, _) in set.tiles() {
        levels.resize(levels.len().max(node.level as usize + 1), 0);
        levels[node.level as usize] += 1;
    }
    let window = Window::around(set);
    save(path, &picture(set, &window, levels.len()))?;
    let root = f64::from(wedges::root_side(field));
    Ok(Needed {
        map_texels: texture_area(layout.texture_level()),
        wedges: wedges.len(),
        nodes: set.tiles().count(),
        slots: layout.slots,
        bytes: set.tiles().count() as u64 * VirtualGroundLayout::tile_bytes(),
        texel_px: needed.texel_px(),
        texels: set.texels(),
        texels_a_pixel: set.texels() / f64::from(view.size[0]) / f64::from(view.size[1]),
        levels,
        shown: [window.first[0], window.first[1], window.side].map(|share| share * root),
    })
}

impl Window {
    /// Returns the smallest square around all nodes below the root; the whole texture if there are none.
    fn around(set: &WorkingSet) -> Self {
        let side = |node: &TileId| 0.5f64.powi(node.level as i32);
        let ends = |k: usize| {
            let nodes = set.tiles().map(|(node, _)| node).filter(|node| node.level > 0);
            nodes.fold([1.0f64, 0.0f64], |[low, high], node| {
                let first = f64::from(node.at[k]) * side(&node);
                [low.min(first), high.max(first + side(&node))]
            })
        };
        let ends = [ends(0), ends(1)];
        let widest = ends.iter().map(|[low, high]| high - low).fold(0.0, f64::max);
        if widest <= 0.0 {
            return Self { first: [0.0; 2], side: 1.0 };
        }
        Self { first: ends.map(|[low, high]| (low + high - widest) / 2.0), side: widest }
    }

    /// Returns the position of a pixel's centre on the virtual texture, shares of the root square.
    fn at(&self, x: u32, y: u32) -> [f64; 2] {
        [(0, x), (1, y)].map(|(k, n)| self.first[k] + (f64::from(n) + 0.5) / f64::from(SIDE_PX) * self.side)
    }
}

fn picture(set: &WorkingSet, window: &Window, levels: usize) -> RgbaImage {
    let pixel_side = window.side / f64::from(SIDE_PX);
    RgbaImage::from_fn(SIDE_PX, SIDE_PX, |x, y| {
        let at = window.at(x, y);
        let is_on_map = at.iter().all(|part| (0.0..1.0).contains(part));
        let of_level = |level: u32| {
            let node = TileId { level, at: at.map(|part| (part * f64::from(1u32 << level)) as u32) };
            Some((node, set.resolution(node)?))
        };
        // The finest node lies on top of the others.
        let found = (0..levels as u32).rev().filter(|_| is_on_map).find_map(of_level);
        found.map_or(Rgba([40, 40, 40, 255]), |(node, resolution)| colour(node, resolution, at, pixel_side))
    })
}

/// Returns the colour of a pixel at the position `at` in a node. `pixel_side` is the side of a pixel, a share of the
/// root square.
fn colour(node: TileId, resolution: u32, at: [f64; 2], pixel_side: f64) -> Rgba<u8> {
    let side = 0.5f64.powi(node.level as i32);
    // A line one pixel wide surrounds each node that is large enough for it.
    let is_edge = (0..2).any(|k| at[k] / side - f64::from(node.at[k]) < pixel_side / side) && side > 5.0 * pixel_side;
    if is_edge {
        return Rgba([0, 0, 0, 255]);
    }
    let light = 0.4 + 0.6 * f64::from(resolution + 1) / f64::from(TILE_LEVEL + 1);
    let hue = (f64::from(node.level) * 0.618_034).fract() * 6.0;
    let part = |shift: f64| (((hue + shift) % 6.0 - 3.0).abs() - 1.0).clamp(0.0, 1.0);
    let [r, g, b] = [0.0, 4.0, 2.0].map(|shift| (255.0 * light * (0.25 + 0.75 * part(shift))) as u8);
    Rgba([r, g, b, 255])
}
