//! Places an overlay image over a height field and converts sample positions to texture coordinates.

use crate::height::Field;

/// Placement of an overlay image over a field, in samples from the field's first sample along (x, z). Over a tiled
/// field the placement repeats with every tile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drape {
    /// Position of the image's north-west corner, samples.
    pub first: [f64; 2],
    /// Length of the image's sides, samples.
    pub length: [f64; 2],
    /// Tile length along (x, z), samples, if the image repeats with a tiled field.
    pub period: [Option<u32>; 2],
    /// True if terrain outside the image keeps its own colour; false if the outermost texels extend outwards.
    pub ends: bool,
}

/// Affine map from samples to texture coordinates (0 to 1 across the image), as the shaders apply it: uv = (samples
/// relative to the render origin · scale + first, modulo period) + start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OverlayUv {
    /// Texture coordinate of the render origin relative to the start of its tile.
    pub first: [f32; 2],
    /// Texture coordinate per sample.
    pub scale: [f32; 2],
    /// Period in texture coordinates; 0 if the image does not repeat.
    pub period: [f32; 2],
    /// Texture coordinate at the start of a tile.
    pub start: [f32; 2],
}

impl Drape {
    /// Returns the placement of an image over a whole field, or over each tile of a tiled field.
    pub fn over(field: &Field) -> Self {
        Self::of_part(field, [0, 0], if field.procedural().is_some() { field.size() } else { field.stored() })
    }

    /// Returns the placement of an image of a raster of `whole` samples of which the field is the crop that starts at
    /// sample `at`.
    ///
    /// The image's sides lie on the raster's outermost samples. Where the whole raster repeats, they lie half a
    /// sample further out, so that neighbouring copies share an edge.
    pub fn of_part(field: &Field, at: [u32; 2], whole: [u32; 2]) -> Self {
        let (stored, period) = (field.stored(), Self::period_of(field));
        let meets = |k: usize| period[k].is_some() && stored[k] == whole[k];
        let first = |k: usize| -f64::from(at[k]) - if meets(k) { 0.5 } else { 0.0 };
        let length = |k: usize| f64::from(if meets(k) { whole[k] } else { whole[k] - 1 });
        Self { first: [0, 1].map(first), length: [0, 1].map(length), period, ends: false }
    }

    /// Returns the tile length of a tiled field along (x, z), samples; `None` where it does not repeat.
    pub fn period_of(field: &Field) -> [Option<u32>; 2] {
        let (stored, size) = (field.stored(), field.size());
        [0, 1].map(|k| (field.procedural().is_none() && size[k] > stored[k]).then_some(stored[k]))
    }

    /// Returns true, per axis, if the image wraps around seamlessly: one period is exactly one image.
    pub fn repeats(&self) -> [bool; 2] {
        [0, 1].map(|k| self.period[k].is_some_and(|period| f64::from(period) == self.length[k]))
    }

    /// Returns the map to texture coordinates relative to a render origin (a lattice position, samples). Computed in
    /// f64, so that f32 shaders lose no precision far from the field's first sample.
    pub fn uv_from_samples(&self, render_origin: [i32; 2]) -> OverlayUv {
        let axes = [0, 1].map(|k| {
            let (at, first, length) = (f64::from(render_origin[k]), self.first[k], self.length[k]);
            match self.period[k].map(f64::from) {
                None => [at - first, 0.0, 0.0],
                // A seamless image starts its period at its own side, any other at the field's first sample.
                Some(period) if period == length => [(at - first).rem_euclid(period), period, 0.0],
                Some(period) => [at.rem_euclid(period), period, -first],
            }
            .map(|samples| (samples / length) as f32)
        });
        let [first, period, start] = [0, 1, 2].map(|n| axes.map(|axis| axis[n]));
        OverlayUv { first, scale: self.length.map(|length| (1.0 / length) as f32), period, start }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::{Holes, Samples};

    fn field(size: [u32; 2]) -> Field {
        let count = (size[0] * size[1]) as usize;
        Field::new(Samples::F32(vec![0.0; count]), size, [10.0; 2], Holes::none(count))
    }

    /// Evaluates the map in single precision, as the shader does.
    fn uv(drape: &Drape, render_origin: [i32; 2], from_render_origin: [f32; 2]) -> [f32; 2] {
        let OverlayUv { first, scale, period, start } = drape.uv_from_samples(render_origin);
        [0, 1].map(|k| {
            let uv = from_render_origin[k] * scale[k] + first[k];
            start[k] + if period[k] > 0.0 { uv - period[k] * (uv / period[k]).floor() } else { uv }
        })
    }

    #[test]
    fn a_cropped_field_shows_its_part_of_the_image() {
        let drape = Drape::of_part(&field([201, 101]), [100, 50], [1025, 513]);
        assert_eq!(uv(&drape, [0, 0], [0.0, 0.0]), [100.0 / 1024.0, 50.0 / 512.0]);
        assert_eq!(uv(&drape, [200, 100], [0.0, 0.0]), [300.0 / 1024.0, 150.0 / 512.0]);
        assert_eq!(uv(&Drape::over(&field([201, 101])), [100, 50], [100.0, 50.0]), [1.0, 1.0]);
    }

    /// All tiles show the same texels, also far out, where f32 positions no longer resolve fractions of a sample.
    #[test]
    fn a_whole_image_repeats_with_its_tiled_field() {
        let drape = Drape::over(&field([1000, 1000]).tiled([1000, 1]));
        assert_eq!((drape.repeats(), drape.period), ([true, false], [Some(1000), None]));
        for along in [0.0f32, 0.25, 17.3, 998.9] {
            let [here, _] = uv(&drape, [0, 0], [along, 0.0]);
            for tile in [1, 7, 500, 998] {
                let [there, _] = uv(&drape, [1000 * tile, 0], [along, 0.0]);
                assert!((here - there).abs() < 1e-7, "{along} in tile {tile}: {here}, {there}");
            }
            assert!((f64::from(here) - (f64::from(along) + 0.5) / 1000.0).abs() < 1e-7);
        }
        // At the boundary of two copies the coordinate wraps from 1 to 0.
        let [end, start] = [-0.500_1, -0.499_9].map(|along| uv(&drape, [5000, 0], [along, 0.0])[0]);
        assert!(end > 0.999 && start < 0.001, "{end}, {start}");
    }

    /// A cropped image does not wrap around seamlessly; it restarts in every tile.
    #[test]
    fn a_cropped_image_repeats_with_its_tiled_field() {
        let drape = Drape::of_part(&field([200, 200]).tiled([4, 4]), [100, 100], [1025, 1025]);
        assert_eq!(drape.repeats(), [false; 2]);
        let first = uv(&drape, [10, 20], [0.0; 2]);
        let second = uv(&drape, [210, 620], [0.0; 2]);
        assert!((0..2).all(|k| (first[k] - second[k]).abs() < 1e-6), "{first:?}, {second:?}");
        assert!((first[0] - 110.0 / 1024.0).abs() < 1e-6, "{first:?}");
        // A tile ends at the field's last sample, independently of the image's position.
        let last = uv(&drape, [200, 200], [199.5, 150.0]);
        assert!((last[0] - 299.5 / 1024.0).abs() < 1e-6 && (last[1] - 250.0 / 1024.0).abs() < 1e-6, "{last:?}");
    }
}
