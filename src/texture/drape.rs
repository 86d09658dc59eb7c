//! The place of a picture over a field, in samples.

use crate::height::Field;

/// The place of a picture over a field, in samples from the field's first one along (x, z). A picture over a tiled field
/// lies over every tile alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drape {
    /// Place of its north-west corner.
    pub first: [f64; 2],
    /// Length of its sides.
    pub length: [f64; 2],
    /// Samples after which it lies over the field again.
    pub period: [Option<u32>; 2],
    /// True if the terrain beyond its sides keeps its own colour. Otherwise its outermost texels go on there.
    pub ends: bool,
}

/// A drape as shaders apply it: share of the picture's side = (samples from a lattice position · scale + first, less
/// whole periods) + start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shares {
    /// Shares from the start of a tile to the lattice position.
    pub first: [f32; 2],
    /// Shares a sample.
    pub scale: [f32; 2],
    /// Shares after which the picture repeats; 0: it does not.
    pub period: [f32; 2],
    /// Share at the start of a tile.
    pub start: [f32; 2],
}

impl Drape {
    /// A picture of all of a field, or of every tile of a tiled one.
    pub fn over(field: &Field) -> Self {
        Self::of_part(field, [0, 0], if field.procedural().is_some() { field.size() } else { field.stored() })
    }

    /// A picture of a raster of `whole` samples, of which the field is the part that begins at sample `at`.
    ///
    /// The picture's sides lie on the raster's outermost samples. Where all of the raster repeats, they lie half a
    /// sample further out: there two of them meet.
    pub fn of_part(field: &Field, at: [u32; 2], whole: [u32; 2]) -> Self {
        let (stored, period) = (field.stored(), Self::period_of(field));
        let meets = |k: usize| period[k].is_some() && stored[k] == whole[k];
        let first = |k: usize| -f64::from(at[k]) - if meets(k) { 0.5 } else { 0.0 };
        let length = |k: usize| f64::from(if meets(k) { whole[k] } else { whole[k] - 1 });
        Self { first: [0, 1].map(first), length: [0, 1].map(length), period, ends: false }
    }

    /// Samples after which a field repeats.
    pub fn period_of(field: &Field) -> [Option<u32>; 2] {
        let (stored, size) = (field.stored(), field.size());
        [0, 1].map(|k| (field.procedural().is_none() && size[k] > stored[k]).then_some(stored[k]))
    }

    /// True if the picture goes on from its start where it ends.
    pub fn repeats(&self) -> [bool; 2] {
        [0, 1].map(|k| self.period[k].is_some_and(|period| f64::from(period) == self.length[k]))
    }

    /// The same relative to a lattice position: no large number is rounded.
    pub fn shares(&self, render_origin: [i32; 2]) -> Shares {
        let axes = [0, 1].map(|k| {
            let (at, first, length) = (f64::from(render_origin[k]), self.first[k], self.length[k]);
            match self.period[k].map(f64::from) {
                None => [at - first, 0.0, 0.0],
                // A tile of the picture itself begins at its side, any other at the field's first sample.
                Some(period) if period == length => [(at - first).rem_euclid(period), period, 0.0],
                Some(period) => [at.rem_euclid(period), period, -first],
            }
            .map(|samples| (samples / length) as f32)
        });
        let [first, period, start] = [0, 1, 2].map(|n| axes.map(|axis| axis[n]));
        Shares { first, scale: self.length.map(|length| (1.0 / length) as f32), period, start }
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

    /// The shader's result, in single precision.
    fn share(drape: &Drape, render_origin: [i32; 2], from_render_origin: [f32; 2]) -> [f32; 2] {
        let Shares { first, scale, period, start } = drape.shares(render_origin);
        [0, 1].map(|k| {
            let share = from_render_origin[k] * scale[k] + first[k];
            start[k] + if period[k] > 0.0 { share - period[k] * (share / period[k]).floor() } else { share }
        })
    }

    #[test]
    fn a_picture_of_the_whole_is_cropped_with_it() {
        let drape = Drape::of_part(&field([201, 101]), [100, 50], [1025, 513]);
        assert_eq!(share(&drape, [0, 0], [0.0, 0.0]), [100.0 / 1024.0, 50.0 / 512.0]);
        assert_eq!(share(&drape, [200, 100], [0.0, 0.0]), [300.0 / 1024.0, 150.0 / 512.0]);
        assert_eq!(share(&Drape::over(&field([201, 101])), [100, 50], [100.0, 50.0]), [1.0, 1.0]);
    }

    /// Every tile shows the same, far out too, where a single-precision number has no parts of a sample left.
    #[test]
    fn a_picture_repeats_with_its_field() {
        let drape = Drape::over(&field([1000, 1000]).tiled([1000, 1]));
        assert_eq!((drape.repeats(), drape.period), ([true, false], [Some(1000), None]));
        for along in [0.0f32, 0.25, 17.3, 998.9] {
            let [here, _] = share(&drape, [0, 0], [along, 0.0]);
            for tile in [1, 7, 500, 998] {
                let [there, _] = share(&drape, [1000 * tile, 0], [along, 0.0]);
                assert!((here - there).abs() < 1e-7, "{along} in tile {tile}: {here}, {there}");
            }
            assert!((f64::from(here) - (f64::from(along) + 0.5) / 1000.0).abs() < 1e-7);
        }
        // Where two meet, one ends and the next begins.
        let [end, start] = [-0.500_1, -0.499_9].map(|along| share(&drape, [5000, 0], [along, 0.0])[0]);
        assert!(end > 0.999 && start < 0.001, "{end}, {start}");
    }

    /// A cropped or placed picture does not meet itself: it is laid over every tile anew.
    #[test]
    fn a_part_of_a_picture_repeats_too() {
        let drape = Drape::of_part(&field([200, 200]).tiled([4, 4]), [100, 100], [1025, 1025]);
        assert_eq!(drape.repeats(), [false; 2]);
        let first = share(&drape, [10, 20], [0.0; 2]);
        let second = share(&drape, [210, 620], [0.0; 2]);
        assert!((0..2).all(|k| (first[k] - second[k]).abs() < 1e-6), "{first:?}, {second:?}");
        assert!((first[0] - 110.0 / 1024.0).abs() < 1e-6, "{first:?}");
        // A tile ends with the field's last sample, wherever the picture begins.
        let last = share(&drape, [200, 200], [199.5, 150.0]);
        assert!((last[0] - 299.5 / 1024.0).abs() < 1e-6 && (last[1] - 250.0 / 1024.0).abs() < 1e-6, "{last:?}");
    }
}
