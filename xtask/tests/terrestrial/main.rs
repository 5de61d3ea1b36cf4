//! The shipped terrestrial chain as a whole: the same models however the scan lies, is ordered and is
//! run; bad input; and a program in place of the built-in `tree-labels`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may fail")]

mod bad_input;
mod hook;
mod invariance;
mod scenes;
mod support;
