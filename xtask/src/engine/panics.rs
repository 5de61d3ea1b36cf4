//! A panic inside a stage is that unit's failure, with its place, and never the end of the run.

use std::any::Any;
use std::sync::{Mutex, PoisonError};

static LAST_PLACE: Mutex<Option<String>> = Mutex::new(None);

/// Keeps panics from printing; [`describe`] tells where they were.
pub fn quieten() {
    std::panic::set_hook(Box::new(|info| {
        let place = info.location().map(|place| format!("{}:{}", place.file(), place.line()));
        tracing::debug!("{info}");
        *LAST_PLACE.lock().unwrap_or_else(PoisonError::into_inner) = place;
    }));
}

/// A caught panic in words.
#[must_use]
pub fn describe(payload: &(dyn Any + Send)) -> String {
    let text = payload
        .downcast_ref::<&str>()
        .map(|text| (*text).to_owned())
        .or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".to_owned());
    match LAST_PLACE.lock().unwrap_or_else(PoisonError::into_inner).take() {
        Some(place) => format!("internal error at {place}: {text}; please report it"),
        None => format!("internal error: {text}; please report it"),
    }
}
