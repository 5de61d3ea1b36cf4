//! What the process uses, as the system counts it.

/// Largest resident size since [`reset_peak`], bytes; `None` where the system does not tell.
#[must_use]
pub fn peak_bytes() -> Option<u64> {
    field("VmHWM:")
}

/// Begins a new measurement of [`peak_bytes`]. Where that is not allowed, the peak is that of the
/// whole process.
pub fn reset_peak() {
    // "5" resets the high-water mark (proc(5), /proc/pid/clear_refs).
    if let Err(error) = std::fs::write("/proc/self/clear_refs", "5") {
        tracing::debug!("peak memory counts from the start of the process: {error}");
    }
}

/// Memory that programs can still take without swapping, bytes.
#[must_use]
pub fn available_bytes() -> Option<u64> {
    parse(&std::fs::read_to_string("/proc/meminfo").ok()?, "MemAvailable:")
}

fn field(name: &str) -> Option<u64> {
    parse(&std::fs::read_to_string("/proc/self/status").ok()?, name)
}

fn parse(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    let kibibytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kibibytes * 1024)
}

#[cfg(test)]
mod tests {
    #[test]
    fn reads_the_systems_form() {
        assert_eq!(super::parse("VmPeak:\t 9 kB\nVmHWM:\t  12 kB\n", "VmHWM:"), Some(12288));
    }
}
