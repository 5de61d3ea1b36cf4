//! Gives every point its tree.
