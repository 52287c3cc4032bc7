use std::sync::{Arc, Mutex};

use super::*;

fn given(text: &str) -> Given {
    let text = format!("n: {{ros__parameters: {text}}}");
    Given::from_iter(crate::params_file::read(&text, "/n").unwrap())
}

fn specs() -> Vec<ParameterSpec> {
    vec![
        ParameterSpec::new("rate", 2.0, "How often")
            .range(0.0, f64::MAX)
            .change(Change::Anytime),
        ParameterSpec::new("steps", 3_i64, "").integer_range(1, 10),
        ParameterSpec::new("loud", false, "").change(Change::Never),
        ParameterSpec::new("bodies", vec!["a".to_string()], "")
            .constraints("no empty names")
            .check(|value| match value {
                ParameterValue::StringArray(names) if names.iter().all(|name| !name.is_empty()) => {
                    Ok(())
                }
                _ => Err("expected names that are not empty".into()),
            }),
        ParameterSpec::optional::<Vec<f64>>("gains", "").change(Change::Anytime),
        ParameterSpec::optional::<String>("scene", "Path"),
    ]
}

fn declare(text: &str) -> Result<Parameters, ParameterError> {
    Parameters::declare(given(text), specs())
}

fn refusal(text: &str) -> String {
    declare(text).unwrap_err().to_string()
}

#[test]
fn values_are_those_given_or_the_defaults() {
    let parameters = declare("{rate: 4, loud: true, gains: [1.0, 2.5], bodies: []}").unwrap();
    assert_eq!(parameters.get("rate"), Ok(4.0));
    assert_eq!(parameters.get("steps"), Ok(3_i64));
    assert_eq!(parameters.get("loud"), Ok(true));
    assert_eq!(parameters.get("gains"), Ok(vec![1.0, 2.5]));
    assert_eq!(parameters.get("bodies"), Ok(Vec::<String>::new()));
    assert_eq!(parameters.get_optional::<String>("scene"), Ok(None));
}

#[test]
fn what_is_given_is_checked() {
    for (text, expected) in [
        (
            "{rate: fast}",
            r#"parameter "rate" is "fast"; expected a number"#,
        ),
        (
            "{rate: -1}",
            r#"parameter "rate" is -1.0; expected a number at least 0.0"#,
        ),
        (
            "{rate: .nan}",
            r#"parameter "rate" is NaN; expected a number at least"#,
        ),
        (
            "{rate: .inf}",
            r#"parameter "rate" is inf; expected a number at least"#,
        ),
        (
            "{rate: null}",
            r#"parameter "rate" is null; expected a number"#,
        ),
        (
            "{steps: 2.0}",
            r#"parameter "steps" is 2.0; expected an integer"#,
        ),
        (
            "{steps: 11}",
            r#"parameter "steps" is 11; expected an integer from 1 to 10"#,
        ),
        ("{steps: 18446744073709551615}", "expected an integer"),
        (
            "{bodies: [a, '']}",
            r#"parameter "bodies" is ["a", ""]; expected names that are not empty"#,
        ),
        ("{gains: [a, x]}", "expected a list of numbers"),
        (
            "{rte: 1}",
            r#"unknown parameter "rte"; this node has bodies, gains, loud, rate, scene, steps"#,
        ),
    ] {
        let refusal = refusal(text);
        assert!(refusal.contains(expected), "{text}: {refusal}");
    }
}

#[test]
fn what_rclcpp_nodes_know_is_no_error() {
    let text = "{start_type_description_service: false, qos_overrides./x.publisher.depth: 3}";
    assert!(declare(text).is_ok());
    assert!(declare("{qos_override: 3}").is_err());
}

#[test]
fn reading_says_what_is_wrong() {
    let parameters = declare("{}").unwrap();
    assert_eq!(
        parameters.get::<String>("scene").unwrap_err().to_string(),
        r#"parameter "scene" is not set; expected a string"#
    );
    assert!(matches!(
        parameters.get::<i64>("rate"),
        Err(ParameterError::Refused { .. })
    ));
    assert!(matches!(
        parameters.get::<f64>("rte"),
        Err(ParameterError::NotDeclared { known, .. }) if known.len() == 6
    ));
}

