//! Threads that share the steps of one analysis.

use std::sync::Arc;

/// Threads that share the steps of one analysis; by default none but the caller's.
#[derive(Debug, Clone, Default)]
pub struct Threads(Option<Arc<rayon::ThreadPool>>);

impl Threads {
    /// `count` threads; with 0 or 1 the caller's own.
    ///
    /// # Errors
    /// What the system says if it cannot start threads.
    pub fn new(count: usize) -> std::io::Result<Threads> {
        if count <= 1 {
            return Ok(Threads(None));
        }
        let pool =
            rayon::ThreadPoolBuilder::new().num_threads(count).build().map_err(std::io::Error::other)?;
        Ok(Threads(Some(Arc::new(pool))))
    }

    /// Runs `work` in the threads' pool; it is told whether there is one.
    pub(super) fn run<R: Send>(&self, work: impl FnOnce(bool) -> R + Send) -> R {
        match &self.0 {
            Some(pool) => pool.install(|| work(true)),
            None => work(false),
        }
    }
}
