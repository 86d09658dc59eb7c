//! Techniques with altered draw lists or requirements, for tests that must notice the difference.

use cuesta::internal::draw::{DrawList, Geometry, Limits, PipelineRequirements};
use cuesta::internal::lod::{Entry, Technique, geomipmap};
use cuesta::internal::view::View;

/// A technique whose draw lists and requirements are changed after the fact.
pub struct Altered {
    inner: Box<dyn Technique>,
    list: fn(&mut DrawList),
    requirements: fn(&mut PipelineRequirements),
}

impl Altered {
    /// Changes every draw list.
    pub fn list(inner: Box<dyn Technique>, list: fn(&mut DrawList)) -> Box<dyn Technique> {
        Box::new(Self { inner, list, requirements: |_| () })
    }

    /// Changes the requirements.
    #[cfg(feature = "vulkan")]
    pub fn requirements(inner: Box<dyn Technique>, requirements: fn(&mut PipelineRequirements)) -> Box<dyn Technique> {
        Box::new(Self { inner, list: |_| (), requirements })
    }
}

impl Technique for Altered {
    fn resident(&self) -> &Geometry {
        self.inner.resident()
    }
    fn limits(&self) -> Limits {
        self.inner.limits()
    }
    fn select(&mut self, view: &View, list: &mut DrawList) {
        self.inner.select(view, list);
        (self.list)(list);
    }
    fn keeps_tolerance(&self) -> bool {
        self.inner.keeps_tolerance()
    }
    fn pipeline_requirements(&self) -> PipelineRequirements {
        let mut requirements = self.inner.pipeline_requirements();
        (self.requirements)(&mut requirements);
        requirements
    }
}

/// GeoMipMapping without its last block.
pub static BLOCK_LOST: Entry = Entry {
    name: "block-lost",
    build: |field, settings| {
        Altered::list((geomipmap::ENTRY.build)(field, settings), |list| {
            if let Some(draw) = list.draws.last_mut() {
                draw.instances.end -= 1;
            }
        })
    },
    ..geomipmap::ENTRY
};
