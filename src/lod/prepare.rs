//! Prepares a technique for a field that it can draw.

use std::sync::Arc;

use super::entry::Entry;
use super::settings::Settings;
use super::sorted_strips;
use super::table::TECHNIQUES;
use super::technique::Technique;
use crate::height::Field;

impl Entry {
    /// Prepares the technique for a field.
    ///
    /// # Errors
    /// If the technique cannot draw the field.
    pub fn prepare(&self, field: &Arc<Field>, settings: &Settings) -> Result<Box<dyn Technique>, String> {
        if field.procedural().is_some() {
            self.check_endless()?;
        } else {
            self.check_samples(field.size())?;
        }
        if field.ceiling().is_some() {
            self.check_cave(settings)?;
        }
        Ok((self.build)(Arc::clone(field), settings))
    }

    /// Checks that the technique draws terrain without samples.
    fn check_endless(&self) -> Result<(), String> {
        if self.takes_endless {
            return Ok(());
        }
        let able: Vec<_> = TECHNIQUES.iter().filter(|entry| entry.takes_endless).map(|entry| entry.name).collect();
        Err(format!("{}: it needs samples, and this land has none: try {}", self.name, able.join(", ")))
    }

    /// Checks that a field of this size, in samples, is within the technique's limits.
    fn check_samples(&self, size: [u32; 2]) -> Result<(), String> {
        let ([w, h], Self { name, max_samples, max_side, .. }) = (size.map(u64::from), self);
        if w * h > *max_samples {
            return Err(format!("{name}: {w} x {h} samples, and it goes through them all: at most {max_samples}"));
        }
        if size.iter().any(|n| n > max_side) {
            return Err(format!("{name}: {w} x {h} samples: expected at most {max_side} a side"));
        }
        Ok(())
    }

    /// Checks that the technique draws caves with these settings.
    fn check_cave(&self, settings: &Settings) -> Result<(), String> {
        let able = sorted_strips::ENTRY.name;
        if self.name != able {
            return Err(format!("a ceiling: expected technique {able}, found {}", self.name));
        }
        sorted_strips::cave::can_draw(settings)
    }
}
