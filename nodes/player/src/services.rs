//! The services of rosbag2's player.

use std::num::NonZeroU64;

use lgvi_middleware::ParameterValue;
use lgvi_middleware::node::{Node, NodeError};
use lgvi_middleware::ros::{Executor, Running};
use lgvi_msgs::rosbag2_interfaces::srv::{
    Burst, BurstResponse, GetRate, GetRateResponse, IsPaused, IsPausedResponse, Pause,
    PauseResponse, PlayNext, PlayNextResponse, Resume, ResumeResponse, Seek, SeekResponse, SetRate,
    SetRateResponse, Stop, StopResponse, TogglePaused, TogglePausedResponse,
};
use lgvi_msgs::{Service, stamp};
use tracing::{info, warn};

use crate::remote::{Order, Remote};

/// Offers the services, on a thread of their own, as long as the returned value lives.
pub(crate) fn serve(node: &Node, remote: &Remote) -> Result<Running, NodeError> {
    let mut executor = Executor::new();
    serve_pauses(node, remote, &mut executor)?;
    serve_rate(node, &mut executor)?;
    serve_steps(node, remote, &mut executor)?;
    executor.start().map_err(NodeError::runtime)
}

fn serve_pauses(node: &Node, remote: &Remote, executor: &mut Executor) -> Result<(), NodeError> {
    let asked = remote.clone();
    answer::<Pause>(node, executor, "~/pause", move |_| {
        asked.pause();
        info!("paused");
        PauseResponse::default()
    })?;
    let asked = remote.clone();
    answer::<Resume>(node, executor, "~/resume", move |_| {
        asked.resume();
        info!("resumed");
        ResumeResponse::default()
    })?;
    let asked = remote.clone();
    answer::<TogglePaused>(node, executor, "~/toggle_paused", move |_| {
        asked.toggle_paused();
        TogglePausedResponse::default()
    })?;
    let asked = remote.clone();
    answer::<IsPaused>(node, executor, "~/is_paused", move |_| IsPausedResponse {
        paused: asked.is_paused(),
    })?;
    let asked = remote.clone();
    answer::<Stop>(node, executor, "~/stop", move |_| {
        if asked.stop() {
            info!("stopped");
        } else {
            warn!("nothing is stopped: the node is not active");
        }
        StopResponse::default()
    })
}

/// The rate is a parameter; the loop follows it.
fn serve_rate(node: &Node, executor: &mut Executor) -> Result<(), NodeError> {
    let parameters = node.parameters.clone();
    answer::<SetRate>(node, executor, "~/set_rate", move |request| {
        let rate = request.rate;
        let set = if rate > 0.0 {
            parameters
                .set("rate", ParameterValue::Double(rate))
                .map_err(|error| error.to_string())
        } else {
            Err(format!("rate {rate}, expected more than 0"))
        };
        if let Err(error) = &set {
            warn!("rate not set: {error}");
        }
        SetRateResponse {
            success: set.is_ok(),
        }
    })?;
    let parameters = node.parameters.clone();
    answer::<GetRate>(node, executor, "~/get_rate", move |_| GetRateResponse {
        rate: parameters.get("rate").unwrap_or(f64::NAN),
    })
}

fn serve_steps(node: &Node, remote: &Remote, executor: &mut Executor) -> Result<(), NodeError> {
    let ros = &node.ros;
    let asked = remote.clone();
    let server = ros
        .service_server("~/play_next")
        .map_err(NodeError::runtime)?;
    executor.serve::<PlayNext>(server, move |_, reply| {
        asked.give(Order::Burst(
            Some(1),
            Box::new(move |count| {
                reply.send(&PlayNextResponse { success: count > 0 });
            }),
        ));
    });
    let asked = remote.clone();
    let server = ros.service_server("~/burst").map_err(NodeError::runtime)?;
    executor.serve::<Burst>(server, move |request, reply| {
        let count = NonZeroU64::new(request.num_messages).map(NonZeroU64::get);
        asked.give(Order::Burst(
            count,
            Box::new(move |actually_burst| reply.send(&BurstResponse { actually_burst })),
        ));
    });
    let asked = remote.clone();
    let server = ros.service_server("~/seek").map_err(NodeError::runtime)?;
    executor.serve::<Seek>(server, move |request, reply| {
        let answer: Box<dyn FnOnce(bool) + Send> =
            Box::new(move |success| reply.send(&SeekResponse { success }));
        let time = stamp::from_message(&request.time);
        match time.ok().and_then(|time| u64::try_from(time).ok()) {
            Some(time) => asked.give(Order::Seek(time, answer)),
            None => {
                warn!("cannot seek {:?}, expected a time", request.time);
                answer(false);
            }
        }
    });
    Ok(())
}

/// Offers a service whose requests are answered at once.
fn answer<S: Service>(
    node: &Node,
    executor: &mut Executor,
    name: &str,
    mut answer: impl FnMut(S::Request) -> S::Response + Send + 'static,
) -> Result<(), NodeError> {
    let server = node.ros.service_server(name).map_err(NodeError::runtime)?;
    executor.serve::<S>(server, move |request, reply| reply.send(&answer(request)));
    Ok(())
}
