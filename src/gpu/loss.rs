//! Loss of the device. A driver that resets it or gives up reports the loss at a submission or a wait, and every later call
//! fails. Tests simulate a loss after a number of calls.

use std::sync::atomic::Ordering::Relaxed;

use anyhow::{Result, anyhow};
use ash::prelude::VkResult;
use ash::vk;

use super::device::Gpu;

impl Gpu {
    /// Simulates a loss of the device after the next `calls` submissions and waits.
    pub fn lose_after(&self, calls: u64) {
        self.presence.calls_left.store(calls, Relaxed);
        self.presence.is_lost.store(false, Relaxed);
    }

    /// Returns true if the device is lost.
    pub fn is_lost(&self) -> bool {
        self.presence.is_lost.load(Relaxed)
    }

    /// Returns the message of a lost device.
    pub fn loss(&self) -> String {
        format!("{}: the device is lost: its driver has reset it or given up", self.candidate.name)
    }

    /// Runs `call` unless the device is lost, and records a loss.
    pub(super) fn check_device_lost<T>(&self, call: impl FnOnce() -> VkResult<T>) -> Result<T> {
        let left = &self.presence.calls_left;
        let is_spent = left.fetch_update(Relaxed, Relaxed, |left| left.checked_sub(1)).is_err();
        let answer = if is_spent || self.is_lost() { Err(vk::Result::ERROR_DEVICE_LOST) } else { call() };
        answer.map_err(|error| self.failure(error))
    }

    /// Turns the error of a Vulkan call into a message, and records a loss.
    pub(super) fn failure(&self, error: vk::Result) -> anyhow::Error {
        if error != vk::Result::ERROR_DEVICE_LOST {
            return error.into();
        }
        self.presence.is_lost.store(true, Relaxed);
        anyhow!(self.loss())
    }
}
