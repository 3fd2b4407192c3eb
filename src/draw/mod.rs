//! Pictures of success sets and pose-sets.
