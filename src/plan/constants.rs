//! The specialization constants of a scene's shaders, declared once. A feature that a plan omits is a constant that
//! is off, so that the driver removes its code.
//!
//! `build.rs` includes this file by path and serves [`SceneConstants::glsl`] to `#include "constants.glsl"`.

use super::colour::Colour;

/// A type that a specialization constant can have.
trait Value: Copy {
    /// Type and default value in GLSL.
    const GLSL: [&str; 2];

    /// The four bytes that the pipeline is given.
    fn word(self) -> u32;
}

impl Value for bool {
    const GLSL: [&str; 2] = ["bool", "false"];

    fn word(self) -> u32 {
        self.into()
    }
}

impl Value for u32 {
    const GLSL: [&str; 2] = ["uint", "0"];

    fn word(self) -> u32 {
        self
    }
}

impl Value for f32 {
    const GLSL: [&str; 2] = ["float", "0.0"];

    fn word(self) -> u32 {
        self.to_bits()
    }
}

impl Value for Colour {
    const GLSL: [&str; 2] = u32::GLSL;

    fn word(self) -> u32 {
        self as u32
    }
}

macro_rules! constants {
    ($($(#[$doc:meta])* $name:ident: $type:ident,)*) => {
        /// Values of the specialization constants. Their ids count from 0 in the order of the fields; in GLSL their
        /// names are in capitals.
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct SceneConstants { $($(#[$doc])* pub $name: $type,)* }

        impl SceneConstants {
            /// The values in the order of their ids.
            pub fn words(&self) -> Vec<u32> {
                vec![$(self.$name.word(),)*]
            }

            /// The constants as GLSL declarations, and the numbers of [`Colour`].
            pub fn glsl() -> String {
                let declared = [$((stringify!($name), <$type as Value>::GLSL),)*];
                let declare = |(id, (name, [ty, default])): (usize, (&str, [&str; 2]))| {
                    format!("layout(constant_id = {id}) const {ty} {} = {default};\n", name.to_uppercase())
                };
                declared.into_iter().enumerate().map(declare).chain([Colour::glsl()]).collect()
            }
        }
    };
}

constants! {
    /// Heights are 16-bit codes, not metres.
    coded: bool,
    /// The field repeats.
    tiled: bool,
    /// Side of a page of the height texture as a power of two; 0: one page holds the field.
    page_shift: u32,
    /// Some samples have no data.
    holes: bool,
    /// Fog is computed.
    fog: bool,
    /// The quantity that colours show.
    colour: Colour,
    /// The device's sampler filters the height texture linearly.
    filtered: bool,
    /// Lattice vertices morph to coarser levels or snap to coarser sides.
    morph: bool,
    /// Lattice meshes have skirts.
    skirts: bool,
    /// Detail textures cover the ground.
    detail: bool,
    /// Each lattice vertex morphs by its own distance.
    distance: bool,
    /// The samples stored along both axes are powers of two.
    masked: bool,
    /// The field is the floor of a cave.
    ceiling: bool,
    /// Binary digits of a fraction of a sample in positions on the virtual ground.
    map_shift: u32,
    /// Pages of the overlay along x, where it is a virtual texture; else 0.
    map_columns: f32,
    /// Pages of the overlay along z.
    map_rows: f32,
    /// The overlay covers a part of the field only.
    overlay_ends: bool,
}
