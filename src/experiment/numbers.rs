//! Numbers of a results file that may not be finite. JSON has no such numbers: they are written as `null`, and a metric that
//! came out as one is read back as NaN, so that one broken run does not make all others unreadable.

use serde::{Deserialize, Deserializer};
use std::collections::BTreeMap;

/// A number, or NaN for `null`.
///
/// # Errors
/// Anything else.
pub fn number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

/// Three of them.
///
/// # Errors
/// Anything else.
pub fn three<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f64; 3], D::Error> {
    Ok(<[Option<f64>; 3]>::deserialize(deserializer)?.map(|v| v.unwrap_or(f64::NAN)))
}

/// Some of them by name.
///
/// # Errors
/// Anything else.
pub fn named<'de, D: Deserializer<'de>>(deserializer: D) -> Result<BTreeMap<String, f64>, D::Error> {
    let values = BTreeMap::<String, Option<f64>>::deserialize(deserializer)?;
    Ok(values.into_iter().map(|(key, v)| (key, v.unwrap_or(f64::NAN))).collect())
}
