//! Runout's coordinator and its user's command, as a library that the binary and the tests call.
//!
//! In the order of the data's way: [`load`] reads what the user wrote, [`cli`] holds one command a file, and
//! [`picture`], [`vtu`] and [`report`] show what came out.

pub mod load;

pub mod cli;
pub mod fit_tables;
pub mod picture;
pub mod report;
pub mod table;
pub mod vtu;
