//! Hears one text, answers with it until it is told to end, and lists the parameters of the node `/own`.
//!
//! Arguments: the router's endpoint, the domain.

use std::{env, error::Error, time::Duration};

use hiroz::{Builder, context::ZContextBuilder};
use hiroz_msgs::{
    rcl_interfaces::{ListParametersRequest, srv::ListParameters},
    std_msgs::String as Text,
};

const PATIENCE: Duration = Duration::from_secs(20);
const PERIOD: Duration = Duration::from_millis(50);

#[allow(clippy::print_stdout, reason = "the test reads it")]
fn main() -> Result<(), Box<dyn Error + Send + Sync>> {
    let mut arguments = env::args().skip(1);
    let endpoint = arguments.next().ok_or("no endpoint")?;
    let domain = arguments.next().ok_or("no domain")?.parse()?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()?;
    runtime.block_on(async move {
        let context = ZContextBuilder::default()
            .with_domain_id(domain)
            .with_connect_endpoints([endpoint])
            .with_json("scouting/multicast/enabled", false)
            .build()?;
        let node = context.create_node("hiroz_peer").build()?;
        let heard = node.create_sub::<Text>("/to_peer").build()?;
        let answers = node.create_pub::<Text>("/from_peer").build()?;
        let parameters = node
            .create_client::<ListParameters>("/own/list_parameters")
            .build()?;
        let text = heard.recv_timeout(PATIENCE)?.data;
        println!("heard {text}");
        for number in 0..20 {
            let data = format!("{text} {number}");
            answers.publish(&Text { data })?;
            tokio::time::sleep(PERIOD).await;
        }
        let all = ListParametersRequest {
            prefixes: Vec::new(),
            depth: 0,
        };
        let reply = parameters.call_with_timeout(&all, PATIENCE).await?;
        println!("parameters {:?}", reply.result.names);
        Ok(())
    })
}
