//! Caves: a floor and a ceiling over the same samples, which meet at rock.

use std::sync::Arc;

use rayon::prelude::*;

use super::error::Error;
use super::field::Field;
use super::holes::Holes;
use super::raster::Raster;
use super::samples::Samples;

/// Floor and ceiling of a cave, welded: at samples of rock both have the same height.
///
/// A sample is rock if the ceiling is not above the floor, or if one of the two has no data. Rock beside the cave lies
/// half-way between floor and ceiling, about where surfaces through their samples would meet. Rock further in continues
/// smoothly from there. A triangle with three rock corners is the same in both surfaces. It is drawn by neither, so that
/// floor and ceiling end in one common edge.
#[derive(Clone, Debug)]
pub struct Cave {
    floor: Arc<Field>,
    ceiling: Arc<Field>,
}

impl Cave {
    /// Welds two fields. `file` is the name of the ceiling's file in errors.
    ///
    /// # Errors
    /// If the ceiling differs from the floor in size, tiling, spacing or origin.
    pub fn new(floor: &Field, ceiling: &Field, file: &str) -> Result<Self, Error> {
        let differs = |place: &str, expected: String, found: String| {
            Error::new(file, place, format!("expected the floor's {expected}, found {found}"))
        };
        if (floor.stored(), floor.size()) != (ceiling.stored(), ceiling.size()) {
            let [expected, found] =
                [floor, ceiling].map(|field| field.size()).map(|[w, h]| format!("{w} × {h} samples"));
            return Err(differs("size", expected, found));
        }
        for (place, of_floor, of_ceiling) in
            [("spacing", floor.spacing, ceiling.spacing), ("origin", floor.origin, ceiling.origin)]
        {
            if of_floor != of_ceiling {
                return Err(differs(place, format!("{of_floor:?} m"), format!("{of_ceiling:?} m")));
            }
        }
        Ok(Self::welded(floor, ceiling))
    }

    fn welded(floor: &Field, ceiling: &Field) -> Self {
        let heights = |field: &Field| (0..field.samples().len()).map(|k| field.samples().height(k)).collect::<Vec<_>>();
        let [low, high] = [floor, ceiling].map(heights);
        let no_data = |k: usize| floor.holes().contains(k) || ceiling.holes().contains(k);
        let is_rock: Vec<bool> = (0..low.len()).map(|k| high[k] <= low[k] || no_data(k)).collect();
        let between = meeting(floor.stored(), &low, &high, &is_rock);
        let welded = |heights: Vec<f32>| {
            let height = |k: usize| if is_rock[k] { between.samples().height(k) } else { heights[k] };
            let samples = Samples::F32((0..heights.len()).map(height).collect());
            floor.source().with_raster(Raster::new(samples, floor.stored(), Holes::none(heights.len())))
        };
        let ceiling = Arc::new(floor.with_source(welded(high)));
        Self { floor: Arc::new(floor.with_source(welded(low)).under(Arc::clone(&ceiling))), ceiling }
    }

    /// Returns the cave that a field is the floor of.
    pub fn of(floor: &Arc<Field>) -> Option<Self> {
        let ceiling = Arc::clone(floor.ceiling()?);
        Some(Self { floor: Arc::clone(floor), ceiling })
    }

    /// Returns the floor. It holds the ceiling, so that it stands for the cave wherever a field is needed.
    pub fn floor(&self) -> &Arc<Field> {
        &self.floor
    }

    /// Returns the ceiling, nowhere below the floor.
    pub fn ceiling(&self) -> &Arc<Field> {
        &self.ceiling
    }

    /// Returns true if floor and ceiling meet at a sample.
    #[inline]
    pub fn is_rock(&self, i: u32, j: u32) -> bool {
        self.floor.height(i, j) == self.ceiling.height(i, j)
    }
}

/// Returns the surface along which floor and ceiling meet: half-way between them at rock beside the cave, filled in from
/// there elsewhere.
fn meeting(size: [u32; 2], low: &[f32], high: &[f32], is_rock: &[bool]) -> Raster {
    let [w, h] = size.map(|n| n as usize);
    let around = |n: usize, last: usize| n.saturating_sub(1)..=(n + 1).min(last);
    let is_beside = |k: usize| {
        let mut near = around(k / w, h - 1).flat_map(|j| around(k % w, w - 1).map(move |i| j * w + i));
        is_rock[k] && near.any(|k| !is_rock[k])
    };
    let known: Vec<bool> = (0..low.len()).into_par_iter().map(is_beside).collect();
    let mut holes = Holes::none(low.len());
    (0..low.len()).filter(|&k| !known[k]).for_each(|k| holes.insert(k));
    let half_way = low.iter().zip(high).map(|(low, high)| low * 0.5 + high * 0.5).collect();
    Raster::new(Samples::F32(half_way), size, holes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(heights: [f32; 16]) -> Field {
        Field::new(Samples::F32(heights.to_vec()), [4, 4], [2.0; 2], Holes::none(16))
    }

    const FLOOR: [f32; 16] = [5.0, 5.0, 5.0, 5.0, 5.0, 1.0, 2.0, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 9.0];
    const CEILING: [f32; 16] = [3.0, 3.0, 3.0, 3.0, 3.0, 4.0, 6.0, 3.0, 5.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, -7.0];

    #[test]
    fn the_fields_meet_at_rock_and_nowhere_else() {
        let cave = Cave::new(&field(FLOOR), &field(CEILING), "ceiling").unwrap();
        for (i, j) in (0..4).flat_map(|i| (0..4).map(move |j| (i, j))) {
            let k = (4 * j + i) as usize;
            assert_eq!(cave.is_rock(i, j), CEILING[k] <= FLOOR[k], "({i}, {j})");
            let [floor, ceiling] = [cave.floor(), cave.ceiling()].map(|field| field.height(i, j));
            assert!(ceiling >= floor);
            if !cave.is_rock(i, j) {
                assert_eq!([floor, ceiling], [FLOOR[k], CEILING[k]]);
            } else if j <= 2 && i <= 3 {
                assert_eq!(floor, (FLOOR[k] + CEILING[k]) / 2.0, "({i}, {j}) beside the cave");
            } else {
                assert!((3.0..=6.0).contains(&floor), "({i}, {j}) goes on from beside the cave: {floor}");
            }
        }
    }

    #[test]
    fn what_has_no_data_is_rock() {
        let mut holes = Holes::none(16);
        holes.insert(5);
        let ceiling = Field::new(Samples::F32(CEILING.to_vec()), [4, 4], [2.0; 2], holes);
        let cave = Cave::new(&field(FLOOR), &ceiling, "ceiling").unwrap();
        assert!(cave.is_rock(1, 1) && !cave.is_rock(2, 1));
        assert_eq!(cave.ceiling().holes().count(), 0);
    }

    #[test]
    fn fields_that_do_not_lie_alike_are_refused() {
        let floor = field(FLOOR);
        let smaller = Field::new(Samples::F32(vec![0.0; 12]), [4, 3], [2.0; 2], Holes::none(12));
        let mut elsewhere = field(CEILING);
        elsewhere.origin = [1.0, 0.0];
        let mut wider = field(CEILING);
        wider.spacing = [2.0, 3.0];
        for (ceiling, place) in
            [(smaller, "size"), (elsewhere, "origin"), (wider, "spacing"), (field(CEILING).tiled([2, 1]), "size")]
        {
            let error = Cave::new(&floor, &ceiling, "roof.tif").unwrap_err();
            assert_eq!((error.file.as_str(), error.place.as_str()), ("roof.tif", place));
        }
    }
}
