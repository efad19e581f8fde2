//! The user's command and the coordinator.

pub mod difference;
pub mod load;
pub mod queue;
pub mod run_directory;
pub mod store;
