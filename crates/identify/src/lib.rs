//! Compare a model with measurements, find the missing effect, fit it, and say how sure that is.
