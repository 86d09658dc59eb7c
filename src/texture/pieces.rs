//! Clips wedges to the view and splits them into pieces, none of which needs a texture above a size limit.
//!
//! J. Blow, "Terrain Rendering at High Levels of Detail" (2000), measures whole triangles and gives those that may
//! cross the near plane the finest texture there is (§5). One such wedge can need as many texels as a thousand
//! screens; the paper does not split wedges for their textures (§2.1).
//!
//! Difference: wedges are clipped to the frustum here. The pixels of the clipped polygon over its share of the wedge
//! give the density at which the wedge is seen. Where that density needs a texture above the limit for the smallest
//! tile around the wedge, the wedge is bisected as in the binary triangle tree. Halves outside the view need nothing.
//! Thus no tile's texture is above the limit, and the density is nearly constant over a piece.

use glam::{DVec2, DVec3};

use super::hidden::{Depths, Outline};
use super::resolution::level_by_exponent;
use super::working_set::Wedge;
use crate::view::{Lens, View};

/// A corner of a wedge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Position in the root square, 0 to 1.
    pub uv: DVec2,
    /// Position in the world, metres.
    pub world: DVec3,
}

/// The planes that wedges are clipped to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClipPlanes {
    /// The near plane only.
    NearPlane,
    /// The near plane and the four sides of the image.
    Screen,
}

/// Settings for clipping and splitting wedges in one view.
#[derive(Clone, Copy, Debug)]
pub struct Clipper<'a> {
    view: View,
    planes: [(DVec3, f64); 5],
    planes_used: ClipPlanes,
    /// Texels per pixel (area).
    density: f64,
    /// Level of the whole virtual texture: it has 4^level texels.
    texture_level: i32,
    /// Largest texture level of a tile; `None` if wedges are not split.
    max: Option<i32>,
    /// Occluders; pieces hidden by them are omitted. `None` for no occlusion test.
    depths: Option<&'a Depths>,
}

/// A visible piece of a wedge, itself a wedge of the binary triangle tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Level and barycentre of the piece.
    pub wedge: Wedge,
    /// Visible area on the screen, pixels.
    pub pixels: f64,
    /// Texels that the whole piece needs at the density of its visible part: quality² × pixels.
    pub texels: f32,
}

impl<'a> Clipper<'a> {
    /// Creates a clipper for a view, `quality` texels per pixel along an axis and a virtual texture of
    /// 4^`texture_level` texels. Wedges are split until no tile needs a texture above level `max`.
    pub fn new(view: &View, quality: f64, texture_level: i32, max: i32) -> Self {
        let mut planes = view.planes();
        // Moved by a rounding error's margin: clipped corners stay in front of the near plane.
        planes[0].1 -= view.near * 1e-9;
        let density = quality * quality;
        Self {
            view: *view,
            planes,
            planes_used: ClipPlanes::Screen,
            density,
            texture_level,
            max: Some(max),
            depths: None,
        }
    }

    /// Returns a clipper that clips to the given planes and does not split wedges.
    pub fn unsplit(self, planes_used: ClipPlanes) -> Self {
        Self { planes_used, max: None, ..self }
    }

    /// Returns a clipper that omits pieces hidden by occluders.
    pub fn with_occlusion(self, depths: &'a Depths) -> Self {
        Self { depths: Some(depths), ..self }
    }

    /// Adds a wedge to the occluders.
    pub fn add_occluder(&self, corners: &[Corner; 3], depths: &mut Depths) {
        depths.add_occluder(&self.on_screen(corners, &self.outline(corners)));
    }

    /// Calls `visit` for the visible pieces of a front-facing wedge. Corners: right angle first, counter-clockwise
    /// seen from above.
    pub fn split(&self, level: u32, corners: [Corner; 3], visit: &mut impl FnMut(&Piece)) {
        let Some(piece) = self.piece(level, &corners) else { return };
        let alpha = level_by_exponent(piece.texels, level).min(self.texture_level);
        if self.max.is_none_or(|max| alpha - max <= (level / 2) as i32) {
            return visit(&piece);
        }
        let [apex, left, right] = corners;
        let middle = Corner { uv: (left.uv + right.uv) / 2.0, world: (left.world + right.world) / 2.0 };
        self.split(level + 1, [middle, apex, left], visit);
        self.split(level + 1, [middle, right, apex], visit);
    }

