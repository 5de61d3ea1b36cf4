//! Well-known text of coordinate reference systems: what ingest needs of it.
//!
//! Reads WKT 1 (OGC 01-009) and WKT 2 (ISO 19162): `KEYWORD["text", number, KEYWORD[...]]` with
//! square or round brackets.

/// One keyword with what stands in its brackets.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Node {
    /// The keyword, in capitals.
    pub(crate) key: String,
    /// Texts and numbers, in order.
    pub(crate) values: Vec<String>,
    /// Nested keywords, in order.
    pub(crate) children: Vec<Node>,
}

/// Real systems nest about eight deep.
const MAX_DEPTH: usize = 32;

impl Node {
    /// Parses a text; `None` when it is not of this form.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let mut parser = Parser { rest: text.trim_start_matches('\u{feff}') };
        parser.node(0)
    }

    /// The first child with one of the keywords.
    pub(crate) fn child(&self, keys: &[&str]) -> Option<&Node> {
        self.children.iter().find(|child| keys.contains(&child.key.as_str()))
    }

    /// The first value: the name.
    pub(crate) fn name(&self) -> &str {
        self.values.first().map_or("", String::as_str)
    }

    /// The EPSG code given directly to this node.
    pub(crate) fn epsg(&self) -> Option<u32> {
        let id = self.child(&["AUTHORITY", "ID"])?;
        if !id.name().eq_ignore_ascii_case("EPSG") {
            return None;
        }
        id.values.get(1)?.parse().ok()
    }
}

struct Parser<'a> {
    rest: &'a str,
}

impl Parser<'_> {
    fn skip_blank(&mut self) {
        self.rest = self.rest.trim_start();
    }

    fn accept(&mut self, chars: &[char]) -> bool {
        self.skip_blank();
        let found = self.rest.starts_with(chars);
        if found {
            self.rest = &self.rest[1..];
        }
        found
    }

    fn word(&mut self) -> String {
        self.skip_blank();
        let stops = |c: char| c.is_whitespace() || matches!(c, '[' | ']' | '(' | ')' | ',' | '"');
        let end = self.rest.find(stops).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        word.to_owned()
    }

    /// A text in quotes; two quotes in a row stand for one.
    fn quoted(&mut self) -> Option<String> {
        let mut text = String::new();
        loop {
            let end = self.rest.find('"')?;
            text.push_str(&self.rest[..end]);
            self.rest = &self.rest[end + 1..];
            if !self.rest.starts_with('"') {
                return Some(text);
            }
            text.push('"');
            self.rest = &self.rest[1..];
        }
    }

    fn node(&mut self, depth: usize) -> Option<Node> {
        let key = self.word().to_ascii_uppercase();
        if key.is_empty() || depth > MAX_DEPTH || !self.accept(&['[', '(']) {
            return None;
        }
        let mut node = Node { key, ..Node::default() };
        loop {
            self.item(&mut node, depth)?;
            if self.accept(&[']', ')']) {
                return Some(node);
            }
            if !self.accept(&[',']) {
                return None;
            }
        }
    }

    fn item(&mut self, node: &mut Node, depth: usize) -> Option<()> {
        if self.accept(&['"']) {
            node.values.push(self.quoted()?);
            return Some(());
        }
        let before = self.rest;
        let word = self.word();
        self.skip_blank();
        if self.rest.starts_with(['[', '(']) {
            self.rest = before;
            node.children.push(self.node(depth + 1)?);
        } else {
            node.values.push(word);
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_generations() {
        let old = Node::parse(r#"PROJCS["a ""b""",UNIT["metre",1],AUTHORITY["EPSG","26910"]]"#);
        let old = old.unwrap();
        assert_eq!((old.name(), old.epsg()), ("a \"b\"", Some(26910)));
        let new = Node::parse(
            "PROJCRS[\"x\",\n CS[Cartesian,2],LENGTHUNIT[\"foot\",0.3048],ID[\"EPSG\",2994]]",
        );
        let new = new.unwrap();
        assert_eq!(new.child(&["LENGTHUNIT"]).unwrap().values[1], "0.3048");
        assert_eq!(new.epsg(), Some(2994));
    }

    #[test]
    fn other_texts_are_none_and_deep_ones_end() {
        for text in ["", "abc", "PROJCS[", "PROJCS[\"a", "[]", "A[B[C]"] {
            assert_eq!(Node::parse(text), None, "{text}");
        }
        assert_eq!(Node::parse(&"A[".repeat(100_000)), None);
    }
}
