//! What the figures were measured on.

use super::Setup;

pub fn describe(setup: &Setup) -> String {
    let processor = std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
        let line = text.lines().find(|line| line.starts_with("model name"))?.split_once(':')?.1;
        Some(line.split_whitespace().collect::<Vec<_>>().join(" "))
    });
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let load = std::fs::read_to_string("/proc/loadavg").ok();
    let load = load.as_deref().and_then(|text| text.split_whitespace().next());
    let mut text = format!(
        "{}, {threads} threads at a time. {} Compiled by default settings for {}.",
        processor.as_deref().unwrap_or("unknown processor"),
        instructions(),
        std::env::consts::ARCH,
    );
    if let Some(load) = load {
        text += &format!(" Load average at the start: {load}.");
    }
    if let Some(label) = &setup.arguments.label {
        text += &format!(" State of the program: {label}.");
    }
    text + "\n"
}

/// The instruction sets that the loops over rows are compiled for, and which of them this machine runs.
#[cfg(target_arch = "x86_64")]
fn instructions() -> String {
    use pulp::x86::V3;
    let sets = [("AVX2 (x86-64-v3)", V3::try_new().is_some()), ("SSE2", true)];
    let available: Vec<&str> = sets.iter().filter(|(_, is)| *is).map(|(name, _)| *name).collect();
    format!("Instruction sets: {}; the first is used.", available.join(", "))
}

#[cfg(not(target_arch = "x86_64"))]
fn instructions() -> String {
    format!("Instruction set: {:?}.", pulp::Arch::new())
}
