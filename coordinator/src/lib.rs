//! The user's command and the coordinator.

pub mod cli;
pub mod difference;
pub mod engine;
pub mod load;
pub mod local;
pub mod progress;
pub mod queue;
pub mod run_directory;
pub mod serve;
pub mod service;
pub mod status;
pub mod store;
pub mod writer;
