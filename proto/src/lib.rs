//! The wire contract and its conversions.
