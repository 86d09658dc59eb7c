//! Morph weights of an instance: the three encodings, and the weights by slots.
//!
//! An instance has a tag and four words, which hold a [`SlotWeights`], a [`SkirtWeights`] or a [`DistanceWeights`].
//! This file packs and unpacks them on the host, `shaders/weights.glsl` in shaders. All three keep the flag [`FINER`]
//! of quadrant q in bit 7 of byte q of the first word.
//!
//! A mesh is four quadrants, number `q = (x half) + 2 (z half)` after the rotation. Its vertices lie inside a quadrant,
//! on an outer side, or on a seam between quadrants. The halves of sides and seams and the insides of quadrants are the
//! sixteen slots of a [`SlotWeights`], a byte each, in units of 1 / [`ONE`]. Weight 0 is the vertex's own level and
//! `ONE` the next coarser one. On outer sides `2 ONE` is the level after that.
//!
//! An odd vertex snaps to the even one before it where blocks of two levels meet, so that no T-junction is left: on an
//! outer side from weight `ONE` on, and on a seam with the flag [`STITCHED`]. Weights are integers, so that both meshes
//! of a side agree to the bit.

use super::layout::{DISTANCE_WEIGHTS, FIRST_SIDE, Instance, LAST_SIDE, NO_LINE, SEAM, SKIRT_WEIGHTS, SLOT_WEIGHTS};
pub use super::layout::{DistanceWeights, FINER, ONE, STITCHED, SkirtWeights, SlotWeights};

/// The weights of an instance in one of their encodings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Weights {
    /// A weight for each slot.
    Slots(SlotWeights),
    /// A mesh with skirts: a weight for each quadrant.
    Skirts(SkirtWeights),
    /// Each vertex has the weight of its distance to the eye.
    Distance(DistanceWeights),
}

impl Instance {
    /// Unpacks the weights.
    pub fn weights(&self) -> Weights {
        match self.weights_kind {
            SKIRT_WEIGHTS => Weights::Skirts(SkirtWeights::of(self)),
            DISTANCE_WEIGHTS => Weights::Distance(DistanceWeights::of(self)),
            _ => Weights::Slots(SlotWeights::of(self)),
        }
    }

    /// The instance with other weights.
    pub fn with_weights(self, weights: impl Into<Weights>) -> Self {
        let (weights_kind, weights_words) = match weights.into() {
            Weights::Slots(w) => (SLOT_WEIGHTS, [w.inside, w.first_sides, w.last_sides, w.seams]),
            Weights::Skirts(w) => (SKIRT_WEIGHTS, [w.inside, w.sides, w.depth_m.to_bits(), 0]),
            Weights::Distance(w) => {
                let [range, finer_range, above] = [w.range, w.finer_range, w.above_squared].map(f32::to_bits);
                (DISTANCE_WEIGHTS, [w.flags, range, finer_range, above])
            }
        };
        Self { weights_kind, weights_words, ..self }
    }

    /// True if a quadrant is one level finer than the instance, in any encoding.
    pub fn is_finer(&self, quadrant: usize) -> bool {
        self.weights_words[0] >> (8 * quadrant) & FINER != 0
    }
}

impl SlotWeights {
    /// Unpacks the weights of an instance of this kind.
    pub fn of(instance: &Instance) -> Self {
        let [inside, first_sides, last_sides, seams] = instance.weights_words;
        Self { inside, first_sides, last_sides, seams }
    }

    /// Weights that all quadrants share: inside, and on the sides x = 0, z = 0, x = cells and z = cells.
    pub fn uniform(inside: u32, [x_first, z_first, x_last, z_last]: [u32; 4]) -> Self {
        let sides = |x: u32, z: u32| x * 0x0101 + z * 0x0101_0000;
        let all = inside * 0x0101_0101;
        Self { inside: all, first_sides: sides(x_first, z_first), last_sides: sides(x_last, z_last), seams: all }
    }

    /// The byte of a slot, flags included.
    pub fn get(&self, slot: Slot) -> u32 {
        let word = match slot.line {
            NO_LINE => self.inside,
            FIRST_SIDE => self.first_sides,
            LAST_SIDE => self.last_sides,
            _ => self.seams,
        };
        word >> (8 * slot.byte) & 255
    }

    /// Adds bits to the byte of a slot.
    pub fn set(&mut self, slot: Slot, weight: u32) {
        let word = match slot.line {
            NO_LINE => &mut self.inside,
            FIRST_SIDE => &mut self.first_sides,
            LAST_SIDE => &mut self.last_sides,
            _ => &mut self.seams,
        };
        *word |= weight << (8 * slot.byte);
    }

