//! Rigid-body dynamics of robot trees: RNEA, CRBA, ABA, energy.
