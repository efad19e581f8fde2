//! Random fields.
