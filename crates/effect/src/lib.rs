//! The trait of a physical effect, its card, and the contract every effect must keep.
