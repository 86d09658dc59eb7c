//! The public benchmark kit: a fixed list of scenes, so that results from different machines can be compared.
//!
//! Its fields are synthetic and identical on every machine, bit by bit. Height files on the command line are added to
//! them, along [`REAL_PATHS`].

use std::sync::Arc;

use super::rows::Terrain;
use crate::height::Field;
use crate::height::synth::{self, Kind};

/// Version of the kit. It increases with every change of the list or of the pictures' size.
pub const VERSION: u32 = 1;
/// Paths over height files that are measured along with the kit.
pub const REAL_PATHS: &[&str] = &["circle", "corner"];

/// One scene of the kit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KitScene {
    /// Kind of the synthetic field. Its samples are 1 m apart.
    pub kind: Kind,
    /// Samples along each side.
    pub side: u32,
    /// Seed of the field.
    pub seed: u64,
    /// Name of the camera path.
    pub path: &'static str,
    /// Number of frames on the path.
    pub frames: usize,
    /// Errors are measured at frames 0, `every`, 2 · `every`, …
    pub every: usize,
}

const fn peers(side: u32) -> KitScene {
    KitScene { kind: Kind::Peers, side, seed: 1, path: "fly", frames: 120, every: 10 }
}

const fn scene(kind: Kind, side: u32, seed: u64, path: &'static str) -> KitScene {
    KitScene { kind, side, seed, path, frames: 60, every: 5 }
}

/// All scenes. The `peers` scenes follow the protocol under which other terrain renderers were measured: 20 warm-up
/// frames, 1280 × 720 pixels, 45° vertical field of view, errors at every 10th frame.
pub const SCENES: &[KitScene] = &[
    peers(513),
    peers(1025),
    peers(2049),
    peers(4097),
    scene(Kind::Eroded, 1025, 7, "circle"),
    scene(Kind::Eroded, 1025, 7, "skim"),
    scene(Kind::Eroded, 1025, 7, "spin"),
    scene(Kind::Eroded, 1025, 7, "zoom"),
    scene(Kind::Fractal, 1025, 1, "dive"),
    scene(Kind::Fractal, 1025, 1, "hover"),
    scene(Kind::Fractal, 1025, 1, "teleport"),
    scene(Kind::Cliff, 513, 1, "corner"),
];

/// Warm-up frames before each path of the kit.
pub const WARM_UP: usize = 20;
/// Picture size (x, y) of all scenes, pixels.
pub const SIZE: [u32; 2] = [1280, 720];

impl KitScene {
    /// Returns the name, size and spacing of the field.
    pub fn terrain(&self) -> Terrain {
        let name = format!("{}-{}", self.kind, self.seed);
        Terrain { name, size: [self.side; 2], spacing_m: [1.0; 2] }
    }

    /// Returns field and path, as in "peers-1 2049x2049, fly".
    pub fn name(&self) -> String {
        format!("{}, {}", self.terrain(), self.path)
    }

    /// Synthesises the field.
    pub fn field(&self) -> Arc<Field> {
        let mut field = synth::synth(self.kind, [self.side; 2], self.seed);
        field.spacing = [1.0; 2];
        Arc::new(field)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::paths;

    #[test]
    fn every_scene_has_a_path_and_no_scene_is_there_twice() {
        for (k, scene) in SCENES.iter().enumerate() {
            assert!(paths::find(scene.path).is_some(), "{scene:?}");
            assert!(!SCENES[..k].contains(scene), "{scene:?}");
        }
    }

    #[test]
    fn the_peers_protocol_is_in() {
        for side in [2049, 4097] {
            let found = SCENES.iter().find(|s| s.kind == Kind::Peers && s.side == side).unwrap();
            assert_eq!((found.seed, found.path, found.frames, found.every), (1, "fly", 120, 10));
        }
        assert_eq!((WARM_UP, SIZE), (20, [1280, 720]));
    }

    /// Pins the list by its FNV-1a hash. A change of a scene also requires an increase of [`VERSION`].
    #[test]
    fn a_change_of_the_list_needs_another_version() {
        let text = format!("{SCENES:?} {WARM_UP} {SIZE:?} {REAL_PATHS:?}");
        let sum = text.bytes().fold(0xcbf2_9ce4_8422_2325u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x100_0000_01b3));
        assert_eq!((VERSION, sum), (1, 3058367418236527111));
    }
}
