//! What is seen of a wedge, cut into pieces none of which needs a texture larger than one size.
//!
//! J. Blow, "Terrain Rendering at High Levels of Detail" (2000), measures whole triangles and gives those that the near
//! plane may cut the finest texture there is (§5): one such wedge can need as many texels as a thousand screens. The
//! paper leaves out cutting wedges for their textures (§2.1); here that is done. What the frustum leaves of a wedge is a
//! polygon: its pixels over its share of the wedge are the density at which the wedge is seen. Where that needs a
//! texture above the limit for the smallest node around the wedge, the wedge is bisected as the binary tree would, and
//! what is out of sight of the halves needs nothing. So every node's texture is of the limit's size or smaller, and the
//! density hardly changes over one.

use glam::{DVec2, DVec3};

use super::hidden::{Depths, Outline};
use super::resolution::level_by_exponent;
use super::working_set::Wedge;
use crate::view::{Lens, View};

/// A corner of a wedge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// In the root square, 0 to 1.
    pub map: DVec2,
    /// In the world, metres.
    pub world: DVec3,
}

/// What a wedge is cut by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bounds {
    /// The near plane.
    NearPlane,
    /// The near plane and the picture's sides.
    Screen,
}

/// How wedges are cut.
#[derive(Clone, Copy, Debug)]
pub struct Cutter<'a> {
    view: View,
    planes: [(DVec3, f64); 5],
    bounds: Bounds,
    /// Texels for each pixel along an axis, squared.
    density: f64,
    /// Level of the whole map.
    map_level: i32,
    /// Level of the largest texture of a node, if wedges are bisected for that.
    max: Option<i32>,
    /// What hides pieces, if they are left out where they are hidden.
    depths: Option<&'a Depths>,
}

/// A part of a wedge, a wedge itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Where it lies.
    pub wedge: Wedge,
    /// What it covers of the picture, pixels.
    pub pixels: f64,
    /// What all of it would need if seen as what is seen of it: quality² × pixels.
    pub texels: f32,
}

impl<'a> Cutter<'a> {
    /// For a view, so many texels a pixel along an axis and a map of 4^`map_level` texels; wedges are bisected until no
    /// node needs a texture above level `max`.
    pub fn new(view: &View, quality: f64, map_level: i32, max: i32) -> Self {
        let mut planes = view.planes();
        // What is cut lies in front of the near plane, whatever rounding does.
        planes[0].1 -= view.near * 1e-9;
        let density = quality * quality;
        Self { view: *view, planes, bounds: Bounds::Screen, density, map_level, max: Some(max), depths: None }
    }

    /// The same for whole wedges: cut by less, and not bisected.
    pub fn whole(self, bounds: Bounds) -> Self {
        Self { bounds, max: None, ..self }
    }

    /// The same without what is hidden by the wedges that `depths` were covered with.
    pub fn behind(self, depths: &'a Depths) -> Self {
        Self { depths: Some(depths), ..self }
    }

    /// Adds a wedge to what hides others.
    pub fn cover(&self, corners: &[Corner; 3], depths: &mut Depths) {
        depths.cover(&self.on_screen(corners, &self.outline(corners)));
    }

    /// Calls `visit` for the pieces in sight of a wedge of a level that faces the eye, its right angle first, its corners
    /// counter-clockwise seen from above.
    pub fn cut(&self, level: u32, corners: [Corner; 3], visit: &mut impl FnMut(&Piece)) {
        let Some(piece) = self.piece(level, &corners) else { return };
        let alpha = level_by_exponent(piece.texels, level).min(self.map_level);
        if self.max.is_none_or(|max| alpha - max <= (level / 2) as i32) {
            return visit(&piece);
        }
        let [apex, left, right] = corners;
        let middle = Corner { map: (left.map + right.map) / 2.0, world: (left.world + right.world) / 2.0 };
        self.cut(level + 1, [middle, apex, left], visit);
        self.cut(level + 1, [middle, right, apex], visit);
    }

    /// A wedge as one piece, if any of it is seen from above.
    fn piece(&self, level: u32, corners: &[Corner; 3]) -> Option<Piece> {
        let outline = self.outline(corners);
        let seen = self.on_screen(corners, &outline);
        // Rows count downwards on the screen, southwards on the map: seen from above both turn the same way.
        let area_px = -area(seen.corners.iter().copied());
        let on_map = |corners: &[Corner]| area(corners.iter().map(|corner| corner.map).collect::<Vec<_>>().into_iter());
        let share = on_map(&outline) / on_map(corners);
        let texels = (self.density * area_px / share) as f32;
        let is_hidden = |depths: &Depths| !depths.sees(&seen);
        let is_seen = texels >= f32::MIN_POSITIVE && texels.is_finite() && !self.depths.is_some_and(is_hidden);
        let [a, b, c] = corners.map(|corner| corner.map);
        let wedge = Wedge { level, barycentre: ((a + b + c) / 3.0).to_array() };
        is_seen.then_some(Piece { wedge, pixels: area_px, texels })
    }

    /// What the planes leave of a wedge (I. Sutherland and G. Hodgman, "Reentrant Polygon Clipping", 1974).
    fn outline(&self, corners: &[Corner; 3]) -> Vec<Corner> {
        let mut outline = corners.to_vec();
        let count = if self.bounds == Bounds::NearPlane { 1 } else { self.planes.len() };
        for (normal, offset) in &self.planes[..count] {
            let inside = |corner: &Corner| normal.dot(corner.world - self.view.eye) + offset;
            if outline.iter().all(|corner| inside(corner) >= 0.0) {
                continue;
            }
            let edges = outline.iter().zip(outline.iter().cycle().skip(1));
            outline = edges
                .flat_map(|(from, to)| {
                    let (a, b) = (inside(from), inside(to));
                    let crossing = ((a < 0.0) != (b < 0.0)).then(|| between(from, to, a / (a - b)));
                    (a >= 0.0).then_some(*from).into_iter().chain(crossing)
                })
                .collect();
        }
        outline
    }

