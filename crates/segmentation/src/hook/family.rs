//! A program with everything it started: how much memory all of it takes, and its end.
//!
//! The program leads a process group of its own, which can be killed at once. On Linux, children that
//! left the group are found by their parents in /proc as well.

use std::process::{Child, Command};
#[cfg(target_os = "linux")]
use {rustix::process::kill_process, std::collections::BTreeMap};
#[cfg(unix)]
use {
    rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process_group, waitid},
    std::os::unix::process::CommandExt,
};

/// A running program and its descendants.
#[derive(Debug)]
pub(super) struct Family {
    child: Child,
    /// Descendants seen so far, with the time at which each began, which tells a process from a later
    /// one with its number.
    #[cfg(target_os = "linux")]
    known: BTreeMap<i32, u64>,
}

impl Family {
    /// Starts a command at the head of a process group.
    pub(super) fn start(command: &mut Command) -> std::io::Result<Self> {
        #[cfg(unix)]
        command.process_group(0);
        let child = command.spawn()?;
        Ok(Self {
            child,
            #[cfg(target_os = "linux")]
            known: BTreeMap::new(),
        })
    }

    pub(super) fn child(&mut self) -> &mut Child {
        &mut self.child
    }

    /// Whether the program has ended. It keeps its number until [`Family::end`].
    #[cfg(unix)]
    pub(super) fn has_ended(&mut self) -> std::io::Result<bool> {
        let how = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        Ok(waitid(WaitId::Pid(Pid::from_child(&self.child)), how)?.is_some())
    }

    /// Whether the program has ended.
    #[cfg(not(unix))]
    pub(super) fn has_ended(&mut self) -> std::io::Result<bool> {
        Ok(self.child.try_wait()?.is_some())
    }

    /// Ends whatever is left of the program and its descendants, and says how the program ended.
    pub(super) fn end(mut self) -> std::io::Result<std::process::ExitStatus> {
        self.kill();
        self.child.wait()
    }

    #[cfg(not(unix))]
    fn kill(&mut self) {
        // It may have ended by itself.
        self.child.kill().unwrap_or_default();
    }

    #[cfg(all(unix, not(target_os = "linux")))]
    fn kill(&mut self) {
        // A group that has ended by itself is no fault.
        kill_process_group(Pid::from_child(&self.child), Signal::KILL).unwrap_or_default();
    }

    /// Kills until nobody is left who could start another.
    #[cfg(target_os = "linux")]
    fn kill(&mut self) {
        const ROUNDS: usize = 100;
        let leader = Pid::from_child(&self.child);
        for _ in 0..ROUNDS {
            let alive = self.look().0;
            // A process that has ended by itself meanwhile is no fault.
            kill_process_group(leader, Signal::KILL).unwrap_or_default();
            for pid in alive.iter().filter_map(|pid| Pid::from_raw(*pid)) {
                kill_process(pid, Signal::KILL).unwrap_or_default();
            }
            if alive.is_empty() {
                return;
            }
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
    }

    /// Resident memory of the program and its descendants, bytes; `None` where the system does not
    /// tell. What they share counts once for each.
    #[cfg(target_os = "linux")]
    pub(super) fn memory_bytes(&mut self) -> Option<u64> {
        Some(self.look().1 * rustix::param::page_size() as u64)
    }

    /// Resident memory: this system does not tell.
    #[cfg(not(target_os = "linux"))]
    pub(super) fn memory_bytes(&mut self) -> Option<u64> {
        None
    }

    /// Numbers of all that live, and the pages that are resident.
    #[cfg(target_os = "linux")]
    fn look(&mut self) -> (Vec<i32>, u64) {
        let all: BTreeMap<i32, Stat> = stats().map(|stat| (stat.pid, stat)).collect();
        let group = self.child.id() as i32;
        self.known.retain(|pid, began| all.get(pid).is_some_and(|stat| stat.began == *began));
        loop {
            let ours = |stat: &&Stat| {
                stat.group == group || stat.pid == group || self.known.contains_key(&stat.parent)
            };
            let new: Vec<(i32, u64)> = all
                .values()
                .filter(|stat| !self.known.contains_key(&stat.pid))
                .filter(ours)
                .map(|stat| (stat.pid, stat.began))
                .collect();
            if new.is_empty() {
                break;
            }
            self.known.extend(new);
        }
        let ours = all.values().filter(|stat| self.known.contains_key(&stat.pid));
        let alive: Vec<&Stat> = ours.filter(|stat| !stat.is_dead).collect();
        (alive.iter().map(|stat| stat.pid).collect(), alive.iter().map(|stat| stat.pages).sum())
    }
}

/// What /proc says about a process.
#[cfg(target_os = "linux")]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Stat {
    pid: i32,
    parent: i32,
    group: i32,
    began: u64,
    pages: u64,
    is_dead: bool,
}

#[cfg(target_os = "linux")]
impl Stat {
    /// Reads a line of /proc/pid/stat (proc(5)); the name in it may hold spaces and brackets.
    fn parse(line: &str) -> Option<Self> {
        let (pid, rest) = line.split_once(' ')?;
        let fields: Vec<&str> = rest.get(rest.rfind(')')? + 1..)?.split_whitespace().collect();
        // The first of them is the third of the line.
        let field = |number: usize| fields.get(number - 3).copied();
        Some(Self {
            pid: pid.parse().ok()?,
            is_dead: matches!(field(3)?, "Z" | "X" | "x"),
            parent: field(4)?.parse().ok()?,
            group: field(5)?.parse().ok()?,
            began: field(22)?.parse().ok()?,
            pages: field(24)?.parse().ok()?,
        })
    }
}

/// All processes that can be seen.
#[cfg(target_os = "linux")]
fn stats() -> impl Iterator<Item = Stat> {
    let entries = std::fs::read_dir("/proc").into_iter().flatten().filter_map(Result::ok);
    let numbered = entries.filter(|entry| {
        entry.file_name().to_str().is_some_and(|name| name.bytes().all(|b| b.is_ascii_digit()))
    });
    numbered
        .filter_map(|entry| Stat::parse(&std::fs::read_to_string(entry.path().join("stat")).ok()?))
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_the_system() {
        let line =
            "42 (a) b (c) S 7 40 40 0 -1 4194304 1 0 0 0 0 0 0 0 20 0 1 0 991 2097152 55 18 1";
        let expected =
            Stat { pid: 42, parent: 7, group: 40, began: 991, pages: 55, is_dead: false };
        assert_eq!(Stat::parse(line), Some(expected));
        assert_eq!(Stat::parse("42 (a"), None);
        let own = std::process::id() as i32;
        assert!(stats().any(|stat| stat.pid == own && stat.pages > 0));
    }
}
