//! What is wrong with a configuration file, and where.

use std::fmt;
use std::path::{Path, PathBuf};

/// A position in a text file, both counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
pub struct Place {
    /// Line.
    pub line: usize,
    /// Column, in characters.
    pub column: usize,
}

/// One fault.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
pub struct Problem {
    /// The file.
    pub file: PathBuf,
    /// Where in it.
    pub place: Option<Place>,
    /// What is wrong.
    pub what: String,
    /// What to do about it.
    pub hint: Option<String>,
}

impl Problem {
    /// A fault without a hint.
    #[must_use]
    pub fn new(file: &Path, place: Option<Place>, what: impl Into<String>) -> Self {
        Self { file: file.to_owned(), place, what: what.into(), hint: None }
    }

    /// The same with a hint.
    #[must_use]
    pub fn hint(mut self, hint: Option<String>) -> Self {
        self.hint = hint;
        self
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if let Some(Place { line, column }) = self.place {
            write!(f, ":{line}:{column}")?;
        }
        write!(f, ": {}", self.what)?;
        match &self.hint {
            Some(hint) => write!(f, "\n    {hint}"),
            None => Ok(()),
        }
    }
}

/// All faults found at once; never empty.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problems(pub Vec<Problem>);

impl Problems {
    /// A single fault.
    #[must_use]
    pub fn one(problem: Problem) -> Self {
        Self(vec![problem])
    }

    /// `Err` with the faults in the order of the file, if there are any.
    ///
    /// # Errors
    /// The faults themselves.
    pub fn check(mut found: Vec<Problem>) -> Result<(), Self> {
        if found.is_empty() {
            return Ok(());
        }
        found.sort_by(|a, b| (&a.file, a.place, &a.what).cmp(&(&b.file, b.place, &b.what)));
        found.dedup();
        Err(Self(found))
    }
}

impl fmt::Display for Problems {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, problem) in self.0.iter().enumerate() {
            let end = if index + 1 < self.0.len() { "\n" } else { "" };
            write!(f, "{problem}{end}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Problems {}

/// The name among `known` that somebody probably meant, if one is near enough.
#[must_use]
pub fn nearest<'a>(given: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let near = |name: &'a str| (strsim::damerau_levenshtein(given, name), name);
    let close = |&(distance, name): &(usize, &str)| {
        distance <= 1 + name.len().max(given.len()) / 4 || name.starts_with(given)
    };
    known.into_iter().map(near).filter(close).min().map(|(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_names() {
        assert_eq!(nearest("edge", ["ground", "edge_m"]), Some("edge_m"));
        assert_eq!(nearest("treetop", ["ground", "treetops"]), Some("treetops"));
        assert_eq!(nearest("zebra", ["ground", "treetops"]), None);
    }

    #[test]
    fn faults_come_in_the_order_of_the_file() {
        let at =
            |line, what: &str| Problem::new(Path::new("a"), Some(Place { line, column: 1 }), what);
        let all = Problems::check(vec![at(9, "late"), at(2, "early"), at(9, "late")]).unwrap_err();
        assert_eq!(all.to_string(), "a:2:1: early\na:9:1: late");
    }
}
