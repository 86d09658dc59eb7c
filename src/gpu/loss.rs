//! The loss of the device: a driver that resets it or gives up says so at a submission or at a wait, and nothing can be
//! done on it any more but to end. What happens then can be tried: so many calls succeed, and the next one is told so.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};

use anyhow::{Result, anyhow};
use ash::prelude::VkResult;
use ash::vk;

use super::device::Gpu;

/// Whether the device is there.
pub(super) struct Presence {
    /// Calls that are still to succeed.
    calls_left: AtomicU64,
    is_lost: AtomicBool,
}

impl Default for Presence {
    fn default() -> Self {
        Self { calls_left: AtomicU64::new(u64::MAX), is_lost: AtomicBool::new(false) }
    }
}

impl Gpu {
    /// From now on so many submissions and waits succeed, and then the device counts as lost: to try what happens.
    pub fn lose_after(&self, calls: u64) {
        self.presence.calls_left.store(calls, Relaxed);
        self.presence.is_lost.store(false, Relaxed);
    }

    /// Whether it is lost.
    pub fn is_lost(&self) -> bool {
        self.presence.is_lost.load(Relaxed)
    }

    /// What is to be said when it is lost.
    pub fn loss(&self) -> String {
        format!("{}: the device is lost: its driver has reset it or given up", self.candidate.name)
    }

    /// Makes a call that is told when the device is lost; on a lost one none is made.
    pub(super) fn check_device_lost<T>(&self, call: impl FnOnce() -> VkResult<T>) -> Result<T> {
        let left = &self.presence.calls_left;
        let is_spent = left.fetch_update(Relaxed, Relaxed, |left| left.checked_sub(1)).is_err();
        let answer = if is_spent || self.is_lost() { Err(vk::Result::ERROR_DEVICE_LOST) } else { call() };
        answer.map_err(|error| self.failure(error))
    }

    /// A call's failure in words.
    pub(super) fn failure(&self, error: vk::Result) -> anyhow::Error {
        if error != vk::Result::ERROR_DEVICE_LOST {
            return error.into();
        }
        self.presence.is_lost.store(true, Relaxed);
        anyhow!(self.loss())
    }
}
