//! The page of `lgvi report` in a browser.

use std::path::PathBuf;

use lgvi_msgs::msg::{Scene, SystemState};
use lgvi_tests::{Recording, World, browse, reference_bag, scene};
use serde_json::Value;

/// Pixels of the view that are not of its background, and where bodies are seen (px).
const LOOK: &str = r#"
const view = window.lgvi.view;
const drawn = () => {
  view.draw();
  const gl = view.renderer.getContext();
  const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
  const pixels = new Uint8Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  let count = 0;
  for (let i = 0; i < pixels.length; i += 4) {
    if (Math.abs(pixels[i] - 0x10) + Math.abs(pixels[i + 1] - 0x15) + Math.abs(pixels[i + 2] - 0x1f) > 12) count++;
  }
  return { count, width, height };
};
const seen = () => view.bodies.map(({ place }) => {
  const at = view.root.localToWorld(toVector(place)).project(view.camera);
  return [(0.5 + 0.5 * at.x) * view.width, (0.5 - 0.5 * at.y) * view.height];
});
"#;

fn page(world: &World, name: &str) -> PathBuf {
    let page = world.path(&format!("{name}.html"));
    let bag = reference_bag(name);
    let line = [
        "report".as_ref(),
        bag.as_os_str(),
        "--output".as_ref(),
        page.as_os_str(),
    ];
    world.lgvi(line).finish().expect(0);
    page
}

#[track_caller]
fn show(world: &World, name: &str, script: &str) -> Value {
    let (found, problems) = browse(world, &page(world, name), &format!("{LOOK}{script}"));
    assert_eq!(problems, Vec::<String>::new(), "{name}");
    found
}

#[test]
fn the_view_draws_and_the_slider_moves_the_bodies() {
    let world = World::new();
    let script = r#"
        const slider = document.getElementById("slider");
        const visit = (part) => {
          slider.value = part;
          slider.dispatchEvent(new Event("input"));
          const { count, width, height } = drawn();
          const { flight } = window.lgvi;
          return { count, width, height, seen: seen(), time: window.lgvi.time(), now: document.getElementById("now").textContent,
            position: flight.position(flight.bodies[0], flight.at(window.lgvi.time())),
            marks: [...document.querySelectorAll('#marks span:not([hidden])')].map((mark) => mark.textContent) };
        };
        return { ready: document.documentElement.dataset.ready, all: [0, 0.5, 1].map(visit) };
    "#;
    let found = show(&world, "inclination_change", script);
    assert_eq!(found["ready"], "true");
    let states: Vec<SystemState> =
        Recording::read(&reference_bag("inclination_change")).messages("/lgvi_propagator/state");
    let all = found["all"].as_array().unwrap();
    for (visit, index) in all.iter().zip([0, 500, 1000]) {
        let number = |key: &str| visit[key].as_f64().unwrap();
        let part = number("count") / (number("width") * number("height"));
        assert!((0.002..0.9).contains(&part), "{part} of the view is drawn");
        assert!((number("time") - states[index].time).abs() < 1e-12);
        for (found, expected) in visit["position"]
            .as_array()
            .unwrap()
            .iter()
            .zip(states[index].bodies[0].position)
        {
            assert!(
                (found.as_f64().unwrap() - expected).abs() < 1e-9,
                "{found} {expected}"
            );
        }
        let place: Vec<f64> = serde_json::from_value(visit["seen"][0].clone()).unwrap();
        assert!(
            place[0] > 0.0
                && place[0] < number("width")
                && place[1] > 0.0
                && place[1] < number("height"),
            "{place:?}"
        );
        assert!(
            visit["marks"]
                .as_array()
                .unwrap()
                .contains(&"spacecraft".into()),
            "{visit}"
        );
    }
    let moved = |a: usize, b: usize| {
        let [a, b] =
            [a, b].map(|k| serde_json::from_value::<[f64; 2]>(all[k]["seen"][0].clone()).unwrap());
        (a[0] - b[0]).hypot(a[1] - b[1])
    };
    assert!(moved(0, 1) > 50.0 && moved(1, 2) > 50.0, "{found}");
}

