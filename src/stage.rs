//! What a long preparation is at: said by whoever works, shown by whoever likes to.

use std::sync::{Mutex, PoisonError};

static STAGE: Mutex<String> = Mutex::new(String::new());

/// A stage of some length begins.
pub fn begin(words: impl Into<String>) {
    *STAGE.lock().unwrap_or_else(PoisonError::into_inner) = words.into();
}

/// The last stage that began; empty before there is any.
pub fn current() -> String {
    STAGE.lock().unwrap_or_else(PoisonError::into_inner).clone()
}
