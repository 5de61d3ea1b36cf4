//! Sets of indices that grow together.

/// Sets of indices that are joined one by one (Tarjan 1975, with path halving).
#[derive(Debug)]
pub(crate) struct Joined {
    parent: Vec<u32>,
}

impl Joined {
    /// Every index below `len` by itself.
    pub(crate) fn new(len: usize) -> Self {
        Self { parent: (0..len as u32).collect() }
    }

    /// The smallest index of the set that `at` is in.
    pub(crate) fn root(&mut self, mut at: u32) -> u32 {
        while self.parent[at as usize] != at {
            self.parent[at as usize] = self.parent[self.parent[at as usize] as usize];
            at = self.parent[at as usize];
        }
        at
    }

    /// Makes one set of two. The smaller root stays, so that the name of a set is its smallest index.
    pub(crate) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }
}