/// Frames of view: what it is fixed to stays in the middle.
#[test]
fn the_view_goes_with_a_body() {
    let world = World::new();
    let script = r#"
        const frames = document.getElementById("frame");
        const visit = (frame, time) => {
          frames.value = frame;
          frames.dispatchEvent(new Event("change"));
          window.lgvi.seek(time);
          drawn();
          return view.bodies.map(({ place }) => place);
        };
        const { flight } = window.lgvi;
        const k = flight.time.length >> 1;
        const time = flight.time[k];
        const apart = minus(nth(flight.bodies[1].position, k), nth(flight.bodies[0].position, k));
        const turned = rotate(conjugate(flight.bodies[0].attitude.slice(4 * k, 4 * k + 4)), apart);
        return { centered: visit("centered 0", time), fixed: visit("fixed 0", time), inertial: visit("inertial", time), apart, turned,
          trails: view.trails.group.children.length };
    "#;
    let found = show(&world, "two_dumbbells", script);
    let vector = |value: &Value| serde_json::from_value::<[f64; 3]>(value.clone()).unwrap();
    let close = |a: &Value, b: [f64; 3]| {
        let a = vector(a);
        (0..3).all(|i| (a[i] - b[i]).abs() < 1e-9)
    };
    for frame in ["centered", "fixed"] {
        assert!(close(&found[frame][0], [0.0; 3]), "{found}");
    }
    assert!(
        close(&found["centered"][1], vector(&found["apart"])),
        "{found}"
    );
    assert!(
        close(&found["fixed"][1], vector(&found["turned"])),
        "{found}"
    );
    assert!(!close(&found["inertial"][0], [0.0; 3]), "{found}");
    // All of the way, and what lies shortly behind.
    assert_eq!(found["trails"], 4);
}

/// Of many bodies a few have trails and names at first; a list chooses others.
#[test]
fn many_bodies_stay_readable() {
    let world = World::new();
    let (_, bag) = world.fly(&scene("rocks"), "rocks");
    world
        .lgvi(["report".as_ref(), bag.as_os_str()])
        .finish()
        .expect(0);
    let script = r#"
        const state = () => {
          drawn();
          return { trails: view.trails.recent.length, legend: document.querySelectorAll('#legend li').length,
            names: [...document.querySelectorAll('#marks span:not([hidden])')].filter((mark) => mark.className !== "frame").length };
        };
        const boxes = [...document.querySelectorAll('#bodies input')];
        const before = state();
        const other = boxes.find((box) => !box.checked);
        other.click();
        const after = state();
        const focus = document.getElementById("focus");
        focus.value = "7";
        focus.dispatchEvent(new Event("change"));
        const middle = () => {
          drawn();
          return seen()[7].map((x, i) => x / [view.width, view.height][i]);
        };
        const places = [0, 0.3, 1].map((part) => {
          window.lgvi.seek(part * window.lgvi.flight.end);
          return middle();
        });
        return { boxes: boxes.length, before, after, places };
    "#;
    let script = format!("{LOOK}{script}");
    let (found, problems) = browse(&world, &bag.join("report.html"), &script);
    assert_eq!(problems, Vec::<String>::new());
    assert_eq!(found["boxes"], 64);
    assert_eq!(found["before"]["trails"], 5, "{found}");
    assert_eq!(found["after"]["trails"], 6, "{found}");
    assert!(found["before"]["names"].as_u64().unwrap() <= 5, "{found}");
    assert!(found["before"]["legend"].as_u64().unwrap() <= 12, "{found}");
    // The picture goes with the body in focus.
    for place in found["places"].as_array().unwrap() {
        let place: [f64; 2] = serde_json::from_value(place.clone()).unwrap();
        assert!(
            place.iter().all(|part| (part - 0.5).abs() < 1e-3),
            "{found}"
        );
    }
}

