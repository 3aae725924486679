//! Whether something else runs on the machine beside a render: then its times say nothing.

/// Seconds that the threads of this process have waited for a processor while they could have run, summed over those that
/// there are now; none where the system does not tell (it does on Linux, in `/proc/PID/task/TID/schedstat`: nanoseconds on a
/// processor, and those waiting for one).
pub fn waited() -> Option<f64> {
    let tasks = std::fs::read_dir("/proc/self/task").ok()?;
    let mut nanoseconds = 0u64;
    for task in tasks {
        // A thread may end meanwhile.
        let Ok(text) = std::fs::read_to_string(task.ok()?.path().join("schedstat")) else { continue };
        nanoseconds += text.split_whitespace().nth(1)?.parse::<u64>().ok()?;
    }
    Some(nanoseconds as f64 * 1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, Instant};

    /// Twice as many threads as there are processors wait for each other half of the time.
    #[test]
    #[cfg(target_os = "linux")]
    fn threads_that_wait_are_seen() {
        let processors = std::thread::available_parallelism().expect("a number").get();
        let before = waited().expect("Linux tells");
        let most = std::thread::scope(|scope| {
            let until = Instant::now() + Duration::from_millis(600);
            for _ in 0..2 * processors {
                scope.spawn(move || while Instant::now() < until {});
            }
            std::thread::sleep(Duration::from_millis(500));
            waited().expect("Linux tells") - before
        });
        assert!(most > 0.2 * processors as f64, "{most} s");
    }
}
