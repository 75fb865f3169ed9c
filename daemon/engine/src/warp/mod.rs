//! Moves colour along trajectories: gather (backward), scatter (forward) and the snapped grid.
//!
//! Positions are signed Q8 pixels of the colour plane: the centre of pixel `i` is `i * 256`.

pub mod sample;
