//! Makes the seeds of the corpora anew from what the repository ships.

use std::{error::Error, fs, path::Path};

use lgvi_bag::Compression;
use lgvi_msgs::{RosMessage, cdr};

use crate::{
    sample,
    targets::{file_of_records, key},
};

type Done = Result<(), Box<dyn Error>>;

/// Writes all seeds; `root` is that of the repository.
pub fn make(root: &Path, corpus: &Path) -> Done {
    bags(corpus)?;
    messages(corpus)?;
    definitions(corpus)?;
    scenes(corpus)?;
    copies(corpus, "scene", &root.join("scenes"), "toml")?;
    let params = root.join("launch_scripts/params");
    copies(corpus, "params_file", &params, "yaml")?;
    by_hand(corpus)
}

fn put(corpus: &Path, target: &str, name: &str, bytes: impl AsRef<[u8]>) -> Done {
    let directory = corpus.join(target);
    fs::create_dir_all(&directory)?;
    Ok(fs::write(directory.join(name), bytes)?)
}

fn bags(corpus: &Path) -> Done {
    for (name, compression) in [
        ("none", Compression::None),
        ("zstd", Compression::Zstd),
        ("lz4", Compression::Lz4),
    ] {
        let (metadata, file) = sample::bag(compression)?;
        put(corpus, "bag_metadata", "good", metadata)?;
        let unchecked = without_checksums(&file).ok_or("no MCAP file")?;
        put(
            corpus,
            "bag_reader",
            &format!("{name}_unchecked"),
            &unchecked,
        )?;
        let records = records(&unchecked).ok_or("no MCAP file")?;
        file_of_records(&records);
        put(corpus, "bag_recover", &format!("{name}_records"), &records)?;
        put(corpus, "bag_records", name, records)?;
        put(corpus, "bag_recover", name, &file)?;
        // As where the recorder was killed: within the last chunk, and within the summary.
        let cuts = [file.len() / 3, file.len() / 2, file.len() - 20];
        for (index, cut) in cuts.into_iter().enumerate() {
            put(
                corpus,
                "bag_recover",
                &format!("{name}_cut_{index}"),
                &file[..cut],
            )?;
        }
        if compression == Compression::None {
            // A damaged length in the head of what a killed recorder left.
            let mut damaged = file.get(..file.len() / 2).ok_or("no MCAP file")?.to_vec();
            *damaged.get_mut(40).ok_or("no MCAP file")? ^= 1;
            put(corpus, "bag_recover", "none_head", damaged)?;
        }
        put(corpus, "bag_reader", name, file)?;
    }
    Ok(())
}

/// Operation code, place and end of the body of each record.
fn walk(file: &[u8]) -> Vec<(u8, usize, usize)> {
    let mut found = Vec::new();
    let mut at = 8;
    while let Some((&[code, ref length @ ..], _)) = file
        .get(at..)
        .and_then(|left| left.split_first_chunk::<9>())
        && let Ok(length) = usize::try_from(u64::from_le_bytes(*length))
        && let Some(end) = length.checked_add(at + 9).filter(|end| *end <= file.len())
    {
        found.push((code, at + 9, end));
        at = end;
    }
    found
}

fn without_checksums(file: &[u8]) -> Option<Vec<u8>> {
    let mut bytes = file.to_vec();
    for (code, start, end) in walk(file) {
        match code {
            0x02 | 0x0f => bytes.get_mut(end - 4..end)?.fill(0),
            0x06 => bytes.get_mut(start + 24..start + 28)?.fill(0),
            _ => {}
        }
    }
    Some(bytes)
}

/// The input from which `file_of_records` makes such a file.
fn records(file: &[u8]) -> Option<Vec<u8>> {
    let mut input = Vec::new();
    let mut summary = false;
    for (code, start, end) in walk(file) {
        let body = file.get(start..end)?;
        match code {
            0x01 | 0x02 | 0x07 | 0x08 => {}
            0x0f => summary = true,
            0x06 => push(&mut input, code, &chunk(body)?),
            _ => push(&mut input, if summary { code | 0x80 } else { code }, body),
        }
    }
    Some(input)
}

fn chunk(body: &[u8]) -> Option<Vec<u8>> {
    let (times, rest) = body.split_at_checked(16)?;
    let (size, rest) = rest.split_at_checked(8)?;
    let name_length = *rest.get(4)?;
    let content = rest.get(8 + usize::from(name_length) + 8..)?;
    let compression = match name_length {
        0 => 0,
        4 => 1,
        _ => 2,
    };
    let mut input = [&[compression], times].concat();
    if compression == 0 {
        for (code, start, end) in walk(&[&[0; 8], content].concat()) {
            push(&mut input, code, content.get(start - 8..end - 8)?);
        }
    } else {
        input.extend(size);
        input.extend(content);
    }
    Some(input)
}

fn push(input: &mut Vec<u8>, code: u8, body: &[u8]) {
    input.push(code);
    input.extend((body.len() as u16).to_le_bytes());
    input.extend(body);
}