#[test]
fn values_are_set_by_the_same_rules() {
    let parameters = declare("{}").unwrap();
    parameters.set("rate", 5_i64.into()).unwrap();
    assert_eq!(parameters.get("rate"), Ok(5.0), "integers are numbers");
    parameters.set("gains", vec![1_i64, 2].into()).unwrap();
    assert_eq!(parameters.get("gains"), Ok(vec![1.0, 2.0]));
    parameters.set("gains", Vec::<bool>::new().into()).unwrap();
    assert_eq!(parameters.get("gains"), Ok(Vec::<f64>::new()), "of no type");
    parameters.set("gains", ParameterValue::NotSet).unwrap();
    assert_eq!(parameters.get_optional::<Vec<f64>>("gains"), Ok(None));

    for (name, value) in [
        ("rate", ParameterValue::from("fast")),
        ("rate", true.into()),
        ("rate", (-0.5).into()),
        ("rate", ParameterValue::NotSet),
        ("steps", 2.0.into()),
        ("steps", 0_i64.into()),
        ("scene", 1_i64.into()),
        ("bodies", ParameterValue::ByteArray(vec![1])),
        ("bodies", vec![String::new()].into()),
        ("rte", 1.0.into()),
    ] {
        let before = format!("{parameters:?}");
        assert!(
            parameters.set(name, value.clone()).is_err(),
            "{name}: {value}"
        );
        assert_eq!(format!("{parameters:?}"), before);
    }
}

#[test]
fn when_a_parameter_may_change_is_kept_to() {
    let parameters = declare("{}").unwrap();
    let read_only = ParameterError::ReadOnly {
        name: "loud".into(),
        value: true.into(),
    };
    assert_eq!(parameters.set("loud", true.into()), Err(read_only));
    parameters.set("steps", 4_i64.into()).unwrap();
    parameters.configured(true);
    assert_eq!(
        parameters
            .set("steps", 5_i64.into())
            .unwrap_err()
            .to_string(),
        r#"parameter "steps" cannot be set to 5 now; it can while the node is unconfigured"#
    );
    parameters.set("rate", 1.0.into()).unwrap();
    parameters.configured(false);
    parameters.set("steps", 6_i64.into()).unwrap();
    assert_eq!(parameters.get("steps"), Ok(6_i64));
}

#[test]
fn all_are_set_or_none() {
    let parameters = declare("{}").unwrap();
    let set = |steps: i64| {
        parameters.set_all(vec![
            ("rate".into(), 7.0.into()),
            ("steps".into(), steps.into()),
        ])
    };
    assert!(set(99).is_err());
    assert_eq!(parameters.get("rate"), Ok(2.0));
    set(9).unwrap();
    assert_eq!(parameters.get("rate"), Ok(7.0));
    parameters.configured(true);
    assert!(matches!(
        parameters.set_all(vec![
            ("rate".into(), 8.0.into()),
            ("steps".into(), 1_i64.into())
        ]),
        Err(ParameterError::Configured { .. })
    ));
    assert_eq!(parameters.get("rate"), Ok(7.0));
}

#[test]
fn changes_are_heard_once_they_have_taken_effect() {
    let parameters = declare("{}").unwrap();
    let heard = Arc::new(Mutex::new(Vec::new()));
    let (log, reader) = (Arc::clone(&heard), parameters.clone());
    let hear = move |value: &ParameterValue| {
        log.lock()
            .unwrap()
            .push((value.clone(), reader.get::<f64>("rate").unwrap()));
    };
    parameters.on_change("rate", hear).unwrap();
    assert!(parameters.on_change("rte", |_| {}).is_err());
    parameters.set("rate", 3.0.into()).unwrap();
    parameters.set("rate", 3_i64.into()).unwrap();
    assert!(parameters.set("rate", (-3.0).into()).is_err());
    parameters.set("steps", 9_i64.into()).unwrap();
    assert_eq!(*heard.lock().unwrap(), [(3.0.into(), 3.0)]);
}

