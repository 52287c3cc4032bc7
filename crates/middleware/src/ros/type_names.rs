//! Type names as they appear on a wire, and back.

use super::RosError;

/// `package/msg/Type` is `package::msg::dds_::Type_`; `srv` and `action` likewise.
pub(super) fn dds_type(type_name: &str) -> Result<String, RosError> {
    let mut parts = type_name.split('/');
    match (parts.next(), parts.next(), parts.next(), parts.next()) {
        (Some(package), Some(kind @ ("msg" | "srv" | "action")), Some(name), None)
            if !package.is_empty() && !name.is_empty() =>
        {
            Ok(format!("{package}::{kind}::dds_::{name}_"))
        }
        _ => Err(RosError::TypeName(type_name.into())),
    }
}

/// The ROS message type of a DDS type; `None` if it is none.
pub(super) fn ros_type(dds_type: &str) -> Option<String> {
    let (package, name) = dds_type.strip_suffix('_')?.split_once("::dds_::")?;
    Some(format!("{}/{name}", package.replace("::", "/")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_go_there_and_back() {
        let dds = dds_type("nav_msgs/msg/Odometry").unwrap();
        assert_eq!(dds, "nav_msgs::msg::dds_::Odometry_");
        assert_eq!(ros_type(&dds).as_deref(), Some("nav_msgs/msg/Odometry"));
        assert_eq!(ros_type("DCPSTopic"), None);
    }

    #[test]
    fn malformed_types_are_refused() {
        for bad in [
            "",
            "Odometry",
            "nav_msgs/Odometry",
            "a/type/B",
            "a/msg/",
            "a/msg/B/c",
        ] {
            assert!(dds_type(bad).is_err(), "{bad:?} was accepted");
        }
    }
}
