//! Runs tasks on worker threads within a memory budget.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};

/// How much may run at once.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Worker threads.
    pub jobs: usize,
    /// Sum of the estimates of running tasks, bytes. A task that is larger runs alone.
    pub memory_bytes: u64,
}

struct State {
    next: usize,
    running: usize,
    used: u64,
}

/// Runs `work` for every task, beginning them in order, each with a rayon pool of its own so that
/// all tasks together use `jobs` threads. `None` marks tasks that were not begun because of `stop`.
pub fn run<T: Sync, R: Send>(
    tasks: &[T],
    limits: Limits,
    stop: &AtomicBool,
    estimate: impl Fn(&T) -> u64 + Sync,
    work: impl Fn(&T) -> R + Sync,
) -> Vec<Option<R>> {
    let workers = limits.jobs.clamp(1, tasks.len().max(1));
    let threads = (limits.jobs / workers).max(1);
    let results: Vec<Mutex<Option<R>>> = tasks.iter().map(|_| Mutex::new(None)).collect();
    let gate = Gate {
        state: Mutex::new(State { next: 0, running: 0, used: 0 }),
        change: Condvar::new(),
        limits,
    };
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                while let Some((index, bytes)) = gate.take(tasks, stop, &estimate) {
                    let result = match &pool {
                        Ok(pool) => pool.install(|| work(&tasks[index])),
                        Err(_) => work(&tasks[index]),
                    };
                    *results[index].lock().unwrap_or_else(PoisonError::into_inner) = Some(result);
                    gate.give_back(bytes);
                }
            });
        }
    });
    results
        .into_iter()
        .map(|slot| slot.into_inner().unwrap_or_else(PoisonError::into_inner))
        .collect()
}

struct Gate {
    state: Mutex<State>,
    change: Condvar,
    limits: Limits,
}

impl Gate {
    /// The next task and its estimate, once there is room for it.
    fn take<T>(
        &self,
        tasks: &[T],
        stop: &AtomicBool,
        estimate: &impl Fn(&T) -> u64,
    ) -> Option<(usize, u64)> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if stop.load(Ordering::SeqCst) || state.next >= tasks.len() {
                return None;
            }
            let bytes = estimate(&tasks[state.next]);
            if state.running == 0 || state.used.saturating_add(bytes) <= self.limits.memory_bytes {
                let index = state.next;
                *state = State {
                    next: index + 1,
                    running: state.running + 1,
                    used: state.used.saturating_add(bytes),
                };
                return Some((index, bytes));
            }
            state = self.change.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn give_back(&self, bytes: u64) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.running -= 1;
        state.used = state.used.saturating_sub(bytes);
        self.change.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicU64;

    #[test]
    fn the_budget_holds_and_a_giant_runs_alone() {
        let tasks = [3u64, 4, 5, 100, 1, 2, 9, 9];
        let (used, worst, stop) = (AtomicU64::new(0), AtomicU64::new(0), AtomicBool::new(false));
        let limits = Limits { jobs: 4, memory_bytes: 10 };
        let done = run(
            &tasks,
            limits,
            &stop,
            |t| *t,
            |t| {
                let now = used.fetch_add(*t, Ordering::SeqCst) + t;
                worst.fetch_max(if *t == 100 { now - 90 } else { now }, Ordering::SeqCst);
                std::thread::sleep(std::time::Duration::from_millis(2));
                used.fetch_sub(*t, Ordering::SeqCst);
                t * 2
            },
        );
        assert!(worst.load(Ordering::SeqCst) <= 10);
        assert_eq!(done, tasks.map(|t| Some(t * 2)));
    }

    #[test]
    fn stop_begins_nothing_more() {
        let stop = AtomicBool::new(false);
        let done = run(
            &[1, 2, 3],
            Limits { jobs: 1, memory_bytes: 0 },
            &stop,
            |_| 1,
            |t| {
                stop.store(*t == 2, Ordering::SeqCst);
                *t
            },
        );
        assert_eq!(done, [Some(1), Some(2), None]);
    }
}