#[test]
fn declarations_that_contradict_themselves_are_refused() {
    for (spec, expected) in [
        (
            ParameterSpec::new("x", 2.0, "").range(0.0, 1.0),
            "from 0.0 to 1.0",
        ),
        (
            ParameterSpec::new("x", 2.0, "").integer_range(0, 9),
            "not of its type",
        ),
        (
            ParameterSpec::optional::<String>("x", "").range(0.0, 1.0),
            "not of its type",
        ),
        (
            ParameterSpec::new("x", true, "").check(|_| Err("never".into())),
            "never",
        ),
    ] {
        let error = Parameters::declare(given("{}"), vec![spec]).unwrap_err();
        assert!(
            matches!(error, ParameterError::Declaration { .. }),
            "{error}"
        );
        assert!(error.to_string().contains(expected), "{error}");
    }
    let twice = vec![
        ParameterSpec::new("x", 1.0, ""),
        ParameterSpec::new("x", 2.0, ""),
    ];
    assert!(Parameters::declare(given("{}"), twice).is_err());
}

#[test]
fn descriptors_say_what_is_accepted() {
    let parameters = declare("{}").unwrap();
    let descriptor = |name| parameters.spec(name).unwrap().descriptor();
    let rate = descriptor("rate");
    assert_eq!(
        (rate.r#type, rate.description.as_str(), rate.read_only),
        (3, "How often", false)
    );
    assert_eq!(rate.floating_point_range[0].to_value, f64::MAX);
    assert_eq!(rate.additional_constraints, "");
    let steps = descriptor("steps");
    let range = &steps.integer_range[0];
    assert_eq!(
        (steps.r#type, range.from_value, range.to_value, range.step),
        (2, 1, 10, 0)
    );
    assert!(descriptor("loud").read_only);
    assert_eq!(
        descriptor("bodies").additional_constraints,
        "no empty names; set it while the node is unconfigured"
    );
    assert_eq!(descriptor("gains").r#type, 8, "though it is not set");
}

#[test]
fn values_survive_messages() {
    for value in [
        ParameterValue::NotSet,
        true.into(),
        (-7_i64).into(),
        1e-300.into(),
        "x".into(),
        ParameterValue::ByteArray(vec![1, 2]),
        vec![true, false].into(),
        vec![i64::MIN].into(),
        vec![0.5].into(),
        vec!["a".to_string(), String::new()].into(),
    ] {
        let message = value.to_message();
        assert_eq!(message.r#type, value.number());
        assert_eq!(ParameterValue::from_message(message), Ok(value));
    }
    let unknown = lgvi_msgs::rcl_interfaces::ParameterValue {
        r#type: 10,
        ..Default::default()
    };
    assert_eq!(ParameterValue::from_message(unknown), Err(10));
}

#[test]
fn the_word_null_unsets_what_can_be_not_set_and_is_a_string_elsewhere() {
    let declare = |text: &str| {
        let read = crate::params_file::read(text, "/n").unwrap();
        Parameters::declare(Given::from_iter(read), specs())
    };
    let all = |values: &str| format!("n: {{ros__parameters: {{{values}}}}}");
    let unset = declare(&all("gains: [1.0], gains: null, scene: null")).unwrap();
    assert_eq!(unset.get_optional::<Vec<f64>>("gains"), Ok(None));
    assert_eq!(unset.get_optional::<String>("scene"), Ok(None));
    let word = declare(&all("scene: 'null', bodies: [null]")).unwrap();
    assert_eq!(word.get("scene"), Ok("null".to_owned()));
    assert_eq!(word.get("bodies"), Ok(vec!["null".to_owned()]));
    let error = declare(&all("rate: null")).unwrap_err().to_string();
    assert_eq!(error, r#"parameter "rate" is null; expected a number"#);
}