fn messages(corpus: &Path) -> Done {
    macro_rules! defaults {
        ($($message:ty),* $(,)?) => {[$({
            let name = <$message as RosMessage>::TYPE_NAME;
            (name, cdr::encode(&<$message>::default())?)
        }),*]};
    }
    for (name, payload) in lgvi_msgs::for_every_message!(defaults) {
        let input = [&key(name)[..], &payload].concat();
        put(corpus, "cdr", &name.replace('/', "."), input)?;
    }
    Ok(())
}

/// Messages with short definitions.
fn definitions(corpus: &Path) -> Done {
    macro_rules! texts {
        ($($message:ty),* $(,)?) => {[$({
            let message = <$message>::default();
            let definition = <$message as RosMessage>::DEFINITION;
            (<$message as RosMessage>::TYPE_NAME, definition, cdr::encode(&message)?)
        }),*]};
    }
    for (name, definition, payload) in lgvi_msgs::for_every_message!(texts) {
        // Comments are no part of what is fuzzed.
        let lines = definition.lines().filter_map(|line| {
            let line = line.split('#').next().unwrap_or_default().trim();
            (!line.is_empty()).then(|| format!("{line}\n"))
        });
        let definition: String = lines.collect();
        if definition.len() > 800 {
            continue;
        }
        let row = [&(payload.len() as u16).to_le_bytes(), &*payload].concat();
        let choice = (name.len() % 8) as u8;
        let input = [&[choice], definition.as_bytes(), &[0], &row, &row].concat();
        put(corpus, "tables", &name.replace('/', "."), input)?;
    }
    Ok(())
}

fn copies(corpus: &Path, target: &str, directory: &Path, extension: &str) -> Done {
    for entry in fs::read_dir(directory)? {
        let path = entry?.path();
        if path.extension().is_some_and(|found| found == extension) {
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            put(corpus, target, &name, fs::read(&path)?)?;
        }
    }
    Ok(())
}

/// What a user, or somebody who means ill, might write.
fn by_hand(corpus: &Path) -> Done {
    let lines = [
        "scene.toml\n--ros-args\n-r\n__ns:=/chaser\n-r\n~/state:=/truth\n--\n--fast",
        "--ros-args\n-p\nrate:=2.5\n-p\nlgvi_propagator:topics:=[a, b]\n--log-level\ndebug",
        "--ros-args\n-r\nlgvi_propagator:__node:=other\n-r\nrostopic://~/state:=s\n-e\n/a/b",
        "--ros-args\n--params-file\nf\n--log-level\nrcl:=warn\n--disable-stdout-logs\n\0\
         /**:\n  ros__parameters:\n    rate: 0x1f\n    steps: 017",
        "__ns:=/a/{node}\nrosservice:///a/b:=~/c",
    ];
    for (index, line) in lines.iter().enumerate() {
        put(corpus, "ros_args", &format!("line_{index}"), line)?;
    }
    let deep = "[".repeat(5000);
    let files = [
        (
            "aliases",
            "a: &a [x, x]\nb: &b [*a, *a]\nc: &c [*b, *b]\nd: [*c, *c]\n",
        ),
        (
            "anchors",
            "/**: &p\n  ros__parameters: &q {rate: &r 1.0, scene: !!str 5}\n",
        ),
        ("deep", &deep),
        (
            "numbers",
            "n: {ros__parameters: {a: 1e999, b: -9223372036854775808, c: 0x, d: .inf, e: 0b1, f: 08}}",
        ),
        (
            "nodes",
            "/a:\n  b:\n    ros__parameters: {weights: [1.0, 2.5], flags: [yes, no]}\n'/**/c': {ros__parameters: {}}\n",
        ),
        (
            "documents",
            "---\n%YAML 1.2\n---\n? [a]\n: b\n--- |\n text\n...\n",
        ),
    ];
    for (name, text) in files {
        put(corpus, "params_file", name, text)?;
        put(corpus, "bag_metadata", name, text)?;
    }
    Ok(())
}

