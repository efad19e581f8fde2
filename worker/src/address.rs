//! Where the coordinator is: a URL that stays, or whatever stands in a run directory that both can read.
//!
//! A coordinator that is started again elsewhere writes its new address there, and its workers find it.

use crate::client::ClientError;
use runout_proto::tls::{self, Credentials};
use std::fs;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tonic::transport::Endpoint;

/// Name of the file that a coordinator writes into its run directory.
const ADDRESS_FILE: &str = "coordinator.addr";
/// Time between two looks at a file that is not there yet.
const LOOK_AGAIN: Duration = Duration::from_millis(500);

/// Where the coordinator is.
#[derive(Debug, Clone)]
pub enum Address {
    /// Always there.
    Fixed(String),
    /// Where the file in this run directory says.
    RunDirectory(PathBuf),
}

impl Address {
    /// The URL as it stands now; absent while no coordinator has written one.
    pub fn now(&self) -> Option<String> {
        match self {
            Address::Fixed(url) => Some(url.clone()),
            Address::RunDirectory(path) => {
                let text = fs::read_to_string(path.join(ADDRESS_FILE)).ok()?;
                Some(text.trim().to_owned()).filter(|url| !url.is_empty())
            }
        }
    }

    /// Waits for a URL; absent if there is none within `limit`.
    pub async fn wait(&self, limit: Duration) -> Option<String> {
        let started = Instant::now();
        loop {
            let url = self.now();
            if url.is_some() || started.elapsed() >= limit {
                return url;
            }
            tokio::time::sleep(LOOK_AGAIN).await;
        }
    }
}

/// The way to the coordinator: where it is, and what the worker is known by there.
#[derive(Debug, Clone)]
pub struct Way {
    /// Where it is.
    pub address: Address,
    /// The worker's certificate, for `https://`.
    pub credentials: Option<Arc<Credentials>>,
}

impl Way {
    /// The endpoint of the coordinator at `url`, without limits on its calls.
    ///
    /// # Errors
    /// Not a URL, or not one for these credentials.
    pub fn endpoint(&self, url: &str) -> Result<Endpoint, ClientError> {
        tls::endpoint(url, self.credentials.as_deref())
            .map_err(|error| ClientError::Url { url: url.to_owned(), error })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_address_is_what_the_run_directory_says_now() {
        let folder = tempfile::tempdir().unwrap();
        let address = Address::RunDirectory(folder.path().to_owned());
        assert_eq!(address.now(), None);
        for url in ["http://10.0.0.1:7421", "http://10.0.0.2:7421"] {
            fs::write(folder.path().join(ADDRESS_FILE), format!("{url}\n")).unwrap();
            assert_eq!(address.now().as_deref(), Some(url));
        }
    }
}
