//! The samples cross iceoryx2 as slices under their user headers.

#![allow(clippy::unwrap_used)]

use iceoryx2::{
    prelude::{NodeBuilder, ServiceName, ZeroCopySend},
    service::local,
};
use lgvi_msgs::cdr;
use lgvi_msgs::geometry_msgs::Vector3;
use lgvi_msgs::msg::ControlSequence;
use lgvi_msgs::shm::{BodySample, ControlHeader, Name, StateHeader};

fn sent_and_received<H, S>(service: &str, header: H, samples: &[S]) -> (H, Vec<S>)
where
    H: ZeroCopySend + Copy + Default + std::fmt::Debug + 'static,
    S: ZeroCopySend + Copy + Default + std::fmt::Debug + 'static,
{
    let node = NodeBuilder::new().create::<local::Service>().unwrap();
    let service = node
        .service_builder(&ServiceName::new(service).unwrap())
        .publish_subscribe::<[S]>()
        .user_header::<H>()
        .open_or_create()
        .unwrap();
    let subscriber = service.subscriber_builder().create().unwrap();
    let publisher = service
        .publisher_builder()
        .initial_max_slice_len(samples.len())
        .create()
        .unwrap();

    let mut sample = publisher.loan_slice(samples.len()).unwrap();
    *sample.user_header_mut() = header;
    sample.payload_mut().copy_from_slice(samples);
    sample.send().unwrap();

    let received = subscriber.receive().unwrap().unwrap();
    (*received.user_header(), received.payload().to_vec())
}

#[test]
fn states() {
    let header = StateHeader {
        sequence: 1,
        step: 2,
        time: 0.3,
        stamp_nanoseconds: 4,
    };
    let bodies = ["chaser", "target"].map(|name| BodySample {
        name: Name::try_from(name).unwrap(),
        attitude: [0.1; 9],
        ..BodySample::default()
    });
    assert_eq!(
        sent_and_received("state", header, &bodies),
        (header, bodies.to_vec())
    );
}

#[test]
fn control_sequences() {
    let header = ControlHeader {
        publisher: [7; 16],
        number: 3,
    };
    let message = ControlSequence {
        body: "chaser".into(),
        force: vec![Vector3::default(); 5],
        ..ControlSequence::default()
    };
    let bytes = cdr::encode(&message).unwrap();
    let (received, bytes) = sent_and_received("control", header, &bytes);
    assert_eq!(received, header);
    assert_eq!(cdr::decode::<ControlSequence>(&bytes).unwrap(), message);
}
