//! Treetops: local maxima of the point cloud.
