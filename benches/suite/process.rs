//! Running whole programs.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// What one run of a program took.
pub struct Run {
    /// From its start to its end as another program sees it.
    pub whole: f64,
    pub peak_megabytes: f64,
    /// What it printed.
    pub output: Vec<u8>,
}

impl Run {
    /// What it printed as JSON.
    pub fn json(&self) -> serde_json::Value {
        serde_json::from_slice(&self.output).unwrap()
    }
}

/// The program of this package.
pub fn brdfit() -> Command {
    Command::new(env!("CARGO_BIN_EXE_brdfit"))
}

/// The program's exit code for a result that should not be trusted, which has taken its time all the same.
const NOT_USABLE: i32 = 1;

/// Runs a program, which must do its work.
pub fn run(command: &mut Command) -> Run {
    let started = Instant::now();
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let id = child.id();
    let watcher = std::thread::spawn(move || peak_megabytes(id));
    let output = child.wait_with_output().unwrap();
    let whole = started.elapsed().as_secs_f64();
    assert!(
        output.status.success() || output.status.code() == Some(NOT_USABLE),
        "{command:?}: {}\n{}",
        output.status,
        String::from_utf8_lossy(&output.stderr)
    );
    Run { whole, peak_megabytes: watcher.join().unwrap(), output: output.stdout }
}

/// The largest resident size of a process, where the system tells; sampled until it ends.
fn peak_megabytes(id: u32) -> f64 {
    let mut peak: f64 = 0.0;
    while let Ok(status) = std::fs::read_to_string(format!("/proc/{id}/status")) {
        let kilobytes = status
            .lines()
            .find_map(|line| line.strip_prefix("VmHWM:"))
            .and_then(|rest| rest.split_whitespace().next()?.parse::<f64>().ok());
        // A process that has ended but was not waited for has no size any more.
        let Some(kilobytes) = kilobytes else { break };
        peak = peak.max(kilobytes / 1024.0);
        // The system keeps the largest size itself: only what comes in the last moment can be missed.
        std::thread::sleep(Duration::from_millis(10));
    }
    peak
}
