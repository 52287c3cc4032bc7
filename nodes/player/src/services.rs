//! The services of rosbag2's player.

use std::num::NonZeroU64;

use lgvi_middleware::ParameterValue;
use lgvi_middleware::node::Node;
use lgvi_middleware::ros::{Executor, RosError, RosNode, Running};
use lgvi_msgs::rosbag2_interfaces::srv::{
    Burst, BurstResponse, GetRate, GetRateResponse, IsPaused, IsPausedResponse, Pause,
    PauseResponse, PlayNext, PlayNextResponse, Resume, ResumeResponse, Seek, SeekResponse, SetRate,
    SetRateResponse, Stop, StopResponse, TogglePaused, TogglePausedResponse,
};
use lgvi_msgs::stamp;
use tracing::{info, warn};

use crate::remote::{Order, Remote};

/// Offers the services, on a thread of their own, as long as the returned value lives.
pub(crate) fn serve(node: &Node, remote: &Remote) -> Result<Running, RosError> {
    let mut executor = Executor::new();
    serve_pauses(&node.ros, remote, &mut executor)?;
    serve_rate(node, &mut executor)?;
    serve_steps(&node.ros, remote, &mut executor)?;
    executor.start()
}

fn serve_pauses(ros: &RosNode, remote: &Remote, executor: &mut Executor) -> Result<(), RosError> {
    let asked = remote.clone();
    executor.answer::<Pause>(ros, "~/pause", move |_| {
        asked.pause();
        info!("paused");
        PauseResponse::default()
    })?;
    let asked = remote.clone();
    executor.answer::<Resume>(ros, "~/resume", move |_| {
        asked.resume();
        info!("resumed");
        ResumeResponse::default()
    })?;
    let asked = remote.clone();
    executor.answer::<TogglePaused>(ros, "~/toggle_paused", move |_| {
        asked.toggle_paused();
        TogglePausedResponse::default()
    })?;
    let asked = remote.clone();
    executor.answer::<IsPaused>(ros, "~/is_paused", move |_| IsPausedResponse {
        paused: asked.is_paused(),
    })?;
    let asked = remote.clone();
    executor.answer::<Stop>(ros, "~/stop", move |_| {
        if asked.stop() {
            info!("stopped");
        } else {
            warn!("nothing is stopped: the node is not active");
        }
        StopResponse::default()
    })
}

/// The rate is a parameter; the loop follows it.
fn serve_rate(node: &Node, executor: &mut Executor) -> Result<(), RosError> {
    let ros = &node.ros;
    let parameters = node.parameters.clone();
    executor.answer::<SetRate>(ros, "~/set_rate", move |request| {
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
    executor.answer::<GetRate>(ros, "~/get_rate", move |_| GetRateResponse {
        rate: parameters.get("rate").unwrap_or(f64::NAN),
    })
}

fn serve_steps(ros: &RosNode, remote: &Remote, executor: &mut Executor) -> Result<(), RosError> {
    let asked = remote.clone();
    executor.serve::<PlayNext>(ros, "~/play_next", move |_, reply| {
        asked.give(Order::Burst(
            Some(1),
            Box::new(move |count| {
                reply.send(&PlayNextResponse { success: count > 0 });
            }),
        ));
    })?;
    let asked = remote.clone();
    executor.serve::<Burst>(ros, "~/burst", move |request, reply| {
        let count = NonZeroU64::new(request.num_messages).map(NonZeroU64::get);
        asked.give(Order::Burst(
            count,
            Box::new(move |actually_burst| reply.send(&BurstResponse { actually_burst })),
        ));
    })?;
    let asked = remote.clone();
    executor.serve::<Seek>(ros, "~/seek", move |request, reply| {
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
    })
}