/// Scenes that together have what the shipped ones lack.
fn scenes(corpus: &Path) -> Done {
    let integrators = [
        "\"auto\"",
        "{ name = \"auto\", tolerance = 1e-3 }",
        "{ name = \"lgvi\", rotor = \"exact\" }",
        "\"lgvi_lagrangian\"",
        "{ name = \"lie_euler\", rotor = \"discrete\" }",
        "{ name = \"composition\", order = 4 }",
        "{ name = \"nystrom\", order = 6 }",
        "{ name = \"galerkin\", degree = 2, quadrature = \"lobatto\", points = 3, origin = \"start\" }",
        "{ name = \"euler_poincare\", degree = 3 }",
        "\"closed_form\"",
        "\"explicit_midpoint\"",
        "\"implicit_midpoint\"",
        "\"crouch_grossman\"",
        "\"runge_kutta4\"",
        "{ name = \"fehlberg78\", tolerance = 1e-9 }",
        "{ name = \"dormand_prince853\", tolerance = 1e-9 }",
        "{ name = \"taylor\", tolerance = 1e-9 }",
    ];
    let run = |integrator: &str, more: &str| {
        format!(
            "title = \"t\"\n[run]\nduration = 1.0\nsteps = 10\nintegrator = {integrator}\n{more}\n\
             [[bodies]]\nname = \"a\"\nmass = 2.0\n"
        )
    };
    let state = "position = [1.0, 0.0, 0.0]\nvelocity = [0.0, 1.0, 0.0]\n\
                 attitude = { w = 1.0, x = 0.0, y = 0.0, z = 0.0 }\nangular_velocity = [0.1, 0.2, 0.3]\n";
    let still = "position = [5.0, 0.0, 0.0]\nattitude = [[1,0,0],[0,1,0],[0,0,1]]\n";
    let inertia = "inertia = [1.0, 2.0, 2.5]\n";
    for (index, integrator) in integrators.iter().enumerate() {
        let text = run(integrator, "substeps = 2") + inertia + state;
        put(corpus, "scene", &format!("integrator_{index}"), text)?;
    }
    let bodies = [
        "inertia = [[1,0,0],[0,2,0],[0,0,2.5]]\npoints = [{ mass = 1.0, position = [1,0,0] }, { mass = 1.0, position = [-1,0,0] }]\n",
        "polyhedron = { cuboid = [1,2,3], degree = 4 }\n",
        "polyhedron = { ellipsoid = [1,2,3], subdivisions = 1 }\n",
        "polyhedron = { obj = \"v 0 0 0\\nv 1 0 0\\nv 0 1 0\\nv 0 0 1\\nf 1 3 2\\nf 1 2 4\\nf 2 3 4\\nf 1 4 3\\n\" }\n",
        "polyhedron = { vertices = [[0,0,0],[1,0,0],[0,1,0],[0,0,1]], faces = [[0,2,1],[0,1,3],[1,2,3],[0,3,2]] }\n",
        "multipole = { order = 4, ellipsoid = [1,2,3] }\n",
        "inertia = [1.0, 2.0, 2.5]\nmultipole = { order = 2 }\n",
    ];
    let gravity = "[gravity]\nmutual = { constant = 1.0 }\nuniform = { acceleration = [0,0,-1] }\n\
                   central = { gm = 1.0, j2 = 1e-3, reference_radius = 1.0, pole = [0,0,1], position = [0,9,0], radius = 0.1 }\n";
    for (index, body) in bodies.iter().enumerate() {
        let other =
            format!("[[bodies]]\nname = \"b\"\nmass = 1.0\n{inertia}mobility = \"fixed\"\n{still}");
        let text = run("\"lgvi\"", "substeps = 2\nepoch = 2020-01-01T00:00:00Z")
            + body
            + state
            + &other
            + gravity;
        put(corpus, "scene", &format!("body_{index}"), text)?;
    }
    let mobilities = [
        "mobility = \"pivoted\"\nangular_velocity = [0.1, 0.2, 0.3]\n",
        "mobility = { uniform = { velocity = [1,0,0], spin = [0,0,1] } }\n",
        "mobility = { circle = { center = [0,0,0], rate = [0,0,1], spin = [0,1,0] } }\n",
    ];
    for (index, mobility) in mobilities.iter().enumerate() {
        let frames = "[[frames]]\nname = \"f\"\nparent = \"a\"\nposition = [1,2,3]\n";
        let text = run("\"lgvi\"", "subdivide = 3") + inertia + mobility + still + frames;
        put(corpus, "scene", &format!("mobility_{index}"), text)?;
    }
    let targets = [
        "position = [2,0,0]\nvelocity = [0,0,0]\nattitude = { w = 1.0, x = 0.0, y = 0.0, z = 0.0 }\nangular_velocity = [0,0,0]\n",
        "orbit = { position = [2,0,0], velocity = [0,0.7,0] }\nspin_axis = { axis = [0,0,1], direction = [1,0,0] }\nangular_velocity = [0,0,1]\n",
    ];
    let constraints = "constraints = [{ kind = \"commands\", limit = 1.0 }, { kind = \"force_components\", limit = [1,2,3] }, \
        { kind = \"moment_norm\", limit = 2.0 }, { kind = \"keep_out_cone\", axis = [1,0,0], direction = [0,1,0], half_angle = 0.3 }, \
        { kind = \"keep_out_sphere\", center = [9,9,9], radius = 1.0 }, { kind = \"corridor\", apex = [0,0,0], axis = [1,0,0], half_angle = 1.0 }]\n";
    for (index, target) in targets.iter().enumerate() {
        let maneuver = format!(
            "[maneuver]\nbody = \"a\"\ndynamics = \"lgvi\"\nforce_weight = 2.0\nmoment_weight = [1,2,3]\n{constraints}\
             final_time = {{ min = 0.5, weight = 1.0 }}\nsearch = {{ starts = 3, seed = 1 }}\n\
             solver = {{ method = \"newton\", tolerance = 1e-9, max_iterations = 5 }}\n[maneuver.target]\n{target}\
             [disturbance]\nseed = 1\nposition = 0.01\nforce_error = 0.1\n"
        );
        let text = run("\"lgvi\"", "") + inertia + state + &maneuver;
        put(corpus, "scene", &format!("maneuver_{index}"), text)?;
    }
    Ok(())
}
