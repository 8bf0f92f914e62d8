//! The contract that every effect keeps, as one check for all of them.
