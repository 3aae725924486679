//! Where and when an experiment runs.

use super::results::Machine;
use std::time::{SystemTime, UNIX_EPOCH};

/// This computer, with as many threads as the current pool has.
pub fn machine() -> Machine {
    Machine { cpu: cpu(), cores: usable(), threads: rayon::current_num_threads() }
}

/// Processors that this process may use.
pub fn usable() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}

/// Processors of this computer, whichever of them this process may use.
pub fn processors() -> usize {
    match info().lines().filter(|l| l.starts_with("processor")).count() {
        0 => usable(),
        count => count,
    }
}

/// What Linux tells of the processors; nothing elsewhere.
fn info() -> String {
    std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default()
}

fn cpu() -> String {
    let info = info();
    let value = |key: &str| {
        let line = info.lines().find(|l| l.starts_with(key))?;
        line.split_once(':').map(|(_, v)| v.trim().to_owned()).filter(|v| !v.is_empty())
    };
    value("model name").or_else(|| value("Hardware")).unwrap_or_else(|| "unknown".into())
}

/// Now, UTC, as `2026-01-31T23:59:59Z`.
pub fn now() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs());
    timestamp(seconds)
}

/// Seconds since 1970 as a date and time of day.
fn timestamp(seconds: u64) -> String {
    let (days, time) = (seconds / 86_400, seconds % 86_400);
    let leap = |y: u64| (y.is_multiple_of(4) && !y.is_multiple_of(100)) || y.is_multiple_of(400);
    let (mut year, mut day) = (1970, days);
    while day >= 365 + u64::from(leap(year)) {
        day -= 365 + u64::from(leap(year));
        year += 1;
    }
    let february = 28 + u64::from(leap(year));
    let mut month = 1;
    for length in [31, february, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31] {
        if day < length {
            break;
        }
        day -= length;
        month += 1;
    }
    let (hour, minute, second) = (time / 3600, time / 60 % 60, time % 60);
    format!("{year:04}-{month:02}-{:02}T{hour:02}:{minute:02}:{second:02}Z", day + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_by_hand() {
        for (seconds, text) in [
            (0, "1970-01-01T00:00:00Z"),
            (951_782_400, "2000-02-29T00:00:00Z"),
            (1_709_251_199, "2024-02-29T23:59:59Z"),
            (1_735_689_599, "2024-12-31T23:59:59Z"),
            (4_107_542_400, "2100-03-01T00:00:00Z"),
        ] {
            assert_eq!(timestamp(seconds), text);
        }
    }

    #[test]
    fn the_machine_has_a_name_and_cores() {
        let machine = machine();
        assert!(!machine.cpu.is_empty() && machine.cores > 0 && machine.threads > 0);
        assert!(processors() >= machine.cores);
    }
}
