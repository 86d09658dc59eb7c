//! The colour modes of the terrain, declared once: the enum, its numbers in shaders, and its command-line words.
//!
//! `build.rs` includes this file by path and serves [`Colour::glsl`] to shaders.

macro_rules! colours {
    ($(#[doc = $help:literal] $variant:ident = $name:literal,)*) => {
        /// The quantity that a fragment's colour shows.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        #[repr(u32)]
        pub enum Colour {
            #[default]
            $(#[doc = $help] $variant,)*
        }

        impl Colour {
            /// All of them, in the order of their numbers.
            pub const ALL: &[Colour] = &[$(Colour::$variant,)*];

            /// The word on the command line and in the viewer.
            pub fn name(self) -> &'static str {
                match self { $(Colour::$variant => $name,)* }
            }

            /// One line of help.
            pub fn help(self) -> &'static str {
                match self { $(Colour::$variant => $help,)* }.trim().trim_end_matches('.')
            }
        }
    };
}

colours! {
    /// Hypsometric tint.
    Height = "height",
    /// Level of detail.
    Level = "level",
    /// The overlay picture.
    Overlay = "overlay",
    /// Distance from the samples' surface: blue exact, red one pixel, white more.
    Error = "error",
    /// Surface normal.
    Normal = "normal",
    /// Draw call.
    Batch = "batch",
    /// Level and borders of the overlay's tiles (--texture-memory).
    Maps = "maps",
    /// A ground of 2^36 texels, generated near the eye.
    Ground = "ground",
    /// Level and borders of the tiles of that ground.
    Nodes = "nodes",
}

impl Colour {
    /// True if the mode needs texels of the virtual ground.
    pub fn shows_ground(self) -> bool {
        matches!(self, Colour::Ground | Colour::Nodes)
    }

    /// True if the mode needs the overlay picture.
    pub fn shows_overlay(self) -> bool {
        matches!(self, Colour::Overlay | Colour::Maps)
    }

    /// The numbers as GLSL constants: `COLOUR_HEIGHT` and so on.
    pub fn glsl() -> String {
        let declare =
            |colour: &Colour| format!("const uint COLOUR_{} = {};\n", colour.name().to_uppercase(), *colour as u32);
        Colour::ALL.iter().map(declare).collect()
    }
}
