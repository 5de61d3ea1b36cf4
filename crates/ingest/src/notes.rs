//! What a reader should know about a file that was read all the same.

/// Collects messages about one file, each once, in the order they came up.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Notes {
    messages: Vec<String>,
}

/// A damaged file could fill the memory with messages.
const MAX_NOTES: usize = 100;

impl Notes {
    /// Adds a message unless it has been said before.
    pub fn say(&mut self, message: impl Into<String>) {
        let message = message.into();
        if self.messages.len() < MAX_NOTES && !self.messages.contains(&message) {
            self.messages.push(message);
        }
    }

    /// The messages so far.
    #[must_use]
    pub fn messages(&self) -> &[String] {
        &self.messages
    }

    /// The messages.
    #[must_use]
    pub fn into_messages(self) -> Vec<String> {
        self.messages
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_said_once() {
        let mut notes = Notes::default();
        notes.say("a");
        notes.say("a");
        assert_eq!(notes.into_messages(), ["a"]);
    }
}
