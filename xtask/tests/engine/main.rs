//! The engine over a tiny chain of stages, each command in a process of its own.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test may fail"
)]

mod cases;
mod resume;
mod support;
mod trees;

#[test]
#[ignore = "the other side of the tests here"]
fn child_process() {
    support::child();
}