    /// A polygon of a wedge's plane on the screen.
    fn on_screen(&self, wedge: &[Corner; 3], outline: &[Corner]) -> Outline {
        let (focal, is_pinhole) = (self.view.focal_px(), matches!(self.view.lens, Lens::Perspective { .. }));
        let from_eye = |world: DVec3| {
            // Right, down, forward.
            self.view.world_from_eye.transpose() * (world - self.view.eye) * DVec3::new(1.0, -1.0, -1.0)
        };
        let pixel = |at: DVec3| at.truncate() * (focal / if is_pinhole { at.z } else { 1.0 });
        let [a, b, c] = wedge.map(|corner| from_eye(corner.world));
        let normal = (b - a).cross(c - a);
        // On the plane normal · at = offset; 1 / depth, or depth, is linear in the pixel.
        let offset = normal.dot(a);
        let nearness = if is_pinhole {
            [normal.z, normal.x / focal, normal.y / focal].map(|part| part / offset)
        } else {
            [-offset, normal.x / focal, normal.y / focal].map(|part| part / normal.z)
        };
        Outline { corners: outline.iter().map(|corner| pixel(from_eye(corner.world))).collect(), nearness }
    }
}

fn between(from: &Corner, to: &Corner, share: f64) -> Corner {
    Corner { map: from.map.lerp(to.map, share), world: from.world.lerp(to.world, share) }
}

/// Of a polygon, positive if it turns from x to y.
fn area(corners: impl Iterator<Item = DVec2> + Clone) -> f64 {
    let Some(first) = corners.clone().next() else { return 0.0 };
    let next = corners.clone().skip(1).chain(std::iter::once(first));
    // From the first corner on: nothing large is subtracted.
    corners.zip(next).map(|(a, b)| (a - first).perp_dot(b - first)).sum::<f64>() / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::{Metric, Tolerance};

    fn view(dice: &mut fastrand::Rng) -> View {
        View {
            eye: DVec3::new(500.0 + 300.0 * dice.f64(), 2.0 + 60.0 * dice.f64(), 500.0),
            world_from_eye: View::turned(360.0 * dice.f64(), -60.0 * dice.f64(), 20.0 * dice.f64()),
            lens: Lens::Perspective { fov_x: 1.2 },
            size: [64, 40],
            near: 0.5,
            tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
            time_s: 0.0,
        }
    }

    /// The two halves of a root square of 1024 m.
    fn roots() -> [[Corner; 3]; 2] {
        let [a, b, c, d] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]
            .map(|[x, z]| Corner { map: DVec2::new(x, z), world: DVec3::new(1024.0 * x, 0.0, 1024.0 * z) });
        [[c, d, a], [b, a, d]]
    }

    /// Pixels whose ray meets the square.
    fn covered(view: &View) -> f64 {
        let pixels = (0..view.size[1]).flat_map(|row| (0..view.size[0]).map(move |column| [column, row]));
        let is_covered = |[column, row]: &[u32; 2]| {
            let [x, y] = [column, row].map(|&n| f64::from(n) + 0.5);
            let [w, h] = view.size.map(f64::from);
            let ray = view.world_from_eye * DVec3::new(x - w / 2.0, h / 2.0 - y, -view.focal_px());
            let at = view.eye - ray * (view.eye.y / ray.y);
            ray.y < 0.0 && (0.0..=1024.0).contains(&at.x) && (0.0..=1024.0).contains(&at.z)
        };
        pixels.filter(is_covered).count() as f64
    }

    /// Two triangles that reach behind the eye: the pieces cover what is seen, and no node needs a large texture.
    #[test]
    fn pieces_cover_the_picture_once_and_are_served_by_small_nodes() {
        let mut dice = fastrand::Rng::with_seed(6);
        for _ in 0..40 {
            let view = view(&mut dice);
            let cutter = Cutter::new(&view, 1.0, 14, 4);
            let (mut pixels, mut count) = (0.0, 0);
            for root in roots() {
                cutter.cut(0, root, &mut |piece| {
                    pixels += piece.pixels;
                    count += 1;
                    let alpha = level_by_exponent(piece.texels, piece.wedge.level).min(14);
                    assert!(alpha - (piece.wedge.level / 2) as i32 <= 4, "{piece:?}");
                    assert!(piece.pixels <= f64::from(piece.texels) * (1.0 + 1e-6), "{piece:?}");
                });
            }
            let seen = covered(&view);
            assert!((pixels - seen).abs() <= 0.03 * seen + 20.0, "{pixels} pixels in pieces, {seen} seen");
            assert!(count > 10, "{count} pieces");
        }
    }

    #[test]
    fn whole_wedges_are_one_piece_with_more_pixels_the_less_they_are_cut() {
        let view = view(&mut fastrand::Rng::with_seed(8));
        let cutter = Cutter::new(&view, 2.0, 14, 4);
        let pieces = |bounds| {
            let mut pieces = Vec::new();
            roots().into_iter().for_each(|root| cutter.whole(bounds).cut(0, root, &mut |piece| pieces.push(*piece)));
            pieces
        };
        let (near, screen) = (pieces(Bounds::NearPlane), pieces(Bounds::Screen));
        let sum = |pieces: &[Piece]| pieces.iter().map(|piece| piece.pixels).sum::<f64>();
        assert!(near.len() <= 2 && screen.len() <= near.len());
        assert!(sum(&near) > 2.0 * sum(&screen), "{near:?} {screen:?}");
    }
}
