//! Who may make a call, and with which worker the coordinator works.

use super::{NOTES, SHOWN, invalid};
use crate::listen::{Caller, Right};
use runout_proto::check::Check;
use runout_proto::convert::readable;
use runout_proto::{identity, v1};
use std::sync::Arc;
use tonic::Request;

/// The message of a call, if the caller may make it and the message keeps to the contract. Waits while the caller
/// calls more often than it may.
pub(super) async fn admit<M: Check>(
    request: Request<M>,
    right: Right,
    call: &str,
) -> Result<M, tonic::Status> {
    let caller = request.extensions().get::<Arc<Caller>>().cloned();
    let caller = caller.ok_or_else(|| tonic::Status::internal("the caller is not known"))?;
    caller.pace().await;
    caller.may(right).map_err(|why| {
        NOTES.say(&format!("{call} from {} refused: {why}", caller.peer()));
        tonic::Status::permission_denied(why)
    })?;
    let message = request.into_inner();
    message.check().map_err(invalid)?;
    Ok(message)
}

/// Whether a worker runs what the coordinator runs, on a machine that computes the same bits.
pub(super) fn check_identity(request: &v1::RegisterRequest, fingerprint: &str) -> Result<(), tonic::Status> {
    let expected = (identity::PROTOCOL, identity::build(), fingerprint);
    let differs = |what: &str, here: &dyn std::fmt::Display, there: &dyn std::fmt::Display, advice: &str| {
        let there = readable(&there.to_string(), SHOWN);
        Err(tonic::Status::failed_precondition(format!(
            "the worker's {what} is {there}, the coordinator's is {here}: {advice}"
        )))
    };
    if request.protocol != expected.0 {
        return differs("protocol", &expected.0, &request.protocol, "run both from the same version");
    }
    if request.build != expected.1 {
        return differs("build", &expected.1, &request.build, "run both from the same version");
    }
    if request.fingerprint != expected.2 {
        let advice = "this machine computes other bits, so its outcomes would not be reproducible";
        return differs("fingerprint", &expected.2, &request.fingerprint, advice);
    }
    Ok(())
}
