//! What several tests need.

pub(crate) mod reference;
pub(crate) mod stand;