/// Plots have units on both axes, show the time of the slider, and zoom together.
#[test]
fn plots_are_linked() {
    let world = World::new();
    let script = r#"
        const { plots, seek, flight } = window.lgvi;
        const all = [...plots.all];
        const middle = (flight.start + flight.end) / 2;
        seek(middle);
        const before = all.map(({ plot, now }) => ({ at: parseFloat(now.style.left) / plot.over.clientWidth, index: plot.legend.idx }));
        all[0].plot.setSelect({ left: 0.25 * all[0].plot.over.clientWidth, width: 0.5 * all[0].plot.over.clientWidth, top: 0, height: 1 });
        const ranges = () => all.map(({ plot }) => [plot.scales.x.min, plot.scales.x.max]);
        // Plots take up what was set when the script is done.
        const settled = () => new Promise((resume) => setTimeout(resume, 50));
        await settled();
        const zoomed = ranges();
        all[1].plot.over.dispatchEvent(new MouseEvent("dblclick"));
        await settled();
        window.lgvi.seek(0);
        window.lgvi.plots.resize();
        await settled();
        const told = all.map(({ element }) => [...element.querySelectorAll(".u-value")].map((value) => value.textContent));
        return { told, titles: all.map(({ element }) => element.querySelector("h3").textContent), units: all.map(({ plot }) => plot.axes.map((axis) => axis.label)),
          before, zoomed, whole: ranges(), end: flight.end };
    "#;
    let found = show(&world, "inclination_change", script);
    let titles: Vec<String> = serde_json::from_value(found["titles"].clone()).unwrap();
    for wanted in [
        "Control force",
        "Control moment",
        "Attitude",
        "Angular velocity",
        "Position",
        "Linear momentum",
        "Energy",
        "Change of the total energy",
    ] {
        assert!(
            titles.iter().any(|title| title.starts_with(wanted)),
            "{wanted} is not in {titles:?}"
        );
    }
    let end = found["end"].as_f64().unwrap();
    for k in 0..titles.len() {
        let units: [String; 2] = serde_json::from_value(found["units"][k].clone()).unwrap();
        assert_eq!(units[0], "time (s)");
        assert!(!units[1].is_empty(), "{}", titles[k]);
        // Legends tell the values at the time from the start, also after a change of the window.
        let told: Vec<String> = serde_json::from_value(found["told"][k].clone()).unwrap();
        assert_eq!(told[0], "0", "{}", titles[k]);
        assert!(told.iter().all(|value| value != "–"), "{told:?}");
        let at = found["before"][k]["at"].as_f64().unwrap();
        assert!((at - 0.5).abs() < 0.01, "{at}: {}", titles[k]);
        let index = found["before"][k]["index"].as_u64().unwrap();
        assert!((499..=500).contains(&index), "{index}: {}", titles[k]);
        let range = |key: &str| serde_json::from_value::<[f64; 2]>(found[key][k].clone()).unwrap();
        assert!(
            (range("zoomed")[0] - 0.25 * end).abs() < 0.01 * end,
            "{found}"
        );
        assert!(
            (range("zoomed")[1] - 0.75 * end).abs() < 0.01 * end,
            "{found}"
        );
        assert_eq!(range("whole"), [0.0, end]);
    }
}

/// What a pendulum hangs by is above it, whichever way z points.
#[test]
fn a_pendulum_hangs_down() {
    let world = World::new();
    let script = r#"
        drawn();
        const { flight } = window.lgvi;
        const mass = toVector(flight.bodies[0].shape.center ?? [0, 0, 0.3]);
        const group = view.bodies[0].group;
        const at = (place) => group.localToWorld(place).project(view.camera).y;
        return { pivot: at(toVector([0, 0, 0])), center: at(mass) };
    "#;
    let found = show(&world, "pendulum", script);
    assert!(
        found["pivot"].as_f64().unwrap() > found["center"].as_f64().unwrap() + 0.05,
        "{found}"
    );
}

#[test]
fn a_hostile_title_is_shown_and_does_nothing() {
    let world = World::new();
    let mut recording = Recording::read(&reference_bag("free_body"));
    let title =
        "</script><script>window.broken = true</script><img src=x onerror='window.broken = true'>";
    recording.edit("/lgvi_propagator/scene", 0, |scene: &mut Scene| {
        let line = scene.text.lines().find(|line| line.starts_with("title"));
        let line = line.unwrap().to_owned();
        let title = serde_json::to_string(title).unwrap();
        scene.text = scene.text.replace(&line, &format!("title = {title}"));
    });
    let bag = world.path("hostile");
    recording.write(&bag);
    world
        .lgvi(["report".as_ref(), bag.as_os_str()])
        .finish()
        .expect(0);
    let script = "return { broken: window.broken ?? false, heading: document.querySelector('h1').textContent, title: document.title };";
    let (found, problems) = browse(&world, &bag.join("report.html"), script);
    assert_eq!(problems, Vec::<String>::new());
    assert_eq!(found["broken"], false);
    assert_eq!(found["heading"], title);
    assert_eq!(found["title"], title);
}
