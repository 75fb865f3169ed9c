//! From decoded planes to quantised trajectories: dilation and quantisation of motion.
