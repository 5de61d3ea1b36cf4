//! The engine over a tiny chain of stages, each command in a process of its own.

mod cases;
mod resume;
mod support;

#[test]
#[ignore = "the other side of the tests here"]
fn child_process() {
    support::child();
}
