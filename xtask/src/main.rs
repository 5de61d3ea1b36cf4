//! `cargo xtask`: see the library for everything.

use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use tracing_subscriber::EnvFilter;
use tracing_subscriber::filter::LevelFilter;
use xtask::cli::Program;
use xtask::engine::panics;
use xtask::las::LasSurveyor;
use xtask::registry::Registry;

static CANCEL: AtomicBool = AtomicBool::new(false);

fn main() -> ExitCode {
    tracing_subscriber::fmt()
        .with_env_filter(
            EnvFilter::builder().with_default_directive(LevelFilter::WARN.into()).from_env_lossy(),
        )
        .with_writer(std::io::stderr)
        .init();
    panics::quieten();
    let handler = ctrlc::set_handler(|| {
        // The second time the user means it: what is half written is swept by the next run.
        if CANCEL.swap(true, Ordering::SeqCst) {
            std::process::exit(1);
        }
        xtask::cli::out::talk(
            "stopping: units that run are being ended; once more to stop at once",
        );
    });
    if let Err(error) = handler {
        tracing::warn!("Ctrl-C ends the program at once: {error}");
    }
    let program =
        Program { registry: Registry::shipped(), surveyor: Box::new(LasSurveyor), cancel: &CANCEL };
    let code = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        program.main(std::env::args_os())
    }));
    ExitCode::from(code.unwrap_or_else(|payload| {
        xtask::cli::out::error(&panics::describe(&*payload));
        xtask::cli::FAILED
    }))
}
