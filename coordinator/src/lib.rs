//! Runout's coordinator and its user's command, as a library that the binary and the tests call.
//!
//! In the order of the data's way: [`load`] reads what the user wrote; [`queue`] and [`store`] carry a campaign, whose
//! files stand in a [`run_directory`]; [`report`], [`picture`] and [`vtu`] show what came out; [`cli`] holds one
//! command a file.

pub mod load;

pub mod advice;

pub mod difference;
pub mod queue;
pub mod run_directory;
pub mod store;

pub mod fit_tables;
pub mod gallery;
pub mod picture;
pub mod report;
pub mod table;
pub mod vtu;

pub mod cli;