    /// True if odd vertices of a slot snap to even ones.
    pub fn is_stitched(&self, slot: Slot) -> bool {
        match slot.line {
            NO_LINE => false,
            SEAM => self.get(slot) & STITCHED != 0,
            _ => self.get(slot) >= ONE,
        }
    }

    /// The weight of a region, 0 to [`ONE`]; 0 of region 0.
    pub fn of_region(&self, region: u32) -> u32 {
        if region == 0 {
            return 0;
        }
        let (slot, stage) = ((region - 1) & 15, (region - 1) >> 4);
        self.get(Slot { line: slot as i32 / 4, byte: slot % 4 }).saturating_sub(stage * ONE).min(ONE)
    }
}

impl SkirtWeights {
    /// Unpacks the weights of an instance of this kind.
    pub fn of(instance: &Instance) -> Self {
        let [inside, sides, depth, _] = instance.weights_words;
        Self { inside, sides, depth_m: f32::from_bits(depth) }
    }

    /// The weight of a quadrant, without its flag.
    pub fn inside(&self, quadrant: usize) -> u32 {
        self.inside >> (8 * quadrant) & 255 & !FINER
    }
}

impl DistanceWeights {
    /// Unpacks the weights of an instance of this kind.
    pub fn of(instance: &Instance) -> Self {
        let [flags, range, finer_range, above] = instance.weights_words;
        let [range, finer_range, above_squared] = [range, finer_range, above].map(f32::from_bits);
        Self { flags, range, finer_range, above_squared }
    }
}

impl From<SlotWeights> for Weights {
    fn from(weights: SlotWeights) -> Self {
        Self::Slots(weights)
    }
}

impl From<SkirtWeights> for Weights {
    fn from(weights: SkirtWeights) -> Self {
        Self::Skirts(weights)
    }
}

impl From<DistanceWeights> for Weights {
    fn from(weights: DistanceWeights) -> Self {
        Self::Distance(weights)
    }
}

/// A byte of a [`SlotWeights`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Slot {
    /// [`NO_LINE`], [`FIRST_SIDE`], [`LAST_SIDE`] or [`SEAM`].
    pub line: i32,
    /// Number of the byte in the word of the line.
    pub byte: u32,
}

impl Slot {
    /// The inside of a quadrant.
    pub fn inside(quadrant: u32) -> Self {
        Self { line: NO_LINE, byte: quadrant }
    }

    /// The slot of a vertex after the rotation. Where lines cross no level within reach lacks the vertex, and any slot
    /// is right.
    pub fn of_vertex(instance: &Instance, [x, z]: [i32; 2]) -> Self {
        let cells = instance.cells as i32;
        let half = |n: i32| u32::from(2 * n >= cells);
        let (line, byte) = match (line(cells, x), line(cells, z)) {
            (side @ (FIRST_SIDE | LAST_SIDE), _) => (side, half(z)),
            (_, side @ (FIRST_SIDE | LAST_SIDE)) => (side, 2 + half(x)),
            (SEAM, _) => (SEAM, half(z)),
            (_, SEAM) => (SEAM, 2 + half(x)),
            _ => (NO_LINE, half(x) + 2 * half(z)),
        };
        Self { line, byte }
    }

    /// True on an outer side.
    pub fn is_outer(self) -> bool {
        self.line == FIRST_SIDE || self.line == LAST_SIDE
    }

    /// True if the slot's line runs along z.
    pub fn is_upright(self) -> bool {
        self.byte < 2
    }

    /// Number, 1 to 32, by which an explicit vertex refers to the slot: at stage 0 on the way to the next level, at
    /// stage 1 on the way from that to the one after it.
    pub fn region(self, stage: u32) -> u32 {
        1 + 16 * stage + 4 * self.line as u32 + self.byte
    }
}

/// The line that a coordinate lies on.
fn line(cells: i32, n: i32) -> i32 {
    match n {
        0 => FIRST_SIDE,
        _ if n == cells => LAST_SIDE,
        _ if 2 * n == cells => SEAM,
        _ => NO_LINE,
    }
}

/// Level of detail at a vertex after the rotation: of the finest quadrant that it touches.
pub fn vertex_level(instance: &Instance, turned: [i32; 2]) -> i32 {
    let cells = instance.cells as i32;
    let touches = |n: i32, half: usize| if half == 0 { 2 * n <= cells } else { 2 * n >= cells };
    let is_finer = (0..4).any(|quadrant: usize| {
        touches(turned[0], quadrant & 1) && touches(turned[1], quadrant >> 1) && instance.is_finer(quadrant)
    });
    instance.level as i32 - i32::from(is_finer)
}
