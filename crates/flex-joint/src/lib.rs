//! Robots with elastic joints: the reduced (Spong) model for any mixture of rigid and elastic joints.
