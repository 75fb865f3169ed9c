//! Repairs disocclusions: what no source pixel lands on.
