//! The heartbeat: a thread with a runtime and a connection of its own, so that no computation can hold it up.

use crate::address::Way;
use crate::board::{Board, Mode, reached};
use crate::client::{Client, ClientError, Introduction};
use runout_proto::v1::heartbeat_reply::Order;
use std::io;
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// Starts the thread; it ends when the board says stop.
///
/// # Errors
/// The system refuses a thread or a runtime.
pub fn start(
    way: Way,
    url: String,
    introduction: Introduction,
    give_up_after: Duration,
    board: Arc<Board>,
) -> io::Result<JoinHandle<()>> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    thread::Builder::new().name("heartbeat".to_owned()).spawn(move || {
        let beaten = runtime.block_on(async {
            let client = Client::new(way, &url, introduction, give_up_after)?;
            beat(&client, &board).await
        });
        if let Err(error) = beaten {
            board.fail(error);
        }
    })
}

async fn beat(client: &Client, board: &Board) -> Result<(), ClientError> {
    let mut mode = board.mode();
    loop {
        let registration = board.registration();
        tokio::select! {
            () = tokio::time::sleep(registration.heartbeat) => {}
            () = reached(&mut mode, Mode::Stopping) => return Ok(()),
        }
        let answer = client.heartbeat(registration.worker_id, board.progress(), registration.heartbeat).await;
        match answer {
            Ok(Some(reply)) => {
                for lease in &reply.cancel {
                    let (index, attempt) = (lease.index, lease.attempt);
                    tracing::info!(index, attempt, "realisation {index} is not needed any more");
                    board.cancel(*lease);
                }
                match reply.order() {
                    Order::Stop => board.raise(Mode::Stopping),
                    // The slots hear of it with their next lease; what runs may finish.
                    Order::Drain | Order::Continue | Order::Unspecified => {}
                }
            }
            Ok(None) => {
                tokio::select! {
                    renewed = board.renew(client, registration.worker_id) => renewed?,
                    () = reached(&mut mode, Mode::Stopping) => return Ok(()),
                }
            }
            // The next one may arrive; the slots decide when to give up.
            Err(status) => tracing::debug!("heartbeat: {}", status.message()),
        }
    }
}
