//! Synthetic height fields. The same seed gives the same bytes on every machine: they use integer hashing and
//! + − × ÷ sqrt floor of f64 in a fixed order, and threads only where no value depends on another.

mod cave;
mod eroded;
pub mod flow;
mod fractal;
pub mod noise;
mod peers;
mod plain;
mod rock;
mod settle;

use std::fmt;
use std::str::FromStr;

use super::field::Field;

/// A family of fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// A horizontal plane.
    Flat,
    /// A sloping plane.
    Ramp,
    /// Warped, ridged noise.
    Fractal,
    /// Mountains cut by rivers, with troughs, plains and lakes.
    Eroded,
    /// A checkerboard of the lowest and highest 16-bit height.
    Checker,
    /// A vertical wall across a plain.
    Cliff,
    /// One sample of 10⁵ m on a plain.
    Spike,
    /// A wall one sample wide on a plain.
    Ridge,
    /// The field on which other renderers were measured.
    Peers,
    /// The floor of a cave.
    CaveFloor,
    /// The ceiling of the cave with the floor of the same size and seed.
    CaveCeiling,
}

/// One row of [`KINDS`].
pub struct Entry {
    /// The kind.
    pub kind: Kind,
    /// Its name on the command line.
    pub name: &'static str,
    /// Description in one sentence.
    pub about: &'static str,
    make: fn(size: [u32; 2], seed: u64) -> Field,
}

/// Every kind, in the order of [`Kind`].
#[rustfmt::skip]
pub const KINDS: &[Entry] = &[
    Entry { kind: Kind::Flat, name: "flat", about: "a plane at 100 m", make: plain::flat },
    Entry { kind: Kind::Ramp, name: "ramp", about: "a plane that rises 1 m a sample east and 1/2 m south", make: plain::ramp },
    Entry { kind: Kind::Fractal, name: "fractal", about: "warped, ridged noise, rough on the heights and smooth in the valleys", make: fractal::fractal },
    Entry { kind: Kind::Eroded, name: "eroded", about: "alpine land cut by rivers, with troughs, plains and lakes", make: eroded::eroded },
    Entry { kind: Kind::Checker, name: "checker", about: "-32768 m and 32767 m in turn", make: plain::checker },
    Entry { kind: Kind::Cliff, name: "cliff", about: "a wall of 1000 m within one cell, aslant across a plain", make: plain::cliff },
    Entry { kind: Kind::Spike, name: "spike", about: "one sample of 100000 m on a plain, its place by the seed", make: plain::spike },
    Entry { kind: Kind::Ridge, name: "ridge", about: "a wall of 300 m, one sample wide, aslant across a plain", make: plain::ridge },
    Entry { kind: Kind::Peers, name: "peers", about: "the fractal field that other renderers were measured on", make: peers::peers },
    Entry { kind: Kind::CaveFloor, name: "cave-floor", about: "the floor of winding passages", make: cave::floor },
    Entry { kind: Kind::CaveCeiling, name: "cave-ceiling", about: "the ceiling over the cave-floor of the same seed, below it in the rock", make: cave::ceiling },
];

/// Makes the field of a kind, `size` samples along (x, z), at least 2 × 2.
pub fn synth(kind: Kind, size: [u32; 2], seed: u64) -> Field {
    (KINDS[kind as usize].make)(size, seed)
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(KINDS[*self as usize].name)
    }
}

impl FromStr for Kind {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let names: Vec<_> = KINDS.iter().map(|entry| entry.name).collect();
        let found = KINDS.iter().find(|entry| entry.name == name).map(|entry| entry.kind);
        found.ok_or_else(|| format!("expected one of {}, found {name}", names.join(", ")))
    }
}
