//! Keeps panics of decompression code from ending the program.
//!
//! The `laz` crate indexes tables with values from the file and panics on some damaged files. What
//! can be checked beforehand is checked in [`crate::laszip`]; the rest is caught here and becomes
//! an error of that chunk.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;

thread_local! {
    static QUIET: Cell<bool> = const { Cell::new(false) };
}

static HOOK: Once = Once::new();

/// Runs code that may panic and turns a panic into its message.
///
/// The panic is not printed. Other threads, and this one outside of `code`, report panics as
/// before: the hook that was installed stays in use for them.
///
/// # Errors
/// The panic's message.
pub(crate) fn contained<T>(code: impl FnOnce() -> T) -> Result<T, String> {
    HOOK.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if !QUIET.get() {
                before(info);
            }
        }));
    });
    let outer = QUIET.replace(true);
    // What the code was working on is dropped or overwritten by the caller after a panic.
    let result = catch_unwind(AssertUnwindSafe(code));
    QUIET.set(outer);
    result.map_err(|payload| {
        let text = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
        text.or_else(|| payload.downcast_ref::<String>().cloned())
            .unwrap_or_else(|| "no message".to_owned())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_its_message() {
        assert_eq!(contained(|| 3), Ok(3));
        let limit = 3;
        assert_eq!(contained(|| panic!("over {limit}")), Err::<(), _>("over 3".to_owned()));
        assert!(!QUIET.get());
    }
}
