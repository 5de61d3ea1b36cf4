//! Crown models: consensus fits around treetops and L1 paraboloids over segments.
