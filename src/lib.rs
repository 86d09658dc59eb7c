//! **cuesta** draws large terrain with a bounded error on the screen. It implements six published families of continuous
//! level of detail behind one trait.
//!
//! ```
//! use std::sync::Arc;
//! use cuesta::{DrawList, View, accuracy, glam::DVec3, heights, techniques::Techniques};
//!
//! let field = Arc::new(heights::demo());
//! let view = View::builder().eye(DVec3::new(12_800.0, 4000.0, 25_600.0)).look_at(DVec3::new(12_800.0, 0.0, 12_800.0));
//! let view = view.tolerance_px(2.0).build()?;
//! let mut technique = Techniques::built_in().prepare("geomipmap", &field)?;
//! let mut list = DrawList::default();
//! technique.select(&view, &mut list);
//! let errors = accuracy::errors(&field, &view, technique.resident(), &list);
//! println!("{} triangles, largest error {:.2} pixels", list.triangles(), errors.screen_px.max);
//! assert!(errors.screen_px.max <= 2.0);
//! # Ok::<(), String>(())
//! ```
//!
//! A [`Technique`](techniques::Technique) turns a [`View`] into a [`DrawList`]: plain data, selected without a device.
//! [`accuracy`] measures and proves lists on the CPU.
#![cfg_attr(feature = "vulkan", doc = "[`offscreen`] draws a list on Vulkan.")]
//!
//! World axes: right-handed, x east, y up, z south, metres. Screen: pixels, x right, y down.
//!
//! # Features
//!
//! All are on by default.
//!
//! - `vulkan`: draw on a device. Without it the crate ends at the draw list.
//! - `viewer`: the window.
//! - `bench`: benchmarks, profiles, the stress suite and their reports.
//! - `cli`: the program `cuesta`.

#[doc(hidden)]
pub mod internal;

// Short paths inside the crate: `crate::view`, `crate::height` and so on.
#[allow(unused_imports)]
use internal::*;

pub use glam;

#[doc(inline)]
pub use internal::{
    draw::DrawList,
    view::{
        Aabb, Allowance, Containment, Frustum, Lens, Metric, Projected, Tolerance, View, builder::ViewBuilder,
        default_near,
    },
};

/// Height data: fields of samples, read from files, synthesised, or held in memory.
pub mod heights {
    #[doc(inline)]
    pub use crate::internal::height::{
        Encoding, Error, Field, Footprint, HoleFill, Holes, Loaded, Options, Order, Place, RawLayout, SampleType,
        Samples, SourceFile, Statistics, Unit,
        bezier::Bezier,
        cave::Cave,
        demo::demo,
        load, load_all, load_bytes, load_bytes_with,
        progress::Progress,
        surface::{Corner, Triangle, deviation, height_at},
        synth::{Kind, synth},
    };
}

/// Techniques of continuous level of detail: one trait, the built-in ones, and a place for a caller's own.
///
/// An own technique is a type that implements [`Technique`](techniques::Technique), and an
/// [`Entry`](techniques::Entry) that [`Techniques::with`](techniques::Techniques::with) adds. `examples/own_technique.rs`
/// is one.
pub mod techniques {
    #[doc(inline)]
    pub use crate::internal::lod::{
        Diagnostics, Entry, Gradual, Need, Omitted, SelectInParts, SelectOnGpu, Setting, Settings, TECHNIQUES,
        Technique, TechniqueSpec, Techniques, Values, Variant,
    };
}

/// The parts of a [`DrawList`]: plain data between a technique and a renderer.
pub mod draw_list {
    #[doc(inline)]
    pub use crate::internal::draw::{
        DepthMode, DeviceGeometry, Draw, DrawKinds, ExplicitVertex, Geometry, GpuSelection, Instance, LatticeVertex,
        Limits, Morph, Normals, PipelineRequirements, RESTART, Seams, Source, Submission, Topology, Upload,
        VertexNormals, expand::world_triangles,
    };
}

/// Measures the error of draw lists, and proves that they are one surface. Needs no device.
pub mod accuracy {
    #[doc(inline)]
    pub use crate::internal::measure::{
        geometric::{ANGLES, Errors, Place, Summary, errors},
        in_view,
        watertight::{CounterExample, Kind, Proof, prove_list},
    };
}

/// Draws pictures on Vulkan without a window.
#[cfg(feature = "vulkan")]
pub mod offscreen {
    #[doc(inline)]
    pub use crate::internal::{
        gpu::Choice,
        plan::{Colour, Forced, Look},
        scene::picture::picture,
        texture::drape::Drape,
    };
}

/// Terrain inside another program's Vulkan renderer.
#[cfg(feature = "vulkan")]
#[doc(inline)]
pub use internal::embed;

/// The program `cuesta` as a function, for programs with techniques of their own.
#[cfg(feature = "cli")]
pub mod program {
    #[doc(inline)]
    pub use crate::internal::cli::main;
}