    /// Returns a wedge as one piece; `None` if no part of it is visible from above.
    fn piece(&self, level: u32, corners: &[Corner; 3]) -> Option<Piece> {
        let outline = self.outline(corners);
        let seen = self.on_screen(corners, &outline);
        // Screen y points down and texture z south: polygons seen from above have the same orientation in both.
        let area_px = -area(seen.corners.iter().copied());
        let uv_area = |corners: &[Corner]| area(corners.iter().map(|corner| corner.uv).collect::<Vec<_>>().into_iter());
        let share = uv_area(&outline) / uv_area(corners);
        let texels = (self.density * area_px / share) as f32;
        let is_hidden = |depths: &Depths| !depths.is_visible(&seen);
        let is_seen = texels >= f32::MIN_POSITIVE && texels.is_finite() && !self.depths.is_some_and(is_hidden);
        let [a, b, c] = corners.map(|corner| corner.uv);
        let wedge = Wedge { level, barycentre: ((a + b + c) / 3.0).to_array() };
        is_seen.then_some(Piece { wedge, pixels: area_px, texels })
    }

    /// Clips a wedge to the planes (I. Sutherland and G. Hodgman, "Reentrant Polygon Clipping", 1974).
    fn outline(&self, corners: &[Corner; 3]) -> Vec<Corner> {
        let mut outline = corners.to_vec();
        let count = if self.planes_used == ClipPlanes::NearPlane { 1 } else { self.planes.len() };
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

    /// Projects a polygon in a wedge's plane to the screen.
    fn on_screen(&self, wedge: &[Corner; 3], outline: &[Corner]) -> Outline {
        let (focal, is_pinhole) = (self.view.focal_px(), matches!(self.view.lens, Lens::Perspective { .. }));
        let from_eye = |world: DVec3| {
            // Right, down, forward.
            self.view.world_from_eye.transpose() * (world - self.view.eye) * DVec3::new(1.0, -1.0, -1.0)
        };
        let pixel = |at: DVec3| at.truncate() * (focal / if is_pinhole { at.z } else { 1.0 });
        let [a, b, c] = wedge.map(|corner| from_eye(corner.world));
        let normal = (b - a).cross(c - a);
        // On the plane normal · p = offset, 1 / depth (perspective) or depth (orthographic) is linear in the pixel position.
        let offset = normal.dot(a);
        let nearness = if is_pinhole {
            [normal.z, normal.x / focal, normal.y / focal].map(|part| part / offset)
        } else {
            [-offset, normal.x / focal, normal.y / focal].map(|part| part / normal.z)
        };
        Outline { corners: outline.iter().map(|corner| pixel(from_eye(corner.world))).collect(), nearness }
    }
}

/// Interpolates between two corners.
fn between(from: &Corner, to: &Corner, share: f64) -> Corner {
    Corner { uv: from.uv.lerp(to.uv, share), world: from.world.lerp(to.world, share) }
}

/// Returns the signed area of a polygon, positive if it turns from x to y.
fn area(corners: impl Iterator<Item = DVec2> + Clone) -> f64 {
    let Some(first) = corners.clone().next() else { return 0.0 };
    let next = corners.clone().skip(1).chain(std::iter::once(first));
    // Relative to the first corner, to avoid cancellation.
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
            .map(|[x, z]| Corner { uv: DVec2::new(x, z), world: DVec3::new(1024.0 * x, 0.0, 1024.0 * z) });
        [[c, d, a], [b, a, d]]
    }

    /// Counts the pixels whose ray hits the square.
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

    /// Two triangles that reach behind the eye: pieces cover the visible pixels, and no tile exceeds the limit.
    #[test]
    fn pieces_cover_the_image_once_and_keep_the_size_limit() {
        let mut dice = fastrand::Rng::with_seed(6);
        for _ in 0..40 {
            let view = view(&mut dice);
            let clipper = Clipper::new(&view, 1.0, 14, 4);
            let (mut pixels, mut count) = (0.0, 0);
            for root in roots() {
                clipper.split(0, root, &mut |piece| {
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
    fn unsplit_wedges_clipped_by_fewer_planes_cover_more_pixels() {
        let view = view(&mut fastrand::Rng::with_seed(8));
        let clipper = Clipper::new(&view, 2.0, 14, 4);
        let pieces = |planes_used| {
            let mut pieces = Vec::new();
            roots()
                .into_iter()
                .for_each(|root| clipper.unsplit(planes_used).split(0, root, &mut |piece| pieces.push(*piece)));
            pieces
        };
        let (near, screen) = (pieces(ClipPlanes::NearPlane), pieces(ClipPlanes::Screen));
        let sum = |pieces: &[Piece]| pieces.iter().map(|piece| piece.pixels).sum::<f64>();
        assert!(near.len() <= 2 && screen.len() <= near.len());
        assert!(sum(&near) > 2.0 * sum(&screen), "{near:?} {screen:?}");
    }
}
