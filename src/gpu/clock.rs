//! Converts device timestamps to the host's time line.

use std::time::Instant;

use anyhow::{Context, Result};
use ash::vk;

use super::device::Gpu;

/// Number of simultaneous readings of both clocks; the one with the smallest deviation is used.
const READINGS: usize = 8;

/// A pair of simultaneous device and host times, from which device ticks convert to microseconds.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    /// Device ticks.
    ticks: u64,
    /// Host time at those ticks, microseconds after the origin.
    us: f64,
    /// Origin of the time line.
    origin: Instant,
    /// Maximum error of a converted time, microseconds.
    pub deviation_us: f64,
    /// True if the driver read both clocks together (`VK_EXT_calibrated_timestamps`). False if the times were aligned
    /// by the submission and the end of the work.
    pub is_calibrated: bool,
    unit: Unit,
}

/// Unit and width of device ticks.
#[derive(Clone, Copy, Debug)]
struct Unit {
    /// Microseconds per tick.
    us: f64,
    /// Valid bits of a timestamp.
    bits: u32,
}

impl Clock {
    /// Reads the device clock between two readings of the host clock; `None` if the driver does not support it.
    pub fn calibrated(gpu: &Gpu, origin: Instant) -> Result<Option<Self>> {
        let Some(reader) = &gpu.clock else { return Ok(None) };
        let domain = [vk::CalibratedTimestampInfoEXT::default().time_domain(vk::TimeDomainEXT::DEVICE)];
        let read = || -> Result<Self> {
            let before = us(origin, Instant::now());
            // SAFETY: the reader exists only if the device supports this time domain.
            let (ticks, _) =
                unsafe { reader.get_calibrated_timestamps(&domain) }.context("reading the device clock")?;
            let after = us(origin, Instant::now());
            Ok(Self::within(Unit::of(gpu), origin, ticks[0], [before, after], true))
        };
        let mut best = read()?;
        for _ in 1..READINGS {
            let next = read()?;
            best = if next.deviation_us < best.deviation_us { next } else { best };
        }
        Ok(Some(best))
    }

    /// Aligns the clocks by work with known first and last ticks that the host submitted and saw finished at the
    /// given instants. The result is the middle of the possible interval.
    pub fn aligned(gpu: &Gpu, origin: Instant, ticks: [u64; 2], instants: [Instant; 2]) -> Self {
        Self::enclosed(Unit::of(gpu), origin, ticks, instants)
    }

    fn enclosed(unit: Unit, origin: Instant, [first, last]: [u64; 2], [submitted, finished]: [Instant; 2]) -> Self {
        let length = Self::within(unit, origin, first, [0.0; 2], false).us(last);
        Self::within(unit, origin, first, [us(origin, submitted), us(origin, finished) - length], false)
    }

    /// Returns a clock at which `ticks` fell in the interval from `from` to `to`, microseconds.
    fn within(unit: Unit, origin: Instant, ticks: u64, [from, to]: [f64; 2], is_calibrated: bool) -> Self {
        Self { ticks, us: (from + to) / 2.0, origin, deviation_us: (to - from).abs() / 2.0, is_calibrated, unit }
    }

    /// Converts device ticks to microseconds after the origin. Ticks may wrap around.
    pub fn us(&self, ticks: u64) -> f64 {
        // Sign-extends the difference from its highest valid bit.
        let unused = 64 - self.unit.bits;
        let difference = (ticks.wrapping_sub(self.ticks) << unused) as i64 >> unused;
        self.us + difference as f64 * self.unit.us
    }

    /// Converts a host instant to microseconds after the origin.
    pub fn host_us(&self, at: Instant) -> f64 {
        us(self.origin, at)
    }
}

impl Unit {
    fn of(gpu: &Gpu) -> Self {
        Self { us: gpu.timestamp_ns / 1e3, bits: gpu.timestamp_bits }
    }
}

/// Returns the signed microseconds from `origin` to `at`.
fn us(origin: Instant, at: Instant) -> f64 {
    1e6 * (at.saturating_duration_since(origin).as_secs_f64() - origin.saturating_duration_since(at).as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_before_and_after_wraparound_convert() {
        let clock = Clock {
            ticks: (1 << 36) - 10,
            us: 1000.0,
            origin: Instant::now(),
            deviation_us: 0.0,
            is_calibrated: true,
            unit: Unit { us: 0.5, bits: 36 },
        };
        assert_eq!(clock.us((1 << 36) - 10), 1000.0);
        assert_eq!(clock.us((1 << 36) - 30), 990.0);
        assert_eq!(clock.us(10), 1010.0, "over the end of 36 bits");
        let whole = Clock { ticks: 5, unit: Unit { us: 0.5, bits: 64 }, ..clock };
        assert_eq!([whole.us(3), whole.us(u64::MAX)], [999.0, 997.0]);
    }

    #[test]
    fn host_times_before_the_origin_are_negative() {
        let origin = Instant::now();
        let later = origin + std::time::Duration::from_micros(250);
        assert!((us(origin, later) - 250.0).abs() < 1e-6);
        assert!((us(later, origin) + 250.0).abs() < 1e-6);
    }

    /// 2 ms of work, submitted at 0.5 ms and finished at 4.5 ms, must have begun between 0.5 and 2.5 ms.
    #[test]
    fn uncalibrated_work_is_centred_between_its_submission_and_end() {
        let origin = Instant::now();
        let at = |us| origin + std::time::Duration::from_micros(us);
        let clock = Clock::enclosed(Unit { us: 2.0, bits: 64 }, origin, [7000, 8000], [at(500), at(4500)]);
        let found = [clock.us(7000), clock.us(8000), clock.deviation_us];
        assert!(found.iter().zip([1500.0, 3500.0, 1000.0]).all(|(a, b)| (a - b).abs() < 1e-6), "{found:?}");
        assert!(!clock.is_calibrated);
    }
}
