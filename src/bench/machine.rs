//! Facts about the computer that runs a benchmark, and the peak memory of the process.

use std::fs;

use super::rows::Machine;

impl Machine {
    /// Describes this computer. The processor is "unknown" except on Linux.
    pub fn this() -> Self {
        let cpu = fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| field(&text, "model name"));
        Self {
            cpu: cpu.unwrap_or_else(|| "unknown".to_string()),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        }
    }
}

/// Returns the peak resident memory of this process, bytes; `None` except on Linux.
pub fn host_bytes() -> Option<u64> {
    let kilobytes = field(&fs::read_to_string("/proc/self/status").ok()?, "VmHWM")?;
    kilobytes.trim_end_matches(" kB").parse::<u64>().ok().map(|n| n * 1024)
}

/// Returns the first value of a key in lines of the form `key: value`.
fn field(text: &str, key: &str) -> Option<String> {
    let lines = text.lines().filter_map(|line| line.split_once(':'));
    lines.into_iter().find(|(name, _)| name.trim() == key).map(|(_, value)| value.trim().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_found_by_their_whole_name() {
        let text = "processor\t: 0\nmodel\t\t: 143\nmodel name\t: Fast One @ 3 GHz: x\n\nmodel name\t: Slow One\n";
        assert_eq!(field(text, "model name").as_deref(), Some("Fast One @ 3 GHz: x"));
        assert_eq!(field(text, "name"), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn memory_held_counts() {
        let before = host_bytes().unwrap();
        let budget = vec![1u8; 64 << 20];
        assert!(host_bytes().unwrap() >= before.max(budget.iter().map(|&b| u64::from(b)).sum()));
    }
}
