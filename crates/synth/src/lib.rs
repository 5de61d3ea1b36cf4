//! Virtual forests and laser scanners with exact truth.
