//! Techniques with altered views, draw lists or requirements, for tests that must notice the difference.

use cuesta::internal::draw::weights::SkirtWeights;
use cuesta::internal::draw::{DrawList, Geometry, Limits, PipelineRequirements};
use cuesta::internal::lod::{Entry, Technique, geomipmap};
use cuesta::internal::view::View;

/// A technique that is given another view, or whose draw lists or requirements are changed after the fact.
pub struct Altered {
    inner: Box<dyn Technique>,
    view: Box<dyn FnMut(&View) -> View + Send>,
    list: Box<dyn FnMut(&mut DrawList) + Send>,
    requirements: fn(&mut PipelineRequirements),
}

impl Altered {
    /// Changes nothing yet.
    pub fn new(inner: Box<dyn Technique>) -> Self {
        Self { inner, view: Box::new(|view| *view), list: Box::new(|_| ()), requirements: |_| () }
    }

    /// Changes every view before selection.
    pub fn with_view(self, view: impl FnMut(&View) -> View + Send + 'static) -> Self {
        Self { view: Box::new(view), ..self }
    }

    /// Changes every draw list.
    pub fn with_list(self, list: impl FnMut(&mut DrawList) + Send + 'static) -> Self {
        Self { list: Box::new(list), ..self }
    }

    /// Changes the requirements.
    pub fn with_requirements(self, requirements: fn(&mut PipelineRequirements)) -> Self {
        Self { requirements, ..self }
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
        self.inner.select(&(self.view)(view), list);
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
        let lose_a_block = |list: &mut DrawList| {
            if let Some(draw) = list.draws.last_mut() {
                draw.instances.end -= 1;
            }
        };
        Box::new(Altered::new((geomipmap::ENTRY.build)(field, settings)).with_list(lose_a_block))
    },
    ..geomipmap::ENTRY
};

/// Multiplies the depths of all skirts.
pub fn scale_skirts(list: &mut DrawList, factor: f32) {
    for instance in &mut list.instances {
        let weights = SkirtWeights::of(instance);
        *instance = instance.with_weights(SkirtWeights { depth_m: factor * weights.depth_m, ..weights });
    }
}
