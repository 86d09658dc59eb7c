//! The table of features: condition, reason and memory of each, and the ways to force it.

use super::mipmaps::overlay_bytes;
use super::scene_plan::ScenePlan;
use crate::draw::layout::{ExplicitVertex, VertexNormals};
use crate::draw::{DepthMode, DeviceGeometry, Morph, Normals, Seams};
use crate::texture::detail;

/// One feature.
pub struct Feature {
    /// Its name.
    pub name: &'static str,
    /// Returns true if a plan and the geometry of a technique need it.
    pub(super) is_kept: fn(&ScenePlan, &DeviceGeometry) -> bool,
    /// Reason if it is kept.
    pub(super) kept: &'static str,
    /// Reason if it is omitted.
    pub(super) left_out: &'static str,
    /// True if the technique needs it, not the scene.
    pub(super) by_technique: bool,
    /// Device bytes that it takes.
    pub(super) bytes: fn(&ScenePlan, &DeviceGeometry) -> u64,
    /// Ways to force it by hand.
    pub(super) force: Force,
}

/// The ways to force a feature by hand.
pub(super) enum Force {
    /// None, for this reason.
    Never(&'static str),
    /// Keep it where nothing needs it.
    In(fn(&mut ScenePlan)),
    /// Keep or omit it. Omitting may change the picture.
    Either(fn(&mut ScenePlan, bool)),
}

/// All features, in the order of reports.
pub const FEATURES: &[Feature] = &[
    Feature {
        name: "32-bit heights",
        is_kept: |plan, _| !plan.coded,
        kept: "heights do not fit 16 bits",
        left_out: "heights are exact in 16 bits",
        by_technique: false,
        bytes: |plan, _| 2 * plan.samples(),
        force: Force::In(|plan| plan.coded = false),
    },
    Feature {
        name: "hole mask",
        is_kept: |plan, _| plan.holes,
        kept: "samples without data",
        left_out: "every sample has data",
        by_technique: false,
        bytes: |plan, _| plan.samples(),
        force: Force::In(|plan| plan.holes = true),
    },
    Feature {
        name: "ceiling",
        is_kept: |plan, _| plan.ceiling,
        kept: "the field is the floor of a cave",
        left_out: "nothing lies over the field",
        by_technique: false,
        bytes: |plan, _| plan.texel_bytes() * plan.samples(),
        force: Force::Never("it is read with --ceiling"),
    },
    Feature {
        name: "tiling",
        is_kept: |plan, _| plan.tiled,
        kept: "the field repeats",
        left_out: "the field does not repeat",
        by_technique: false,
        bytes: none,
        force: Force::In(|plan| plan.tiled = true),
    },
    Feature {
        name: "height pages",
        is_kept: |plan, _| plan.page_shift > 0,
        kept: "the field exceeds one image",
        left_out: "one image holds the field",
        by_technique: false,
        bytes: none,
        force: Force::In(ScenePlan::cut_into_pages),
    },
    Feature {
        name: "filtering in the shader",
        is_kept: |plan, _| !plan.filtered,
        kept: "the device's sampler cannot: the heights' format, or several pages",
        left_out: "the device's sampler does it",
        by_technique: false,
        bytes: none,
        force: Force::In(|plan| plan.filtered = false),
    },
    Feature {
        name: "lattice program",
        is_kept: |plan, _| plan.draws.lattice,
        kept: "vertices get their heights from the texture",
        left_out: "vertices come with their heights",
        by_technique: true,
        bytes: none,
        force: Force::In(|plan| plan.draws.lattice = true),
    },
    Feature {
        name: "explicit program",
        is_kept: |plan, _| plan.draws.explicit,
        kept: "vertices come with their heights",
        left_out: "vertices get their heights from the texture",
        by_technique: true,
        bytes: none,
        force: Force::In(|plan| plan.draws.explicit = true),
    },
    Feature {
        name: "triangle strips",
        is_kept: |plan, _| plan.draws.strips,
        kept: "some draws are strips",
        left_out: "no draw is a strip",
        by_technique: true,
        bytes: none,
        force: Force::In(|plan| plan.draws.strips = true),
    },
    Feature {
        name: "vertex weights",
        is_kept: |plan, _| plan.requirements.morph != Morph::No,
        kept: "lattice vertices morph or fall onto coarser sides",
        left_out: "no lattice vertex moves",
        by_technique: true,
        bytes: none,
        force: Force::In(|plan| {
            if plan.requirements.morph == Morph::No {
                plan.requirements.morph = Morph::ByInstance;
            }
        }),
    },
    Feature {
        name: "skirts",
        is_kept: |plan, _| plan.requirements.seams == Seams::Skirts,
        kept: "meshes have edges of their own",
        left_out: "meshes share their edges",
        by_technique: true,
        bytes: none,
        force: Force::Never("meshes have them or not: a setting of the technique"),
    },
    Feature {
        name: "vertex normals",
        is_kept: |plan, _| plan.requirements.normals == Normals::Vertices,
        kept: "vertices carry what lights them",
        left_out: "the height texture lights each pixel",
        by_technique: true,
        bytes: |_, kept| (kept.geometry.normals.len() * size_of::<VertexNormals>()) as u64,
        force: Force::Never("vertices have them or not: a setting of the technique"),
    },
    Feature {
        name: "streamed geometry",
        is_kept: |_, kept| kept.limits.vertices > 0,
        kept: "every frame has vertices of its own",
        left_out: "what is drawn stays on the device",
        by_technique: true,
        bytes: |_, kept| {
            let limits = kept.limits;
            let [vertex, normal] = [size_of::<ExplicitVertex>(), size_of::<VertexNormals>()];
            (limits.vertices * vertex + limits.normals * normal + limits.indices * size_of::<u32>()) as u64
        },
        force: Force::Never("it is what the technique draws"),
    },
    Feature {
        name: "uploads",
        is_kept: |_, kept| kept.limits.upload_bytes > 0,
        kept: "what stays on the device changes from frame to frame",
        left_out: "what stays on the device does not change",
        by_technique: true,
        bytes: |_, kept| kept.limits.upload_bytes as u64,
        force: Force::Never("it is what the technique draws"),
    },
    Feature {
        name: "selection on the device",
        is_kept: |_, kept| kept.gpu_selection.is_some(),
        kept: "the technique leaves it to the device",
        left_out: "the host selects",
        by_technique: true,
        bytes: none,
        force: Force::Never("it is a variant of the technique"),
    },
    Feature {
        name: "depth buffer",
        is_kept: |plan, _| plan.has_depth(),
        kept: "triangles come in any order",
        left_out: "the furthest come first",
        by_technique: true,
        bytes: none,
        force: Force::In(|plan| plan.requirements.depth_mode = DepthMode::Buffer),
    },
    Feature {
        name: "fog",
        is_kept: |plan, _| plan.fog,
        kept: "asked for",
        left_out: "density 0",
        by_technique: false,
        bytes: none,
        force: Force::Either(|plan, keep| plan.fog = keep),
    },
    Feature {
        name: "detail textures",
        is_kept: |plan, _| plan.detail,
        kept: "asked for",
        left_out: "the ground is not looked at from near",
        by_technique: false,
        bytes: |_, _| detail::bytes(),
        force: Force::Either(|plan, keep| plan.detail = keep),
    },
    Feature {
        name: "overlay",
        is_kept: |plan, _| plan.colour.shows_overlay() && plan.maps.is_none(),
        kept: "asked for",
        left_out: "no picture is laid over as a whole",
        by_technique: false,
        bytes: |plan, _| plan.overlay.map_or(0, overlay_bytes),
        force: Force::Never("a picture is laid over with --overlay"),
    },
    Feature {
        name: "texture maps",
        is_kept: |plan, _| plan.colour.shows_overlay() && plan.maps.is_some(),
        kept: "the picture exceeds the memory for it, or one image",
        left_out: "no picture exceeds the memory for it",
        by_technique: false,
        bytes: |plan, _| plan.maps.map_or(0, |cut| cut.bytes()),
        force: Force::Never("it is the memory for a picture that decides: --texture-memory"),
    },
    Feature {
        name: "ground texels",
        is_kept: |plan, _| plan.ground.is_some(),
        kept: "asked for",
        left_out: "no ground is made where it is seen",
        by_technique: false,
        bytes: |plan, _| plan.ground.map_or(0, |cut| cut.bytes()),
        force: Force::Never("they are asked for with --colour ground"),
    },
    Feature {
        name: "wireframe",
        is_kept: |plan, _| plan.wireframe,
        kept: "asked for",
        left_out: "faces are filled",
        by_technique: false,
        bytes: none,
        force: Force::Never("it is asked for with --wireframe"),
    },
    Feature {
        name: "swapchain",
        is_kept: |plan, _| plan.windowed,
        kept: "pictures go to a window",
        left_out: "pictures stay in memory",
        by_technique: false,
        bytes: none,
        force: Force::Never("only view opens a window"),
    },
    Feature {
        name: "queries",
        is_kept: |plan, _| plan.measured,
        kept: "times are reported",
        left_out: "nothing is measured",
        by_technique: false,
        bytes: none,
        force: Force::Either(|plan, keep| plan.measured = keep),
    },
];

fn none(_: &ScenePlan, _: &DeviceGeometry) -> u64 {
    0
}

impl Feature {
    /// Returns true if it can be kept (or omitted) by hand.
    pub fn can_be(&self, kept: bool) -> bool {
        match self.force {
            Force::Never(_) => false,
            Force::In(_) => kept,
            Force::Either(_) => true,
        }
    }

    /// Keeps it in a plan or omits it, if it can be forced so.
    pub(super) fn force(&self, plan: &mut ScenePlan, keep: bool) {
        match self.force {
            Force::Either(force) => force(plan, keep),
            Force::In(force) if keep => force(plan),
            _ => {}
        }
    }
}
