//! What stages read and write: the container, one file per artefact kind, and the stage contract.
