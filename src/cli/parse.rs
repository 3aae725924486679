//! Values of options.

/// `--spp`: at least 1.
pub fn spp(text: &str) -> Result<u64, String> {
    match text.parse() {
        Ok(0) => Err("at least 1 sample per pixel is needed".into()),
        Ok(spp) => Ok(spp),
        Err(_) => Err("expected a whole number from 1 up".into()),
    }
}

/// `--threads`: at least 1.
pub fn threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(n) if (1..=4096).contains(&n) => Ok(n),
        _ => Err("expected a whole number from 1 to 4096".into()),
    }
}

/// `--size`: `WxH`, each at least 1.
pub fn size(text: &str) -> Result<[u32; 2], String> {
    let number = |part: &str| part.trim().parse().ok().filter(|n| *n > 0);
    let parts = text.split_once(['x', 'X', '×']);
    parts
        .and_then(|(w, h)| Some([number(w)?, number(h)?]))
        .ok_or_else(|| "expected WIDTHxHEIGHT in pixels, as in 640x480".into())
}

/// `--exposure`: within what a float can be multiplied by.
pub fn stops(text: &str) -> Result<f32, String> {
    match text.trim().parse::<f32>() {
        Ok(stops) if stops.abs() <= 60.0 => Ok(stops),
        _ => Err("expected a number of stops from -60 to 60".into()),
    }
}

/// `--time`, in seconds: a number with the unit ms, s, m or h; without one it is seconds.
pub fn duration(text: &str) -> Result<f64, String> {
    let split = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let scale = match unit {
        "ms" => 1e-3,
        "s" | "" => 1.0,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        _ => 0.0,
    };
    let seconds = number.trim().parse::<f64>().map_or(0.0, |n| n * scale);
    if seconds > 0.0 && seconds.is_finite() {
        return Ok(seconds);
    }
    Err("expected a time above 0 with the unit ms, s, m or h, as in 30s".into())
}

/// `--pixel`: `X,Y`.
pub fn pixel(text: &str) -> Result<[u32; 2], String> {
    let number = |part: &str| part.trim().parse().ok();
    let parts = text.split_once(',').and_then(|(x, y)| Some([number(x)?, number(y)?]));
    parts.ok_or_else(|| "expected column and row, as in 120,45".into())
}

/// `--tev`: `HOST:PORT`.
pub fn address(text: &str) -> Result<String, String> {
    let port =
        text.rsplit_once(':').filter(|(host, _)| !host.is_empty()).and_then(|(_, p)| p.parse::<u16>().ok());
    port.map(|_| text.to_owned()).ok_or_else(|| "expected a host and a port, as in 127.0.0.1:14158".into())
}

/// A number in a list that starts at 1.
pub fn ordinal(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| *n > 0).ok_or_else(|| "expected a whole number from 1 up".into())
}

/// `--shard`: `I/N` with I from 1 to N; the number of the shard from 0, and N.
pub fn shard(text: &str) -> Result<(u64, u64), String> {
    let parts =
        text.split_once('/').and_then(|(i, n)| Some((i.trim().parse().ok()?, n.trim().parse().ok()?)));
    match parts {
        Some((i, n)) if (1..=n).contains(&i) => Ok((i - 1, n)),
        _ => Err("expected I/N with I from 1 to N, as in 2/8 for the second of eight".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_units() {
        for (text, seconds) in
            [("30s", 30.0), ("500ms", 0.5), ("2m", 120.0), ("1.5h", 5400.0), ("7", 7.0), ("1 m", 60.0)]
        {
            assert_eq!(duration(text), Ok(seconds), "{text}");
        }
        for text in ["", "s", "-3s", "0", "3 days", "nan", "inf", "1e400s"] {
            assert!(duration(text).is_err(), "{text}");
        }
    }

    #[test]
    fn sizes_are_two_numbers() {
        assert_eq!(size("640x480"), Ok([640, 480]));
        for text in ["640", "640x", "x3", "0x3", "-1x3", "3x3x3", "4.5x3"] {
            assert!(size(text).is_err(), "{text}");
        }
    }

    #[test]
    fn shards_count_from_one() {
        assert_eq!((shard("1/4"), shard("4/4")), (Ok((0, 4)), Ok((3, 4))));
        for text in ["0/4", "5/4", "4", "a/4", "-1/4", "1/0"] {
            assert!(shard(text).is_err(), "{text}");
        }
    }

    #[test]
    fn counts_start_at_one() {
        assert_eq!(spp("1"), Ok(1));
        assert!(spp("0").unwrap_err().contains("at least 1"));
        assert!(threads("0").is_err() && threads("2") == Ok(2));
    }
}
