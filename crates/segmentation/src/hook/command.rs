//! Which files a command names.

use std::path::Path;

/// Endings of scripts: an argument that has one names a file even without a folder.
const SCRIPTS: [&str; 8] = [".py", ".r", ".jl", ".sh", ".pl", ".js", ".lua", ".m"];

/// What an argument could name: itself, or what follows `=` in an option.
fn candidate(argument: &str) -> &str {
    match argument.strip_prefix('-') {
        Some(option) => option.split_once('=').map_or("", |(_, value)| value),
        None => argument,
    }
}

/// The names of files in a command, and whether each must be there.
///
/// A program without a folder is looked for on the search path and names no file here. Every other
/// argument names a file if there is one of that name; it must be there if it looks like a file's
/// name: with a folder in it, or with the ending of a script. In an option (`--weights=w/a.npz`) what
/// follows the `=` names a file if there is one.
#[must_use]
pub fn named_files(command: &[String]) -> Vec<(String, bool)> {
    let mut files = Vec::new();
    for (place, argument) in command.iter().enumerate() {
        let name = candidate(argument);
        let on_search_path = place == 0 && !name.contains('/');
        if name.is_empty() || on_search_path || name.contains("://") {
            continue;
        }
        let lower = name.to_lowercase();
        let script = SCRIPTS.iter().any(|ending| lower.ends_with(ending));
        let required = name == argument && (name.contains('/') || script);
        files.push((name.to_owned(), required));
    }
    files
}

/// The command with the files it names where `find` says they are.
#[must_use]
pub fn resolve<'a>(command: &[String], find: impl Fn(&str) -> Option<&'a Path>) -> Vec<String> {
    let resolved = |(place, argument): (usize, &String)| {
        let name = candidate(argument);
        let on_search_path = place == 0 && !name.contains('/');
        match find(name).filter(|_| !name.is_empty() && !on_search_path) {
            Some(path) => {
                format!("{}{}", &argument[..argument.len() - name.len()], path.display())
            }
            None => argument.clone(),
        }
    };
    command.iter().enumerate().map(resolved).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn command(words: &str) -> Vec<String> {
        words.split(' ').map(str::to_owned).collect()
    }

    #[test]
    fn what_looks_like_a_file_must_be_one() {
        let found = named_files(&command(
            "python3 hooks/a.py b.R 0.3 --size=2 --w=c/d.npz -v http://e/f table",
        ));
        let found: Vec<_> = found.iter().map(|(name, must)| (name.as_str(), *must)).collect();
        let expected = [
            ("hooks/a.py", true),
            ("b.R", true),
            ("0.3", false),
            ("2", false),
            ("c/d.npz", false),
            ("table", false),
        ];
        assert_eq!(found, expected);
        assert_eq!(named_files(&command("./tool")), [("./tool".to_owned(), true)]);
    }

    #[test]
    fn files_are_put_where_they_are() {
        let find = |name: &str| ["a.py", "w"].contains(&name).then_some(Path::new("/p/x"));
        let resolved = resolve(&command("w a.py --w=w --w w z"), find);
        assert_eq!(resolved, ["w", "/p/x", "--w=/p/x", "--w", "/p/x", "z"]);
    }
}
