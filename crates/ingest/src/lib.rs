//! Reads LAS, LAZ and COPC files into tiles on a world-aligned grid.
