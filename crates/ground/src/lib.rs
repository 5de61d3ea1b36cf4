//! Ground classification, the Hardy multiquadric terrain model and heights above ground.
