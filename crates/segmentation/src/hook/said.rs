//! What a program writes to its terminal: read without end, kept within bounds.

use std::collections::VecDeque;
use std::io::Read;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Bytes kept of the beginning and of the end.
const HEAD: usize = 16 << 10;
const TAIL: usize = 48 << 10;
/// Bytes of the end that go into an error's message.
const SHORT: usize = 1200;
/// How long to wait for the rest after the program's end. All who could write are gone by then.
const PATIENCE: Duration = Duration::from_secs(2);

/// Beginning and end of a stream.
#[derive(Debug, Default)]
struct Kept {
    head: Vec<u8>,
    tail: VecDeque<u8>,
    dropped: u64,
}

impl Kept {
    fn add(&mut self, bytes: &[u8]) {
        let room = (HEAD - self.head.len()).min(bytes.len());
        self.head.extend(&bytes[..room]);
        self.tail.extend(&bytes[room..]);
        let excess = self.tail.len().saturating_sub(TAIL);
        self.tail.drain(..excess);
        self.dropped += excess as u64;
    }

    fn text(&self) -> String {
        let gap = match self.dropped {
            0 => String::new(),
            dropped => format!("\n[... {dropped} bytes left out ...]\n"),
        };
        let (one, two) = self.tail.as_slices();
        let tail = [one, two].concat();
        if gap.is_empty() {
            return String::from_utf8_lossy(&[&self.head[..], &tail].concat()).into_owned();
        }
        format!("{}{gap}{}", String::from_utf8_lossy(&self.head), String::from_utf8_lossy(&tail))
    }
}

/// A stream that is being read by a thread of its own, so that the program never waits for us.
#[derive(Debug)]
pub(super) struct Stream {
    kept: Arc<Mutex<Kept>>,
    reader: JoinHandle<()>,
}

impl Stream {
    pub(super) fn read(mut from: impl Read + Send + 'static) -> Self {
        let kept = Arc::new(Mutex::new(Kept::default()));
        let shared = Arc::clone(&kept);
        let reader = std::thread::spawn(move || {
            let mut buffer = [0; 8192];
            loop {
                match from.read(&mut buffer) {
                    Ok(0) => break,
                    Ok(read) => {
                        shared.lock().unwrap_or_else(PoisonError::into_inner).add(&buffer[..read]);
                    }
                    Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                    Err(_) => break,
                }
            }
        });
        Self { kept, reader }
    }

    /// What was said, once everybody who could say something is gone.
    pub(super) fn end(self) -> String {
        let begun = Instant::now();
        while !self.reader.is_finished() && begun.elapsed() < PATIENCE {
            std::thread::sleep(Duration::from_millis(1));
        }
        self.kept.lock().unwrap_or_else(PoisonError::into_inner).text()
    }
}

/// The end of a text for an error's message; empty for an empty text.
pub(super) fn short(text: &str) -> String {
    let text = text.trim();
    if text.is_empty() {
        return String::new();
    }
    let mut start = text.len().saturating_sub(SHORT);
    while !text.is_char_boundary(start) {
        start += 1;
    }
    let dots = if start > 0 { "..." } else { "" };
    format!("; it said: {dots}{}", &text[start..])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_texts_are_whole() {
        assert_eq!(Stream::read(&b"a\xFFb"[..]).end(), "a\u{FFFD}b");
        assert_eq!(short(" \n"), "");
        assert_eq!(short("x\n"), "; it said: x");
    }

    #[test]
    fn of_long_texts_the_ends_are_kept() {
        let text: Vec<u8> = (0..3_000_000_u32).map(|i| b'a' + (i % 26) as u8).collect();
        let end = String::from_utf8(text[text.len() - 9..].to_vec()).unwrap();
        let kept = Stream::read(std::io::Cursor::new(text)).end();
        assert!(kept.len() < HEAD + TAIL + 60, "{}", kept.len());
        assert!(kept.starts_with("abcdef") && kept.ends_with(&end));
        assert!(kept.contains(&format!("[... {} bytes left out ...]", 3_000_000 - HEAD - TAIL)));
        assert!(short(&kept).len() < SHORT + 20);
    }
}
